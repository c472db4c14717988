"""`ballplate map`: volumetric errors of a machine that a file describes."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from .common import add_picture, count, print_json, print_lines
from .outputs import Writer, add_force, write_outputs

if TYPE_CHECKING:
    from ballplate.simulator.machines.description import Three
    from ballplate.simulator.machines.protocol import Array

    from ..error_maps.volumetric_errors import AlongAxis, Volumetric

WRONG_USAGE, BAD_FILE = 2, 3

# Points along a line unless told.
POINTS = 21


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser: ArgumentParser = commands.add_parser(
        "map",
        help="volumetric errors of a machine, from its parametric errors",
        description=(
            "Combine the parametric errors of a machine file to volumetric errors, systematic and"
            " random: on a grid with the length errors of the four body diagonals, along a line"
            " parallel to an axis, or one parametric error along its axis. Errors are where the tip"
            " is, less where the scales say; the error of indication has the opposite sign."
        ),
    )
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
        parser, "--plot", help="draw it as well, in three dimensions or along the line or axis"
    )
    add_force(parser)
    parser.add_argument(
        "--magnification",
        metavar="N",
        type=count,
        help="of errors in the drawing of the grid; default: as fits",
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
    for doubt in doubts:
        print(f"warning: {doubt}", file=sys.stderr)
    drawn = options.plot is not None and options.line is None and options.error is None
    if options.magnification is not None and not drawn:
        print(
            "ballplate map: --magnification is for the drawing of the grid; leave it out",
            file=sys.stderr,
        )
        return WRONG_USAGE
    if options.points is not None and options.line is None:
        print("ballplate map: --points is for --line; leave it out", file=sys.stderr)
        return WRONG_USAGE
    if options.error is not None:
        from ..error_maps.volumetric_tables import why_not_along

        every = {one.error.name: one for one in along_axes(machine)}
        if options.error not in every:
            told = why_not_along(options.error, Volumetric(machine), str(options.file))
            print(f"ballplate map: {told}", file=sys.stderr)
            return WRONG_USAGE
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
        print(f"ballplate map: the line is outside the volume in {named}", file=sys.stderr)
        return WRONG_USAGE
    return _on_a_line(built, start, end, options)


def _of_one(along: AlongAxis, options: Namespace) -> int:
    from ..error_maps.volumetric_tables import along_csv, along_data, along_lines
    from ..report.volumetric_plots import draw_along

    status = _drawn(options, partial(draw_along, along))
    if options.format == "json":
        print_json([along_data(along)])
    else:
        print_lines(along_lines(along) if options.format == "text" else list(along_csv(along)))
    return status


def _on_a_line(machine: Volumetric, start: Array, end: Array, options: Namespace) -> int:
    from ..error_maps.volumetric_errors import between
    from ..error_maps.volumetric_tables import (
        error_csv,
        error_data,
        error_lines,
        length_data,
        length_line,
        machine_data,
    )
    from ..report.volumetric_plots import draw_line

    found = machine.errors(between(start, end, options.points or POINTS))
    length = machine.lengths(start[None], end[None])
    status = _drawn(options, partial(draw_line, found))
    if options.format == "json":
        print_json(
            [{**machine_data(machine), "length": length_data(length)[0], "line": error_data(found)}]
        )
    elif options.format == "csv":
        print_lines(list(error_csv(found)))
    else:
        print_lines([*error_lines(found), length_line(length)])
    return status


def _on_a_grid(machine: Volumetric, options: Namespace) -> int:
    from ..error_maps.volumetric_tables import (
        diagonal_data,
        diagonal_lines,
        error_csv,
        error_data,
        error_lines,
        machine_data,
        machine_lines,
    )
    from ..report.volumetric_plots import draw_grid

    found = machine.errors(machine.grid(options.grid))
    diagonals = machine.diagonals()
    status = _drawn(
        options, lambda path: draw_grid(found, diagonals, options.grid, options.magnification, path)
    )
    if options.format == "json":
        data = {
            **machine_data(machine),
            "diagonals": diagonal_data(diagonals),
            "grid": error_data(found),
        }
        print_json([data])
    elif options.format == "csv":
        print_lines(list(error_csv(found)))
    else:
        print_lines(
            [*machine_lines(machine), "", *diagonal_lines(diagonals), "", *error_lines(found)]
        )
    return status


def _drawn(options: Namespace, writer: Writer) -> int:
    """Draw what was asked for, before anything is printed that nobody may read to its end."""
    return (
        0
        if options.plot is None or write_outputs({options.plot: writer}, options.force)
        else BAD_FILE
    )
