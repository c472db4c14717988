"""Whitened rows of candidates for the parameters that all positions share: balls, machine errors,
offsets, lengths.

A pose belongs to one position. Projecting its columns out of the position's rows leaves rows for
shared parameters, so the information of several positions is the sum of theirs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from ballplate.simulator.design import (
    EXACT,
    BallObservations,
    Calibration,
    Design,
    JointValues,
    Lengths,
    Observations,
    SharedLayout,
    State,
    length_derivative,
    length_whitening,
    nominal_state,
    reading_blocks,
    shared_layout,
)
from ballplate.simulator.experiment import Experiment, Position, lay_out
from ballplate.simulator.inputs import ExperimentError, refused
from ballplate.simulator.machines import Array, Integers

# A micrometre: columns are scaled so that a unit step moves some point by up to this.
STEP = 1e-6

# Readings whose rows are formed at once.
AT_ONCE = 10_000


@dataclass(frozen=True)
class CandidateRows:
    """Whitened rows of one candidate, columns in micrometres.

    `by_ball` (m, k, d) are the derivatives by the `balls` (m, k) of each row (k may be 0),
    `by_shared` (m, s) those by shared parameters, `by_pose` (m, q) those by the pose. With
    `frame`, the rows fix balls in the frame of their plate.
    """

    balls: Integers
    by_ball: Array
    by_shared: Array
    by_pose: Array
    frame: bool = False

    def __len__(self) -> int:
        return len(self.by_shared)


@dataclass(frozen=True)
class PoolDesign:
    """All positions that may be chosen, laid out as one design, and the columns of shared
    parameters.

    Shared columns are those of the layout less poses and less the influence quantities of single
    positions, then the error of each certificate of a length, in its standard uncertainty.
    """

    design: Design
    layout: SharedLayout
    state: State

    @cached_property
    def columns(self) -> Integers:
        """Columns of the layout that positions share."""
        start = self.layout.influences.start
        place = np.array(
            [parameter.position for parameter in self.design.influence_parameters], np.int64
        )
        before = np.arange(self.layout.model.start, start)
        return np.concatenate([before, start + np.flatnonzero(place < 0)])

    def influences_of(self, position: int) -> tuple[Integers, Array]:
        """The influence quantities of a position alone, with their standard uncertainties."""
        every = self.design.influence_parameters
        indices = np.array(
            [k for k, parameter in enumerate(every) if parameter.position == position], np.int64
        )
        return indices, np.array([every[k].uncertainty for k in indices], float)

    @property
    def certificates(self) -> int:
        return int(self.design.of(Lengths).certificate.max(initial=-1)) + 1

    @property
    def shared(self) -> int:
        """Number of shared columns."""
        return len(self.columns) + self.certificates

    @property
    def scale(self) -> Array:
        """Size of a unit step of each shared column (shared,)."""
        return np.concatenate([self.layout.scale[self.columns] * STEP, np.ones(self.certificates)])


def draw(experiment: Experiment, positions: Sequence[Position]) -> PoolDesign:
    """Lay out an experiment with all `positions` that may be chosen, in their order.

    :raises ExperimentError: a prior concerns a pose; its meaning depends on the position that
        holds the frame.
    """
    messages = [
        prior.mark.message(
            prior.path, f'"{prior.name}" is of a pose, which a plan cannot weigh; remove it to plan'
        )
        for prior in experiment.priors
        if prior.position is not None
    ]
    if messages:
        raise ExperimentError(messages)
    design = lay_out(replace(experiment, positions=tuple(positions)), is_pool=True)
    refuse_influences(experiment, design)
    return PoolDesign(design, shared_layout(design), nominal_state(design))


def refuse_influences(experiment: Experiment, design: Design) -> None:
    """Refuse influence quantities that a plan cannot weigh.

    :raises ExperimentError: a position brings a free parameter of its own.
    """
    text = ""
    free = [
        parameter.name
        for parameter in design.influence_parameters
        if parameter.position >= 0 and not np.isfinite(parameter.uncertainty)
    ]
    if free:
        text = (
            f"{free[0]} is unknown, which a plan cannot weigh; state a standard uncertainty to plan"
        )
    if text:
        raise refused(experiment.source, text, "influences")


def position_rows(drawn: PoolDesign) -> Iterator[CandidateRows]:
    """Rows of every position in order."""
    design, d = drawn.design, drawn.design.dimension
    place = design.readings.position[design.plate_readings]
    count = np.bincount(place, minlength=len(design.positions.names))
    end = np.cumsum(count)
    chosen = design.plate_readings[np.argsort(place, kind="stable")]
    lengths = _length_rows(drawn)
    first = 0
    while first < len(count):
        start = end[first] - count[first]
        last = max(int(np.searchsorted(end, start + AT_ONCE, side="right")), first + 1)
        index = chosen[start : end[last - 1]]
        readings = design.readings.select(index)
        blocks = reading_blocks(design, drawn.state, readings, None)
        by_shared = np.zeros((len(index), d, drawn.shared))
        by_shared[:, :, : blocks.by_model.shape[2]] = blocks.by_model
        if blocks.by_offset is not None:
            columns = drawn.layout.offset_columns[readings.probe] - drawn.layout.model.start
            for axis in range(d):
                free = np.flatnonzero(columns[:, axis] >= 0)
                by_shared[free, :, columns[free, axis]] = blocks.by_offset[free, :, axis]
        if blocks.by_influence is not None:
            first_influence = drawn.columns - drawn.layout.influences.start
            by_shared[:, :, np.flatnonzero(first_influence >= 0)] = blocks.by_influence[
                :, :, first_influence[first_influence >= 0]
            ]
        by_shared *= drawn.scale
        for k in range(first, last):
            if k in lengths:
                yield lengths[k]
                continue
            position_slice = slice(end[k] - count[k] - start, end[k] - start)
            balls = np.repeat(readings.ball[position_slice], d)[:, None]
            rows = CandidateRows(
                balls,
                STEP * blocks.by_ball[position_slice].reshape(len(balls), 1, d),
                by_shared[position_slice].reshape(len(balls), drawn.shared),
                blocks.by_pose[position_slice].reshape(len(balls), blocks.by_pose.shape[2]),
            )
            if blocks.by_influence is not None:
                rows = _with_influences(drawn, k, rows, blocks.by_influence[position_slice])
            yield rows
        first = last


def _with_influences(
    drawn: PoolDesign, position: int, rows: CandidateRows, by_influence: Array
) -> CandidateRows:
    """Add the position's own influence quantities, which are eliminated with its pose, and their
    priors.
    """
    # A parameter of one position alone is like its pose: no other choice tells of it, and it is
    # projected out with the pose, after its prior.
    influences, uncertainty = drawn.influences_of(position)
    q, count = rows.by_pose.shape[1], len(influences)
    by_own = by_influence[:, :, influences].reshape(len(rows), count)
    by_pose = np.zeros((len(rows) + count, q + count))
    by_pose[: len(rows)] = np.concatenate([rows.by_pose, by_own], axis=1)
    by_pose[len(rows) + np.arange(count), q + np.arange(count)] = 1.0 / uncertainty
    none = np.zeros((count, *rows.by_ball.shape[1:]))
    return CandidateRows(
        np.concatenate([rows.balls, rows.balls[np.zeros(count, np.int64)]]),
        np.concatenate([rows.by_ball, none]),
        np.concatenate([rows.by_shared, np.zeros((count, drawn.shared))]),
        by_pose,
    )


def _length_rows(drawn: PoolDesign) -> dict[int, CandidateRows]:
    """Rows of the lengths of standards and gauges, by position."""
    design, layout = drawn.design, drawn.layout
    if not len(design.of(Lengths)):
        return {}
    length, derivative, by_error = design.once(length_whitening).by_position(
        design.of(Lengths), length_derivative(design, drawn.state)
    )
    shared = np.concatenate([derivative[:, drawn.columns], by_error], axis=1) * drawn.scale
    place = design.readings.position[design.of(Lengths).first[length]]
    rows_by_item = {}
    for k in np.unique(place).tolist():
        chosen, columns = np.flatnonzero(place == k), layout.pose_columns[k]
        rows_by_item[k] = replace(
            _of_shared(drawn, shared[chosen]),
            by_pose=derivative[np.ix_(chosen, columns[columns >= 0])],
        )
    return rows_by_item


def _of_shared(drawn: PoolDesign, shared: Array) -> CandidateRows:
    """Rows (m, s) that no ball takes part in."""
    m = len(shared)
    none = np.zeros((m, 0, drawn.design.dimension))
    return CandidateRows(np.zeros((m, 0), np.int64), none, shared, np.zeros((m, 0)))


def always(drawn: PoolDesign) -> list[CandidateRows]:
    """Rows of information that every selection has: calibrations and priors of the experiment, and
    errors of certificates.
    """
    unit = np.eye(drawn.shared)[drawn.shared - drawn.certificates :]
    return [*_of_observations(drawn, drawn.design.observations), _of_shared(drawn, unit)]


def calibration_rows(
    drawn: PoolDesign, experiment: Experiment, item: Calibration, name: str
) -> list[CandidateRows]:
    """Rows of a calibration item that may be chosen; of a length standard, of its unknown length.

    :raises ExperimentError: it is of a length standard that has a certificate already, or more than
        one length.
    """
    if not item.artefact:
        return _of_observations(drawn, [item.observed(0)])
    artefact = drawn.design.artefacts.names.index(item.artefact)
    if experiment.is_observed(item):
        first = int(drawn.design.balls.of(artefact)[0])
        values, root = item.observed(first), item.root
        if root is not None and isinstance(values, BallObservations):
            values = JointValues.of([(values, root)])
        return _of_observations(drawn, [values])
    named = drawn.design.unknown_lengths.of(artefact)
    if len(named) != 1:
        text = (
            f'"{name}": {item.artefact} has no unknown length that this could determine; remove'
            " one of"
            " its certificates"
        )
        raise refused(experiment.source, text, "pool.calibration")
    stated_value = next(item.certified_values(experiment.layouts[item.artefact]))
    row = np.zeros((1, drawn.shared))
    row[0, drawn.layout.lengths.start - drawn.layout.model.start + named[0]] = 1.0 / max(
        stated_value.standard_uncertainty, EXACT
    )
    return [_of_shared(drawn, row * drawn.scale)]


def _of_observations(
    drawn: PoolDesign, observations: Sequence[Observations]
) -> list[CandidateRows]:
    """Rows of observations that are not formed of readings."""
    candidate_rows = []
    for observation in observations:
        if len(observation) and not isinstance(observation, Lengths):
            rows = observation.rows(drawn.design, drawn.state, None)
            by_shared = np.zeros((len(observation), drawn.shared))
            if rows.by_shared is not None:
                by_shared[:, : len(drawn.columns)] = rows.by_shared[:, drawn.columns]
            is_shared = by_shared.any(axis=1) | rows.by_ball.any(axis=(1, 2))
            candidate_rows.append(
                CandidateRows(
                    observation.balls[is_shared],
                    STEP * rows.by_ball[is_shared],
                    by_shared[is_shared] * drawn.scale,
                    np.zeros((int(is_shared.sum()), 0)),
                    len(observation.fixing()[0]) > 0,
                )
            )
    return candidate_rows
