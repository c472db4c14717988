"""Error curve through measured points: a spline with prescribed values and slopes, and its
uncertainty.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

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
    periodic,
    prescribed,
    straight,
    with_boundaries,
)

from .profile import NotOnProfileError, Profile, along
from .read_points import ARC_LENGTH, CurvePoints

Place = float | tuple[float, float] | Literal["start", "end"]
"""An abscissa, nominal co-ordinates (radius, axial) on the profile, or an end of the curve."""

EVERY = 5
# A profile goes on beyond its points for no more than this many times the largest distance between
# two of them.
CONTINUED = 2.0
# Time grows with the square of these, times the points.
MOST_COEFFICIENTS = 500


@dataclass(frozen=True)
class Hold:
    """A prescribed value (derivative 0) or slope (1) at a place, in metres or radians."""

    at: Place
    derivative: int
    value: float


@dataclass(frozen=True)
class CurveSettings:
    """What curve is wanted. Lengths and angles are in metres and radians.

    Knots are at every `every`-th point of each feature, or where `knots` says. At `boundaries` only
    value and slope are continuous, at `corners` nothing is; `straight` are the features, counted
    from 1, that are straight lines. `period` closes the curve.
    """

    order: int = 4
    every: int = EVERY
    knots: tuple[float, ...] | None = None
    start: Place = "start"
    end: Place = "end"
    boundaries: tuple[Place, ...] = ()
    corners: tuple[Place, ...] = ()
    straight: tuple[int, ...] = ()
    holds: tuple[Hold, ...] = ()
    period: float | None = None


@dataclass(frozen=True)
class ErrorCurve:
    """A fitted curve. `fit` has the points in ascending order of x, which `points` (names and
    columns) follows.

    `sigma` is the standard uncertainty of a point, or the factor of the stated ones:
    `sigma_is_estimated` from the residuals, and then not a number without degrees of freedom, or 1.
    """

    points: CurvePoints
    settings: CurveSettings
    fit: SplineFit
    boundaries: tuple[float, ...]
    holds: tuple[Constraint, ...]
    sigma: float
    sigma_is_estimated: bool
    has_uncertainties: bool
    profile_boundaries: Array = field(repr=False)
    corners: tuple[float, ...] = ()
    profile: Profile | None = field(default=None, repr=False)

    @property
    def coverage_factor(self) -> float:
        """Of the expanded uncertainty for 95 %: Student's where sigma is estimated, otherwise
        normal.
        """
        from scipy.special import ndtri, stdtrit

        if self.sigma_is_estimated:
            return (
                float(stdtrit(self.fit.degrees_of_freedom, 0.975))
                if self.fit.degrees_of_freedom
                else float("nan")
            )
        return float(ndtri(0.975))

    def standard_uncertainty(self, x: Array, derivative: int = 0) -> Array:
        """Of the curve or a derivative at x (m,), from the points' scatter alone.

        :raises SplineError: an x beyond the ends.
        """
        return np.asarray(self.sigma * self.fit.spread(x, derivative))


def fit_curve(
    points: CurvePoints,
    settings: CurveSettings,
    uncertainty: float | None = None,
    sigma: str | None = None,
) -> ErrorCurve:
    """Fit the curve. `uncertainty` is that of each point where the points state none; `sigma` is
    given or estimated.

    :raises SplineError: it cannot be fitted, all reasons found; or sigma should be given, and no
        uncertainty is.
    """
    x, ends, boundaries, corners, holds, on_profile, profile = _located(points, settings)
    lower, upper = ends
    if lower == upper == x.min() == x.max():
        raise SplineError(
            [
                SplineProblem(
                    "all points are at {0}, which defines no curve; give points at several"
                    " abscissae",
                    (lower,),
                )
            ]
        )
    order = np.argsort(x, kind="stable")
    x, points = x[order], points.chosen(order.tolist())
    boundaries, corners = tuple(sorted(set(boundaries))), tuple(sorted(set(corners)))
    between = tuple(sorted({*boundaries, *corners}))
    problems = [
        *_misplaced(settings, between, lower, upper),
        *_misplaced_corners(settings, boundaries, corners, holds, x),
    ]
    if problems:
        raise SplineError(problems)
    features = list(pairwise((lower, *between, upper)))
    lines = [features[k - 1] for k in sorted(set(settings.straight))]
    space = _space(settings, x, ends, boundaries, corners, lines)
    constraints = (*holds, *(periodic(space) if settings.period is not None else ()))
    for start, end in lines:
        constraints += straight(space, start, end)
    uncertainties = points.uncertainties
    if uncertainties is None and uncertainty is not None:
        uncertainties = np.full(len(x), uncertainty)
    if uncertainties is None and sigma == "given":
        text = "no uncertainties are stated; add a column such as u_um, or give --uncertainty"
        raise SplineError([SplineProblem(text)])
    fitted = fit(space, x, points.y, uncertainties, constraints)
    is_estimated = (sigma or ("estimated" if uncertainties is None else "given")) == "estimated"
    factor = fitted.sigma if is_estimated else 1.0
    return ErrorCurve(
        points,
        settings,
        fitted,
        boundaries,
        holds,
        factor,
        is_estimated,
        uncertainties is not None,
        on_profile,
        corners,
        profile,
    )


def _space(
    settings: CurveSettings,
    x: Array,
    ends: tuple[float, float],
    boundaries: tuple[float, ...],
    corners: tuple[float, ...],
    lines: Sequence[tuple[float, float]],
) -> SplineSpace:
    """The splines with the knots that are wanted, or at every so many of the points x (m,) that are
    not of straight `lines`.

    :raises SplineError: there are too many knots.
    """
    knots = settings.knots
    if knots is None:
        knots_found = at_every(x, settings.every, *ends, sorted({*boundaries, *corners}))
        knots = tuple(
            knot for knot in knots_found if not any(start <= knot <= end for start, end in lines)
        )
    every = with_boundaries(knots, boundaries, settings.order, corners)
    space = SplineSpace(settings.order, *ends, every)
    if space.count > MOST_COEFFICIENTS:
        text = (
            f"{space.count} coefficients are too many; at most {MOST_COEFFICIENTS} are possible,"
            " leave out knots"
        )
        raise SplineError([SplineProblem(text)])
    return space


def _misplaced(
    settings: CurveSettings, boundaries: tuple[float, ...], lower: float, upper: float
) -> list[SplineProblem]:
    """Faults of features, boundaries and knots between the ends of a curve."""
    problems = [
        SplineProblem(
            f"there is no feature {k}; there are {len(boundaries) + 1}, counted from the start of"
            " the curve"
        )
        for k in settings.straight
        if not 1 <= k <= len(boundaries) + 1
    ]
    problems += [
        SplineProblem(
            "the boundary at {0} is not between the ends of the curve, {1} and {2}; give one there",
            (place, lower, upper),
        )
        for place in boundaries
        if not lower < place < upper
    ]
    problems += [
        SplineProblem("{0} is a boundary and a knot; leave it out of the knots", (knot,))
        for knot in settings.knots or ()
        if knot in boundaries
    ]
    problems += [
        SplineProblem(
            f"the knot at {{0}} is given {times} times; give it {settings.order - 1} times at most",
            (knot,),
        )
        for knot, times in Counter(settings.knots or ()).items()
        if times >= settings.order
    ]
    if settings.order < 3 and settings.boundaries:
        problems.append(
            SplineProblem("broken lines share no slope at boundaries; give an order of 3 or more")
        )
    return problems


def _misplaced_corners(
    settings: CurveSettings,
    boundaries: tuple[float, ...],
    corners: tuple[float, ...],
    holds: tuple[Constraint, ...],
    x: Array,
) -> list[SplineProblem]:
    """Faults of corners: whatever stands on one belongs to either feature."""
    problems = []
    for corner in corners:
        if corner in boundaries:
            problems.append(
                SplineProblem("{0} is a corner and a boundary; give only one of the two", (corner,))
            )
        if (x == corner).any():
            text = "a point is on the corner at {0}, so its feature is ambiguous; leave it out"
            problems.append(SplineProblem(text, (corner,)))
        if any(corner in hold.places for hold in holds):
            text = (
                "no value or slope can be prescribed at the corner at {0}, between two features;"
                " leave it out"
            )
            problems.append(SplineProblem(text, (corner,)))
    if corners and settings.period is not None:
        problems.append(SplineProblem("a periodic curve has no corners; leave them out"))
    return problems


def whole_profile(
    points: CurvePoints, boundaries: Array, corners: int = 0
) -> tuple[Profile, Array]:
    """The profile of all points of a file with boundaries (n, 2) on it, the last of them `corners`,
    and the points' indices in it.

    :raises SplineError: the points do not make a profile.
    """
    assert points.places is not None
    _refuse_coincident(points.places)
    profile, whole, _ = along(points.places, points.features, boundaries, corners=corners)
    return profile, whole


def _located(
    points: CurvePoints, settings: CurveSettings
) -> tuple[
    Array,
    tuple[float, float],
    tuple[float, ...],
    tuple[float, ...],
    tuple[Constraint, ...],
    Array,
    Profile | None,
]:
    """Abscissae of points, ends, boundaries, corners and prescribed values, the places among them
    on the profile (n, 2), and the profile.
    """
    shared = [*settings.boundaries, *settings.corners]
    wanted = [*(hold.at for hold in settings.holds), *settings.boundaries]
    corners_at = [place for place in settings.corners if isinstance(place, tuple)]
    places_between = [place for place in dict.fromkeys(wanted) if place not in corners_at]
    nominal = [
        *(place for place in places_between if isinstance(place, tuple)),
        *dict.fromkeys(corners_at),
    ]
    ends = [settings.start, settings.end]
    where: dict[Place, float] = {}
    profile = None
    if points.x is not None:
        if nominal or any(isinstance(end, tuple) for end in ends):
            text = (
                "nominal co-ordinates define a point on the profile, but the abscissa is"
                f" {points.x_column.words}"
            )
            raise SplineError(
                [SplineProblem(f"{text}; give one value, or choose --x {ARC_LENGTH}")]
            )
        x = points.x
    else:
        x, where, profile = _on_profile(points, settings, nominal)
    lower = float(x.min()) if settings.start == "start" else _abscissa(settings.start, where)
    upper = float(x.max()) if settings.end == "end" else _abscissa(settings.end, where)
    if settings.period is not None:
        if settings.end != "end":
            raise SplineError(
                [
                    SplineProblem(
                        "a periodic curve ends one period after its start; leave the end out"
                    )
                ]
            )
        if settings.start == "start" and points.x_column.kind == "angle":
            lower = 0.0
        upper = lower + settings.period
        x = lower + np.mod(x - lower, settings.period)
    where |= {"start": lower, "end": upper}
    # The slope at the upper end is that of the last piece, so that either side will do.
    holds = tuple(
        prescribed(_abscissa(hold.at, where), hold.derivative, hold.value)
        for hold in settings.holds
    )
    boundaries, corners = (
        tuple(_abscissa(place, where) for place in places)
        for places in (settings.boundaries, settings.corners)
    )
    on_profile = np.array([place for place in shared if isinstance(place, tuple)]).reshape(-1, 2)
    return x, (lower, upper), boundaries, corners, holds, on_profile, profile


def _abscissa(place: Place, where: dict[Place, float]) -> float:
    return where[place] if isinstance(place, tuple | str) else place


def _on_profile(
    points: CurvePoints, settings: CurveSettings, nominal: Sequence[tuple[float, float]]
) -> tuple[Array, dict[Place, float], Profile]:
    """Arc lengths of the points and of places by their nominal co-ordinates, and the profile."""
    assert points.places is not None
    start, end = (
        (
            None
            if isinstance(place, float | str) or (points.places == place).all(axis=1).any()
            else np.array(place)
        )
        for place in (settings.start, settings.end)
    )
    _refuse_coincident(points.places)
    _refuse_distant(points.places, start, end)
    try:
        profile, profile_points, breaks = along(
            points.places,
            points.features,
            np.array(nominal).reshape(-1, 2),
            start,
            end,
            sum(isinstance(place, tuple) for place in set(settings.corners)),
        )
    except NotOnProfileError as error:
        text = (
            "the point ({0}, {1}) is not on the profile between two points; correct it, or give the"
            " arc length"
        )
        raise SplineError([SplineProblem(text, nominal[error.args[0]])]) from None
    lengths = profile.lengths
    where: dict[Place, float] = dict(zip(nominal, lengths[breaks].tolist(), strict=True))
    for place in (settings.start, settings.end):
        if isinstance(place, tuple):
            where[place] = float(lengths[(profile.places == place).all(axis=1)][0])
    return lengths[profile_points], where, profile


def _refuse_distant(places: Array, start: Array | None, end: Array | None) -> None:
    """Refuse a start or an end that does not continue the profile beyond its first or last point.

    :raises SplineError: it is nearer to another point, or much farther away than points are from
        one another.
    """
    if len(places) < 2:
        return
    farthest = CONTINUED * np.hypot(*np.diff(places, axis=0).T).max()
    problems = []
    for place, end_index in ((start, 0), (end, len(places) - 1)):
        if place is None:
            continue
        away = np.hypot(*(places - place).T)
        if away[end_index] > min(float(away.min()), farthest):
            text = (
                "the point ({0}, {1}) is not on the profile or just beyond it; correct it, or give"
                " the arc length"
            )
            problems.append(SplineProblem(text, tuple(place.tolist())))
    if problems:
        raise SplineError(problems)


def _refuse_coincident(places: Array) -> None:
    """Refuse neighbouring places that are the same, between which nothing has a direction.

    :raises SplineError: there are such.
    """
    same = [
        SplineProblem("two neighbouring points are at ({0}, {1}); remove one", tuple(place))
        for place, two in pairwise(places.tolist())
        if place == two
    ]
    if same:
        raise SplineError(same)
