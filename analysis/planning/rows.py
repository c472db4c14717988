"""Whitened rows that candidates contribute to what all positions share: balls, machine errors,
offsets, lengths.

The pose of a position belongs to it alone. Its columns are projected out of the position's rows, so
that what is left concerns shared parameters only, and the information of several positions is the
sum of theirs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.design.arrays import Design, State, nominal_state
from ballplate.simulator.design.layout import lay_out
from ballplate.simulator.estimation.observations import (
    coordinate_rows,
    distance_rows,
    length_derivative,
    prior_rows,
    reading_blocks,
)
from ballplate.simulator.estimation.parameters import SharedLayout, shared_layout
from ballplate.simulator.experiment.model import (
    Calibration,
    CoordinateCalibration,
    Experiment,
    Position,
    RadiusCalibration,
)
from ballplate.simulator.inputs.messages import ExperimentError, Message
from ballplate.simulator.machines.protocol import Array, Integers

# A micrometre: columns are scaled so that a unit step moves some point by up to this.
STEP = 1e-6

# Readings whose rows are formed at once.
AT_ONCE = 10_000


@dataclass(frozen=True)
class Rows:
    """Whitened rows of one candidate, columns in micrometres.

    `by_ball` (m, d) is the derivative by the ball `ball` (m,), -1 where there is none, and its
    negative that by the ball `other` (m,) of a distance; `by_shared` (m, s) that by shared
    parameters; `by_pose` (m, q) that by the pose.
    """

    ball: Integers
    other: Integers
    by_ball: Array
    by_shared: Array
    by_pose: Array


@dataclass(frozen=True)
class PoolDesign:
    """All positions that may be chosen, laid out as one design, and the columns of shared
    parameters.

    Shared columns are those of the layout less poses, then the error of each certificate of a
    length, in its standard uncertainty.
    """

    design: Design
    layout: SharedLayout
    state: State

    @property
    def own(self) -> slice:
        """Columns of the layout that positions share."""
        return slice(self.layout.model.start, len(self.layout))

    @property
    def certificates(self) -> int:
        return int(self.design.lengths.certificate.max(initial=-1)) + 1

    @property
    def shared(self) -> int:
        """Number of shared columns."""
        return self.own.stop - self.own.start + self.certificates

    @property
    def scale(self) -> Array:
        """Size of a unit step of each shared column (shared,)."""
        return np.concatenate([self.layout.scale[self.own] * STEP, np.ones(self.certificates)])


def draw(experiment: Experiment, positions: Sequence[Position]) -> PoolDesign:
    """Lay out an experiment with all `positions` that may be chosen, in their order.

    :raises ExperimentError: a prior is about a pose; what it means depends on the position that
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
    design = lay_out(replace(experiment, positions=tuple(positions)))
    return PoolDesign(design, shared_layout(design), nominal_state(design))


def position_rows(drawn: PoolDesign) -> Iterator[Rows]:
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
            columns = drawn.layout.offset_columns[readings.probe] - drawn.own.start
            for axis in range(d):
                free = np.flatnonzero(columns[:, axis] >= 0)
                by_shared[free, :, columns[free, axis]] = blocks.by_offset[free, :, axis]
        by_shared *= drawn.scale
        for k in range(first, last):
            if k in lengths:
                yield lengths[k]
                continue
            own = slice(end[k] - count[k] - start, end[k] - start)
            ball = np.repeat(readings.ball[own], d)
            yield Rows(
                ball,
                np.full(len(ball), -1),
                STEP * blocks.by_ball[own].reshape(len(ball), d),
                by_shared[own].reshape(len(ball), drawn.shared),
                blocks.by_pose[own].reshape(len(ball), blocks.by_pose.shape[2]),
            )
        first = last


def _length_rows(drawn: PoolDesign) -> dict[int, Rows]:
    """Rows of the lengths of standards and gauges, by position."""
    design, layout = drawn.design, drawn.layout
    if not len(design.lengths):
        return {}
    by_position = design.length_whitening.by_position(
        design.lengths, length_derivative(design, layout, drawn.state, None)
    )
    derivative = by_position.rows
    shared = np.concatenate([derivative[:, drawn.own], by_position.by_error], axis=1) * drawn.scale
    place = design.readings.position[design.lengths.first[by_position.length]]
    found = {}
    for k in np.unique(place).tolist():
        chosen, columns = np.flatnonzero(place == k), layout.pose_columns[k]
        found[k] = replace(
            _of_shared(drawn, shared[chosen]),
            by_pose=derivative[np.ix_(chosen, columns[columns >= 0])],
        )
    return found


def _of_shared(drawn: PoolDesign, shared: Array) -> Rows:
    """Rows (m, s) that no ball takes part in."""
    none = np.full(len(shared), -1)
    return Rows(
        none,
        none,
        np.zeros((len(shared), drawn.design.dimension)),
        shared,
        np.zeros((len(shared), 0)),
    )


def always(drawn: PoolDesign) -> list[Rows]:
    """Rows of what is known in any case: calibrations and priors of the experiment, and errors of
    certificates.
    """
    unit = np.eye(drawn.shared)[drawn.shared - drawn.certificates :]
    found = [*_of_calibration(drawn, drawn.design), _of_shared(drawn, unit)]
    if len(drawn.design.priors):
        _, derivative = prior_rows(drawn.design, drawn.layout, drawn.state)
        own = derivative[:, drawn.own]
        shared = np.zeros((len(own), drawn.shared))
        shared[:, : own.shape[1]] = own
        found.append(_of_shared(drawn, shared * drawn.scale))
    return found


def calibration_rows(
    drawn: PoolDesign, experiment: Experiment, item: Calibration, name: str
) -> list[Rows]:
    """Rows of a calibration item that may be chosen; of a length standard, of its unknown length.

    `experiment` has some position, whichever.

    :raises ExperimentError: it is of a length standard that has a certificate already, or more than
        one length.
    """
    if experiment.artefacts[item.artefact].role == "plate" and not isinstance(
        item, RadiusCalibration
    ):
        return _of_calibration(drawn, lay_out(replace(experiment, calibration=(item,), priors=())))
    named = drawn.design.unknown_lengths.of(drawn.design.artefacts.names.index(item.artefact))
    if len(named) != 1 or isinstance(item, CoordinateCalibration):
        text = (
            f'"{name}": {item.artefact} has no unknown length that this could tell; remove one of'
            " its certificates"
        )
        raise ExperimentError([Message(str(experiment.source), 0, 0, "pool.calibration", text)])
    if isinstance(item, RadiusCalibration):
        uncertainty = item.standard_uncertainty
    else:
        uncertainty = float(item.standard_uncertainties[0])
    row = np.zeros((1, drawn.shared))
    row[0, drawn.layout.lengths.start - drawn.own.start + named[0]] = 1.0 / uncertainty
    return [_of_shared(drawn, row * drawn.scale)]


def _of_calibration(drawn: PoolDesign, design: Design) -> list[Rows]:
    """Rows of calibrated distances and co-ordinates of a design with the same balls."""
    given, distances = distance_rows(design, drawn.state), design.distances
    coordinates = coordinate_rows(design, drawn.state)

    def rows(ball: Integers, other: Integers, derivative: Array) -> Rows:
        m = len(ball)
        return Rows(ball, other, STEP * derivative, np.zeros((m, drawn.shared)), np.zeros((m, 0)))

    return [
        rows(distances.first, distances.second, given.derivative),
        rows(design.coordinates.ball, np.full(len(design.coordinates), -1), coordinates.derivative),
    ]
