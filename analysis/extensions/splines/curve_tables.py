"""A fitted curve as text for people, as plain data, and as polynomials for a controller."""

from __future__ import annotations

import io
import math

import numpy as np
from ballplate.presentation import (
    Data,
    aligned,
    ascii_units,
    micro,
    number,
    picked,
    records,
    table_lines,
)
from ballplate.simulator.computing import comparable
from ballplate.simulator.inputs import CsvWriter, listing
from ballplate.simulator.splines import Constraint, Pieces, Powers, Side, pieces

from .error_curve import ErrorCurve
from .read_points import Column

ORDERS = {
    2: "broken line",
    3: "quadratic spline",
    4: "cubic spline",
    5: "quartic spline",
    6: "quintic spline",
}
MOST_LISTED = 12
# Of a corner, in the order of the curve.
SIDES: tuple[Side, Side] = ("below", "above")
NOTHING = 1e-13


def shown(value: float, column: Column, digits: int = 6) -> str:
    """A value in metres or radians in the unit of its column."""
    return f"{value / column.factor + 0.0:.{digits}g} {micro(column.unit)}"


def derivative_unit(curve: ErrorCurve, derivative: int) -> str:
    """Unit of a derivative: µm, µm/mm, µm/mm^2."""
    x, y = micro(curve.points.x_column.unit), micro(curve.points.y_column.unit)
    return y if derivative == 0 else f"{y}/{x}" if derivative == 1 else f"{y}/{x}^{derivative}"


def in_unit(curve: ErrorCurve, value: float, derivative: int) -> float:
    """A derivative in its shown unit."""
    return value / curve.points.y_column.factor * curve.points.x_column.factor**derivative


def constraint_words(curve: ErrorCurve, constraint: Constraint) -> str:
    """What is prescribed, with its value."""
    x = curve.points.x_column
    words = constraint.words.format(*(shown(place, x) for place in constraint.places))
    name, _, place = words.partition(" at ")
    value = in_unit(curve, constraint.value, constraint.derivative)
    amount = "0" if value == 0 else f"{value:.6g} {derivative_unit(curve, constraint.derivative)}"
    return f"{name} {amount} at {place}"


def curve_lines(curve: ErrorCurve, file: str, powers: Powers, places: np.ndarray) -> list[str]:
    """The curve as lines of text, with its values at places (m,)."""
    fitted, points = curve.fit, curve.points
    x, y, space = points.x_column, points.y_column, fitted.space
    lines = [
        f"{file}: {y.words} against {x.words}, {len(fitted.x)} points, curve from"
        f" {shown(space.lower, x)} to {shown(space.upper, x)}"
    ]
    knots = [knot for knot in space.knots if knot not in (*curve.boundaries, *curve.corners)]
    listed = ", ".join(f"{knot / x.factor:.6g}" for knot in knots[:MOST_LISTED])
    more = f" and {len(knots) - MOST_LISTED} more" if len(knots) > MOST_LISTED else ""
    where = f" at {listed} {micro(x.unit)}{more}" if knots else ""
    title = ORDERS.get(space.order, f"spline of order {space.order}")
    lines.append(
        f"{title}, {_number_of(len(knots), 'knot')}{where}; "
        f"{_number_of(fitted.free, 'free coefficient')}, "
        f"{_number_of(fitted.degrees_of_freedom, 'degree')} of freedom"
    )
    for boundary in curve.boundaries:
        on = [points.names[k] for k in np.flatnonzero(fitted.x == boundary)]
        shared = f"; point {', '.join(on)} there belongs to both" if on else ""
        lines.append(f"features share value and slope at {shown(boundary, x)}{shared}")
    for corner in curve.corners:
        sides = [float(fitted.values(np.array([corner]), 0, side)[0]) for side in SIDES]
        errors = " and ".join(shown(side_text, y, 4) for side_text in sides)
        lines.append(f"features meet at a corner at {shown(corner, x)}, with errors {errors}")
    if len(set(points.features)) > 1 and not curve.boundaries and not curve.corners:
        names = listing(dict.fromkeys(points.features))
        lines.append(
            f"one curve over {names}: the column feature makes no boundaries; --boundary does"
        )
    for k in sorted(set(curve.settings.straight)):
        lines.append(f"feature {k} is a straight line")
    for hold in curve.holds:
        implied = ", which the others imply" if hold in fitted.redundant else ""
        lines.append(f"prescribed: {constraint_words(curve, hold)}{implied}")
    if curve.settings.period is not None:
        lines.append(f"periodic: ends agree in value and {space.order - 2} derivatives")
    lines += _sigma_lines(curve)
    worst = np.argsort(-comparable(np.abs(fitted.residuals / fitted.uncertainties)), kind="stable")[
        :3
    ]
    worst_residuals = ", ".join(
        f"{shown(fitted.residuals[k], y, 3)} at point {points.names[k]}" for k in worst
    )
    lines += [f"largest residuals: {worst_residuals}", "", *_piece_lines(curve, powers)]
    if len(places):
        lines += ["", *_value_lines(curve, places)]
    return lines


def _number_of(count: int, noun: str) -> str:
    """A number of things, as in 1 knot, 2 knots."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _sigma_lines(curve: ErrorCurve) -> list[str]:
    fitted, y = curve.fit, curve.points.y_column
    estimated = fitted.sigma
    if curve.sigma_is_estimated and math.isnan(estimated):
        return [
            "no degrees of freedom are left to estimate sigma from; state the points' uncertainty"
        ]
    sigma_text = number(curve.sigma, 4) if curve.has_uncertainties else shown(curve.sigma, y, 4)
    source = "estimated from the residuals" if curve.sigma_is_estimated else "given"
    beside = ""
    if not curve.sigma_is_estimated and not math.isnan(estimated):
        beside = f" ({number(estimated, 3)} from the residuals)"
    places = np.linspace(fitted.space.lower, fitted.space.upper, 501)
    spread = curve.standard_uncertainty(places)
    worst = int(np.argmax(comparable(spread)))
    return [
        f"sigma {sigma_text}, {source}{beside}",
        (
            f"standard uncertainty of the curve: median {shown(float(np.median(spread)), y, 3)},"
            f" largest {shown(spread[worst], y, 3)} at"
            f" {shown(places[worst], curve.points.x_column, 4)}; {curve.coverage_factor:.3g} times"
            " that for 95 %"
        ),
    ]


def _coefficients(curve: ErrorCurve, powers: Powers) -> tuple[Pieces, np.ndarray]:
    """Pieces in metres and radians, and their coefficients in the units of the columns."""
    pieces_found = pieces(curve.fit, powers)
    x, y = curve.points.x_column, curve.points.y_column
    return pieces_found, pieces_found.coefficients / y.factor * x.factor ** np.arange(
        pieces_found.coefficients.shape[1]
    )


def _variable(curve: ErrorCurve, powers: Powers) -> str:
    x = curve.points.x_column.words
    return f"{x} less the start of the piece" if powers == "local" else x


def _piece_lines(curve: ErrorCurve, powers: Powers) -> list[str]:
    pieces_shown, coefficients = _coefficients(curve, powers)
    x = curve.points.x_column
    head = ["from", "to", *(f"u^{k}" if k else "1" for k in range(coefficients.shape[1]))]
    unit = micro(x.unit)
    units = [unit, unit, *(derivative_unit(curve, k) for k in range(coefficients.shape[1]))]
    rows = [head, units]
    for start, end, row in zip(
        pieces_shown.breaks, pieces_shown.breaks[1:], coefficients, strict=False
    ):
        # What adds less to the curve than rounding does is told as zero.
        size = NOTHING * float(np.abs(curve.fit.coefficients).max()) / curve.points.y_column.factor
        lengths = (
            (end - start if powers == "local" else max(abs(start), abs(end))) / x.factor
        ) ** np.arange(len(row))
        numbers = [
            "0" if abs(value) * length < size else f"{value:.7g}"
            for value, length in zip(row, lengths, strict=True)
        ]
        rows.append([f"{start / x.factor:.6g}", f"{end / x.factor:.6g}", *numbers])
    note = []
    if powers == "global":
        note = [
            f"terms are up to {pieces_shown.cancellation():.2g} times the curve, and rounding"
            " as much larger"
        ]
    return [
        f"polynomials of u, the {_variable(curve, powers)}, in {unit}; their coefficients of",
        *aligned(rows, [True] * len(head)),
        *note,
    ]


def _value_lines(curve: ErrorCurve, places: np.ndarray) -> list[str]:
    x, y = curve.points.x_column, curve.points.y_column
    values, slopes = curve.fit.values(places), curve.fit.values(places, 1)
    slopes[
        np.abs(slopes) * curve.fit.space.length < NOTHING * np.abs(curve.fit.coefficients).max()
    ] = 0.0
    spread = curve.standard_uncertainty(places)
    columns = {
        f"{x.words}, {micro(x.unit)}": (places / x.factor, "{:.7g}".format),
        f"curve, {micro(y.unit)}": (values / y.factor, "{:.5g}".format),
        "standard uncertainty": (spread / y.factor, 3),
        "expanded": (curve.coverage_factor * spread / y.factor, 3),
        "slope": (
            [in_unit(curve, slope, 1) for slope in slopes],
            lambda slope: f"{slope:.4g} {derivative_unit(curve, 1)}",
        ),
    }
    return table_lines(columns)


# In one piece: one mapping, in the form in which the JSON has it.
def curve_data(curve: ErrorCurve, file: str, powers: Powers, places: np.ndarray) -> Data:
    """The curve as plain data in metres and radians; what is not known is None."""
    fitted, points, space = curve.fit, curve.points, curve.fit.space
    pieces_found = pieces(fitted, powers)
    units = {"length": "m", "angle": "rad"}
    return {
        "file": file,
        "x": {"name": points.x_column.name, "unit": units[points.x_column.kind]},
        "y": {"name": points.y_column.name, "unit": units[points.y_column.kind]},
        **picked(space, "order", "knots"),
        "start": space.lower,
        "end": space.upper,
        **picked(curve, "boundaries", "corners", "sigma", "sigma_is_estimated", "coverage_factor"),
        **picked(fitted, "degrees_of_freedom", "sum_of_squares"),
        "prescribed": [
            {
                "at": hold.places[0],
                **picked(hold, "derivative", "value"),
                "missed_by": fitted.violation(hold),
            }
            for hold in curve.holds
        ],
        "free_coefficients": fitted.free,
        "powers": powers,
        "pieces": records(
            start=pieces_found.breaks[:-1],
            end=pieces_found.breaks[1:],
            coefficients=pieces_found.coefficients,
        ),
        "points": records(
            point=points.names,
            x=fitted.x,
            y=fitted.y,
            curve=fitted.y - fitted.residuals,
            residual=fitted.residuals,
            standard_uncertainty=curve.standard_uncertainty(fitted.x),
        ),
        "values": records(
            x=places,
            curve=fitted.values(places),
            slope=fitted.values(places, 1),
            standard_uncertainty=curve.standard_uncertainty(places),
        ),
    }


def coefficients_csv(curve: ErrorCurve, powers: Powers) -> str:
    """The polynomials of all pieces as CSV at full precision, in the units of the data."""
    pieces_shown, coefficients = _coefficients(curve, powers)
    x, y = curve.points.x_column, curve.points.y_column
    text = io.StringIO()
    count = coefficients.shape[1]
    sum_ = " + ".join("c0" if k == 0 else "c1 u" if k == 1 else f"c{k} u^{k}" for k in range(count))
    text.write(f"# {y.name} = {sum_}, where u is {_variable(curve, powers)}\n")
    writer = CsvWriter(text)
    names = [
        f"c{k}_{ascii_units(derivative_unit(curve, k)).replace('/', '_per_').replace('^', '')}"
        for k in range(count)
    ]
    writer.writerow([f"start_{x.unit}", f"end_{x.unit}", *names])
    breaks = (pieces_shown.breaks / x.factor).tolist()
    for start, end, row in zip(breaks, breaks[1:], coefficients.tolist(), strict=False):
        writer.writerow([repr(start), repr(end), *map(repr, row)])
    return text.getvalue()
