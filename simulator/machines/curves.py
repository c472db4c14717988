"""A machine with measured error curves: a kinematic model whose functions are the curves
themselves.

Values are taken as they are: nothing is subtracted, so that curves which are not zero at the lower
corner, or straightness curves which are not zero at the far end, belong to another frame than the
estimated models'.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np

from ..splines.polynomial_pieces import pieces
from ..splines.space import SplineSpace
from ..splines.spline_fit import SplineFit, fit
from .arrangement import Arrangement
from .bases import Basis, Quoted
from .error_names import AXIS_ERRORS
from .kinematic import ErrorFunction, KinematicModel
from .plane import PlaneModel, in_space
from .protocol import Array, ErrorModel

Interpolation = Literal["linear", "cubic", "monotone"]
NAMES = tuple(AXIS_ERRORS)


@dataclass(frozen=True)
class Points:
    """A measured curve: values, in metres or radians, at ascending positions along the axis in
    metres.
    """

    positions: tuple[float, ...]
    values: tuple[float, ...]

    def curve(self, interpolation: Interpolation, lower: float, upper: float) -> Curve:
        """The function of t that is 0 at `lower` and 1 at `upper`, both in metres."""
        # Positions may differ by less than fractions of a long axis can.
        t, first = np.unique(
            (np.array(self.positions) - lower) / (upper - lower), return_index=True
        )
        return Curve(tuple(t.tolist()), tuple(self.values[k] for k in first), interpolation)


class SingleFunction:
    """What a basis of one function, a stated one, has in common; `kind` says where it comes
    from.
    """

    kind: ClassVar[str]

    @property
    def zero_at_one(self) -> bool:
        return False

    @property
    def size(self) -> int:
        return 1

    def interior(self) -> Basis:
        raise TypeError(f"a {self.kind} function is a single one")

    def quoted(self, variable: str = "t") -> Quoted:
        """The function as it is."""
        return Quoted((f"as {self.kind}",), np.eye(1))

    def quoted_whole(self, variable: str = "t") -> Quoted:
        raise TypeError(f"a {self.kind} function is a single one")


@dataclass(frozen=True)
class Curve(SingleFunction):
    """One function, through values at ascending t; beyond its ends it keeps its end values.

    >>> Curve((0.0, 1.0), (0.0, 2e-6), "linear").values(np.array([0.5, 1.2]))
    array([[1.e-06],
           [2.e-06]])
    """

    t: tuple[float, ...]
    y: tuple[float, ...]
    interpolation: Interpolation

    kind: ClassVar[str] = "measured"

    def values(self, t: Array) -> Array:
        """The curve at t (m,), as (m, 1)."""
        if self.interpolation == "linear" or len(self.t) < 3:
            return np.interp(t, self.t, self.y)[:, None]
        # SciPy takes longer to import than most experiments to check.
        from scipy.interpolate import CubicSpline, PchipInterpolator

        through = CubicSpline if self.interpolation == "cubic" else PchipInterpolator
        return np.asarray(through(self.t, self.y)(np.clip(t, self.t[0], self.t[-1])))[:, None]


@dataclass(frozen=True)
class SmoothCurve(Curve):
    """Polynomials in place of the values, which are then those fitted: `pieces` are coefficients of
    1, u, u^2, … with u the distance in t from each of the `breaks` but the last.
    """

    breaks: tuple[float, ...] = ()
    pieces: tuple[tuple[float, ...], ...] = ()

    kind: ClassVar[str] = "fitted"

    def values(self, t: Array) -> Array:
        """The polynomials at t (m,), as (m, 1)."""
        held = np.clip(t, self.t[0], self.t[-1])
        piece = np.clip(np.searchsorted(self.breaks, held, "right") - 1, 0, len(self.pieces) - 1)
        u = held - np.asarray(self.breaks)[piece]
        found = np.zeros(len(u))
        for coefficients in np.asarray(self.pieces).T[::-1]:
            found = found * u + coefficients[piece]
        return found[:, None]


@dataclass(frozen=True)
class SmoothedPoints(Points):
    """A measured curve of which the least-squares spline of an `order` (degree plus one) counts,
    with interior `knots` in metres; without knots it is one polynomial.
    """

    order: int = 4
    knots: tuple[float, ...] = ()

    @cached_property
    def fitted(self) -> SplineFit:
        """The spline of the position in metres.

        :raises SplineError: the points do not determine it.
        """
        space = SplineSpace(self.order, self.positions[0], self.positions[-1], self.knots)
        return fit(space, np.asarray(self.positions), np.asarray(self.values))

    def curve(self, interpolation: Interpolation, lower: float, upper: float) -> SmoothCurve:
        """The function of t that is 0 at `lower` and 1 at `upper`, both in metres.

        :raises SplineError: the points do not determine it.
        """
        found, length = pieces(self.fitted), upper - lower
        powers = length ** np.arange(self.order)
        plain = super().curve(interpolation, lower, upper)
        return SmoothCurve(
            plain.t,
            plain.y,
            interpolation,
            tuple(((found.breaks - lower) / length).tolist()),
            tuple(map(tuple, (found.coefficients * powers).tolist())),
        )


def curves_model(
    curves: Mapping[str, Points],
    interpolation: Interpolation,
    arrangement: Arrangement,
    lower: tuple[float, ...],
    upper: tuple[float, ...],
    full_rotations: bool = False,
) -> ErrorModel:
    """The machine with the given curves by ISO 230-1 name, each multiplied by a parameter; other
    functions are zero.

    In a volume of two dimensions those count that move points of the plane of x and y within it.
    """
    plane = len(lower) == 2
    functions = []
    for name, points in curves.items():
        error = AXIS_ERRORS[name]
        if plane and not error.in_plane:
            continue
        curve = points.curve(interpolation, lower[error.axis], upper[error.axis])
        functions.append(ErrorFunction(error, curve))
    chain = KinematicModel(arrangement, tuple(functions), *in_space(lower, upper), full_rotations)
    return PlaneModel(chain, 0.0) if plane else chain
