"""Splines as univariate error functions."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array

from .bases import SMALLEST_PIECE, Ends, Quoted


@dataclass(frozen=True)
class Spline:
    """Splines of an order (degree plus one, at least 2) with interior knots.

    A knot may occur in `knots` up to order - 1 times, each time with one continuous derivative
    less; order - 2 times keeps value and slope, as between tangent features. Beyond [0, 1] the
    polynomial of the last piece continues.

    Every function satisfies `ends`. With free ends, the functions are t and the B-splines N_2 to
    N_last-1. A zero slope removes N_2 or N_last-1, and the last B-splines replace t, whose slope
    is 1. Periodic ends have equal derivatives 1 to order - 2: t times a factor (a scale error or
    squareness) plus a periodic function.

    >>> Spline(4, (0.5,)).size, Spline(4, (0.5,), zero_at_one=True).size
    (4, 3)
    >>> Spline(4, (0.5,), ends="zero slopes").size, Spline(4, (0.3, 0.5), ends="periodic").size
    (2, 3)
    """

    order: int
    knots: tuple[float, ...] = ()
    zero_at_one: bool = False
    ends: Ends = "free"

    def __post_init__(self) -> None:
        if self.order < 2:
            raise ValueError("a spline's order is at least 2 (broken lines)")
        if any(not 0.0 < knot < 1.0 for knot in self.knots) or list(self.knots) != sorted(
            self.knots
        ):
            raise ValueError(
                "interior knots are out of order or range; give them between 0 and 1, in ascending"
                " order"
            )
        if max(Counter(self.knots).values(), default=0) >= self.order:
            raise ValueError(
                f"a knot is repeated too often; give it {self.order - 1} times at most, one less"
                " than the order"
            )
        if self.ends != "free" and self.order < 3:
            raise ValueError(
                "broken lines have no slope at their ends to be prescribed; give an order of 3 or"
                " more"
            )
        if self.ends != "free" and self.count < 3 + int(self.ends == "zero slopes"):
            raise ValueError(
                f"no spline of order {self.order} without knots has {self.ends}; give an order of 4"
                " or knots"
            )
        if (
            self.ends == "periodic"
            and np.diff([0.0, *sorted(set(self.knots)), 1.0]).min() < SMALLEST_PIECE
        ):
            raise ValueError(
                f"knots of a periodic spline are too close together; leave {SMALLEST_PIECE:g}"
                " between them"
            )

    @property
    def count(self) -> int:
        """Number of B-splines, the first and the last included."""
        return self.order + len(self.knots)

    @property
    def size(self) -> int:
        """Number of functions."""
        return self._inner.shape[1] + int(not self.zero_at_one)

    @property
    def contains_t(self) -> bool:
        """True if t, a straight line, is among the functions that vanish at 0."""
        return self.ends in ("free", "periodic")

    @property
    def _all_knots(self) -> Array:
        return np.array([0.0] * self.order + list(self.knots) + [1.0] * self.order)

    def values(self, t: Array) -> Array:
        """Return the functions at t (m,), as (m, size)."""
        # SciPy takes longer to import than most experiments to check.
        from scipy.interpolate import BSpline

        splines = BSpline(self._all_knots, np.eye(self.count), self.order - 1)(t)
        # Products with the unit matrix would cost free ends nothing but time.
        inner = splines[:, 1:-1] if self.ends == "free" else splines @ self._inner
        if self.zero_at_one:
            return inner
        return np.column_stack([t if self.contains_t else splines @ self._first, inner])

    def interior(self) -> Spline:
        """Return the functions that vanish at both ends."""
        return replace(self, zero_at_one=True)

    @cached_property
    def _first(self) -> Array:
        """Coefficients (count,) of the function that is 1 at 1."""

        if self.contains_t:
            # The B-spline coefficients of t are means of order - 1 successive knots.
            knots = self._all_knots
            return np.array([knots[j + 1 : j + self.order].mean() for j in range(self.count)])
        # The last B-spline has a slope at 1, and that before it the opposite one.
        return (
            np.eye(self.count)[-1 if self.ends == "zero slope at start" else [-2, -1]]
            .reshape(-1, self.count)
            .sum(0)
        )

    @cached_property
    def _inner(self) -> Array:
        """Coefficients (count, number) of the functions that vanish at both ends."""
        whole = np.eye(self.count)[:, 1:-1]
        if self.ends == "free":
            return whole
        if self.ends != "periodic":
            first, last = self.ends != "zero slope at end", self.ends != "zero slope at start"
            return whole[:, int(first) : whole.shape[1] - int(last)]
        from scipy.interpolate import BSpline

        splines = BSpline(self._all_knots, whole, self.order - 1)
        jumps = np.stack(
            [splines(1.0, nu=k) - splines(0.0, nu=k) for k in range(1, self.order - 1)]
        )
        # Derivatives of higher order are larger by far, and every condition counts alike.
        jumps /= np.abs(jumps).max(axis=1, keepdims=True)
        # Orthonormal combinations that have no jumps.
        null = np.linalg.qr(jumps.T, mode="complete")[0][:, len(jumps) :]
        return whole @ null

    def quoted(self, variable: str = "t") -> Quoted:
        """Return coefficients of the B-splines that are not zero by the end conditions."""
        whole = self.quoted_whole(variable)
        matrix = self._inner if self.zero_at_one else np.column_stack([self._first, self._inner])
        used = np.flatnonzero(matrix.any(axis=1))
        return Quoted(tuple(whole.names[k] for k in used), matrix[used])

    def quoted_whole(self, variable: str = "t") -> Quoted:
        """Return coefficients of all B-splines for 1, t and the interior functions."""
        t = replace(self, ends="free")._first
        matrix = np.column_stack([np.ones(self.count), t, self._inner])
        return Quoted(tuple(f"N{k + 1}({variable})" for k in range(self.count)), matrix)
