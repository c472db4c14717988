"""Prescribed values, slopes and higher derivatives of a spline, as data.

NISTIR 6517 prescribes values and slopes at both ends, equations (12) to (16). Here a condition may
be at any point and concern any derivative.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array

from .space import SplineSpace

NAMES = ("value", "slope", "second derivative", "third derivative")


@dataclass(frozen=True)
class Constraint:
    """A value (derivative 0), slope (1) or higher derivative at a point, in metres or radians (of
    y) per metre or radian (of x) to some power. A derivative that jumps is that of the piece above.
    """

    at: float
    derivative: int
    value: float = 0.0

    @property
    def name(self) -> str:
        """The quantity that is prescribed.

        >>> Constraint(0.5, 1).name
        'slope'
        """
        known = self.derivative < len(NAMES)
        return NAMES[self.derivative] if known else f"derivative {self.derivative}"


def straight(space: SplineSpace, lower: float, upper: float) -> tuple[Constraint, ...]:
    """Return the conditions of a straight line: no curvature in any piece between two points."""
    starts = [place for place in space.breaks[:-1].tolist() if lower <= place < upper]
    return tuple(Constraint(place, k) for place in starts for k in range(2, space.order))


def rows(space: SplineSpace, constraints: tuple[Constraint, ...]) -> tuple[Array, Array]:
    """Return the matrix (m, count) and right-hand side (m,), each row scaled to length 1.

    Zero rows, of derivatives that no spline of this order has, are unchanged.

    :raises SplineError: a point beyond the ends.
    """
    matrix, values = np.zeros((len(constraints), space.count)), np.zeros(len(constraints))
    for k, constraint in enumerate(constraints):
        matrix[k] = space.rows(np.array([constraint.at]), constraint.derivative)[0]
        # Whatever the unit of x, a slope's row then counts as much as a value's.
        size = float(np.linalg.norm(matrix[k])) or 1.0
        matrix[k] /= size
        values[k] = constraint.value / size
    return matrix, values
