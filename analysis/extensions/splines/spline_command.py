"""`ballplate spline`: a spline with prescribed values and slopes through measured errors."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.cli import (
    UsageError,
    Writer,
    add_force,
    add_output,
    add_picture,
    count,
    print_json,
    print_lines,
    write,
)

if TYPE_CHECKING:
    from .read_points import CurvePoints


DESCRIPTION = (
    "Fit a spline to errors along an axis or along the profile of a turned part, by least"
    " squares, with values and slopes prescribed at its ends or at other points, and write it as"
    " polynomials for a controller. The file has columns such as position_mm and error_um,"
    " or nominal_x_mm and nominal_z_mm for a profile, whose arc length is then the"
    " abscissa; also point, feature and u_um. A LOCATION is an abscissa"
    ' such as "12.5 mm", start, end, or nominal co-ordinates on the profile such as "37.084'
    ' mm, -37.084 mm".'
)


# In one piece: one option after the other, with its help.
def add_options(parser: ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="measured points (CSV)")
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
    data.add_argument(
        "--uncertainty",
        metavar="VALUE",
        help="standard uncertainty of each error, if there is no column u",
    )
    data.add_argument(
        "--sigma",
        choices=("given", "estimated"),
        help=(
            "believe the stated uncertainties, or estimate a factor; default: given if there"
            " are any"
        ),
    )
    shape = parser.add_argument_group("curve")
    knots = shape.add_mutually_exclusive_group()
    knots.add_argument(
        "--every",
        metavar="R",
        type=count,
        help="a knot at every R-th point of each feature; default: 5",
    )
    knots.add_argument("--knots", metavar="LOCATIONS", help='knots such as "10 mm, 20 mm", or none')
    shape.add_argument(
        "--order", metavar="N", type=count, default=4, help="degree plus one; default: 4, cubic"
    )
    shape.add_argument(
        "--start",
        metavar="LOCATION",
        default="start",
        help="where the curve starts; default: first point",
    )
    shape.add_argument(
        "--end", metavar="LOCATION", default="end", help="where the curve ends; default: last point"
    )
    shape.add_argument(
        "--boundary",
        metavar="LOCATION",
        action="append",
        default=[],
        help="between features that share value and slope; may be repeated",
    )
    shape.add_argument(
        "--corner",
        metavar="LOCATION",
        action="append",
        default=[],
        help="between features that share only their location; may be repeated",
    )
    shape.add_argument(
        "--straight",
        metavar="K",
        type=count,
        action="append",
        default=[],
        help="the K-th feature is a straight line; may be repeated",
    )
    shape.add_argument(
        "--periodic", action="store_true", help="closed curve, of 360 deg if there is no --period"
    )
    shape.add_argument(
        "--period", metavar="PERIOD", help='closed curve of another period, such as "10 mm"'
    )
    prescribed = parser.add_argument_group("prescribed")
    for end in ("start", "end"):
        prescribed.add_argument(
            f"--{end}-value", metavar="VALUE", help=f'error at the {end}, such as "3 um"'
        )
        prescribed.add_argument(
            f"--{end}-slope", metavar="SLOPE", help=f'slope at the {end}, such as 0 or "2 um/mm"'
        )
    prescribed.add_argument(
        "--at",
        nargs=3,
        metavar=("LOCATION", "value|slope", "VALUE"),
        action="append",
        default=[],
        help='for example --at "30 mm" slope 0; may be repeated',
    )
    output = parser.add_argument_group("output")
    output.add_argument(
        "--evaluate",
        metavar="LOCATIONS",
        help=('also print the values at these locations, such as "10 mm, 12.5 mm"'),
    )
    output.add_argument("--powers", choices=("local", "global"), default="local", help=POWERS)
    add_output(
        output,
        "-o",
        "--output",
        metavar="FILE",
        takes_screen=True,
        help="write the polynomials as CSV; - for the screen",
    )
    add_output(
        output,
        "--compensated",
        metavar="CSV",
        help="write the points of the profile moved against their errors, and its corners",
    )
    output.add_argument(
        "--nominal",
        metavar="CSV",
        type=Path,
        help=(
            "with --compensated: nominal points on the profile instead of the measured ones, with"
            " columns such as nominal_x_mm and nominal_z_mm"
        ),
    )
    add_picture(output, "--plot", help="draw points and curve (.svg, .png or .pdf)")
    add_picture(
        output, "--whiskers", help="draw errors as bars normal to the profile (.svg, .png or .pdf)"
    )
    add_force(output)
    output.add_argument("--json", action="store_true", help="print JSON in metres and radians")


POWERS = (
    "polynomials in the distance from the start of each piece (default), or in the abscissa itself"
)


def run(options: Namespace) -> int:
    """Fit, print and draw."""

    from .curve_options import Asked, OptionError
    from .curve_result import error_curve

    asked = Asked(**{field.name: getattr(options, field.name) for field in fields(Asked)})
    try:
        curve = error_curve(
            options.file,
            options.x,
            options.y,
            options.points,
            asked,
            options.sigma,
            options.powers,
            partial(_check, options),
        )
    except OptionError as error:
        raise UsageError(error) from None
    lines = [] if options.json else curve.lines()
    contents: dict[Path | None, Writer | str] = {
        options.plot: curve.plot,
        options.whiskers: curve.plot_whiskers,
    }
    if options.compensated is not None:
        contents[options.compensated] = curve.compensated(options.nominal).csv()
    polynomials = None if options.output is None else curve.coefficients()
    is_screen = str(options.output) == "-"
    if polynomials is not None and not is_screen:
        contents[options.output] = polynomials
    write(options, contents)
    if options.json:
        print_json([curve.to_dict()])
    elif polynomials is not None and is_screen:
        sys.stdout.write(polynomials)
    else:
        print_lines(lines)
    return 0


def _check(options: Namespace, points: CurvePoints) -> None:
    """Refuse options that do not go together.

    :raises UsageError: there are such.
    """
    if options.whiskers is not None and points.places is None:
        raise UsageError(
            "--whiskers needs a profile; add the columns nominal_x_mm and nominal_z_mm to the file"
        )
    if options.whiskers is not None and points.y_column.kind != "length":
        raise UsageError(
            f"--whiskers draws errors normal to the surface, but {points.y_column.name} is an angle"
        )
    if options.compensated is not None and points.x is not None:
        raise UsageError(
            "--compensated needs the arc length along a profile as abscissa; add the columns"
            " nominal_x_mm and nominal_z_mm to the file, and leave --x out"
        )
    if options.compensated is not None and points.y_column.kind != "length":
        raise UsageError(f"--compensated moves points, but {points.y_column.name} is an angle")
    if options.nominal is not None and options.compensated is None:
        raise UsageError("--nominal is for --compensated; add that, or leave it out")
    if options.json and str(options.output) == "-":
        raise UsageError("--json and -o - both go to the screen; name a file for one")
