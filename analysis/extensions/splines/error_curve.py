"""Error curve through measured points: a spline with prescribed values and slopes, and its
uncertainty.
"""

from __future__ import annotations

from argparse import Namespace
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from ballplate.simulator.machines import Array
from ballplate.simulator.splines import (
    Constraint,
    SplineError,
    SplineFit,
    SplineProblem,
    SplineSpace,
    at_every,
    fit,
)

from .arc_lengths import arc_lengths
from .read_points import CurvePoints

CUBIC = 4
# Time grows with the square of these, times the points.
MOST_COEFFICIENTS = 500


@dataclass(frozen=True)
class ErrorCurve:
    """A fitted curve through `points` in ascending order of x."""

    points: CurvePoints
    fit: SplineFit
    prescribed: tuple[Constraint, ...]

    @property
    def coverage_factor(self) -> float:
        """Student's, of the expanded uncertainty for 95 %; NaN without degrees of freedom."""
        from scipy.special import stdtrit

        freedom = self.fit.degrees_of_freedom
        return float(stdtrit(freedom, 0.975)) if freedom else float("nan")

    def standard_uncertainty(self, x: Array) -> Array:
        """Of the curve at x (m,), from the points' noise alone.

        :raises SplineError: an x beyond the ends.
        """
        return np.asarray(self.fit.sigma * self.fit.spread(x))


def fit_curve(points: CurvePoints, wanted: Namespace) -> ErrorCurve:
    """Fit the curve that the options of `ballplate spline` want.

    :raises SplineError: it cannot be fitted.
    """
    x = _abscissae(points)
    lower, upper = (
        float(extreme) if place is None else place
        for place, extreme in ((wanted.start, x.min()), (wanted.end, x.max()))
    )
    if lower == upper == x.min() == x.max():
        text = "all points are at {0}, which defines no curve; give points at several abscissae"
        raise SplineError([SplineProblem(text, (lower,))])
    order = np.argsort(x, kind="stable")
    x, points = x[order], points.chosen(order.tolist())
    knots = wanted.knots
    if knots is None:
        knots = at_every(x, wanted.every, lower, upper)
    space = SplineSpace(CUBIC, lower, upper, tuple(sorted(set(knots))))
    if space.count > MOST_COEFFICIENTS:
        text = f"{space.count} coefficients are too many; at most {MOST_COEFFICIENTS} are possible"
        raise SplineError([SplineProblem(f"{text}, leave out knots")])
    ends = (
        (lower, (wanted.start_value, wanted.start_slope)),
        (upper, (wanted.end_value, wanted.end_slope)),
    )
    prescribed = tuple(
        Constraint(end, derivative, value)
        for end, values in ends
        for derivative, value in enumerate(values)
        if value is not None
    )
    return ErrorCurve(points, fit(space, x, points.y, prescribed), prescribed)


def _abscissae(points: CurvePoints) -> Array:
    """Abscissae (m,) of the points.

    :raises SplineError: neighbouring points of a profile are at the same place.
    """
    if points.places is None or points.x is not None:
        return np.asarray(points.x)
    same = [
        SplineProblem("two neighbouring points are at ({0}, {1}); remove one", tuple(place))
        for place, following in pairwise(points.places.tolist())
        if place == following
    ]
    if same:
        raise SplineError(same)
    return arc_lengths(points.places, points.features)
