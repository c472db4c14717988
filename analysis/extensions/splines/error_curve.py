"""Error curve through measured points: a spline with prescribed values and slopes, and its
uncertainty.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from ballplate.simulator.machines import Array
from ballplate.simulator.splines import (
    Constraint,
    Side,
    SplineError,
    SplineFit,
    SplineProblem,
    SplineSpace,
    at_every,
    fit,
    straight,
    with_boundaries,
)

from .profile import NotOnProfileError, Profile, along
from .read_points import ARC_LENGTH, CurvePoints

Place = float | tuple[float, float]
"""An abscissa, or nominal co-ordinates (radius, axial) on the profile, in metres."""

CUBIC = 4
# Of a corner, in the order of the curve.
SIDES: tuple[Side, Side] = ("below", "above")
# A profile goes on beyond its points for no more than this many times the largest distance between
# two of them.
CONTINUED = 2.0
# Time grows with the square of these, times the points.
MOST_COEFFICIENTS = 500


@dataclass(frozen=True)
class ErrorCurve:
    """A fitted curve through `points` in ascending order of x, on the `profile` if its abscissa is
    the arc length; `straight` are the features, counted from 1, that are lines.
    """

    points: CurvePoints
    fit: SplineFit
    boundaries: tuple[float, ...]
    corners: tuple[float, ...]
    straight: tuple[int, ...]
    prescribed: tuple[Constraint, ...]
    profile: Profile | None = field(default=None, repr=False)

    @property
    def knots(self) -> tuple[float, ...]:
        """Knots within the features."""
        between = (*self.boundaries, *self.corners)
        return tuple(knot for knot in self.fit.space.knots if knot not in between)

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

    :raises SplineError: it cannot be fitted, all reasons found.
    """
    x, where, profile = _on_profile(points, wanted)
    lower, upper = (
        float(extreme) if place is None else where.get(place, place)
        for place, extreme in ((wanted.start, x.min()), (wanted.end, x.max()))
    )
    boundaries, corners = (
        tuple(sorted({where.get(place, place) for place in places}))
        for places in (wanted.boundary, wanted.corner)
    )
    if lower == upper == x.min() == x.max():
        text = "all points are at {0}, which defines no curve; give points at several abscissae"
        raise SplineError([SplineProblem(text, (lower,))])
    between = sorted({*boundaries, *corners})
    features = list(pairwise((lower, *between, upper)))
    problems = [*_misplaced(boundaries, corners, lower, upper, x)]
    problems += [
        SplineProblem(
            f"there is no feature {k}; there are {len(features)}, counted from the start of the"
            " curve"
        )
        for k in wanted.straight
        if k > len(features)
    ]
    if problems:
        raise SplineError(problems)
    order = np.argsort(x, kind="stable")
    x, points = x[order], points.chosen(order.tolist())
    lines = sorted(set(wanted.straight))
    spans = [features[k - 1] for k in lines]
    knots = wanted.knots
    if knots is None:
        knots = [
            knot
            for knot in at_every(x, wanted.every, lower, upper, between)
            if not any(start <= knot <= end for start, end in spans)
        ]
    knots = sorted(set(knots) - set(between))
    space = SplineSpace(CUBIC, lower, upper, with_boundaries(knots, boundaries, CUBIC, corners))
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
    level = [condition for span in spans for condition in straight(space, *span)]
    fitted = fit(space, x, points.y, (*prescribed, *level))
    return ErrorCurve(points, fitted, boundaries, corners, tuple(lines), prescribed, profile)


def _misplaced(
    boundaries: Sequence[float], corners: Sequence[float], lower: float, upper: float, x: Array
) -> list[SplineProblem]:
    """Faults of boundaries and corners."""
    outside = "the {2} at {0} is not between the ends of the curve, {1}; give one there"
    ends = f"{1e3 * lower:.6g} mm and {1e3 * upper:.6g} mm"
    problems = [
        SplineProblem(outside.format("{0}", ends, noun), (place,))
        for noun, places in (("boundary", boundaries), ("corner", corners))
        for place in places
        if not lower < place < upper
    ]
    both = "{0} is a corner and a boundary; give only one of the two"
    ambiguous = "a point is on the corner at {0}, so its feature is ambiguous; leave it out"
    problems += [SplineProblem(both, (corner,)) for corner in corners if corner in boundaries]
    problems += [SplineProblem(ambiguous, (corner,)) for corner in corners if (x == corner).any()]
    return problems


def _on_profile(
    points: CurvePoints, wanted: Namespace
) -> tuple[Array, dict[Place, float], Profile | None]:
    """Abscissae of the points and of places by their nominal co-ordinates, and the profile.

    :raises SplineError: a place is not on the profile, or two points are at the same place.
    """
    corners = [place for place in dict.fromkeys(wanted.corner) if isinstance(place, tuple)]
    between = [place for place in dict.fromkeys(wanted.boundary) if isinstance(place, tuple)]
    nominal = [*(place for place in between if place not in corners), *corners]
    ends = [place if isinstance(place, tuple) else None for place in (wanted.start, wanted.end)]
    places = points.places
    if points.x is not None or places is None:
        if nominal or any(ends):
            text = "nominal co-ordinates define a point on the profile, but the abscissa is"
            remedy = f"give one value, or choose --x {ARC_LENGTH}"
            raise SplineError([SplineProblem(f"{text} {points.x_name}; {remedy}")])
        return np.asarray(points.x), {}, None
    same = [
        SplineProblem("two neighbouring points are at ({0}, {1}); remove one", tuple(place))
        for place, following in pairwise(places.tolist())
        if place == following
    ]
    if same:
        raise SplineError(same)
    _refuse_distant(places, ends)
    first, last = (
        None if place is None or (places == place).all(axis=1).any() else np.array(place)
        for place in ends
    )
    try:
        profile, profile_points, breaks = along(
            places, points.features, np.array(nominal).reshape(-1, 2), first, last, len(corners)
        )
    except NotOnProfileError as error:
        text = "the point ({0}, {1}) is not on the profile between two points; correct it, or give"
        problem = SplineProblem(f"{text} the arc length", nominal[error.args[0]])
        raise SplineError([problem]) from None
    lengths = profile.lengths
    where: dict[Place, float] = dict(zip(nominal, lengths[breaks].tolist(), strict=True))
    for place in ends:
        if place is not None:
            where[place] = float(lengths[(profile.places == place).all(axis=1)][0])
    return lengths[profile_points], where, profile


def _refuse_distant(places: Array, ends: Sequence[tuple[float, float] | None]) -> None:
    """Refuse a start or an end that does not continue the profile beyond its first or last point.

    :raises SplineError: it is nearer to another point, or much farther away than points are from
        one another.
    """
    farthest = CONTINUED * np.hypot(*np.diff(places, axis=0).T).max(initial=0.0)
    for place, index in zip(ends, (0, -1), strict=True):
        away = np.array([0.0]) if place is None else np.hypot(*(places - place).T)
        if away.min() > 0.0 and away[index] > min(away.min(), farthest):
            text = "the point ({0}, {1}) is not on the profile or just beyond it; correct it, or"
            raise SplineError([SplineProblem(f"{text} give the arc length", place or ())])
