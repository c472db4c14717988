"""The empirical error model: six functions of three variables, displacement and rotation of the
probe.

Sources: NPL Report CISE 15/98, sections 2.1 and 2.4.1. A corrected point is x + e(x) + p + u(x) x
p with three positional functions e and three rotational functions u, right-handed about the
machine's axes (opposite sign to the report). Unlike in the kinematic model, rotations move only
the probe's tip.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from ballplate.simulator.geometry.ball_layouts import even_grid
from ballplate.simulator.geometry.motions import AXIS_NAMES, cross_matrices
from ballplate.simulator.inputs.number_arrays import Array

from ._rigid_chain import rotation_and_derivatives
from ._terms import Terms
from .protocol import Line, Parameter, Reported, Unit

FUNCTIONS = {
    "EX": "error in X",
    "EY": "error in Y",
    "EZ": "error in Z",
    "EA": "rotation about X",
    "EB": "rotation about Y",
    "EC": "rotation about Z",
}

Condition = tuple[str, tuple[float, float, float]]

# The frame's origin is the lower corner, its x axis the machine's and its xy plane that of the
# machine's x and y axes; the probe's orientation is the one it has at the lower corner. Corners by
# fractions of the volume.
FRAME: tuple[Condition, ...] = (
    *((name, (0.0, 0.0, 0.0)) for name in FUNCTIONS),
    ("EY", (1.0, 0.0, 0.0)),
    ("EZ", (1.0, 0.0, 0.0)),
    ("EZ", (0.0, 1.0, 0.0)),
)

# Rotations move only the probe's tip. Their effect is stated for this offset, a fraction of the
# volume.
USUAL_OFFSET = 0.1

# Lines parallel to the axes that show a function's size and shape, by fractions of the volume.
LEVELS = (0.0, 0.25, 0.5, 0.75, 1.0)


@dataclass(frozen=True)
class EmpiricalModel:
    """e(x, a, p) of six functions in the same `terms`, each with its free `columns`.

    Rotations may have their own terms `of_rotations`. `lower` and `upper` (3,) bound the volume in
    metres; the functions depend on the position scaled to [0, 1]. `full_rotations` turns the probe
    offset by rotation matrices instead of cross products.
    """

    terms: Terms
    columns: tuple[tuple[int, ...], ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    full_rotations: bool = False
    of_rotations: Terms | None = None

    @property
    def dimension(self) -> int:
        return 3

    @property
    def _terms(self) -> tuple[Terms, ...]:
        """Terms of each function."""
        return _of_six(self.terms, self.of_rotations)

    def _values(self, t: Array) -> list[Array]:
        """Return the free terms of each function at scaled positions t (m, 3), each (m,
        number).
        """
        displacing = self.terms.values(t)
        turning = displacing if self.of_rotations is None else self.of_rotations.values(t)
        return [
            (turning if k >= 3 else displacing)[:, columns]
            for k, columns in enumerate(self._chosen)
        ]

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        grid = even_grid(np.zeros(3), np.ones(3), (9, 9, 9))
        peaks = [np.abs(values).max(axis=0, initial=0.0) for values in self._values(grid)]
        arm = USUAL_OFFSET * float(np.subtract(self.upper, self.lower).max())
        parameters = []
        for k, (function, meaning) in enumerate(FUNCTIONS.items()):
            unit: Unit = "rad" if k >= 3 else "m"
            names = self._terms[k].names
            for column, peak in zip(self.columns[k], peaks[k].tolist(), strict=True):
                effect = peak * (arm if k >= 3 else 1.0)
                parameters.append(
                    Parameter(f"{function} {names[column]}", unit, function, meaning, effect)
                )
        return tuple(parameters)

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Indices of each function's coefficients in a."""
        ends = np.cumsum([0, *map(len, self.columns)])
        return tuple(
            slice(int(start), int(end)) for start, end in zip(ends, ends[1:], strict=False)
        )

    @cached_property
    def _chosen(self) -> tuple[list[int], ...]:
        return tuple(map(list, self.columns))

    def scaled(self, x: Array) -> Array:
        """Return positions x (m, 3) scaled to [0, 1] over the volume."""
        lower = np.asarray(self.lower)
        return (x - lower) / (np.asarray(self.upper) - lower)

    def functions(self, x: Array, a: Array) -> Array:
        """Return the six functions at x (m, 3), as (m, 6)."""
        values = self._values(self.scaled(x))
        parts = [block @ a[part] for block, part in zip(values, self.slices, strict=True)]
        return np.stack(parts, axis=1)

    def error(self, x: Array, a: Array, p: Array) -> Array:
        functions = self.functions(x, a)
        if self.full_rotations:
            return functions[:, :3] + np.einsum(
                "mij,mj->mi", rotation_and_derivatives(functions[:, 3:])[0], p
            )
        return functions[:, :3] + p + np.cross(functions[:, 3:], p)

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        values = self._values(self.scaled(x))
        if self.full_rotations:
            angles = self.functions(x, a)[:, 3:]
            by_angle = [
                np.einsum("mij,mj->mi", part, p) for part in rotation_and_derivatives(angles)[1]
            ]
            by_rotation = np.stack(by_angle, axis=2)
        else:
            by_rotation = cross_matrices(p)
        result = np.zeros((len(x), 3, len(self.parameters)), np.result_type(*values, a, p))
        for k, (block, part) in enumerate(zip(values, self.slices, strict=True)):
            if k < 3:
                result[:, k, part] = block
            else:
                result[:, :, part] = by_rotation[:, :, k - 3, None] * block[:, None]
        return result

    def lines(self, function: str, t: Array) -> tuple[Line, ...]:
        """Return the function along lines parallel to the axes, edges of the volume first."""
        index = list(FUNCTIONS).index(function)
        pairs = list(product(LEVELS, repeat=2))
        pairs.sort(key=lambda pair: sum(level not in (0.0, 1.0) for level in pair))
        words, points, axes = [], [], []
        for pair in pairs:
            for axis in range(3):
                fixed = [k for k in range(3) if k != axis]
                location = " and ".join(
                    f"{AXIS_NAMES[k]} {_level(level)}" for k, level in zip(fixed, pair, strict=True)
                )
                words.append(f"along {AXIS_NAMES[axis].upper()} at {location}")
                line = np.zeros((len(t), 3))
                line[:, axis], line[:, fixed] = t, pair
                points.append(line)
                axes.append(axis)
        values = self._values(np.concatenate(points))[index].reshape(len(words), len(t), -1)
        return tuple(map(Line, words, values, axes))

    def reported(self) -> Reported:
        """Return coefficients of monomials if the terms are polynomials, otherwise the
        parameters.
        """
        displacing = self.terms.quoted()
        turning = displacing if self.of_rotations is None else self.of_rotations.quoted()
        names: list[str] = []
        units: list[Unit] = []
        blocks = []
        for k, function in enumerate(FUNCTIONS):
            quoted = turning if k >= 3 else displacing
            block = quoted.matrix[:, self._chosen[k]]
            used = np.flatnonzero(block.any(axis=1))
            blocks.append(block[used])
            names += [f"{function} {quoted.names[row]}" for row in used]
            units += ["rad" if k >= 3 else "m"] * len(used)
        matrix = np.zeros((len(names), len(self.parameters)))
        row = 0
        for block, part in zip(blocks, self.slices, strict=True):
            matrix[row : row + len(block), part] = block
            row += len(block)
        return Reported(tuple(names), tuple(units), matrix)


def empirical_model(
    terms: Terms,
    lower: tuple[float, ...],
    upper: tuple[float, ...],
    full_rotations: bool = False,
    frame: Sequence[Condition] = FRAME,
    of_rotations: Terms | None = None,
) -> EmpiricalModel:
    """Return the model whose functions vanish at the conditions of `frame`.

    Terms that are not zero there are omitted.

    :raises ValueError: a condition has several such terms.

    >>> from .bases import Polynomial
    >>> from ._terms import sums
    >>> len(empirical_model(sums(Polynomial(3)), (0, 0, 0), (1, 1, 1)).parameters)
    87
    """
    columns = []
    for function, own_terms in zip(FUNCTIONS, _of_six(terms, of_rotations), strict=True):
        columns_left = list(range(len(own_terms.names)))
        for name, corner in frame:
            if name == function:
                at_corner = own_terms.values(np.array([corner]))[0, columns_left]
                # A function that has to be zero at a corner loses the term that is not. Two such
                # terms could cancel each other there, and the condition would be no choice of terms
                # any more.
                touched = np.flatnonzero(np.abs(at_corner) > 1e-9)
                if len(touched) > 1:
                    raise ValueError(f"{len(touched)} terms of {function} are not zero at {corner}")
                columns_left = [column for k, column in enumerate(columns_left) if k not in touched]
        columns.append(tuple(columns_left))
    return EmpiricalModel(terms, tuple(columns), lower, upper, full_rotations, of_rotations)


def _of_six(terms: Terms, of_rotations: Terms | None) -> tuple[Terms, ...]:
    """Return the terms of each of the six functions."""
    return (terms,) * 3 + (terms if of_rotations is None else of_rotations,) * 3


def _level(fraction: float) -> str:
    return {0.0: "low", 0.5: "middle", 1.0: "high"}.get(fraction, f"{fraction:g}")
