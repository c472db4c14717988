"""`ballplate acceptance`: the acceptance and reverification test of a machine."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

from ballplate.cli import (
    UsageError,
    add_force,
    add_json,
    add_output,
    count,
    page_path,
    show,
    single,
    write_noted,
)

DESCRIPTION = (
    "Predict or evaluate the test of ISO 10360-2: five lengths in each of seven directions,"
    " measured three times (E0, R0), and along two diagonals with an offset probe (E150). The exit"
    " status is 1 if readings are not within the limits, otherwise 0."
)
DESIGN = "experiment: predict the test of the machine corrected by its map"
SOURCES = {
    "map": "map: predict the test of the machine corrected by it",
    "readings": "columns direction, length_mm, measured_mm; optionally probe (CSV)",
}
# Further arguments of the function, as texts.
ARGUMENTS = {
    "mpe": 'maximum permissible error, such as "1.5 um + L/333000" with L in metres',
    "mpl": "maximum permissible limit of the range R0",
    "probe": "offset probe of E150; default: no E150",
    "point_repeatability": "standard repeatability of a touched point along the length",
    "gauge": "standard uncertainty of calibrated lengths with their expansion, common to all",
    "draws": "number of tests drawn; default: 20000",
    "seed": "seed of the draws; default: 1",
}


def add_options(parser: ArgumentParser) -> None:
    named: dict[str, Any] = {"metavar": "FILE", "type": Path}
    parser.add_argument("--design", dest="files", nargs=1, help=DESIGN, **named)
    for name, words in SOURCES.items():
        parser.add_argument(f"--{name}", help=words, **named)
    parser.add_argument(
        "--variant", metavar="NAME", action="append", default=[], help="variant of the experiment"
    )
    for name, words in ARGUMENTS.items():
        kind = count if name in ("draws", "seed") else str
        option = f"--{name.replace('_', '-')}"
        parser.add_argument(option, type=kind, required=name == "mpe", help=words)
    add_output(parser, "--report", metavar="FILE", type=page_path, help="write a page (.html)")
    add_force(parser)
    add_json(parser)


def run(options: Namespace) -> int:
    """Print the test and write its page; 1 if readings are not within the limits."""
    from .acceptance_interface import acceptance

    given = {name: getattr(options, name) for name in ("readings", *ARGUMENTS)}
    chosen = {name: value for name, value in given.items() if value is not None}
    if options.files:
        chosen["design"] = single(options)
    try:
        test = acceptance(fitted=options.map, **chosen)
    except ValueError as error:
        raise UsageError(error) from None
    if options.report:
        write_noted(options, {options.report: test.page_text()})
    show(options, test)
    return int(bool(options.readings) and not test.chances["simple acceptance"])
