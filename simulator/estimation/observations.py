"""Whitened residuals and derivatives of every kind of observation.

The model is that of NPL Report CISE 15/98, section 3: reading i of ball j in position k with probe l obeys
x + e(x, a, p) = R y + o + noise. No caller divides by an uncertainty: rows leave here in units of their own
standard uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..design import Design, Readings, State, locations, pose_size, reading_uncertainties
from ..machines.protocol import Array


@dataclass(frozen=True)
class ReadingBlocks:
    """Rows of m readings: residual (m, d), derivatives by ball (m, d, d), pose (m, d, q), model (m, d, n)."""

    residual: Array
    by_ball: Array
    by_pose: Array
    by_model: Array


@dataclass(frozen=True)
class BallRows:
    """Rows that concern ball co-ordinates alone: residual (m,) and the derivative by one ball each (m, d)."""

    residual: Array
    derivative: Array


def expected_readings(design: Design, state: State, readings: Readings) -> Array:
    """Scale readings (m, d) of a machine without errors, true location less probe offset."""
    return locations(design, state, readings) - design.probes[readings.probe]


def rotation_sensitivity(arm: Array) -> Array:
    """Derivative of omega x arm by omega: (m, 3, 3) in space, (m, 2, 1) in the plane.

    >>> rotation_sensitivity(np.array([[2.0, 1.0]])).tolist()
    [[[-1.0], [2.0]]]
    """
    m, d = arm.shape
    if d == 2:
        return np.stack([-arm[:, 1], arm[:, 0]], axis=1)[:, :, None]
    result = np.zeros((m, 3, 3), arm.dtype)
    result[:, 0, 1], result[:, 0, 2] = arm[:, 2], -arm[:, 1]
    result[:, 1, 0], result[:, 1, 2] = -arm[:, 2], arm[:, 0]
    result[:, 2, 0], result[:, 2, 1] = arm[:, 1], -arm[:, 0]
    return result


def reading_weights(design: Design, readings: Readings) -> Array:
    """Reciprocal standard uncertainties (m, d) of the mean of each reading's repeats."""
    return np.asarray(np.sqrt(readings.repeats)[:, None] / reading_uncertainties(design, readings))


def reading_blocks(design: Design, state: State, readings: Readings, x: Array | None) -> ReadingBlocks:
    """Rows of readings of plates, with scale readings x (m, d), or error-free ones where x is None."""
    d = design.dimension
    p = design.probes[readings.probe]
    rotation = state.rotations[readings.position]
    arm = np.einsum("mij,mj->mi", rotation, state.balls[readings.ball])
    true = arm + state.origins[readings.position]
    weight = reading_weights(design, readings)
    if x is None:
        x = true - p
        residual = np.zeros_like(x)
    else:
        residual = weight * (x + design.model.error(x, state.a, p) - true)
    by_model = design.model.jacobian(x, state.a, p)
    by_model *= weight[:, :, None]
    by_pose = np.zeros((len(x), d, pose_size(d)), np.result_type(arm, float))
    by_pose[:, range(d), range(d)] = -weight
    by_pose[:, :, d:] = -weight[:, :, None] * rotation_sensitivity(arm)
    return ReadingBlocks(residual, -weight[:, :, None] * rotation, by_pose, by_model)


def coordinate_rows(design: Design, state: State) -> BallRows:
    """Rows of calibrated ball co-ordinates."""
    given = design.coordinates
    derivative = np.zeros((len(given), design.dimension))
    derivative[np.arange(len(given)), given.axis] = 1.0 / given.uncertainty
    residual = (state.balls[given.ball, given.axis] - given.value) / given.uncertainty
    return BallRows(residual, derivative)


def distance_rows(design: Design, state: State) -> BallRows:
    """Rows of calibrated distances; `derivative` is by the first ball, its negative by the second."""
    given = design.distances
    difference = state.balls[given.first] - state.balls[given.second]
    difference = difference * (np.arange(design.dimension) < given.dimensions[:, None])
    length = np.sqrt((difference**2).sum(axis=1))
    return BallRows((length - given.value) / given.uncertainty, difference / (length * given.uncertainty)[:, None])


def length_rows(design: Design, state: State, x: Array | None) -> tuple[Array, Array]:
    """Rows of a length standard read in the volume: residual (m,) and derivative by the model (m, n).

    `x` (readings, d) holds the scale readings of all readings, or is None for an error-free machine; the
    length between corrected points, or its projection, is compared with the known one (NPL section 3.2.2).
    """
    given = design.lengths
    corrected, jacobian, noise = [], [], []
    for chosen in (given.first, given.second):
        readings = design.readings.select(chosen)
        p = design.probes[readings.probe]
        points = expected_readings(design, state, readings) if x is None else x[chosen]
        corrected.append(points + (p if x is None else design.model.error(points, state.a, p)))
        jacobian.append(design.model.jacobian(points, state.a, p))
        noise.append(reading_weights(design, readings) ** -2)
    difference = corrected[0] - corrected[1]
    unit = difference / np.sqrt((difference**2).sum(axis=1))[:, None]
    unit = np.where(given.projected[:, None], given.direction, unit)
    length = np.einsum("md,md->m", unit, difference)
    # Along the nominal direction, so that weights stay what they are while parameters change.
    scatter = np.einsum("md,md->m", given.direction**2, noise[0] + noise[1]) * given.with_repeatability
    weight = 1.0 / np.sqrt(given.uncertainty**2 + scatter)
    derivative = np.einsum("md,mdn->mn", unit, jacobian[0] - jacobian[1]) * weight[:, None]
    return weight * (length - given.value), derivative
