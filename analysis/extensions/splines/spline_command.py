"""`ballplate spline`: a spline with prescribed values and slopes through measured errors."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from ballplate.cli import (
    UsageError,
    add_force,
    add_output,
    argument_type,
    count,
    print_json,
    print_lines,
    write,
)

DESCRIPTION = (
    "Fit a cubic spline to errors along an axis or along the profile of a turned part, by least"
    " squares, with values and slopes prescribed at its ends, and write it as polynomials for a"
    " controller. The file has columns such as position_mm and error_um, or nominal_x_mm and"
    " nominal_z_mm for a profile, whose arc length is then the abscissa; also point and feature."
)


@argument_type
def error_value(text: str) -> float:
    """Argument type: a length, or 0."""
    from ballplate.simulator.inputs import parse_length

    return 0.0 if text.strip() == "0" else parse_length(text)


@argument_type
def slope(text: str) -> float:
    """Argument type: a slope such as 2 um/mm, or 0."""
    from ballplate.simulator.inputs import QuantityError, parse_length

    rise, _, unit = text.partition("/")
    try:
        return 0.0 if text.strip() == "0" else parse_length(rise) / parse_length(f"1 {unit}")
    except QuantityError:
        raise ValueError(f'"{text}" is not a slope; write for example "0.2 um/mm", or 0') from None


@argument_type
def abscissa(text: str) -> float:
    """Argument type: an abscissa."""
    from ballplate.simulator.inputs import parse_length

    return parse_length(text)


@argument_type
def abscissae(text: str) -> list[float]:
    """Argument type: abscissae, or none."""
    from ballplate.simulator.inputs import parse_length

    return [] if text.strip() == "none" else [parse_length(part) for part in text.split(",")]


# In one piece: one option after the other, with its help.
def add_curve(parser: ArgumentParser) -> None:
    """Add what defines the curve: `ballplate.spline` has the same."""
    data = parser.add_argument_group("points")
    data.add_argument(
        "--x",
        metavar="COLUMN",
        help="abscissa; default: arc_length if there is a profile, or the first",
    )
    data.add_argument("--y", metavar="COLUMN", help="error; default: the only other column")
    data.add_argument(
        "--points", metavar="NAMES", help="only these, such as 12-32 or 1,2,5-9; default: all"
    )
    shape = parser.add_argument_group("curve")
    knots = shape.add_mutually_exclusive_group()
    knots.add_argument(
        "--every",
        metavar="R",
        type=count,
        default=5,
        help="a knot at every R-th point; default: 5",
    )
    knots.add_argument(
        "--knots", metavar="ABSCISSAE", type=abscissae, help='such as "10 mm, 20 mm", or none'
    )
    for end, point in (("start", "first"), ("end", "last")):
        shape.add_argument(
            f"--{end}",
            metavar="ABSCISSA",
            type=abscissa,
            help=f"{end} of the curve; default: {point} point",
        )
    prescribed = parser.add_argument_group("prescribed")
    for end in ("start", "end"):
        prescribed.add_argument(
            f"--{end}-value",
            metavar="VALUE",
            type=error_value,
            help=f'error at the {end}, such as "3 um"',
        )
        prescribed.add_argument(
            f"--{end}-slope",
            metavar="SLOPE",
            type=slope,
            help=f'slope at the {end}, such as 0 or "2 um/mm"',
        )
    parser.add_argument(
        "--powers",
        choices=("local", "global"),
        default="local",
        help=(
            "polynomials in the distance from the start of each piece (default), or in the abscissa"
            " itself, which needs more digits"
        ),
    )


def add_options(parser: ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="measured points (CSV)")
    add_curve(parser)
    output = parser.add_argument_group("output")
    add_output(
        output,
        "-o",
        "--output",
        metavar="FILE",
        takes_screen=True,
        help="write the polynomials as CSV; - for the screen",
    )
    add_force(output)
    output.add_argument("--json", action="store_true", help="print JSON in metres")


def run(options: Namespace) -> int:
    """Fit, print and write."""
    from .curve_result import error_curve

    is_screen = str(options.output) == "-"
    if options.json and is_screen:
        raise UsageError("--json and -o - both go to the screen; name a file for one")
    curve = error_curve(options.file, options)
    if not is_screen:
        write(options, {options.output: curve.coefficients()})
    if options.json:
        print_json([curve.to_dict()])
    elif is_screen:
        sys.stdout.write(curve.coefficients())
    else:
        print_lines(curve.lines())
    return 0
