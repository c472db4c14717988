"""Lengths of length standards that are read in the volume.

They are computed from readings and share their noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array, Flags, Integers
from ballplate.simulator.machines.protocol import ErrorModel

from ..arrays import Design, Observations, Rows
from ..measurement import locations, reading_noise
from ..objects import LengthArrays
from ..parameters import SharedLayout, shared_layout
from ..state import State
from .readings import expected_readings, offset_sensitivity

if TYPE_CHECKING:
    from .joint_lengths import LengthWhitening


@dataclass(frozen=True)
class Lengths(LengthArrays, Observations):
    """Lengths of length standards read in the volume."""

    word: ClassVar[str] = "length"

    def select(self, chosen: Flags | Integers) -> Lengths:
        """The lengths at the given indices."""
        values: dict[str, Any] = {
            name: None if v is None else v[chosen] for name, v in vars(self).items()
        }
        return Lengths(**values)

    def count(self, design: Design) -> int:
        return len(design.once(length_whitening)) if len(self) else 0

    def rows(self, design: Design, state: State, x: Array | None) -> Rows:
        """As many rows as lengths that do not follow from others.

        The length between corrected points, or its projection, is compared with the known one (NPL
        Report CISE 15/98, section 3.2.2).
        """
        if not len(self):
            none = np.zeros((0, len(design.once(shared_layout))))
            return Rows(np.zeros(0), none, np.zeros((0, 0, design.dimension)))
        residual, residuals = _length_residuals(design, state, x)
        by_shared = design.once(length_whitening).whitened(
            _length_derivative(design, design.once(shared_layout), state, residuals)
        )
        return Rows(residual, by_shared, np.zeros((len(residual), 0, design.dimension)))

    def true_values(self, design: Design, truth: State, model: ErrorModel) -> Array:
        return true_lengths(design, truth)

    def errors(self, generator: np.random.Generator, count: int) -> Array:
        """One error for each certificate, wherever it is read."""
        drawn = generator.standard_normal((count, int(self.certificate.max(initial=-1)) + 1))
        return self.uncertainty * drawn[:, self.certificate]

    def weights(self, design: Design, state: State) -> Array:
        # Lengths that scatter have about the weight of a reading besides.
        weights_known = 1.0 / self.uncertainty[self.uncertainty > 0.0]
        return (
            np.append(weights_known, 1.0 / design.machine.repeatability)
            if self.with_repeatability.any()
            else weights_known
        )

    def alike(self, design: Design, state: State) -> Lengths:
        # Each length for itself, with a certificate of its own: correlations by shared readings or
        # certificates change weights, not rank.
        return replace(
            self,
            uncertainty=np.ones(len(self)),
            with_repeatability=np.zeros(len(self), bool),
            certificate=np.arange(len(self)),
        )

    def reread(self, design: Design, place: Integers) -> Lengths:
        second = np.where(self.to_pivot, -1, place[self.second])
        return replace(self, first=place[self.first], second=second)

    def started(self, design: Design, x: Array, state: State) -> State:
        return replace(state, lengths=_measured_lengths(design, state.origins, x))

    def name(self, design: Design, k: int) -> str:
        position = design.readings.position[self.first[k]]
        return f"{length_name(design, k)} in position {design.positions.names[position]}"


def length_whitening(design: Design) -> LengthWhitening:
    """Return the whitening of the lengths of standards."""
    from .joint_lengths import length_whitening_of

    lengths, readings = design.of(Lengths), design.readings
    noise = reading_noise(design, readings)
    standard = design.balls.artefact[readings.ball[lengths.first]]
    place = (
        readings.position[lengths.first] * len(design.probes.names) + readings.probe[lengths.first]
    )
    return length_whitening_of(lengths, noise, standard, place)


def length_name(design: Design, length: int, of_reading: bool = True) -> str:
    """Return the name of a length by its ends, or a gauge's radius, of one reading or of the
    certificate.
    """
    lengths, readings = design.of(Lengths), design.readings
    ball = int(readings.ball[lengths.first[length]])
    artefact = design.artefacts.names[design.balls.artefact[ball]]
    if lengths.second[length] < 0:
        return f"radius of {artefact}" + (
            f" to ball {design.balls.names[ball]}" if of_reading else ""
        )
    second_ball = readings.ball[lengths.second[length]]
    return f"length {design.balls.names[ball]}-{design.balls.names[second_ball]} of {artefact}"


def length_derivative(design: Design, state: State) -> Array:
    """Derivative (m, s) of lengths less those expected by all shared parameters, in metres."""
    layout = design.once(shared_layout)
    return _length_derivative(design, layout, state, _measured(design, state, None))


def _length_derivative(
    design: Design, layout: SharedLayout, state: State, measured: _Measured
) -> Array:
    lengths = design.of(Lengths)
    # What is held goes to the extra column.
    rows = np.zeros((len(lengths), len(layout) + 1))
    # A length changes with the corrected points at its ends, along its direction: a turn of the
    # direction is of second order.
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
    pivoted = np.flatnonzero(lengths.to_pivot)
    columns = layout.pose_columns[
        design.readings.position[lengths.first[pivoted]], : design.dimension
    ]
    np.add.at(rows, (pivoted[:, None], columns), -measured.unit[pivoted])
    if lengths.free is not None:
        free = np.flatnonzero(lengths.free >= 0)
        rows[free, layout.lengths.start + lengths.free[free]] -= 1.0
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


def _measured(design: Design, state: State, x: Array | None) -> _Measured:
    lengths = design.of(Lengths)
    difference = np.zeros((len(lengths), design.dimension))
    pivoted = np.flatnonzero(lengths.to_pivot)
    pivot = state.origins[design.readings.position[lengths.first[pivoted]]]
    ends = []
    for sign, chosen, rows in (
        (1.0, lengths.first, np.arange(len(lengths))),
        (-1.0, lengths.second, np.flatnonzero(~lengths.to_pivot)),
    ):
        readings = design.readings.select(chosen[rows])
        p = state.probes[readings.probe]
        if x is not None:
            points = x[chosen[rows]]
        else:
            points = expected_readings(design, state, readings)
            if sign > 0:
                # Where the ball of a gauge was, which need not be where it was to be.
                reach = length_values(design, state)[pivoted, None] * lengths.direction[pivoted]
                points[pivoted] = pivot + reach - p[pivoted]
        difference[rows] += sign * (
            # In planning the machine has no errors, and the offset is all of the correction.
            points + (p if x is None else design.model.error(points, state.a, p))
        )
        ends.append(_End(sign, rows, points, p, readings.probe))
    difference[pivoted] -= pivot
    # Directions at the state, as derivatives need them. Weights use nominal ones, and stay constant
    # during an iteration.
    unit = difference / np.sqrt((difference**2).sum(axis=1))[:, None]
    unit = np.where(lengths.projected[:, None], lengths.direction, unit)
    length = np.einsum("md,md->m", unit, difference)
    return _Measured(length, unit, (ends[0], ends[1]))


def _length_residuals(design: Design, state: State, x: Array | None) -> tuple[Array, _Measured]:
    """Whitened residuals (r,) of lengths, and what these are formed of."""
    residuals = _measured(design, state, x)
    off = residuals.length - length_values(design, state)
    return design.once(length_whitening).whitened(off), residuals


def length_deviations(design: Design, state: State, x: Array | None) -> tuple[Array, Array]:
    """Return measured less expected lengths (m,), and the uncertainty of each separately, in
    metres.

    Without scale readings x the machine is assumed to read without error.
    """
    if not len(design.of(Lengths)):
        return np.zeros(0), np.ones(0)
    measured = _measured(design, state, x)
    scatter = design.once(length_whitening).scatter
    return measured.length - length_values(design, state), np.hypot(
        scatter, design.of(Lengths).uncertainty
    )


def length_directions(design: Design, state: State, x: Array | None) -> Array:
    """Directions (m, d) from the second end of lengths to the first."""
    if not len(design.of(Lengths)):
        return np.zeros((0, design.dimension))
    return _measured(design, state, x).unit


def length_values(design: Design, state: State) -> Array:
    """Values (m,) at `state` that lengths of standards are compared with: those certified, or the
    unknown ones.
    """
    lengths = design.of(Lengths)
    if lengths.free is None or not len(design.unknown_lengths.names):
        return lengths.value
    return np.where(lengths.free >= 0, state.lengths[lengths.free], lengths.value)


def true_lengths(design: Design, truth: State) -> Array:
    """Lengths (m,) of the design's standards as they truly are; the same wherever one certificate's
    is read.
    """
    lengths = design.of(Lengths)
    if not len(lengths):
        return lengths.value
    there = locations(design, truth, design.readings)
    pivot = truth.origins[design.readings.position[lengths.first]]
    between = there[lengths.first] - np.where(
        lengths.to_pivot[:, None], pivot, there[np.maximum(lengths.second, 0)]
    )
    along = np.abs(np.einsum("md,md->m", lengths.direction, between))
    length = np.where(lengths.projected, along, np.sqrt((between**2).sum(axis=1)))
    _, first = np.unique(lengths.certificate, return_index=True)
    return length[first][lengths.certificate]


def _measured_lengths(design: Design, origins: Array, x: Array) -> Array:
    """Return unknown lengths as the mean of the readings, nominal without readings."""
    lengths = design.of(Lengths)
    if lengths.free is None or not len(design.unknown_lengths.names):
        return design.unknown_lengths.drawn
    places_seen = x + design.probes.offsets[design.readings.probe]
    second_place = np.where(
        lengths.to_pivot[:, None],
        origins[design.readings.position[lengths.first]],
        places_seen[np.maximum(lengths.second, 0)],
    )
    length = np.sqrt(((places_seen[lengths.first] - second_place) ** 2).sum(axis=1))
    lengths_measured = design.unknown_lengths.drawn.copy()
    for number in np.unique(lengths.free[lengths.free >= 0]):
        lengths_measured[number] = length[lengths.free == number].mean()
    return lengths_measured
