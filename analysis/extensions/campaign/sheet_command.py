"""`ballplate sheet`: what goes to the laboratory with a design."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from pathlib import Path

from ballplate.cli import (
    UsageError,
    add_file,
    add_force,
    add_json,
    add_output,
    argument_type,
    page_path,
    show,
    single,
    write_noted,
)

DMIS, POINTS = (".dmi", ".dmis"), (".csv",)

DESCRIPTION = (
    "Write what goes to the laboratory with a design: a run sheet to print and tick off, a CSV"
    " template of the readings in order, which fit reads when it is filled in, and the nominal"
    " centres of the balls in order, as a table or as a DMIS program. By default the run sheet is"
    " printed."
)


def add_options(parser: ArgumentParser) -> None:
    add_file(parser)
    add_output(
        parser,
        "-o",
        "--output",
        metavar="FILE",
        type=page_path,
        help="write the run sheet as a page to print (.html)",
    )
    add_output(
        parser,
        "--readings",
        metavar="CSV",
        help="write the readings in order as a CSV template to fill in",
    )
    add_output(
        parser,
        "--points",
        metavar="FILE",
        type=_points,
        help="write the centres in order: .csv, or .dmi for DMIS with --ball-diameter",
    )
    parser.add_argument(
        "--ball-diameter",
        metavar="LENGTH",
        type=_diameter,
        help="nominal diameter of the balls, such as 22 mm, for the points of a DMIS program",
    )
    add_force(parser)
    add_json(parser)


def _points(text: str) -> Path:
    if not text.lower().endswith((*POINTS, *DMIS)):
        raise ArgumentTypeError(
            f'a file of points ends in {", ".join((*POINTS, *DMIS))}, unlike "{text}"'
        )
    return Path(text)


@argument_type
def _diameter(text: str) -> float:
    from ballplate.simulator.inputs import parse_length

    value = parse_length(text)
    if not 0.0 < value < 1.0:
        raise ArgumentTypeError(f'expected a length above zero, below 1 m, not "{text}"')
    return value


def run(options: Namespace) -> int:
    """Print the run sheet, or write the files."""
    from .sheet import sheet_of

    is_dmis = options.points is not None and options.points.suffix.lower() in DMIS
    if is_dmis and options.ball_diameter is None:
        text = "a DMIS program probes points on balls; give --ball-diameter, or a .csv for centres"
        raise UsageError(text)
    if options.ball_diameter is not None and not is_dmis:
        raise UsageError("--ball-diameter is for --points with a name that ends in .dmi")
    sheet = sheet_of(single(options, planning=True))
    texts = {}
    if options.output is not None:
        texts[options.output] = sheet.page()
    if options.readings is not None:
        texts[options.readings] = sheet.template()
    if options.points is not None:
        texts[options.points] = sheet.points(options.ball_diameter)
    if options.json or not texts:
        show(options, sheet)
    write_noted(options, texts)
    return 0
