"""An error curve as it shows itself: text, plain data, polynomials for a controller."""

from __future__ import annotations

import io
import math
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from ballplate.presentation import Data, MainTable, Result, aligned, picked, records
from ballplate.simulator.computing import comparable
from ballplate.simulator.inputs import CsvWriter, ExperimentError, Message, number_of
from ballplate.simulator.machines import Array
from ballplate.simulator.splines import SplineError, pieces

from .error_curve import ErrorCurve, fit_curve
from .read_points import choose_points, read_points

MOST_LISTED = 12
# What adds less to the curve than this part of its size is rounding.
NOTHING = 1e-13
UNITS = ("µm", "µm/mm", "µm/mm^2", "µm/mm^3")
# From metres to these units.
FACTORS = 1e6 * 1e-3 ** np.arange(4.0)


@dataclass(frozen=True, eq=False, repr=False)
class FittedCurve(Result):
    """A fitted `curve` through points of a file; its polynomials are in the distance from the
    start of each piece if `local`, otherwise in the abscissa.
    """

    file: Path
    curve: ErrorCurve
    local: bool

    @property
    def label(self) -> str:
        return self.file.stem

    @property
    def title(self) -> str:
        points = self.curve.points
        return f"{points.y_name} against {points.x_name}".replace("_", " ")

    def headline(self) -> str:
        fitted = self.curve.fit
        return f"{len(fitted.x)} points, {fitted.free} free coefficients"

    def lines(self) -> list[str]:
        heading = f"{self.file.name}: {self.title}"
        return [*_curve_lines(self.curve, heading), "", *self._piece_lines()]

    def data(self) -> Data:
        curve, fitted, space = self.curve, self.curve.fit, self.curve.fit.space
        return {
            "file": str(self.file),
            **picked(curve.points, "x_name", "y_name"),
            "knots": space.knots,
            "start": space.lower,
            "end": space.upper,
            "coverage_factor": curve.coverage_factor,
            **picked(fitted, "sigma", "degrees_of_freedom", "sum_of_squares"),
            "prescribed": [picked(held, "at", "derivative", "value") for held in curve.prescribed],
            "free_coefficients": fitted.free,
            "powers": "local" if self.local else "global",
            "pieces": records(
                start=space.breaks[:-1],
                end=space.breaks[1:],
                coefficients=pieces(fitted, self.local),
            ),
            "points": records(
                point=curve.points.names,
                x=fitted.x,
                y=fitted.y,
                curve=fitted.y - fitted.residuals,
                residual=fitted.residuals,
                standard_uncertainty=curve.standard_uncertainty(fitted.x),
            ),
        }

    def columns(self) -> MainTable:
        """One row for each point."""
        rows = self.data()["points"]
        units = {"point": "", "x": ", mm"}
        heads = {name: f"{name.replace('_', ' ')}{units.get(name, ', µm')}" for name in rows[0]}
        return {head: [row[name] for row in rows] for name, head in heads.items()}, ()

    def values(self, x: Array, derivative: int = 0) -> Array:
        """Values of the curve (m,), or of a derivative, in metres.

        :raises SplineError: an x beyond its ends.
        """
        return self.curve.fit.values(np.asarray(x, float), derivative)

    def coefficients(self) -> str:
        """The polynomials as CSV at full precision, in millimetres and micrometres."""
        text = io.StringIO()
        name = self.curve.points.y_name
        text.write(f"# {name} = c0 + c1 u + c2 u^2 + c3 u^3, where u is the {self._variable()}\n")
        writer = CsvWriter(text)
        units = ("um", "um_per_mm", "um_per_mm2", "um_per_mm3")
        writer.writerow(["start_mm", "end_mm", *(f"c{k}_{unit}" for k, unit in enumerate(units))])
        for start, end, polynomial in self._pieces():
            writer.writerow([repr(value) for value in (start, end, *polynomial.tolist())])
        return text.getvalue()

    def _variable(self) -> str:
        start = " less the start of the piece" if self.local else ""
        return f"{self.curve.points.x_name.replace('_', ' ')}{start}"

    def _pieces(self) -> Iterator[tuple[float, float, Array]]:
        """Start and end of each piece in millimetres, and its coefficients in micrometres."""
        breaks = (1e3 * self.curve.fit.space.breaks).tolist()
        return zip(breaks, breaks[1:], pieces(self.curve.fit, self.local) * FACTORS, strict=False)

    def _piece_lines(self) -> list[str]:
        size = NOTHING * 1e6 * float(np.abs(self.curve.fit.coefficients).max())
        rows = [["from", "to", "1", "u^1", "u^2", "u^3"], ["mm", "mm", *UNITS]]
        for start, end, polynomial in self._pieces():
            length = end - start if self.local else max(abs(start), abs(end))
            numbers = [
                "0" if abs(value) * length**k < size else f"{value:.7g}"
                for k, value in enumerate(polynomial)
            ]
            rows.append([f"{start:.6g}", f"{end:.6g}", *numbers])
        head = f"polynomials of u, the {self._variable()}, in mm; their coefficients of"
        return [head, *aligned(rows, [True] * 6)]


def _curve_lines(curve: ErrorCurve, heading: str) -> list[str]:
    fitted, points, space = curve.fit, curve.points, curve.fit.space
    lines = [
        f"{heading}, {len(fitted.x)} points, curve from {mm(space.lower)} to {mm(space.upper)}"
    ]
    knots = ", ".join(f"{1e3 * knot:.6g}" for knot in space.knots[:MOST_LISTED])
    more = f" and {len(space.knots) - MOST_LISTED} more" if len(space.knots) > MOST_LISTED else ""
    where = f" at {knots} mm{more}" if knots else ""
    lines.append(
        f"cubic spline, {number_of(len(space.knots), 'knot')}{where};"
        f" {number_of(fitted.free, 'free coefficient')},"
        f" {fitted.degrees_of_freedom} degrees of freedom"
    )
    for held in curve.prescribed:
        value = held.value * FACTORS[held.derivative] + 0.0
        amount = f"{value:.6g} {UNITS[held.derivative]}" if value else "0"
        lines.append(f"prescribed: {held.name} {amount} at {mm(held.at)}")
    if math.isnan(fitted.sigma):
        lines.append("no degrees of freedom are left to estimate sigma from")
    else:
        places = np.linspace(space.lower, space.upper, 501)
        spread = curve.standard_uncertainty(places)
        worst = int(np.argmax(comparable(spread)))
        lines += [
            f"sigma {um(fitted.sigma, 4)}, estimated from the residuals",
            f"standard uncertainty of the curve: median {um(float(np.median(spread)), 3)}, largest"
            f" {um(spread[worst], 3)} at {mm(places[worst], 4)}; {curve.coverage_factor:.3g} times"
            " that for 95 %",
        ]
    worst_points = np.argsort(-comparable(np.abs(fitted.residuals)), kind="stable")[:3]
    worst_residuals = [
        f"{um(fitted.residuals[k], 3)} at point {points.names[k]}" for k in worst_points
    ]
    return [*lines, f"largest residuals: {', '.join(worst_residuals)}"]


def mm(place: float, digits: int = 6) -> str:
    return f"{1e3 * place + 0.0:.{digits}g} mm"


def um(error: float, digits: int) -> str:
    return f"{1e6 * error + 0.0:.{digits}g} µm"


def _placed(error: SplineError, file: Path) -> ExperimentError:
    """The problems with places in millimetres."""
    texts = [problem.told(mm) for problem in error.problems]
    return ExperimentError(Message(str(file), 0, 0, "", text) for text in texts)


def error_curve(file: Path, wanted: Namespace) -> FittedCurve:
    """The curve that the options of `ballplate spline` want, through the points of a file.

    :raises ExperimentError: the file is invalid, or there is no such curve.
    """
    points = read_points(file, wanted.x, wanted.y)
    if wanted.points is not None:
        points = points.chosen(choose_points(points, wanted.points, str(file)))
    try:
        return FittedCurve(file, fit_curve(points, wanted), wanted.powers == "local")
    except SplineError as error:
        raise _placed(error, file) from None
