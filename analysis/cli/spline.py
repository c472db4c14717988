"""`ballplate spline`: a spline with prescribed values and slopes through measured errors."""

from __future__ import annotations

import re
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .common import add_picture, count, print_json, print_lines
from .outputs import UsageError, Writer, add_force, add_output, text_writer, write

if TYPE_CHECKING:
    from ballplate.simulator.inputs.messages import ExperimentError
    from ballplate.simulator.splines.read import Column, CurvePoints
    from ballplate.simulator.splines.spline_problems import SplineError

    from ..error_maps.error_curve import CurveSettings, Place


HELP = "fit a spline with prescribed values and slopes to measured errors"
DESCRIPTION = (
    "Fit a spline to errors along an axis or along the profile of a turned part, by least"
    " squares, with values and slopes prescribed at its ends or elsewhere, and write it as"
    " polynomials for a controller. The file has columns such as position_mm and error_um,"
    " or nominal_x_mm and nominal_z_mm for a profile, whose arc length is then the"
    " abscissa; also point, feature, u_um, normal_x and normal_z. A PLACE is an abscissa"
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
        help="standard uncertainty of each error, where no column u has it",
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
    knots.add_argument("--knots", metavar="PLACES", help='knots such as "10 mm, 20 mm", or none')
    shape.add_argument(
        "--order", metavar="N", type=count, default=4, help="degree plus one; default: 4, cubic"
    )
    shape.add_argument(
        "--start",
        metavar="PLACE",
        default="start",
        help="where the curve starts; default: first point",
    )
    shape.add_argument(
        "--end", metavar="PLACE", default="end", help="where the curve ends; default: last point"
    )
    shape.add_argument(
        "--boundary",
        metavar="PLACE",
        action="append",
        default=[],
        help="between features that share value and slope; may be repeated",
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
    held = parser.add_argument_group("prescribed")
    for end in ("start", "end"):
        held.add_argument(
            f"--{end}-value", metavar="VALUE", help=f'error at the {end}, such as "3 um"'
        )
        held.add_argument(
            f"--{end}-slope", metavar="SLOPE", help=f'slope at the {end}, such as 0 or "2 um/mm"'
        )
    held.add_argument(
        "--at",
        nargs=3,
        metavar=("PLACE", "value|slope", "VALUE"),
        action="append",
        default=[],
        help='for example --at "30 mm" slope 0; may be repeated',
    )
    output = parser.add_argument_group("output")
    output.add_argument(
        "--evaluate",
        metavar="PLACES",
        help=('also print the values at these places, such as "10 mm, 12.5 mm"'),
    )
    output.add_argument("--powers", choices=("local", "global"), default="local", help=POWERS)
    add_output(
        output,
        "--coefficients",
        metavar="FILE",
        takes_screen=True,
        help="write the polynomials as CSV; - for the screen",
    )
    add_picture(output, "--plot", help="draw points and curve (.svg, .png or .pdf)")
    add_picture(
        output, "--whiskers", help="draw errors as bars normal to the profile (.svg, .png or .pdf)"
    )
    add_force(output)
    output.add_argument(
        "--magnification",
        metavar="N",
        type=float,
        help="magnification of the bars; default: one that fits",
    )
    output.add_argument("--json", action="store_true", help="print JSON in metres and radians")


# A polynomial through so many points keeps seven digits; with each further order it loses nearly
# one.
MOST_ORDER = 16

POWERS = (
    "polynomials in the distance from the start of each piece (default), or in the abscissa itself"
)


def run(options: Namespace) -> int:
    """Fit, print and draw."""
    import numpy as np
    from ballplate.simulator.splines.read import choose_points, read_points
    from ballplate.simulator.splines.spline_problems import SplineError

    from ..error_maps.curve_tables import coefficients_csv, curve_data, curve_lines
    from ..error_maps.error_curve import fit_curve
    from ..report.error_curve_plots import plot, whiskers

    everything = read_points(options.file, options.x, options.y)
    points = everything
    if options.points is not None:
        points = everything.chosen(choose_points(everything, options.points, str(options.file)))
    settings = _settings(options, points)
    uncertainty = (
        None if options.uncertainty is None else _positive(options.uncertainty, points.y_column)
    )
    at = _list("--evaluate", options.evaluate, points.x_column) if options.evaluate else []
    _check(options, points)
    try:
        curve = fit_curve(points, settings, uncertainty, options.sigma)
        where = np.array(at, dtype=float)
        curve.fit.values(where)
        lines = [] if options.json else curve_lines(curve, options.file.name, options.powers, where)
        writers: dict[Path, Writer] = {}
        if options.plot is not None:
            writers[options.plot] = partial(plot, curve)
        if options.whiskers is not None:
            writers[options.whiskers] = lambda path: whiskers(
                curve, everything, path, options.magnification
            )
        polynomials = (
            None if options.coefficients is None else coefficients_csv(curve, options.powers)
        )
        if polynomials is not None and str(options.coefficients) != "-":
            writers[options.coefficients] = text_writer(lambda stream: stream.write(polynomials))
        write(options, writers)
    except SplineError as error:
        raise _told(error, points.x_column, options.file) from None
    if options.json:
        print_json([curve_data(curve, str(options.file), options.powers, where)])
    elif polynomials is not None and str(options.coefficients) == "-":
        sys.stdout.write(polynomials)
    else:
        print_lines(lines)
    return 0


def _told(error: SplineError, column: Column, file: Path) -> ExperimentError:
    """The problems with places in the unit of the abscissa."""
    from ballplate.simulator.inputs.messages import ExperimentError, Message

    from ..error_maps.curve_tables import shown

    texts = [problem.told(lambda place: shown(place, column)) for problem in error.problems]
    return ExperimentError(Message(str(file), 0, 0, "", text) for text in texts)


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
    if options.magnification is not None and not 0 < options.magnification < float("inf"):
        raise UsageError("--magnification should be above 0, such as 200")
    if options.magnification is not None and options.whiskers is None:
        raise UsageError("--magnification is that of --whiskers; add that, or leave it out")
    if options.json and str(options.coefficients) == "-":
        raise UsageError("--json and --coefficients - both go to the screen; name a file for one")


def _settings(options: Namespace, points: CurvePoints) -> CurveSettings:
    """What the options ask for.

    :raises UsageError: a value that is no length, angle or slope.
    """
    from ..error_maps.error_curve import EVERY, CurveSettings, Hold

    x, y = points.x_column, points.y_column
    holds = []
    for end in ("start", "end"):
        for derivative, what in enumerate(("value", "slope")):
            text = getattr(options, f"{end}_{what}")
            if text is not None:
                holds.append(
                    Hold(end, derivative, _value(f"--{end}-{what}", text, derivative, x, y))
                )
    for place, what, text in options.at:
        if what not in ("value", "slope"):
            raise UsageError(f'--at: "{what}" should be value or slope, as in --at "30 mm" slope 0')
        derivative = ("value", "slope").index(what)
        holds.append(
            Hold(_place("--at", place, x), derivative, _value("--at", text, derivative, x, y))
        )
    knots = None
    if options.knots is not None:
        knots = (
            ()
            if options.knots.strip() == "none"
            else tuple(sorted(_list("--knots", options.knots, x)))
        )
    if not 2 <= options.order <= MOST_ORDER:
        raise UsageError(f"--order should be 2 to {MOST_ORDER}; 4 is a cubic spline")
    period = None
    if options.period is not None:
        period = _positive(options.period, x, "--period")
    elif options.periodic:
        if x.kind == "length":
            raise UsageError(
                '--periodic: the abscissa is a length; state the period, as in --period "10 mm"'
            )
        period = _positive("360 deg", x)
    if options.start.strip() == "end" or options.end.strip() == "start":
        raise UsageError(
            "the curve starts at its start and ends at its end; give --start and --end other places"
        )
    return CurveSettings(
        order=options.order,
        every=options.every or EVERY,
        knots=knots,
        start=_place("--start", options.start, x),
        end=_place("--end", options.end, x),
        boundaries=tuple(_place("--boundary", text, x) for text in options.boundary),
        straight=tuple(options.straight),
        holds=tuple(holds),
        period=period,
    )


def _parser(kind: str) -> Callable[[object], float]:
    from ballplate.simulator.inputs.quantities import parse_angle, parse_length

    return parse_length if kind == "length" else parse_angle


def _quantity(option: str, text: str, kind: str) -> float:
    from ballplate.simulator.inputs.quantities import QuantityError

    if text.strip() in ("0", "-0", "0.0"):
        return 0.0
    try:
        return _parser(kind)(text)
    except QuantityError as error:
        raise UsageError(f"{option}: {error}") from None


def _positive(text: str, column: Column, option: str = "--uncertainty") -> float:
    found = _quantity(option, text, column.kind)
    if found <= 0:
        raise UsageError(f'{option}: "{text}" must be above zero')
    return found


def _list(option: str, text: str, column: Column) -> list[float]:
    return [_quantity(option, part, column.kind) for part in text.split(",")]


def _place(option: str, text: str, column: Column) -> Place:
    plain = text.strip()
    if plain in ("start", "end"):
        return "start" if plain == "start" else "end"
    parts = plain.split(",")
    if len(parts) > 2 or len(parts) == 2 and column.kind != "length":
        raise UsageError(
            f'{option}: "{text}" should be one abscissa, or two nominal co-ordinates on a profile'
        )
    if len(parts) == 2:
        return _quantity(option, parts[0], "length"), _quantity(option, parts[1], "length")
    return _quantity(option, plain, column.kind)


def _value(option: str, text: str, derivative: int, x: Column, y: Column) -> float:
    """A value of the error, or a slope as a unit of the error over one of the abscissa."""
    from ballplate.simulator.inputs.quantities import (
        UNITS,
        QuantityError,
        metres_or_radians,
        parse_ratio,
    )

    if derivative == 0:
        return _quantity(option, text, y.kind)
    plain = text.strip().replace("µ", "u").replace("μ", "u")
    if plain in ("0", "-0", "0.0"):
        return 0.0
    if re.match("[+-]?[0-9]+,[0-9]", plain):
        raise UsageError(
            f'{option}: "{text}" has a decimal comma; write for example "{text.replace(",", ".")}"'
        )
    found = re.fullmatch(r"([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*([a-z]+)\s*/\s*([a-z]+)", plain)
    units: Any = UNITS
    with suppress(QuantityError):
        if found and found[2] in units[y.kind] and found[3] in units[x.kind]:
            return metres_or_radians(found[1], units[y.kind][found[2]] / units[x.kind][found[3]])
        if x.kind == y.kind == "length":
            return parse_ratio(plain)
    raise UsageError(
        f'{option}: "{text}" is not a slope; write for example "2 {y.unit}/{x.unit}", or 0'
    )
