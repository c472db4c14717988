"""`ballplate map`: volumetric errors of a machine that a file describes."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from .common import add_picture, count, print_json, print_lines
from .outputs import add_force, write_outputs

if TYPE_CHECKING:
    from ..error_maps.volumetric_results import Line

WRONG_USAGE, BAD_FILE = 2, 3


# In one piece: one option after the other, with its help.
def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser: ArgumentParser = commands.add_parser(
        "map",
        help="compute volumetric errors of a machine from its parametric errors",
        description=(
            "Combine the parametric errors of a machine file into volumetric errors, systematic"
            " and random: on a grid with the length errors of the four body diagonals, along a"
            " line, or one parametric error along its axis. An error is the position of the tip"
            " minus the position that the scales indicate; the error of indication has the"
            " opposite sign."
        ),
    )
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
    parser.add_argument(
        "--format",
        choices=("text", "csv", "json"),
        default="text",
        help="csv: the points alone; json: metres, radians",
    )
    parser.add_argument(
        "--json",
        action="store_const",
        dest="format",
        const="json",
        help="the same as --format json",
    )
    parser.set_defaults(run=run)


def _grid(text: str) -> tuple[int, int, int]:
    from ..error_maps.volumetric_errors import MOST_POINTS

    parts = [part.strip() for part in text.split(",")]
    if len(parts) == 3 and all(
        part.isascii() and part.isdigit() and len(part) < 8 for part in parts
    ):
        x, y, z = (int(part) for part in parts)
        if min(x, y, z) >= 2:
            if x * y * z > MOST_POINTS:
                raise ArgumentTypeError(
                    f"{x * y * z} points are too many; at most {MOST_POINTS} are possible"
                )
            return x, y, z
    raise ArgumentTypeError(
        f'expected three whole numbers, 2 or above, such as 13,9,9, not "{text}"'
    )


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
    try:
        if options.magnification is not None and (options.plot is None or not is_grid):
            raise ValueError("--magnification is for the drawing of the grid; leave it out")
        found = machine_errors(
            options.file, options.grid, options.line, options.error, options.points
        )
    except ValueError as error:
        print(f"ballplate map: {error}", file=sys.stderr)
        return WRONG_USAGE
    for note in found.notes:
        print(note, file=sys.stderr)
    draw = found.plot
    if isinstance(found, VolumetricMap):
        draw = partial(found.plot, magnification=options.magnification)
    # Before anything is printed that nobody may read to its end.
    is_drawn = options.plot is None or write_outputs({options.plot: draw}, options.force)
    if options.format == "json":
        print_json([found.to_dict()])
    else:
        print_lines(found.lines() if options.format == "text" else list(found.point_lines()))
    return 0 if is_drawn else BAD_FILE
