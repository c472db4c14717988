"""An error curve from a file of points, as it shows itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from ballplate.presentation import Data, Result
from ballplate.simulator.inputs import ExperimentError, Message
from ballplate.simulator.machines import Array
from ballplate.simulator.splines import Powers, SplineError

from .compensated_points import CompensatedPoints, compensated_points, nominal_points
from .curve_options import Asked, curve_settings, listed, positive
from .curve_tables import coefficients_csv, curve_data, curve_lines, shown
from .error_curve import ErrorCurve, fit_curve
from .error_curve_plots import draw_curve, draw_whiskers
from .read_points import Column, CurvePoints, choose_points, read_points

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class FittedCurve(Result):
    """A fitted `curve` with its values at the places `at` (m,), in metres or radians.

    `everything` are all points of the file, those of the curve among them; `powers` says in what
    its polynomials are.
    """

    file: Path
    curve: ErrorCurve
    everything: CurvePoints
    at: Array
    powers: Powers

    @property
    def label(self) -> str:
        return self.file.stem

    @property
    def title(self) -> str:
        points = self.curve.points
        return f"{points.y_column.words} against {points.x_column.words}"

    def headline(self) -> str:
        fitted = self.curve.fit
        return f"{len(fitted.x)} points, {fitted.free} free coefficients"

    def lines(self) -> list[str]:
        return curve_lines(self.curve, self.file.name, self.powers, self.at)

    def data(self) -> Data:
        return curve_data(self.curve, str(self.file), self.powers, self.at)

    def rows(self) -> list[Data]:
        """One row for each point, in metres and radians."""
        points = self.curve.points
        units = {"x unit": _unit(points.x_column.kind), "y unit": _unit(points.y_column.kind)}
        return [
            {name.replace("_", " "): value for name, value in point.items()} | units
            for point in self.to_dict()["points"]
        ]

    def values(self, x: Array, derivative: int = 0) -> Array:
        """Values of the curve (m,), or of a derivative, in metres and radians.

        :raises SplineError: an x beyond its ends.
        """
        return self.curve.fit.values(np.asarray(x, float), derivative)

    def coefficients(self) -> str:
        """The polynomials of all pieces as CSV at full precision, in the units of the file."""
        return coefficients_csv(self.curve, self.powers)

    def compensated(self, nominal: str | Path | None = None) -> CompensatedPoints:
        """The points of the curve, or nominal points of a CSV file on the same profile, moved
        against the errors that the curve has there, and its corners.

        :raises ExperimentError: the file is invalid, or a point is not on the profile.
        """
        points = self.curve.points
        try:
            if nominal is not None:
                return compensated_points(self.curve, *nominal_points(Path(nominal)))
            places = np.zeros((0, 2)) if points.places is None else points.places
            return compensated_points(self.curve, points.names, places)
        except SplineError as error:
            raise _told(error, Path(nominal or self.file), points.x_column) from None

    def plot(self, path: str | Path | None = None) -> Figure:
        """Points, curve, its expanded uncertainty, knots and boundaries.

        With a path, which ends in .svg, .png or .pdf, the picture is written as well.

        :raises ImportError: matplotlib is missing.
        :raises ValueError: the path ends in something else.
        """
        return draw_curve(self.curve, path)

    def plot_whiskers(self, path: str | Path | None = None) -> Figure:
        """The errors of all points of the file as bars normal to their profile.

        :raises ImportError: matplotlib is missing.
        :raises ValueError: the path ends in something else, or there is no profile.
        :raises ExperimentError: two neighbouring points are at the same place.
        """
        if self.everything.places is None:
            raise ValueError("bars need a profile, of the columns nominal_x_mm and nominal_z_mm")
        try:
            return draw_whiskers(self.curve, self.everything, path)
        except SplineError as error:
            raise _told(error, self.file, self.everything.x_column) from None


def _unit(kind: str) -> Literal["m", "rad"]:
    return "m" if kind == "length" else "rad"


def _told(error: SplineError, file: Path, column: Column) -> ExperimentError:
    """The problems with places in the unit of the abscissa."""
    texts = [problem.told(lambda place: shown(place, column)) for problem in error.problems]
    return ExperimentError(Message(str(file), 0, 0, "", text) for text in texts)


def error_curve(
    file: Path,
    x: str | None = None,
    y: str | None = None,
    points: str | None = None,
    asked: Asked | None = None,
    sigma: str | None = None,
    powers: Powers = "local",
    check: Callable[[CurvePoints], None] = lambda points: None,
) -> FittedCurve:
    """The curve that is asked for, through the points of a file or some of them.

    `check` may refuse points before anything is fitted.

    :raises ExperimentError: the file is invalid, or there is no such curve.
    :raises OptionError: a text that does not say what it should.
    """
    asked = asked or Asked()
    everything = read_points(file, x, y)
    chosen = everything
    if points is not None:
        chosen = everything.chosen(choose_points(everything, points, str(file)))
    settings = curve_settings(asked, chosen)
    uncertainty = (
        None if asked.uncertainty is None else positive(asked.uncertainty, chosen.y_column)
    )
    column = chosen.x_column
    evaluated = np.array(
        listed("--evaluate", asked.evaluate, column) if asked.evaluate else [], float
    )
    check(chosen)
    try:
        curve = fit_curve(chosen, settings, uncertainty, sigma)
        curve.fit.values(evaluated)
    except SplineError as error:
        raise _told(error, file, column) from None
    return FittedCurve(file, curve, everything, evaluated, powers)
