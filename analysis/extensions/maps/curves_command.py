"""`ballplate map --curves`: the error functions of a machine, with their bands."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.cli import UsageError, add_formats, complain, count, print_json, print_lines

from .fitted_argument import FITTED, fitted_map

if TYPE_CHECKING:
    from .error_curves_result import ErrorCurves
    from .error_map import ErrorMap

DESCRIPTION = (
    "Print every error function of a map file (fit -o) along its axis with its expanded"
    " uncertainty, or of a machine file with its random part, the squareness errors as angles, and"
    " other numbers of the error model. Errors are the"
    " position of the tip minus the position that the scales indicate."
)

# Positions along an axis at most.
MOST_POSITIONS = 10_000


def add_options(parser: ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help=f"machine file, {FITTED}")
    parser.add_argument(
        "--error",
        metavar="NAME",
        action="append",
        default=[],
        help="only this one, such as EXX; may be repeated",
    )
    parser.add_argument(
        "--points",
        metavar="N",
        type=_points,
        help="positions along each line, in CSV and JSON; default 41",
    )
    add_formats(parser, ("text", "csv", "json"), "csv: all positions; json: metres, radians")


def _points(text: str) -> int:
    positions = count(text)
    if not 2 <= positions <= MOST_POSITIONS:
        raise ArgumentTypeError(f"a line has 2 to {MOST_POSITIONS} positions, not {positions}")
    return positions


def run(options: Namespace) -> int:
    """Print the curves."""
    from .error_curves_result import error_curves, machine_curves
    from .error_functions import POSITIONS
    from .fit_files import kind_of_file

    file, chosen = options.file, (options.error, options.points or POSITIONS)
    try:
        if kind_of_file(file) == "machine":
            curves = machine_curves(file, *chosen)
        else:
            curves = error_curves(fitted_map(file), file.stem, *chosen)
    except ValueError as error:
        raise UsageError(error) from None
    show_errors(options, curves)
    return 0


def show_errors(options: Namespace, errors: ErrorMap | ErrorCurves) -> None:
    """Print notes and errors, these in the chosen format."""
    for note in errors.notes:
        complain(note)
    if options.format == "json":
        print_json([errors.to_dict()])
    else:
        print_lines(errors.lines() if options.format == "text" else list(errors.point_lines()))
