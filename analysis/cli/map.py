"""`ballplate map`: volumetric errors of a machine that a file describes."""

from __future__ import annotations

import math
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from . import common
from .common import add_formats, add_picture, at_most, count, print_json, print_lines
from .outputs import UsageError, add_force, write
from .telling import complain

if TYPE_CHECKING:
    from ..error_maps.volumetric_results import Line


HELP = "compute volumetric errors of a machine from its parametric errors"
DESCRIPTION = (
    "Combine the parametric errors of a machine file into volumetric errors, systematic"
    " and random: on a grid with the length errors of the four body diagonals, along a"
    " line, or one parametric error along its axis. An error is the position of the tip"
    " minus the position that the scales indicate; the error of indication has the"
    " opposite sign."
)


def add_options(parser: ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="machine file (YAML)")
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--grid",
        metavar="N,N,N",
        type=_grid,
        help="points along x, y and z; default 5,5,5",
    )
    where.add_argument(
        "--line",
        metavar="LINE",
        type=_line,
        help=(
            'errors along a line instead, parallel to an axis as in "y = 600 mm, z = 600 mm", or'
            ' between two points as in "0 mm, 0 mm, 0 mm to 1.8 m, 1.2 m, 1.2 m"'
        ),
    )
    where.add_argument(
        "--error", metavar="NAME", help="a parametric error along its axis instead, such as EXX"
    )
    parser.add_argument(
        "--points", metavar="N", type=_points, help="points along the line, at least 2; default 21"
    )
    add_picture(
        parser,
        "--plot",
        help="also draw the errors, in three dimensions or along the line or axis",
    )
    add_force(parser)
    parser.add_argument(
        "--magnification",
        metavar="N",
        type=count,
        help="magnification of the errors in the drawing of the grid; default: one that fits",
    )
    add_formats(parser, ("text", "csv", "json"), "csv: the points alone; json: metres, radians")


def _grid(text: str) -> tuple[int, ...]:
    from ..error_maps.volumetric_errors import MOST_POINTS

    counts = common.grid(text)
    if counts is None or len(counts) != 3:
        raise ArgumentTypeError(
            f'expected three whole numbers, 2 or above, such as 13,9,9, not "{text}"'
        )
    at_most(math.prod(counts), MOST_POINTS, "points")
    return counts


def _points(text: str) -> int:
    from ..error_maps.volumetric_errors import MOST_POINTS

    found = count(text)
    if not 2 <= found <= MOST_POINTS:
        raise ArgumentTypeError(f"a line has 2 to {MOST_POINTS} points, not {found}")
    return found


def _line(text: str) -> Line:
    from ..error_maps.volumetric_results import parse_places

    try:
        return parse_places(text)
    except ValueError as error:
        raise ArgumentTypeError(str(error)) from None


def run(options: Namespace) -> int:
    """Print, and draw, what was asked for."""
    from ..error_maps.volumetric_results import VolumetricMap, machine_errors

    is_grid = options.line is None and options.error is None
    if options.magnification is not None and (options.plot is None or not is_grid):
        raise UsageError("--magnification is for the drawing of the grid; leave it out")
    try:
        found = machine_errors(
            options.file, options.grid, options.line, options.error, options.points
        )
    except ValueError as error:
        raise UsageError(error) from None
    for note in found.notes:
        complain(note)
    draw = found.plot
    if isinstance(found, VolumetricMap):
        draw = partial(found.plot, magnification=options.magnification)
    # Before anything is printed that nobody may read to its end.
    if options.plot is not None:
        write(options, {options.plot: draw})
    if options.format == "json":
        print_json([found.to_dict()])
    else:
        print_lines(found.lines() if options.format == "text" else list(found.point_lines()))
    return 0
