"""An error model in the neighbourhood of given readings, for many small changes of readings and parameters at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..design import Integers
from ..machines.protocol import Array, ErrorModel

# Half the distance, in metres, between the readings whose difference gives a derivative.
STEP = 1e-4


class LocalModel(Protocol):
    """How the correction at m readings changes with the readings and with the model's parameters.

    For b replicates `moved` (d, m, b) is what each reading differs by and `step` (n, b) what the parameters differ
    by; without a step it is zero.
    """

    def change(self, moved: Array, step: Array | None) -> Array:
        """Change of the correction (d, m, b)."""
        ...

    def gather(self, moved: Array, step: Array | None, pull: Array) -> Array:
        """The derivative by the parameters, transposed, times `pull` (d, m, b): (n, b)."""
        ...


@dataclass(frozen=True)
class Expansion:
    """A model that is linear in its parameters and smooth in the readings: matrix products serve all replicates.

    For each component: `columns` the parameters that matter, `by_parameters` (m, columns), `by_reading` (axes, m),
    and for each axis `mixed_columns` and `mixed` (m, columns), the derivative of `by_parameters` by the reading. A
    product of two small changes needs no more digits than single precision has.
    """

    size: int
    columns: tuple[Integers, ...]
    by_parameters: tuple[Array, ...]
    by_reading: tuple[Array, ...]
    mixed_columns: tuple[tuple[Integers, ...], ...]
    mixed: tuple[tuple[NDArray[np.float32], ...], ...]

    def change(self, moved: Array, step: Array | None) -> Array:
        found = np.empty_like(moved)
        single = None if step is None else step.astype(np.float32)
        for i, by_reading in enumerate(self.by_reading):
            total = found[i]
            if step is None:
                np.multiply(by_reading[0][:, None], moved[0], out=total)
            else:
                np.matmul(self.by_parameters[i], step[self.columns[i]], out=total)
            for axis, along in enumerate(by_reading):
                if step is None and axis == 0:
                    continue
                slope: Array = along[:, None]
                if single is not None and len(self.mixed_columns[i][axis]):
                    slope = slope + self.mixed[i][axis] @ single[self.mixed_columns[i][axis]]
                total += slope * moved[axis]
        return found

    def gather(self, moved: Array, step: Array | None, pull: Array) -> Array:
        found = np.zeros((self.size, pull.shape[2]))
        for i, columns in enumerate(self.columns):
            found[columns] += self.by_parameters[i].T @ pull[i]
            if step is None:
                continue
            for axis, mixed in enumerate(self.mixed[i]):
                if mixed.shape[1]:
                    both = np.empty(pull.shape[1:], np.float32)
                    np.multiply(moved[axis], pull[i], out=both, casting="same_kind")
                    found[self.mixed_columns[i][axis]] += mixed.T @ both
        return found


@dataclass(frozen=True)
class Direct:
    """Any model, evaluated replicate by replicate: `x` (m, d), `a` (n,), `p` (m, d), `value` (m, d) the correction."""

    model: ErrorModel
    x: Array
    a: Array
    p: Array
    value: Array

    def _parameters(self, step: Array | None, k: int) -> Array:
        return self.a if step is None else self.a + step[:, k]

    def change(self, moved: Array, step: Array | None) -> Array:
        found = np.empty_like(moved)
        for k in range(moved.shape[2]):
            error = self.model.error(self.x + moved[:, :, k].T, self._parameters(step, k), self.p)
            found[:, :, k] = (error - self.value).T
        return found

    def gather(self, moved: Array, step: Array | None, pull: Array) -> Array:
        found = np.empty((len(self.a), pull.shape[2]))
        for k in range(pull.shape[2]):
            jacobian = self.model.jacobian(self.x + moved[:, :, k].T, self._parameters(step, k), self.p)
            found[:, k] = np.einsum("mdn,dm->n", jacobian, pull[:, :, k])
        return found


def expand(model: ErrorModel, x: Array, a: Array, p: Array) -> Expansion:
    """Expand a model about readings x (m, d), parameters a (n,) and probe offsets p (m, d)."""
    d = x.shape[1]
    jacobian = model.jacobian(x, a, p)
    by_reading, mixed = [], []
    for axis in range(d):
        shift = np.zeros(d)
        shift[axis] = STEP
        by_reading.append((model.error(x + shift, a, p) - model.error(x - shift, a, p)) / (2 * STEP))
        mixed.append((model.jacobian(x + shift, a, p) - model.jacobian(x - shift, a, p)) / (2 * STEP))
    # Differences leave rounding where the derivative is zero.
    floor = 1e-9 * max((float(np.abs(one).max(initial=0.0)) for one in mixed), default=0.0)
    columns = tuple(np.flatnonzero(jacobian[:, i].any(axis=0)) for i in range(d))
    mixed_columns = tuple(
        tuple(np.flatnonzero((np.abs(mixed[axis][:, i]) > floor).any(axis=0)) for axis in range(d)) for i in range(d)
    )
    return Expansion(
        size=len(a),
        columns=columns,
        by_parameters=tuple(np.ascontiguousarray(jacobian[:, i, columns[i]]) for i in range(d)),
        by_reading=tuple(np.stack([one[:, i] for one in by_reading]) for i in range(d)),
        mixed_columns=mixed_columns,
        mixed=tuple(
            tuple(mixed[axis][:, i, mixed_columns[i][axis]].astype(np.float32) for axis in range(d)) for i in range(d)
        ),
    )
