"""`ballplate map`: volumetric errors of a machine that a file describes."""

from __future__ import annotations

import math
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import common
from .common import add_formats, add_picture, at_most, count, print_json, print_lines
from .outputs import UsageError, Writer, add_force, write
from .telling import warn

if TYPE_CHECKING:
    from ballplate.simulator.machines.description import Three
    from ballplate.simulator.machines.protocol import Array

    from ..error_maps.volumetric_errors import AlongAxis, Volumetric

# Points along a line unless told.
POINTS = 21


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
        default=(5, 5, 5),
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


def _line(text: str) -> dict[str, float] | tuple[Three, Three]:
    from ballplate.simulator.experiment.error_tables import LineError, parse_line, parse_point

    try:
        start, to, end = text.partition(" to ")
        if to:
            ends = parse_point(start), parse_point(end)
            if ends[0] == ends[1]:
                raise ArgumentTypeError("a line ends where it begins; give two points")
            return ends
        found = parse_line(text)
    except LineError as error:
        raise ArgumentTypeError(str(error)) from None
    if len(found) != 2:
        raise ArgumentTypeError(
            "two axes stand still on a line; write for example y = 600 mm, z = 600 mm"
        )
    return found


def run(options: Namespace) -> int:
    """Print, and draw, what was asked for."""
    import numpy as np
    from ballplate.simulator.experiment.machine_file import load_machine
    from ballplate.simulator.inputs.messages import Message

    from ..error_maps.volumetric_errors import Volumetric, along_axes

    doubts: list[Message] = []
    machine = load_machine(options.file, doubts)
    warn(doubts)
    drawn = options.plot is not None and options.line is None and options.error is None
    if options.magnification is not None and not drawn:
        raise UsageError("--magnification is for the drawing of the grid; leave it out")
    if options.points is not None and options.line is None:
        raise UsageError("--points is for --line; leave it out")
    if options.error is not None:
        from ..error_maps.volumetric_tables import why_not_along

        every = {one.error.name: one for one in along_axes(machine)}
        if options.error not in every:
            raise UsageError(why_not_along(options.error, Volumetric(machine), str(options.file)))
        return _of_one(every[options.error], options)
    built = Volumetric(machine)
    if options.line is None:
        return _on_a_grid(built, options)
    start, end = (
        built.parallel(options.line) if isinstance(options.line, dict) else np.array(options.line)
    )
    ends = np.stack([start, end])
    outside = np.flatnonzero(((ends < machine.lower) | (ends > machine.upper)).any(axis=0))
    if len(outside):
        named = " and ".join("xyz"[k] for k in outside)
        raise UsageError(f"the line is outside the volume in {named}")
    return _on_a_line(built, start, end, options)


def _of_one(along: AlongAxis, options: Namespace) -> int:
    from ..error_maps.volumetric_tables import along_csv, along_data, along_lines
    from ..report.volumetric_plots import draw_along

    _draw(options, partial(draw_along, along))
    return _tell(options, along_lines(along), along_csv(along), along_data(along))


def _on_a_line(machine: Volumetric, start: Array, end: Array, options: Namespace) -> int:
    from ..error_maps import volumetric_tables as tables
    from ..error_maps.volumetric_errors import between
    from ..report.volumetric_plots import draw_line

    found = machine.errors(between(start, end, options.points or POINTS))
    length = machine.lengths(start[None], end[None])
    _draw(options, partial(draw_line, found))
    lines = [*tables.error_lines(found), tables.length_line(length)]
    told = {"length": tables.length_data(length)[0], "line": tables.error_data(found)}
    return _tell(options, lines, tables.error_csv(found), tables.machine_data(machine) | told)


def _on_a_grid(machine: Volumetric, options: Namespace) -> int:
    from ..error_maps import volumetric_tables as tables
    from ..report.volumetric_plots import draw_grid

    found, diagonals = machine.errors(machine.grid(options.grid)), machine.diagonals()
    _draw(options, partial(draw_grid, found, diagonals, options.grid, options.magnification))
    lines = [*tables.machine_lines(machine), "", *tables.diagonal_lines(diagonals), ""]
    told = {"diagonals": tables.diagonal_data(diagonals), "grid": tables.error_data(found)}
    return _tell(
        options,
        lines + tables.error_lines(found),
        tables.error_csv(found),
        tables.machine_data(machine) | told,
    )


def _draw(options: Namespace, writer: Writer) -> None:
    """Draw what was asked for, before anything is printed that nobody may read to its end."""
    if options.plot is not None:
        write(options, {options.plot: writer})


def _tell(options: Namespace, lines: list[str], rows: Iterable[str], data: dict[str, Any]) -> int:
    """Print what was found in the form that was asked for."""
    if options.format == "json":
        print_json([data])
    else:
        print_lines(list(rows) if options.format == "csv" else lines)
    return 0
