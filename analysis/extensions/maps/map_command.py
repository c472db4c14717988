"""`ballplate map`: volumetric errors of a machine that a file describes."""

from __future__ import annotations

import math
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.cli import (
    UsageError,
    add_force,
    add_formats,
    add_picture,
    argument_type,
    at_most,
    count,
    grid,
    whole,
    write,
)

from .curves_command import show_errors

if TYPE_CHECKING:
    from ballplate.presentation import Writer

    from .map_places import Line


DESCRIPTION = (
    "Combine the parametric errors of a machine file, systematic and random, or the estimates of a"
    " map file (fit -o), with their expanded uncertainties, into volumetric errors: on a grid with"
    " the length errors of the body diagonals, in a plane, along a line, or at the points of a"
    " table. An error is the position of the tip minus the"
    " position that the scales indicate; the error of indication has the opposite sign."
)


def add_options(parser: ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="machine file (YAML) or map file")
    _add_places(parser)
    parser.add_argument(
        "--probe", metavar="NAME", help="of a map file: the probe, default that of the map"
    )
    parser.add_argument(
        "--draw",
        metavar="N",
        type=_draw,
        help=("draw N realisations of the random part, or of the covariance of a map"),
    )
    parser.add_argument("--seed", metavar="N", type=whole, help="seed of --draw; default 1")
    parser.add_argument(
        "--budget",
        action="store_true",
        help="of a machine file: what each parametric error contributes to errors and random parts",
    )
    add_picture(
        parser,
        "--plot",
        help="also draw the errors, in three dimensions or along the line",
    )
    add_force(parser)
    add_formats(parser, ("text", "csv", "json"), "csv: the points alone; json: metres, radians")


def _add_places(parser: ArgumentParser) -> None:
    parser.add_argument(
        "--grid",
        metavar="N,N,N",
        type=_grid,
        help="points along x, y and z, default 5,5,5; of a plane, along its two axes",
    )
    where = parser.add_mutually_exclusive_group()
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
        "--plane", metavar="PLANE", type=_plane, help='errors in a plane, as in "z = 200 mm"'
    )
    parser.add_argument(
        "--points",
        metavar="N|CSV",
        type=_points,
        help=(
            "points along the line, at least 2, default 21; or a table of points, with the columns"
            " x_mm, y_mm and z_mm (or another unit), for the errors"
        ),
    )


def _grid(text: str) -> tuple[int, ...]:
    from .volumetric_errors import MOST_POINTS

    counts = grid(text)
    if counts is None or len(counts) not in (2, 3):
        raise ArgumentTypeError(
            f'expected three whole numbers, 2 or above, such as 13,9,9, not "{text}"'
        )
    at_most(math.prod(counts), MOST_POINTS, "points")
    return counts


def _points(text: str) -> int | Path:
    from .volumetric_errors import MOST_POINTS

    if not text.isdigit():
        return Path(text)
    number = count(text)
    if not 2 <= number <= MOST_POINTS:
        raise ArgumentTypeError(f"a line has 2 to {MOST_POINTS} points, not {number}")
    return number


def _draw(text: str) -> int:
    from .realisations import MOST_DRAWS

    return at_most(count(text), MOST_DRAWS, "realisations")


@argument_type
def _line(text: str) -> Line:
    from .map_places import parse_places

    return parse_places(text)


@argument_type
def _plane(text: str) -> dict[str, float]:
    from .map_places import parse_plane

    return parse_plane(text)


def run(options: Namespace) -> int:
    """Print, and draw, the errors."""
    from .error_map import map_errors
    from .map_places import PlacesAsked
    from .realisations import Draws

    table = options.points if isinstance(options.points, Path) else None
    if options.seed is not None and options.draw is None:
        raise UsageError("--seed needs --draw; leave it out")
    number = None if table is not None else options.points
    asked = PlacesAsked(options.grid, options.line, options.plane, number, table)
    seed = 1 if options.seed is None else options.seed
    draws = None if options.draw is None else Draws(options.draw, seed)
    try:
        errors = map_errors(options.file, asked, options.probe, draws, options.budget)
    except ValueError as error:
        raise UsageError(error) from None
    # Before anything is printed that nobody may read to its end.
    if options.plot is not None:
        write_picture(options, errors.plot)
    show_errors(options, errors)
    return 0


def write_picture(options: Namespace, draw: Writer) -> None:
    """Write the picture that the options name.

    :raises UsageError: there are no data to draw.
    """
    try:
        write(options, {options.plot: draw})
    except ValueError as error:
        raise UsageError(f"--plot: {error}") from None
