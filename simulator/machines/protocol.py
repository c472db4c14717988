"""Protocol of all error models.

A model of the kernel has its settings and a line in `ERROR_MODELS` of `settings.py`, beside this
file; extensions have their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np
from ballplate.simulator.inputs.extensions import UnusableError
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.number_arrays import Array, Integers as Integers
from ballplate.simulator.inputs.settings import Settings
from ballplate.simulator.inputs.trust import Trust

Unit = Literal["m", "rad", "1", "K", "1/K", "m/h", "1/h"]


@dataclass(frozen=True)
class Parameter:
    """A named parameter of an error model.

    `unit` is that of its value: metres, radians, 1 for a ratio, or units of influence quantities.
    `function` is its error, by ISO 230-1 name if it has one, and `meaning` describes it. `effect`
    is the largest displacement of a corrected point in the volume, in metres per `unit`: it makes
    different parameters comparable, and columns are scaled by it before the rank is judged.
    """

    name: str
    unit: Unit
    function: str
    meaning: str
    effect: float = 1.0


@dataclass(frozen=True)
class Reported:
    """The model in another basis: `values = matrix @ a`, with `names` and `units` per row."""

    names: tuple[str, ...]
    units: tuple[Unit, ...]
    matrix: Array

    @classmethod
    def as_is(cls, parameters: tuple[Parameter, ...]) -> Reported:
        """Return the parameters unchanged."""
        names, units = tuple(p.name for p in parameters), tuple(p.unit for p in parameters)
        return cls(names, units, np.eye(len(parameters)))

    def beside(self, second: Reported) -> Reported:
        """Return the joint report of two models, the parameters of `second` after these."""
        (rows, columns), size = self.matrix.shape, np.add(self.matrix.shape, second.matrix.shape)
        matrix = np.zeros(size)
        matrix[:rows, :columns], matrix[rows:, columns:] = self.matrix, second.matrix
        return Reported(self.names + second.names, self.units + second.units, matrix)

    def known_names(self) -> dict[str, int]:
        """Return rows by all accepted names: `EXX t` is a synonym of the coefficient `EXX t^1`."""
        rows = {name: row for row, name in enumerate(self.names)}
        for row, name in enumerate(self.names):
            rows.setdefault(name.removesuffix("^1"), row)
        return rows


@runtime_checkable
class ErrorModel(Protocol):
    """An error correction e(x, a, p) with e(x, 0, p) = p.

    A corrected point is x + e(x, a, p) for scale readings x, parameters a and probe offset p. The
    model holds no state: one instance serves concurrent estimates. It is linear in p: derivatives
    by free offsets are central differences over 0.1 m to each side.
    """

    @property
    def dimension(self) -> int:
        """2 or 3, the number of machine axes."""
        ...

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The free parameters in the order of a, without those fixed by frame constraints."""
        ...

    def error(self, x: Array, a: Array, p: Array) -> Array:
        """Return the correction in metres, (m, d), at scale readings x (m, d) with offsets p (m,
        d).
        """
        ...

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        """Return the derivative of the correction by a, (m, d, n): a new array, which the caller
        may change.
        """
        ...

    def reported(self) -> Reported:
        """Return the parameters in their usual form: monomial coefficients, angles, ratios."""
        ...


@dataclass(frozen=True)
class TrueMachine:
    """An error model with its parameters `a` (n,)."""

    model: ErrorModel
    a: Array


@dataclass(frozen=True)
class Line:
    """Values of an error function along a line: `basis` (points, parameters) times its parameters.

    `words` names the line if a function has several, such as "along X"; `axis` (0 to 2) is its
    direction, ``None`` if it is oblique.
    """

    words: str
    basis: Array
    axis: int | None = None


@runtime_checkable
class HasLines(Protocol):
    """An error model whose error functions can be shown as curves.

    A function has the parameters whose `function` is its name, in their order.
    """

    def lines(self, function: str, t: Array) -> tuple[Line, ...]:
        """Return the function at fractions t (m,) of lines through the volume, or of its axis."""
        ...


Corner = tuple[float, ...]


class CustomModelError(UnusableError, ValueError):
    """A user's error model is unusable; `key` is the key at fault, "object" or "options"."""

    def __init__(self, text: str, key: str = "object") -> None:
        self.key = key
        super().__init__(text)


@dataclass(frozen=True)
class ErrorModelKind:
    """A type of error model.

    `build` makes the model from `settings` for a volume between two corners in metres;
    `dimensions` lists the possible numbers of co-ordinates. `wrong` returns faults of the settings
    for a number of dimensions as (path in the settings, text) pairs; `with_defaults` states
    defaults that depend on this number. `read` returns the settings completed from files, which are
    found from the folder of the experiment; it raises ExperimentError. What `is_code` is run to be
    built.
    """

    settings: type[Settings]
    build: Callable[[Any, Corner, Corner], ErrorModel]
    dimensions: tuple[int, ...] = (2, 3)
    wrong: Callable[[Any, int], Iterable[tuple[Steps, str]]] = lambda settings, dimension: ()
    with_defaults: Callable[[Any, int], Settings] = lambda settings, dimension: settings
    read: Callable[[Any, Path, Trust], Any] = lambda settings, folder, trust: settings
    is_code: bool = False
