"""Protocol of all error models, whatever their parametrisation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Unit = Literal["m", "rad", "1", "K", "1/K", "m/h", "1/h"]


@dataclass(frozen=True)
class Parameter:
    """A named parameter of an error model.

    `unit` is the unit of its value: metres, radians, 1 for a ratio, or those of influence
    quantities. `function` is the error it
    belongs to, by its ISO 230-1 name where it has one, and `meaning` says in words what that error
    is. `effect` is the displacement of a corrected point, in metres per `unit`, that the parameter
    causes where in the volume it causes most: it makes parameters of different kinds comparable.
    """

    name: str
    unit: Unit
    function: str
    meaning: str
    effect: float = 1.0


@dataclass(frozen=True)
class Reported:
    """The same model in another basis: `values = matrix @ a`, with `names` and `units` per row."""

    names: tuple[str, ...]
    units: tuple[Unit, ...]
    matrix: Array

    @classmethod
    def as_is(cls, parameters: tuple[Parameter, ...]) -> Reported:
        """The parameters themselves."""
        names, units = (
            tuple(one.name for one in parameters),
            tuple(one.unit for one in parameters),
        )
        return cls(names, units, np.eye(len(parameters)))

    def beside(self, other: Reported) -> Reported:
        """What is reported of two models, the parameters of one after those of the other."""
        (rows, columns), size = self.matrix.shape, np.add(self.matrix.shape, other.matrix.shape)
        matrix = np.zeros(size)
        matrix[:rows, :columns], matrix[rows:, columns:] = self.matrix, other.matrix
        return Reported(self.names + other.names, self.units + other.units, matrix)

    def known_names(self) -> dict[str, int]:
        """Rows by all names under which they may be stated: `EXX t` is the coefficient `EXX t^1`,
        too.
        """
        found = {name: row for row, name in enumerate(self.names)}
        for row, name in enumerate(self.names):
            found.setdefault(name.removesuffix("^1"), row)
        return found


@runtime_checkable
class ErrorModel(Protocol):
    """An error correction e(x, a, p) with e(x, 0, p) = p.

    A corrected point is x + e(x, a, p) for scale readings x, parameters a and probe offset p; the
    model holds no state, so that one instance serves any number of estimates at once.
    """

    @property
    def dimension(self) -> int:
        """2 or 3, the number of machine axes."""
        ...

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The free parameters in the order of a, frame constraints already taken out."""
        ...

    def error(self, x: Array, a: Array, p: Array) -> Array:
        """Correction in metres, (m, d), at scale readings x (m, d) with offsets p (m, d)."""
        ...

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        """Derivative of the correction by a, (m, d, n)."""
        ...

    def reported(self) -> Reported:
        """The parameters as the field quotes them: monomial coefficients, angles, ratios."""
        ...


@dataclass(frozen=True)
class TrueMachine:
    """An error model with its parameters `a` (n,)."""

    model: ErrorModel
    a: Array


@dataclass(frozen=True)
class Line:
    """Values of an error function along a line: `basis` (points, parameters of the function) times
    its parameters.

    `words` names the line where a function has more than one, such as "along X", and `axis` is the
    one (0 to 2) that it runs along; None where it runs along none.
    """

    words: str
    basis: Array
    axis: int | None = None


@runtime_checkable
class HasLines(Protocol):
    """What an error model may offer besides: its error functions as curves, to describe and to draw
    them.

    A function has the parameters whose `function` is its name, in their order.
    """

    def lines(self, function: str, t: Array) -> tuple[Line, ...]:
        """The function at fractions t (m,) of lines through the volume; along its axis if it
        depends on one only.
        """
        ...
