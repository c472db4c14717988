"""Conversion between error models, and containment of one in another, to first order in the
errors.

NPL Report CISE 15/98, section 2.3: every kinematic model is a special case of some empirical model,
and an empirical model has values along the axes from which a kinematic one can be made.
"""

from __future__ import annotations

import numpy as np

from .bases import Basis, spline_containing
from .empirical import FRAME, FUNCTIONS, USUAL_OFFSET, EmpiricalModel, empirical_model
from .error_names import AxisError
from .kinematic import KinematicModel
from .protocol import Array, ErrorModel
from .terms import sums

# Largest part of a parameter's effect that may be left over where its model counts as contained.
CONTAINED = 1e-9


class NotContainedError(ValueError):
    """A model cannot do what another can; `parameters` names what is missing."""

    def __init__(self, parameters: tuple[str, ...]) -> None:
        self.parameters = parameters
        super().__init__(f"not contained: {', '.join(parameters)}")


def containing(model: KinematicModel) -> EmpiricalModel:
    """The empirical model of sums of tensor products that contains a kinematic one.

    On the workpiece's side an axis carries its own co-ordinate, which raises the degree by one, and
    a rotation moves the corner by which the frame is fixed: conditions that the kinematic model
    does not meet are left out.

    >>> from .arrangement import ARRANGEMENTS
    >>> from .kinematic import kinematic_model
    >>> kinematic = kinematic_model(ARRANGEMENTS["MB2"], 4, 4, (0, 0, 0), (1, 1, 1))
    >>> linear_map(kinematic, containing(kinematic)).shape
    (141, 51)
    """
    of_axes = [f for f in model.functions if isinstance(f.error, AxisError)]
    families = tuple(dict.fromkeys(_family(f.basis) for f in of_axes))
    rotational = tuple(dict.fromkeys(_family(f.basis) for f in of_axes if f.rotation))
    raised = rotational if model.arrangement.workpiece_side else ()
    basis = spline_containing((*families, *raised), len(raised))
    lower, upper = np.asarray(model.lower), np.asarray(model.upper)
    zero, origin = np.zeros(len(model.parameters)), np.zeros((1, 3))
    held = []
    for name, corner in FRAME:
        row = list(FUNCTIONS).index(name)
        at_corner = model.jacobian((lower + (upper - lower) * corner)[None], zero, origin)[0]
        if row >= 3 or np.abs(at_corner[row]).max(initial=0.0) < 1e-12:
            held.append((name, corner))
    return empirical_model(sums(basis), model.lower, model.upper, model.full_rotations, held)


def linear_map(inner: ErrorModel, outer: ErrorModel) -> Array:
    """Matrix from the parameters of one model to those of another in the same volume, with the same
    first-order errors.

    Found by least squares at random places with several probe offsets.

    :raises NotContainedError: some of the parameters of `inner` have effects that `outer` does not
        know.
    """
    lower, upper = _volume(inner, outer)
    generator = np.random.default_rng(np.random.SeedSequence(1))
    count = len(outer.parameters)
    x = lower + (upper - lower) * generator.random((count, len(lower)))
    p = USUAL_OFFSET * float((upper - lower).max()) * generator.standard_normal(x.shape)
    known = outer.jacobian(x, np.zeros(count), p).reshape(-1, count)
    wanted = inner.jacobian(x, np.zeros(len(inner.parameters)), p).reshape(len(known), -1)
    scale = np.linalg.norm(known, axis=0)
    matrix = np.linalg.lstsq(known / scale, wanted, rcond=1e-13)[0] / scale[:, None]
    left = np.abs(known @ matrix - wanted).max(axis=0) / np.abs(wanted).max(axis=0)
    missing = tuple(
        p.name for p, part in zip(inner.parameters, left, strict=True) if part > CONTAINED
    )
    if missing:
        raise NotContainedError(missing)
    return matrix


def along_axes(model: ErrorModel, a: Array, kinematic: KinematicModel) -> tuple[Array, float]:
    """Parameters of a kinematic model with the errors that `model` has along the axes, and the
    largest deviation there.

    The axes are the three edges of the volume at the lower corner. The deviation, in metres, is
    what the kinematic model's functions cannot follow; elsewhere in the volume the two models
    differ in any case.
    """
    lower, upper = np.asarray(kinematic.lower), np.asarray(kinematic.upper)
    t = np.linspace(0.0, 1.0, 65)
    places = np.concatenate(
        [lower + t[:, None] * (upper - lower) * np.eye(3)[axis] for axis in range(3)]
    )
    arm = USUAL_OFFSET * float((upper - lower).max())
    offsets = np.concatenate([np.zeros((1, 3)), arm * np.eye(3)])
    x, p = np.tile(places, (len(offsets), 1)), np.repeat(offsets, len(places), axis=0)
    wanted = (model.error(x, a, p) - p).ravel()
    known = kinematic.jacobian(x, np.zeros(len(kinematic.parameters)), p).reshape(len(wanted), -1)
    found = np.linalg.lstsq(known, wanted, rcond=1e-13)[0]
    return np.asarray(found), float(np.abs(known @ found - wanted).max())


def _family(basis: Basis) -> Basis:
    """The family of a basis, by its interior functions, which identify it."""
    return basis.interior()


def _volume(*models: ErrorModel) -> tuple[Array, Array]:
    for model in models:
        if isinstance(model, KinematicModel | EmpiricalModel):
            return np.asarray(model.lower, float), np.asarray(model.upper, float)
    return np.zeros(models[0].dimension), np.ones(models[0].dimension)
