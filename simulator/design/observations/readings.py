"""Readings of balls: whitened residuals and derivatives.

The model is that of NPL Report CISE 15/98, section 3: reading i of ball j in position k with probe
l obeys x + e(x, a, p) = R y + o + noise. No caller divides by an uncertainty: rows leave here in
units of their own standard uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.geometry.motions import cross_matrices, pose_size
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.machines.protocol import ErrorModel

from ..arrays import Design, Readings, measured
from ..measurement import influence_shifts, locations, nominal_state, reading_uncertainties
from ..state import State

# Metres: of the size of probe offsets.
OFFSET_STEP = 0.1


@dataclass(frozen=True)
class ReadingBlocks:
    """Rows of m readings: residual (m, d), derivatives by ball (m, d, d), pose (m, d, q), model
    (m, d, n).

    `by_offset` (m, d, d) is the derivative by the probe's offset and `by_influence` (m, d, p) that
    by influence quantities, if these are parameters.
    """

    residual: Array
    by_ball: Array
    by_pose: Array
    by_model: Array
    by_offset: Array | None = None
    by_influence: Array | None = None


def expected_readings(design: Design, state: State, readings: Readings) -> Array:
    """Scale readings (m, d) of a machine without errors, true location less probe offset."""
    return locations(design, state, readings) - state.probes[readings.probe]


def seen_places(design: Design, readings: Readings, x: Array) -> Array:
    """Where scale readings x (m, d) were made on a machine without errors (m, d), influence
    quantities at their stated values.
    """
    places_seen = x + design.probes.offsets[readings.probe]
    if design.influences:
        places_seen = places_seen - influence_shifts(design, nominal_state(design), readings, x)[0]
    return np.asarray(places_seen)


def offset_sensitivity(model: ErrorModel, x: Array, a: Array, p: Array) -> Array:
    """Return the derivative (m, d, d) of the error by the probe offset: identity plus the effect
    of the machine's rotations.

    A rotation acts on the offset linearly, so that a central difference over 0.1 m to each side
    is exact to rounding for every model of rigid axes.
    """
    m, d = x.shape
    steps = OFFSET_STEP * np.concatenate([np.eye(d), -np.eye(d)])
    # All in one call: its costs are mostly those of the call.
    offsets = (p + steps[:, None]).reshape(-1, d)
    ahead, behind = model.error(np.tile(x, (2 * d, 1)), a, offsets).reshape(2, d, m, d)
    return np.asarray(((ahead - behind) / (2.0 * OFFSET_STEP)).transpose(1, 2, 0))


def rotation_sensitivity(arm: Array) -> Array:
    """Derivative of omega x arm by omega: (m, 3, 3) in space, (m, 2, 1) in the plane.

    >>> rotation_sensitivity(np.array([[2.0, 1.0]])).tolist()
    [[[-1.0], [2.0]]]
    """
    if arm.shape[1] == 2:
        return np.stack([-arm[:, 1], arm[:, 0]], axis=1)[:, :, None]
    return cross_matrices(arm)


def reading_weights(design: Design, readings: Readings) -> Array:
    """Reciprocal standard uncertainties (m, d) of the mean of each reading's repeats, zero for
    co-ordinates that are not read.
    """
    weights = np.sqrt(readings.repeats)[:, None] / reading_uncertainties(design, readings)
    return np.where(measured(design, readings), weights, 0.0)


def reading_blocks(
    design: Design, state: State, readings: Readings, x: Array | None
) -> ReadingBlocks:
    """Return rows of readings of plates, with scale readings x (m, d), or error-free ones without
    x.
    """
    d = design.dimension
    p = state.probes[readings.probe]
    rotation = state.rotations[readings.position]
    arm = np.einsum("mij,mj->mi", rotation, state.balls[readings.ball])
    true = arm + state.origins[readings.position]
    weight = reading_weights(design, readings)
    shift, by_influence = None, None
    if design.influences:
        shift, by_influence = influence_shifts(
            design, state, readings, true - p if x is None else x
        )
        by_influence *= -weight[:, :, None]
    if x is None:
        x = true - p
        residual = np.zeros_like(x)
    else:
        # The correction contains the probe's offset: without errors it is p.
        off = x + design.model.error(x, state.a, p) - true
        residual = weight * (off if shift is None else off - shift)
    by_model = design.model.jacobian(x, state.a, p)
    by_model *= weight[:, :, None]
    by_pose = np.zeros((len(x), d, pose_size(d)), np.result_type(arm, float))
    by_pose[:, range(d), range(d)] = -weight
    # A small turn is about the machine's axes, applied after the rotation of the state: its
    # derivative is the cross product with the arm, at any rotation, and no angles of a sequence
    # occur that could become singular.
    by_pose[:, :, d:] = -weight[:, :, None] * rotation_sensitivity(arm)
    if design.positions.across is not None:
        # Tilts are held: they would show through holes that are out of the plane alone.
        across = design.positions.across[readings.position]
        tilts = (across[:, None] >= 0) & (np.arange(3) != across[:, None])
        by_pose[:, :, d:] *= ~tilts[:, None]
    by_offset = None
    if design.probes.free.any():
        by_offset = weight[:, :, None] * offset_sensitivity(design.model, x, state.a, p)
    by_ball = -weight[:, :, None] * rotation
    return ReadingBlocks(residual, by_ball, by_pose, by_model, by_offset, by_influence)
