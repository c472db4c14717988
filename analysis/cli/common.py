"""Common parts of the commands: experiments of the files named, and JSON."""

from __future__ import annotations

import json
import shutil
import sys
import textwrap
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .outputs import PICTURE, add_output

if TYPE_CHECKING:
    from ballplate.simulator.experiment.model import Experiment


def add_file(parser: ArgumentParser, several: bool = False) -> None:
    """Add the experiment file, or several of them, and the choice of a variant."""
    parser.add_argument(
        "files",
        metavar="FILE",
        nargs="+" if several else 1,
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
        help=(
            "print JSON in metres and radians: an object, or an array of them for several"
            " experiments"
        ),
    )


def count(text: str) -> int:
    """Read a number of things from the command line."""
    return whole(text, 1)


def trial_count(text: str) -> int:
    """Read a number of synthetic data sets from the command line."""
    from ..montecarlo.trials import MOST_TRIALS

    found = count(text)
    if found > MOST_TRIALS:
        raise ArgumentTypeError(
            f"{found} data sets are too many; at most {MOST_TRIALS} are possible"
        )
    return found


def whole(text: str, least: int = 0, what: str = "expected") -> int:
    """Read a whole number from the command line."""
    if not text.isascii() or not text.isdigit() or int(text) < least:
        raise ArgumentTypeError(f'{what} a whole number, {least} or above, not "{text}"')
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
    return whole(text, what="a seed is")


def add_picture(parser: Any, name: str, help: str) -> None:
    """Add an option that names a picture to be drawn."""
    add_output(parser, name, metavar="FILE", type=_picture, needed=lambda path: PICTURE, help=help)


def _picture(text: str) -> Path:
    from ..presentation.svg import PICTURES

    if Path(text).suffix.lower() not in PICTURES:
        raise ArgumentTypeError(f'a picture\'s name ends in {", ".join(PICTURES)}, unlike "{text}"')
    return Path(text)


def experiments(options: Namespace, planning: bool = False) -> list[Experiment]:
    """Experiments of all files, every variant one of its own, less those not chosen; with pools for
    `planning`.

    :raises ExperimentError: the errors of all files together.
    """
    from ballplate.simulator.experiment.load import load
    from ballplate.simulator.experiment.variants import unknown_variants
    from ballplate.simulator.inputs.messages import ExperimentError, Message

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
        unknown = unknown_variants(
            options.files, options.variant, {experiment.name for experiment in found}
        )
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
    from ballplate.simulator.inputs.messages import ExperimentError, Message

    found = experiments(options, planning)
    if len(found) > 1:
        names = [str(experiment.name) for experiment in found]
        text = f"the file has several variants; choose one with --variant: {', '.join(names)}"
        raise ExperimentError([Message(str(options.files[0]), 0, 0, "", text)])
    return found[0]


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


def print_json(results: list[dict[str, Any]]) -> None:
    """One object by itself, several as an array."""
    json.dump(
        results[0] if len(results) == 1 else results,
        sys.stdout,
        indent=2,
        allow_nan=False,
        ensure_ascii=False,
    )
    print()
