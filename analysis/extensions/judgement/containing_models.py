"""Containment of one error model in another, to first order in the errors.

NPL Report CISE 15/98, section 2.3: every kinematic model is a special case of some empirical model.
"""

from __future__ import annotations

import numpy as np
from ballplate.simulator.computing import lstsq
from ballplate.simulator.machines import (
    USUAL_OFFSET,
    Array,
    EmpiricalModel,
    ErrorModel,
    KinematicModel,
)

# Largest part of a parameter's effect that may be left over where its model counts as contained.
CONTAINED = 1e-9


class NotContainedError(ValueError):
    """A model cannot represent another; `parameters` names the missing effects."""

    def __init__(self, parameters: tuple[str, ...]) -> None:
        self.parameters = parameters
        super().__init__(f"not contained: {', '.join(parameters)}")


def linear_map(inner: ErrorModel, outer: ErrorModel) -> Array:
    """Return the matrix from the parameters of one model to those of another in the same volume,
    with the same first-order errors.

    It is found by least squares at random points with several probe offsets.

    :raises NotContainedError: some of the parameters of `inner` have effects that `outer` lacks.
    """
    lower, upper = _volume(inner, outer)
    generator = np.random.default_rng(np.random.SeedSequence(1))
    count = len(outer.parameters)
    x = lower + (upper - lower) * generator.random((count, len(lower)))
    p = USUAL_OFFSET * float((upper - lower).max()) * generator.standard_normal(x.shape)
    jacobian = outer.jacobian(x, np.zeros(count), p).reshape(-1, count)
    wanted = inner.jacobian(x, np.zeros(len(inner.parameters)), p).reshape(len(jacobian), -1)
    scale = np.linalg.norm(jacobian, axis=0)
    matrix = lstsq(jacobian / scale, wanted, rcond=1e-13)[0] / scale[:, None]
    misfits = np.abs(jacobian @ matrix - wanted).max(axis=0) / np.abs(wanted).max(axis=0)
    missing = tuple(
        p.name for p, part in zip(inner.parameters, misfits, strict=True) if part > CONTAINED
    )
    if missing:
        raise NotContainedError(missing)
    return matrix


def _volume(*models: ErrorModel) -> tuple[Array, Array]:
    for model in models:
        if isinstance(model, KinematicModel | EmpiricalModel):
            return np.asarray(model.lower, float), np.asarray(model.upper, float)
    return np.zeros(models[0].dimension), np.ones(models[0].dimension)
