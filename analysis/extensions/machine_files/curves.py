"""A machine with measured error curves: a kinematic model whose functions are the curves.

Values remain unchanged. Curves that are not zero at the lower corner, or straightness curves that
are not zero at the far end, therefore belong to another frame than estimated models.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np
from ballplate.simulator.machines import (
    AXIS_ERRORS,
    Arrangement,
    Array,
    ErrorFunction,
    ErrorModel,
    KinematicModel,
    PlaneModel,
    SingleFunction,
    in_space,
)
from ballplate.simulator.splines import SplineFit, SplineSpace, fit, pieces

Interpolation = Literal["linear", "cubic", "monotone"]
NAMES = tuple(AXIS_ERRORS)


@dataclass(frozen=True)
class Points:
    """A measured curve: values (m or rad) at ascending positions along the axis in metres.

    With an `order`, degree plus one, its least-squares spline replaces it; `knots` are interior
    knots in metres, without which the spline is one polynomial.
    """

    positions: tuple[float, ...]
    values: tuple[float, ...]
    order: int = 0
    knots: tuple[float, ...] = ()

    @cached_property
    def fitted(self) -> SplineFit:
        """The spline of the position in metres.

        :raises SplineError: the points do not determine it.
        """
        space = SplineSpace(self.order, self.positions[0], self.positions[-1], self.knots)
        return fit(space, np.asarray(self.positions), np.asarray(self.values))

    def curve(self, interpolation: Interpolation, lower: float, upper: float) -> Curve:
        """Return the function of t that is 0 at `lower` and 1 at `upper`, both in metres.

        :raises SplineError: the points do not determine a spline.
        """
        length = upper - lower
        # Positions may differ by less than fractions of a long axis can.
        t, first = np.unique((np.array(self.positions) - lower) / length, return_index=True)
        curve = Curve(tuple(t.tolist()), tuple(self.values[k] for k in first), interpolation)
        if not self.order:
            return curve
        powers = length ** np.arange(self.order)
        return replace(
            curve,
            breaks=tuple(((self.fitted.space.breaks - lower) / length).tolist()),
            pieces=tuple(map(tuple, (pieces(self.fitted) * powers).tolist())),
        )


@dataclass(frozen=True)
class Curve(SingleFunction):
    """One function, through values at ascending t, or polynomials fitted to them; constant beyond
    its ends.

    `pieces` are coefficients of 1, u, u^2, … with u the distance in t from each of the `breaks`
    except the last.

    >>> Curve((0.0, 1.0), (0.0, 2e-6), "linear").values(np.array([0.5, 1.2]))
    array([[1.e-06],
           [2.e-06]])
    """

    t: tuple[float, ...]
    y: tuple[float, ...]
    interpolation: Interpolation
    breaks: tuple[float, ...] = ()
    pieces: tuple[tuple[float, ...], ...] = ()

    kind: ClassVar[str] = "measured"

    def values(self, t: Array) -> Array:
        """Return the curve at t (m,), as (m, 1)."""
        if self.pieces:
            return self._fitted_values(np.clip(t, self.t[0], self.t[-1]))[:, None]
        if self.interpolation == "linear" or len(self.t) < 3:
            return np.interp(t, self.t, self.y)[:, None]
        # SciPy takes longer to import than most experiments to check.
        from scipy.interpolate import CubicSpline, PchipInterpolator

        through = CubicSpline if self.interpolation == "cubic" else PchipInterpolator
        return np.asarray(through(self.t, self.y)(np.clip(t, self.t[0], self.t[-1])))[:, None]

    def _fitted_values(self, t: Array) -> Array:
        piece = np.clip(np.searchsorted(self.breaks, t, "right") - 1, 0, len(self.pieces) - 1)
        u = t - np.asarray(self.breaks)[piece]
        result = np.zeros(len(u))
        for coefficients in np.asarray(self.pieces).T[::-1]:
            result = result * u + coefficients[piece]
        return result


def curves_model(
    curves: Mapping[str, Points],
    interpolation: Interpolation,
    arrangement: Arrangement,
    lower: tuple[float, ...],
    upper: tuple[float, ...],
    full_rotations: bool = False,
) -> ErrorModel:
    """Return the machine with curves by ISO 230-1 name, each times a parameter; other functions
    are zero.

    In two dimensions, errors count that move points of the xy plane within it.
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
