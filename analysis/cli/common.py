"""What the commands share: experiments of the files named, and JSON."""

from __future__ import annotations

import json
import shutil
import sys
import textwrap
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from ballplate.simulator.experiment.model import Experiment


EXISTS = "exists already; name a new file, or overwrite it with --force"


def add_file(parser: ArgumentParser, several: bool = False) -> None:
    """Add the experiment file, or several of them, and the choice of a variant."""
    parser.add_argument("files", metavar="FILE", nargs="+" if several else 1, type=Path, help="experiment file (YAML)")
    parser.add_argument(
        "--variant", metavar="NAME", action="append", default=[], help="only this variant; may be repeated"
    )


def add_json(parser: ArgumentParser) -> None:
    """Add the choice of JSON."""
    parser.add_argument(
        "--json",
        action="store_true",
        help="print JSON in metres and radians: an object, or an array of them for several experiments",
    )


def count(text: str) -> int:
    """Read a number of things from the command line."""
    if not text.isascii() or not text.isdigit() or int(text) < 1:
        raise ArgumentTypeError(f'expected a whole number, 1 or above, not "{text}"')
    return int(text)


def whole(text: str) -> int:
    """Read an index from the command line."""
    if not text.isascii() or not text.isdigit():
        raise ArgumentTypeError(f'expected a whole number, 0 or above, not "{text}"')
    return int(text)


def percentage(text: str) -> float:
    """Read a percentage above zero from the command line, as a ratio."""
    try:
        value = float(text.removesuffix("%").strip())
    except ValueError:
        value = float("nan")
    if not text.endswith("%") or not 0.0 < value <= 100.0:
        raise ArgumentTypeError(f'expected a percentage such as 1%, not "{text}"')
    return value / 100.0


def seed(text: str) -> int:
    """Read a seed from the command line."""
    if not text.isascii() or not text.isdigit():
        raise ArgumentTypeError(f'a seed is a whole number, 0 or above, not "{text}"')
    return int(text)


def picture(text: str) -> Path:
    """Read the name of a picture to be drawn from the command line."""
    from ..report.svg import PICTURES

    if not text.lower().endswith(PICTURES):
        raise ArgumentTypeError(f'a picture\'s name ends in {", ".join(PICTURES)}, unlike "{text}"')
    return Path(text)


def draw(draw_to: Callable[[Path], object], path: Path) -> bool:
    """Write a picture; False after saying why not on standard error."""
    try:
        draw_to(path)
    except ImportError as error:
        if error.name is None or error.name.partition(".")[0] != "matplotlib":
            raise
        print(f"{path}: {error}", file=sys.stderr)
        return False
    except OSError as error:
        print(f"{path}: cannot be written ({error.strerror or error}); check the folder", file=sys.stderr)
        return False
    return True


def refuse_existing(*paths: Path | None) -> None:
    """Refuse to go on where a file that is to be written is there already, before the work and not after it.

    :raises ExperimentError: one of the files is there already.
    """
    from ballplate.simulator.experiment.messages import ExperimentError, Message

    found = [path for path in paths if path is not None and path.exists()]
    if found:
        raise ExperimentError([Message(str(path), 0, 0, "", EXISTS) for path in found])


def write(path: Path, text: str, force: bool = False) -> None:
    """Write a text file, no other in its place unless with `force`.

    :raises ExperimentError: there is such a file already, or it cannot be written.
    """
    from ballplate.simulator.experiment.messages import ExperimentError, Message

    try:
        with path.open("w" if force else "x", encoding="utf-8", newline="") as stream:
            stream.write(text)
    except FileExistsError:
        raise ExperimentError([Message(str(path), 0, 0, "", EXISTS)]) from None
    except OSError as error:
        told = f"cannot be written ({error.strerror}); name another file"
        raise ExperimentError([Message(str(path), 0, 0, "", told)]) from None
    print(f"{path} written", file=sys.stderr)


def write_all(writers: Mapping[Path, Callable[[TextIO], None]], force: bool = False) -> None:
    """Let each writer write its text file, all of them or none; the file named - is standard output, written last.

    :raises ExperimentError: without `force` there is one already, or one cannot be written.
    """
    from ballplate.simulator.experiment.messages import ExperimentError, Message

    files = [path for path in writers if str(path) != "-"]
    made = []
    try:
        with ExitStack() as opened:
            streams = []
            for path in files:
                is_new = not path.exists()
                # Files that are there are emptied only when all can be written.
                stream = opened.enter_context(path.open("a" if force else "x", encoding="utf-8", newline=""))
                made += [path] if is_new else []
                streams.append(stream)
            for path, stream in zip(files, streams, strict=True):
                if path.is_file():
                    stream.truncate(0)
                writers[path](stream)
    except OSError as error:
        for one in made:
            one.unlink(missing_ok=True)
        told = f"cannot be written ({error.strerror}); name another file"
        text = EXISTS if isinstance(error, FileExistsError) else told
        raise ExperimentError([Message(str(path), 0, 0, "", text)]) from None
    for path in writers.keys() - files:
        writers[path](sys.stdout)


def experiments(options: Namespace, planning: bool = False) -> list[Experiment]:
    """Experiments of all files, every variant one of its own, less those not chosen; with pools for `planning`.

    :raises ExperimentError: the errors of all files together.
    """
    from ballplate.simulator.experiment.load import load
    from ballplate.simulator.experiment.messages import ExperimentError, Message
    from ballplate.simulator.experiment.variants import unknown_variants

    found: list[Experiment] = []
    messages: list[Message] = []
    for path in options.files:
        try:
            found += load(path, planning=planning)
        except ExperimentError as error:
            messages += error.messages
    if messages:
        raise ExperimentError(messages)
    if options.variant:
        unknown = unknown_variants(options.files, options.variant, {experiment.name for experiment in found})
        if unknown:
            raise ExperimentError(unknown)
        found = [experiment for experiment in found if experiment.name in options.variant]
    for doubt in dict.fromkeys(doubt for experiment in found for doubt in experiment.doubts):
        print(f"warning: {doubt}", file=sys.stderr)
    return found


def single(options: Namespace, planning: bool = False) -> Experiment:
    """The one experiment that the options choose, with its pool for `planning`.

    :raises ExperimentError: the file has several variants and none was chosen.
    """
    from ballplate.simulator.experiment.messages import ExperimentError, Message

    found = experiments(options, planning)
    if len(found) > 1:
        names = [str(experiment.name) for experiment in found]
        text = f"the file has several variants; choose one with --variant: {', '.join(names)}"
        raise ExperimentError([Message(str(options.files[0]), 0, 0, "", text)])
    return found[0]


def print_lines(lines: Sequence[str]) -> None:
    """Print lines; on a terminal, sentences are wrapped to its width, and tables are left alone."""
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else 0
    for line in lines:
        is_sentence = "  " not in line.strip()
        wrapped = textwrap.wrap(line, width, subsequent_indent="  ") if width and is_sentence else [line]
        print("\n".join(wrapped or [""]))
    sys.stdout.flush()


def print_json(results: list[dict[str, Any]]) -> None:
    """One object by itself, several as an array."""
    json.dump(results[0] if len(results) == 1 else results, sys.stdout, indent=2, allow_nan=False, ensure_ascii=False)
    print()
