"""Whitened residuals and derivatives of every kind of observation.

The model is that of NPL Report CISE 15/98, section 3: reading i of ball j in position k with probe
l obeys x + e(x, a, p) = R y + o + noise. No caller divides by an uncertainty: rows leave here in
units of their own standard uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..design.arrays import Design, State, locations, reading_uncertainties
from ..design.observations import Readings
from ..geometry.motions import pose_size, vector_from_rotation, vector_rate
from ..machines.protocol import Array, ErrorModel, Integers
from .parameters import SharedLayout

# Metres: of the size of probe offsets.
OFFSET_STEP = 0.1


@dataclass(frozen=True)
class ReadingBlocks:
    """Rows of m readings: residual (m, d), derivatives by ball (m, d, d), pose (m, d, q), model (m,
    d, n).

    `by_offset` (m, d, d) is the derivative by the probe's offset, None where no offset is a
    parameter.
    """

    residual: Array
    by_ball: Array
    by_pose: Array
    by_model: Array
    by_offset: Array | None = None


@dataclass(frozen=True)
class BallRows:
    """Rows that concern ball co-ordinates alone: residual (m,) and the derivative by one ball each
    (m, d).
    """

    residual: Array
    derivative: Array


def expected_readings(design: Design, state: State, readings: Readings) -> Array:
    """Scale readings (m, d) of a machine without errors, true location less probe offset."""
    return locations(design, state, readings) - state.probes[readings.probe]


def offset_sensitivity(model: ErrorModel, x: Array, a: Array, p: Array) -> Array:
    """Derivative (m, d, d) of the error by the probe offset: identity plus what the machine's
    rotations add.

    A rotation acts on the offset linearly, so that a central difference over a whole machine arm is
    exact to rounding for every model of rigid axes.
    """
    columns = []
    for axis in range(x.shape[1]):
        step = np.zeros(x.shape[1])
        step[axis] = OFFSET_STEP
        columns.append(
            (model.error(x, a, p + step) - model.error(x, a, p - step)) / (2.0 * OFFSET_STEP)
        )
    return np.stack(columns, axis=2)


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


def reading_blocks(
    design: Design, state: State, readings: Readings, x: Array | None
) -> ReadingBlocks:
    """Rows of readings of plates, with scale readings x (m, d), or error-free ones where x is
    None.
    """
    d = design.dimension
    p = state.probes[readings.probe]
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
    by_offset = None
    if design.probes.free.any():
        by_offset = weight[:, :, None] * offset_sensitivity(design.model, x, state.a, p)
    return ReadingBlocks(residual, -weight[:, :, None] * rotation, by_pose, by_model, by_offset)


def coordinate_rows(design: Design, state: State) -> BallRows:
    """Rows of calibrated ball co-ordinates."""
    given = design.coordinates
    derivative = np.zeros((len(given), design.dimension))
    derivative[np.arange(len(given)), given.axis] = 1.0 / given.uncertainty
    residual = (state.balls[given.ball, given.axis] - given.value) / given.uncertainty
    return BallRows(residual, derivative)


def distance_rows(design: Design, state: State) -> BallRows:
    """Rows of calibrated distances; `derivative` is by the first ball, its negative by the
    second.
    """
    given = design.distances
    difference = state.balls[given.first] - state.balls[given.second]
    difference = difference * (np.arange(design.dimension) < given.dimensions[:, None])
    length = np.sqrt((difference**2).sum(axis=1))
    return BallRows(
        (length - given.value) / given.uncertainty,
        difference / (length * given.uncertainty)[:, None],
    )


def length_rows(design: Design, state: State, x: Array | None) -> tuple[Array, Array]:
    """Rows of length standards read in the volume: residual (r,) and derivative by the model (r,
    n).

    There are as many rows as lengths that do not follow from others. `x` (readings, d) holds the
    scale readings of all readings, or is None for an error-free machine; the length between
    corrected points, or its projection, is compared with the known one (NPL section 3.2.2).
    """
    residual, found = _length_residuals(design, state, x)
    rows = np.zeros((len(design.lengths), len(state.a)))
    for end in found.ends:
        by_model = design.model.jacobian(end.points, state.a, end.offsets)
        rows[end.rows] += end.sign * np.einsum("md,mdn->mn", found.unit[end.rows], by_model)
    return residual, design.length_whitening.whitened(rows)


def length_shared_rows(
    design: Design, layout: SharedLayout, state: State, x: Array | None
) -> tuple[Array, Array]:
    """The same residuals (r,), with the derivative (r, s) by all shared parameters."""
    residual, found = _length_residuals(design, state, x)
    return residual, design.length_whitening.whitened(
        _length_derivative(design, layout, state, found)
    )


def length_derivative(design: Design, layout: SharedLayout, state: State, x: Array | None) -> Array:
    """Derivative (m, s) of lengths less those expected by all shared parameters, in metres."""
    return _length_derivative(design, layout, state, _measured_lengths(design, state, x))


def _length_derivative(
    design: Design, layout: SharedLayout, state: State, measured: _Measured
) -> Array:
    given = design.lengths
    # What is held goes to the extra column.
    rows = np.zeros((len(given), len(layout) + 1))
    for end in measured.ends:
        along = measured.unit[end.rows]
        by_model = design.model.jacobian(end.points, state.a, end.offsets)
        rows[end.rows, layout.model] += end.sign * np.einsum("md,mdn->mn", along, by_model)
        if design.probes.free.any():
            by_offset = offset_sensitivity(design.model, end.points, state.a, end.offsets)
            columns = layout.offset_columns[end.probe]
            np.add.at(
                rows,
                (end.rows[:, None], columns),
                end.sign * np.einsum("md,mdj->mj", along, by_offset),
            )
    pivoted = np.flatnonzero(given.to_pivot)
    columns = layout.pose_columns[
        design.readings.position[given.first[pivoted]], : design.dimension
    ]
    np.add.at(rows, (pivoted[:, None], columns), -measured.unit[pivoted])
    if given.free is not None:
        free = np.flatnonzero(given.free >= 0)
        rows[free, layout.lengths.start + given.free[free]] -= 1.0
    return rows[:, :-1]


@dataclass(frozen=True)
class _End:
    """Ends of lengths `rows` (k,) that are read: scale readings and probe offsets (k, d), probes
    (k,).
    """

    sign: float
    rows: Integers
    points: Array
    offsets: Array
    probe: Integers


@dataclass(frozen=True)
class _Measured:
    """Lengths between corrected points (m,), their directions (m, d), and the ends that are
    read.
    """

    length: Array
    unit: Array
    ends: tuple[_End, _End]


def _measured_lengths(design: Design, state: State, x: Array | None) -> _Measured:
    given = design.lengths
    difference = np.zeros((len(given), design.dimension))
    pivoted = np.flatnonzero(given.to_pivot)
    pivot = state.origins[design.readings.position[given.first[pivoted]]]
    ends = []
    for sign, chosen, rows in (
        (1.0, given.first, np.arange(len(given))),
        (-1.0, given.second, np.flatnonzero(~given.to_pivot)),
    ):
        readings = design.readings.select(chosen[rows])
        p = state.probes[readings.probe]
        if x is not None:
            points = x[chosen[rows]]
        else:
            points = expected_readings(design, state, readings)
            if sign > 0:
                # Where the ball of a gauge was, which need not be where it was to be.
                reach = length_values(design, state)[pivoted, None] * given.direction[pivoted]
                points[pivoted] = pivot + reach - p[pivoted]
        difference[rows] += sign * (
            points + (p if x is None else design.model.error(points, state.a, p))
        )
        ends.append(_End(sign, rows, points, p, readings.probe))
    difference[pivoted] -= pivot
    unit = difference / np.sqrt((difference**2).sum(axis=1))[:, None]
    unit = np.where(given.projected[:, None], given.direction, unit)
    length = np.einsum("md,md->m", unit, difference)
    return _Measured(length, unit, (ends[0], ends[1]))


def _length_residuals(design: Design, state: State, x: Array | None) -> tuple[Array, _Measured]:
    """Whitened residuals (r,) of lengths, and what these are formed of."""
    found = _measured_lengths(design, state, x)
    return design.length_whitening.whitened(found.length - length_values(design, state)), found


def length_deviations(design: Design, state: State, x: Array | None) -> tuple[Array, Array]:
    """What measured lengths exceed those expected by (m,), and the uncertainty of each by itself,
    in metres.

    Without scale readings x the machine is taken to read without error.
    """
    if not len(design.lengths):
        return np.zeros(0), np.ones(0)
    found = _measured_lengths(design, state, x)
    scatter = design.length_whitening.scatter
    return found.length - length_values(design, state), np.hypot(
        scatter, design.lengths.uncertainty
    )


def length_directions(design: Design, state: State, x: Array | None) -> Array:
    """Directions (m, d) from the second end of lengths to the first."""
    if not len(design.lengths):
        return np.zeros((0, design.dimension))
    return _measured_lengths(design, state, x).unit


def length_values(design: Design, state: State) -> Array:
    """Values (m,) at `state` that lengths of standards are compared with: those certified, or the
    unknown ones.
    """
    given = design.lengths
    if given.free is None or not len(design.unknown_lengths.names):
        return given.value
    return np.where(given.free >= 0, state.lengths[given.free], given.value)


def prior_values(design: Design, state: State) -> Array:
    """Values (m,) at `state` of what the design's priors are about."""
    given = design.priors
    of_poses = _pose_values(design, state)[given.position, given.component]
    axis = np.minimum(given.component, design.dimension - 1)
    of_probes = state.probes[given.probe, axis]
    of_model = given.by_model @ state.a if len(given) else np.zeros(0)
    return np.where(given.position >= 0, of_poses, np.where(given.probe >= 0, of_probes, of_model))


def _pose_values(design: Design, state: State) -> Array:
    """Origins and rotations against the nominal pose (k, pose size)."""
    turned = vector_from_rotation(state.rotations @ design.positions.rotations.transpose(0, 2, 1))
    return np.concatenate([state.origins, turned], axis=1)


def prior_rows(design: Design, layout: SharedLayout, state: State) -> tuple[Array, Array]:
    """Rows of priors: residual (m,) and derivative by the shared parameters (m,
    s).
    """
    given, d = design.priors, design.dimension
    derivative = np.zeros((len(given), len(layout)))
    if not len(given):
        return np.zeros(0), derivative
    derivative[:, layout.model] = given.by_model
    rows = np.flatnonzero(given.probe >= 0)
    derivative[rows, layout.offset_columns[given.probe[rows], given.component[rows]]] = 1.0
    rows = np.flatnonzero((given.position >= 0) & (given.component < d))
    derivative[rows, layout.pose_columns[given.position[rows], given.component[rows]]] = 1.0
    rows = np.flatnonzero((given.position >= 0) & (given.component >= d))
    place = given.position[rows]
    rate = vector_rate(_pose_values(design, state)[place, d:])[
        np.arange(len(rows)), given.component[rows] - d
    ]
    columns = layout.pose_columns[place, d:]
    # What is held does not move.
    row, turn = np.nonzero(columns >= 0)
    derivative[rows[row], columns[row, turn]] = rate[row, turn]
    weight = 1.0 / given.uncertainty
    return weight * (prior_values(design, state) - given.value), weight[:, None] * derivative
