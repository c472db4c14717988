"""Common parts of the commands: experiments of the files named, and JSON."""

from __future__ import annotations

import glob
import json
import math
import shutil
import sys
import textwrap
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable, Sequence
from functools import wraps
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from .notes import note, tell_notes, warn
from .outputs import PICTURE, add_output, write

if TYPE_CHECKING:
    from ballplate.presentation.result import Result
    from ballplate.simulator.experiment.model import Experiment

    from .outputs import Contents


def add_file(parser: ArgumentParser, several: bool = False, needed: bool = True) -> None:
    """Add the experiment file or files, one that is not needed as a single path or None, and the
    choice of a variant.
    """
    parser.add_argument(
        "files",
        metavar="FILE",
        nargs="+" if several else 1 if needed else "?",
        type=Path,
        help="experiment file (YAML)",
    )
    parser.add_argument(
        "--variant",
        metavar="NAME",
        action="append",
        default=[],
        help="use only this variant; may be repeated",
    )


def add_json(parser: ArgumentParser) -> None:
    """Add the choice of JSON."""
    parser.add_argument(
        "--json",
        action="store_true",
        help="print JSON in metres and radians: an object, or an array for several experiments",
    )


T = TypeVar("T")


def argument_type(parse: Callable[[str], T]) -> Callable[[str], T]:
    """Return the type of an argument that reports its parser's message on an invalid text."""

    @wraps(parse)
    def parsed(text: str) -> T:
        try:
            return parse(text)
        except ValueError as error:
            raise ArgumentTypeError(str(error)) from None

    return parsed


def whole(text: str, least: int = 0) -> int:
    """Read an index or a seed from the command line."""
    if not text.isascii() or not text.isdigit() or int(text) < least:
        raise ArgumentTypeError(f'expected a whole number, {least} or above, not "{text}"')
    return int(text)


def count(text: str) -> int:
    """Read a number of things from the command line."""
    return whole(text, 1)


def at_most(number: int, most: int, noun: str) -> int:
    """Refuse more things than are possible."""
    if number > most:
        raise ArgumentTypeError(f"{number} {noun} are too many; at most {most} are possible")
    return number


def trial_count(text: str) -> int:
    """Read a number of synthetic data sets from the command line."""
    from ballplate.montecarlo.experiments import MOST_TRIALS

    return at_most(count(text), MOST_TRIALS, "data sets")


def number(text: str, unit: str = "") -> float:
    """Read a number with or without a unit behind it; NaN if it is not a number."""
    try:
        return float(text.removesuffix(unit).strip())
    except ValueError:
        return math.nan


@argument_type
def day(text: str) -> str:
    """Argument type: a day such as 2026-11-22."""
    from ballplate.simulator.inputs.quantity_types import stated_day

    return stated_day(text)


def map_path(text: str) -> Path:
    """Argument type: a map file to be written, whose name says how."""
    path = Path(text)
    if path.suffix.lower() not in (".yaml", ".yml"):
        raise ArgumentTypeError(f'the name of a map ends in .yaml, unlike "{text}"')
    return path


def coverage_factor(text: str) -> float:
    """Argument type: a coverage factor."""
    value = number(text)
    if not 0.0 < value <= 100.0:
        raise ArgumentTypeError(f'expected a number above 0, such as 2, not "{text}"')
    return value


def percentage(text: str) -> float:
    """Read a percentage above zero from the command line, as a ratio."""
    value = number(text, "%")
    if not text.endswith("%") or not 0.0 < value <= 100.0:
        raise ArgumentTypeError(f'expected a percentage such as 1%, not "{text}"')
    return value / 100.0


def grid(text: str) -> tuple[int, ...] | None:
    """Read the points along some axes of a grid, 2 or above each, if the text is one."""
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isascii() and part.isdigit() and 0 < len(part) < 8 for part in parts):
        return None
    counts = tuple(map(int, parts))
    return counts if min(counts) >= 2 else None


def add_workers(parser: Any) -> None:
    """Add the number of processes."""
    parser.add_argument(
        "--workers",
        metavar="N",
        type=count,
        help="number of processes; default: one per processor",
    )


def add_formats(parser: ArgumentParser, formats: Sequence[str], help: str) -> None:
    """Add the choice among output formats, text by default, and a short way to JSON."""
    parser.add_argument("--format", choices=formats, default="text", help=help)
    parser.add_argument(
        "--json",
        action="store_const",
        dest="format",
        const="json",
        help="the same as --format json",
    )


def add_picture(parser: Any, name: str, help: str) -> None:
    """Add an option that names a picture to be drawn."""
    add_output(parser, name, metavar="FILE", type=_picture, needed=lambda path: PICTURE, help=help)


def _picture(text: str) -> Path:
    from ballplate.presentation.svg import PICTURES

    if Path(text).suffix.lower() not in PICTURES:
        raise ArgumentTypeError(f'a picture\'s name ends in {", ".join(PICTURES)}, unlike "{text}"')
    return Path(text)


def write_noted(options: Namespace, contents: Contents) -> None:
    """Write the files of a command, and note each that is written."""
    if write(options, contents):
        for path in filter(None, contents):
            note(options, f"{path} written")


def add_page(parser: Any, help: str) -> None:
    """Add an option that names a page to be written."""
    add_output(parser, "--report", metavar="FILE", type=page_path, help=f"{help} (.html)")


def page_path(text: str) -> Path:
    """Read the name of a page from the command line."""
    if Path(text).suffix.lower() not in (".html", ".htm"):
        raise ArgumentTypeError(f'a page\'s name ends in .html, unlike "{text}"')
    return Path(text)


def experiments(options: Namespace, planning: bool = False) -> list[Experiment]:
    """Experiments of all files, every variant one of its own, less those not chosen; with pools for
    `planning`.

    :raises ExperimentError: the errors of all files together.
    """
    from ballplate.simulator.experiment.changes import unknown_variants
    from ballplate.simulator.experiment.loading import load
    from ballplate.simulator.inputs.messages import ExperimentError, Message

    chosen_experiments: list[Experiment] = []
    messages: list[Message] = []
    for path in options.files:
        try:
            chosen_experiments += load(path, planning=planning)
        except ExperimentError as error:
            messages += error.messages
    if messages:
        raise ExperimentError(messages)
    if options.variant:
        unknown = unknown_variants(
            options.files, options.variant, {experiment.name for experiment in chosen_experiments}
        )
        if unknown:
            raise ExperimentError(unknown)
        chosen_experiments = [
            experiment for experiment in chosen_experiments if experiment.name in options.variant
        ]
    tell_notes(
        dict.fromkeys(note for experiment in chosen_experiments for note in experiment.notes)
    )
    warn(dict.fromkeys(doubt for experiment in chosen_experiments for doubt in experiment.doubts))
    return chosen_experiments


def single(options: Namespace, planning: bool = False) -> Experiment:
    """Return the one experiment that the options choose, with its pool for `planning`.

    :raises ExperimentError: the file has several variants, and the options choose no single one.
    """
    from ballplate.simulator.inputs.messages import refused

    loaded = experiments(options, planning)
    if len(loaded) > 1:
        names = [str(experiment.name) for experiment in loaded]
        text = f"the file has several variants; choose one with --variant: {', '.join(names)}"
        raise refused(options.files[0], text)
    return loaded[0]


def print_lines(lines: Sequence[str]) -> None:
    """Print lines; on a terminal, sentences are wrapped to its width, and tables are left alone."""
    from ballplate.simulator.inputs.messages import in_one_line

    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else 0
    for line in map(in_one_line, lines):
        is_sentence = "  " not in line.strip()
        wrapped = (
            textwrap.wrap(line, width, subsequent_indent="  ") if width and is_sentence else [line]
        )
        print("\n".join(wrapped or [""]))
    sys.stdout.flush()


def show(options: Namespace, result: Result) -> None:
    """Print a result as text, or as JSON on request."""
    if options.json:
        print_json([result.to_dict()])
    else:
        print_lines(result.lines())


def print_json(results: list[dict[str, Any]]) -> None:
    """Print a single object as such, several as an array."""
    json.dump(
        results[0] if len(results) == 1 else results,
        sys.stdout,
        indent=2,
        allow_nan=False,
        ensure_ascii=False,
    )
    print()


# Folders whose YAML files are no experiments.
OTHERS = ("sweeps", "machines")


def matching_files(patterns: Sequence[Path]) -> list[Path]:
    """Return files of names and patterns, each once; patterns omit folders of sweeps and machines.

    A pattern without a match is kept and reported as a missing file.
    """
    paths: dict[Path, None] = {}
    for path in patterns:
        matches = (
            [Path(name) for name in sorted(glob.glob(str(path), recursive=True))]
            if is_pattern(path)
            else []
        )
        # Folders that the pattern names itself are meant.
        named = sum(1 for _ in takewhile(lambda part: not glob.has_magic(part), path.parts))
        chosen = [
            match
            for match in matches
            if match.is_file() and not set(match.parts[named:-1]) & set(OTHERS)
        ]
        paths |= dict.fromkeys(chosen or [path])
    return list(paths)


def is_pattern(path: Path) -> bool:
    """True if a path is a pattern, and not the name of a file."""
    return glob.has_magic(str(path)) and not path.exists()
