"""Splines of one order over breakpoints, in B-splines: their values, their derivatives from either
side, their pieces.

The abscissa is scaled to [0, 1] inside, so that neither its unit nor its origin costs digits.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array


@dataclass(frozen=True)
class SplineProblem:
    """A fault and its remedy; `text` has {0}, {1}, … for the `places`, in metres or radians."""

    text: str
    places: tuple[float, ...] = ()

    def told(self, place: Callable[[float], str]) -> str:
        """Return the text with each location written by `place`.

        >>> SplineProblem("nothing beyond {0}", (0.25,)).told(lambda x: f"{1000 * x:g} mm")
        'nothing beyond 250 mm'
        """
        return self.text.format(*map(place, self.places))


class SplineError(ValueError):
    """A spline is impossible, undetermined, or evaluated outside its range; `problems` has all
    reasons.
    """

    def __init__(self, problems: Iterable[SplineProblem]) -> None:
        self.problems = tuple(problems)
        super().__init__(
            "; ".join(problem.told(lambda place: f"{place:g}") for problem in self.problems)
        )


@dataclass(frozen=True)
class SplineSpace:
    """Splines of an `order` (degree plus one) from `lower` to `upper` with interior `knots` in
    ascending order.

    A knot repeated m times leaves order - 1 - m continuous derivatives, the value included: twice
    for cubic splines leaves value and slope, `order` times allows a jump. Abscissae are in metres
    or radians.

    >>> SplineSpace(4, 0.0, 2.0, (0.5, 1.0, 1.0)).count
    7
    """

    order: int
    lower: float
    upper: float
    knots: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        problems = []
        if self.order < 2:
            problems.append(SplineProblem("a spline's order is at least 2 (broken lines)"))
        if not self.lower < self.upper:
            problems.append(
                SplineProblem(
                    "the curve ends at {0}, not above its start at {1}", (self.upper, self.lower)
                )
            )
        outside = [knot for knot in self.knots if not self.lower < knot < self.upper]
        for knot in dict.fromkeys(outside):
            problems.append(
                SplineProblem(
                    "the knot at {0} is not between the ends, {1} and {2}; leave it out",
                    (knot, self.lower, self.upper),
                )
            )
        for knot, times in Counter(self.knots).items():
            if times > self.order:
                problems.append(
                    SplineProblem(
                        f"the knot at {{0}} is given {times} times; give it {self.order}"
                        " times at most",
                        (knot,),
                    )
                )
        if list(self.knots) != sorted(self.knots):
            problems.append(
                SplineProblem("the knots are out of order; give them in ascending order")
            )
        if problems:
            raise SplineError(problems)

    @property
    def count(self) -> int:
        """Number of B-splines."""
        return self.order + len(self.knots)

    @property
    def length(self) -> float:
        """From end to end."""
        return self.upper - self.lower

    @cached_property
    def breaks(self) -> Array:
        """Ends of the pieces (pieces + 1,), each once."""
        return np.array([self.lower, *sorted(set(self.knots)), self.upper])

    @cached_property
    def _spline(self) -> object:
        # SciPy takes longer to import than most experiments to check.
        from scipy.interpolate import BSpline

        inner = (np.asarray(self.knots) - self.lower) / self.length
        knots = np.concatenate([np.zeros(self.order), inner, np.ones(self.order)])
        return BSpline(knots, np.eye(self.count), self.order - 1)

    @cached_property
    def pieces(self) -> Array:
        """Taylor coefficients (pieces, order, count) of each B-spline about the start of each
        piece, in x scaled.
        """
        start = (self.breaks[:-1] - self.lower) / self.length
        coefficients = np.empty((len(start), self.order, self.count))
        factorial = 1.0
        for k in range(self.order):
            factorial *= max(k, 1)
            coefficients[:, k] = self._spline(start, nu=k) / factorial  # type: ignore[operator]
        return coefficients

    def rows(self, x: Array, derivative: int = 0) -> Array:
        """Return the B-splines' values or derivatives at x (m,), as (m, count), per metre or
        radian to the power `derivative`; where one jumps, that of the piece above.

        :raises SplineError: an x beyond the ends of the curve.
        """
        x = np.asarray(x, dtype=float)
        outside = np.unique(x[~((x >= self.lower) & (x <= self.upper))])
        if len(outside):
            raise SplineError(
                SplineProblem(
                    "{0} is outside the curve, from {1} to {2}; it is not extrapolated",
                    (u, self.lower, self.upper),
                )
                for u in outside.tolist()
            )
        if derivative >= self.order:
            return np.zeros((len(x), self.count))
        piece = np.searchsorted(self.breaks, x, "right") - 1
        piece = np.clip(piece, 0, len(self.breaks) - 2)
        u = ((x - self.breaks[piece]) / self.length)[:, None]
        row_values = np.zeros((len(x), self.count))
        # Horner's rule for the derivative of the Taylor polynomial: u^k has the factor k (k - 1)
        # ... .
        for k in range(self.order - 1, derivative - 1, -1):
            factor = float(np.prod(np.arange(k - derivative + 1, k + 1)))
            row_values = row_values * u + factor * self.pieces[piece, k]
        return row_values / self.length**derivative


def at_every(x: Array, r: int, lower: float, upper: float) -> tuple[float, ...]:
    """Return knots at every r-th of the points x between the ends, as in NISTIR 6517, equation (5).

    A knot without a point beyond it would be undetermined, and is omitted. Points of the same x
    count as one.

    >>> at_every(np.arange(1.0, 9.0), 3, 1.0, 8.0)
    (3.0, 6.0)
    """
    distinct = np.unique(x)
    inside = distinct[(distinct >= lower) & (distinct <= upper)].tolist()
    return tuple(knot for knot in inside[r - 1 : -1 : r] if lower < knot < upper)


def with_boundaries(
    knots: Sequence[float], boundaries: Sequence[float], order: int
) -> tuple[float, ...]:
    """Return all knots in order, with multiplicities for continuous value and slope at the
    boundaries.

    >>> with_boundaries((1.0, 3.0), (2.0,), 4)
    (1.0, 2.0, 2.0, 3.0)
    """
    doubled = [boundary for boundary in boundaries for _ in range(order - 2)]
    return tuple(sorted([*knots, *doubled]))
