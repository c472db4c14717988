"""Expansion of an error model about readings, for many small changes of readings and parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.design.observations.readings import OFFSET_STEP, offset_sensitivity
from ballplate.simulator.inputs.number_arrays import Array, Integers
from ballplate.simulator.machines.protocol import ErrorModel

# Step of central differences, in metres.
STEP = 1e-4


@dataclass(frozen=True)
class Expansion:
    """A model that is linear in its parameters and smooth in the readings, as matrix products for
    all replicates.

    For each component: `columns` of the parameters that matter, `by_parameters` (columns, m),
    `by_place` (axes, m), and `mixed_columns` with `mixed` (columns, axes x m), the derivative of
    `by_parameters` by the location. The axes are those of the reading and then, if offsets are
    parameters, of the probe offset, less the offset itself.

    For b replicates `moved` (b, d, m) are changes of readings, `offsets` (b, d, m) of their probes'
    offsets if these are parameters, and `step` (b, n) of the parameters.
    """

    size: int
    columns: tuple[Integers, ...]
    by_parameters: tuple[Array, ...]
    by_place: tuple[Array, ...]
    mixed_columns: tuple[Integers, ...]
    mixed: tuple[Array, ...]

    def change(self, moved: Array, step: Array, offsets: Array | None = None) -> Array:
        """Change of the correction (b, d, m)."""
        places = _places(moved, offsets)
        change = np.empty(moved.shape)
        for i, columns in enumerate(self.columns):
            slopes = self._slopes(i, step)[:, : places.shape[1]]
            change[:, i] = step[:, columns] @ self.by_parameters[i]
            change[:, i] += np.einsum("bam,bam->bm", slopes, places)
        return change if offsets is None else change + offsets

    def _slopes(self, i: int, step: Array) -> Array:
        """Derivatives (b, axes, m) of component i by the locations."""
        slopes = step[:, self.mixed_columns[i]] @ self.mixed[i]
        return slopes.reshape(len(step), *self.by_place[i].shape) + self.by_place[i]

    def gather(self, moved: Array, step: Array, pull: Array, offsets: Array | None = None) -> Array:
        """The transposed derivative by the parameters, times `pull` (b, d, m): (b, n)."""
        # Adding to rows takes a fifth of the time of adding to columns.
        result = np.zeros((self.size, len(pull)))
        for i, columns in enumerate(self.columns):
            result[columns] += (pull[:, i] @ self.by_parameters[i].T).T
        places = _places(moved, offsets)
        for i, columns in enumerate(self.mixed_columns):
            products = (places * pull[:, i, None]).reshape(len(pull), -1)
            result[columns] += (products @ self.mixed[i].T).T
        return result.T

    def gather_offsets(self, step: Array, pull: Array) -> Array:
        """The transposed derivative by each reading's probe offset, times `pull` (b, d, m): (b, d,
        m).
        """
        result, d = pull.copy(), pull.shape[1]
        for i in range(d):
            result += self._slopes(i, step)[:, d:] * pull[:, i, None]
        return result


@dataclass(frozen=True)
class Direct:
    """Any model, evaluated replicate by replicate as an `Expansion` is: `x` (m, d), `a` (n,), `p`
    (m, d), and the correction `value` (m, d).
    """

    model: ErrorModel
    x: Array
    a: Array
    p: Array
    value: Array

    def _probe(self, offsets: Array | None, k: int) -> Array:
        return self.p if offsets is None else self.p + offsets[k].T

    def change(self, moved: Array, step: Array, offsets: Array | None = None) -> Array:
        change = np.empty(moved.shape)
        for k in range(len(moved)):
            error = self.model.error(self.x + moved[k].T, self.a + step[k], self._probe(offsets, k))
            change[k] = (error - self.value).T
        return change

    def gather(self, moved: Array, step: Array, pull: Array, offsets: Array | None = None) -> Array:
        result = np.empty((len(pull), len(self.a)))
        for k in range(len(pull)):
            probe = self._probe(offsets, k)
            jacobian = self.model.jacobian(self.x + moved[k].T, self.a + step[k], probe)
            result[k] = np.einsum("mdn,dm->n", jacobian, pull[k])
        return result

    def gather_offsets(self, step: Array, pull: Array) -> Array:
        result = np.empty_like(pull)
        for k in range(len(pull)):
            by_offset = offset_sensitivity(self.model, self.x, self.a + step[k], self.p)
            result[k] = np.einsum("mij,im->jm", by_offset, pull[k])
        return result


# Changes of the correction at m readings with the readings and with the model's parameters.
LocalModel = Expansion | Direct


def _places(moved: Array, offsets: Array | None) -> Array:
    """Return changes of readings, and of offsets if they are parameters, (b, axes, m)."""
    return moved if offsets is None else np.concatenate([moved, offsets], axis=1)


def expand(
    model: ErrorModel, x: Array, a: Array, p: Array, with_offsets: bool = False
) -> Expansion:
    """Return a model expanded about readings x (m, d), parameters a (n,) and, optionally, probe
    offsets p (m, d).
    """
    d = x.shape[1]
    jacobian = model.jacobian(x, a, p)
    by_place, mixed = [], []
    # To first order in readings and in parameters, with the products of both: both change at once
    # in a replicate, by noise and by the estimate. Whether that is enough for a model,
    # `_is_faithful` tests beforehand.
    for axis in range(2 * d if with_offsets else d):
        # Offsets act linearly, so that a large step is exact to rounding.
        step = STEP if axis < d else OFFSET_STEP
        shift = np.zeros((2, d))
        shift[axis // d, axis % d] = step
        above, below = (x + shift[0], a, p + shift[1]), (x - shift[0], a, p - shift[1])
        by_place.append((model.error(*above) - model.error(*below)) / (2 * step))
        mixed.append((model.jacobian(*above) - model.jacobian(*below)) / (2 * step))
    # `change` adds the offset itself, without rounding of differences.
    for axis in range(d, len(by_place)):
        by_place[axis][:, axis - d] -= 1.0
    # Differences for a zero derivative are rounding errors.
    floor = 1e-9 * max(
        (float(np.abs(derivative).max(initial=0.0)) for derivative in mixed), default=0.0
    )
    together = np.stack(mixed, axis=3)
    columns = tuple(np.flatnonzero(jacobian[:, i].any(axis=0)) for i in range(d))
    used = tuple(
        np.flatnonzero((np.abs(together[:, i]) > floor).any(axis=(0, 2))) for i in range(d)
    )
    return Expansion(
        size=len(a),
        columns=columns,
        by_parameters=tuple(jacobian[:, i, columns[i]].T for i in range(d)),
        by_place=tuple(np.stack([derivative[:, i] for derivative in by_place]) for i in range(d)),
        mixed_columns=used,
        mixed=tuple(
            together[:, i, used[i]].transpose(1, 2, 0).reshape(len(used[i]), len(mixed) * len(x))
            for i in range(d)
        ),
    )
