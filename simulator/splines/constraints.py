"""Linear conditions on a spline, as data.

NISTIR 6517 prescribes values and slopes at both ends, equations (12) to (16). Here a condition may
be at any point, concern any derivative, and link two points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..inputs.number_arrays import Array
from .space import Side, SplineSpace

NAMES = ("value", "slope", "second derivative")


@dataclass(frozen=True)
class Term:
    """`factor` times a derivative (0 is the value) of the curve at a point, from one side if it
    jumps.
    """

    at: float
    derivative: int = 0
    factor: float = 1.0
    side: Side = "above"


@dataclass(frozen=True)
class Constraint:
    """The sum of the terms is the value, in metres or radians (of y) per metre or radian (of x) to
    some power.
    """

    terms: tuple[Term, ...]
    value: float = 0.0

    @property
    def derivative(self) -> int:
        """The derivative concerned; a constraint has terms of one only."""
        return self.terms[0].derivative

    @property
    def words(self) -> str:
        """Description of the condition, with {0} and {1} for the points.

        >>> prescribed(0.5, 1, 0.0).words
        'slope at {0}'
        """
        name = (
            NAMES[self.derivative]
            if self.derivative < len(NAMES)
            else f"derivative {self.derivative}"
        )
        return f"{name} at {{0}}" if len(self.terms) == 1 else f"equal {name}s at {{0}} and {{1}}"

    @property
    def places(self) -> tuple[float, ...]:
        """Where the terms are."""
        return tuple(term.at for term in self.terms)


def prescribed(u: float, derivative: int, value: float, side: Side = "above") -> Constraint:
    """Return the condition for a value (derivative 0), slope (1) or higher derivative at a
    point.
    """
    return Constraint((Term(u, derivative, 1.0, side),), value)


def periodic(space: SplineSpace) -> tuple[Constraint, ...]:
    """Value and all continuous derivatives the same at both ends.

    >>> len(periodic(SplineSpace(4, 0.0, 1.0)))
    3
    """
    return tuple(
        Constraint((Term(space.lower, k), Term(space.upper, k, -1.0, "below")))
        for k in range(space.order - 1)
    )


def straight(space: SplineSpace, lower: float, upper: float) -> tuple[Constraint, ...]:
    """Return the conditions of a straight line: no curvature in any piece between two points."""
    starts = [place for place in space.breaks[:-1].tolist() if lower <= place < upper]
    return tuple(prescribed(place, k, 0.0) for place in starts for k in range(2, space.order))


def rows(space: SplineSpace, constraints: tuple[Constraint, ...]) -> tuple[Array, Array]:
    """Return the matrix (m, count) and right-hand side (m,), each row scaled to length 1.

    Zero rows, of derivatives that no spline of this order has, are unchanged.

    :raises SplineError: a point beyond the ends.
    """
    matrix, values = np.zeros((len(constraints), space.count)), np.zeros(len(constraints))
    for k, constraint in enumerate(constraints):
        for term in constraint.terms:
            matrix[k] += (
                term.factor * space.rows(np.array([term.at]), term.derivative, term.side)[0]
            )
        # Whatever the unit of x, a slope's row then counts as much as a value's.
        size = float(np.linalg.norm(matrix[k])) or 1.0
        matrix[k] /= size
        values[k] = constraint.value / size
    return matrix, values
