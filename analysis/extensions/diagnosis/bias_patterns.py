"""Possible errors of observations, single ones and events, each as a pattern over all rows.

A pattern is the change of the whitened residuals by one unit of the bias. Single observations come
first, in the order of their rows, then events.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from ballplate.extensions.influences import Drift, even_clock
from ballplate.simulator.design import (
    Design,
    Lengths,
    State,
    expected_readings,
    length_directions,
    length_values,
    length_whitening,
    locations,
    offset_sensitivity,
    reading_weights,
    rotation_sensitivity,
)
from ballplate.simulator.machines import Array, Integers, Unit

from .hat import row_count, row_places

if TYPE_CHECKING:
    from ballplate.simulator.design import Whitening
    from scipy.sparse import csc_array

# Ends have no axis along which a reading changes lengths by less than this share of the largest
# change, or in proportion to another axis to within the square of this.
SLIGHT = 1e-3
UNITS: dict[str, Literal["m", "rad", "1"]] = {
    "turn": "rad",
    "scale": "1",
    "expansion": "1",
    "scale drift": "1",
}

# Kinds that `fit` searches as smooth errors instead.
DRIFTS: tuple[str, ...] = ("drift", "scale drift")

# Least number of readings of the position before and after a slip; largest number of its starts.
LEAST_PART, MOST_STARTS = 3, 60


@dataclass(frozen=True)
class BiasPatterns:
    """Patterns of one kind: entries `value` at `row` and `column` (each (e,)), `count` columns.

    `subject` (count,) is a reading, length, prior, co-ordinate, distance, position, probe or
    artefact; of a certified length, its first reading, and of a ball, its first reading in that
    position, or from that position on. An `end` is a reading of a standard whose lengths are read
    together, so that its error changes several of them. `axis` (count,) is the direction or axis of
    rotation, -1 without one, the plate's own axis of a moved ball; `start` (count,) the first
    reading after a slip, -1 without one.
    """

    kind: str
    row: Integers
    column: Integers
    value: Array
    subject: Integers
    axis: Integers
    start: Integers

    @property
    def count(self) -> int:
        return len(self.subject)


@dataclass(frozen=True)
class Patterns:
    """Patterns as columns of `matrix` (rows, k); `kind`, `subject`, `axis`, `start` (k,) as in
    `BiasPatterns`.
    """

    design: Design
    matrix: csc_array
    kind: np.ndarray
    subject: Integers
    axis: Integers
    start: Integers

    def __len__(self) -> int:
        return len(self.subject)

    @cached_property
    def is_local(self) -> np.ndarray:
        """Mask (k,) of patterns whose rows are together: of one ball at most, or of one kind."""
        wide = [
            observation.word for observation in self.design.observations if observation.is_joint
        ]
        local = [*single_kinds(self.design), "ball", "moved", "length value"]
        return np.isin(self.kind, local) & ~np.isin(self.kind, wide)

    def of_kind(self, *kinds: str) -> Integers:
        """Return indices of the patterns of some kinds."""
        return np.flatnonzero(np.isin(self.kind, kinds))

    def unit(self, k: int) -> Unit:
        """Return the unit of the bias."""
        kind: str = self.kind[k]
        for observation in self.design.observations:
            if observation.word == kind:
                return observation.unit(self.design, int(self.subject[k]))
        return UNITS.get(kind, "m")


def patterns(design: Design, state: State, x: Array | None, every_start: bool = False) -> Patterns:
    """Return all patterns of a design at `state`, with scale readings `x` (readings, d) or
    error-free ones.

    Slips are half-way and between probes, or with `every_start` at every reading, up to
    `MOST_STARTS` of a position.
    """
    from scipy.sparse import coo_array

    linearised = LinearisedDesign(design, state, x, every_start)
    blocks = [block for build in BUILDERS for block in build(linearised)]
    start = np.cumsum([0, *(block.count for block in blocks)])
    column = np.concatenate(
        [block.column + first for block, first in zip(blocks, start, strict=False)]
    )
    row = np.concatenate([block.row for block in blocks])
    value = np.concatenate([block.value for block in blocks])
    matrix = coo_array((value, (row, column)), shape=(row_count(design), int(start[-1]))).tocsc()
    kind = np.repeat(np.array([block.kind for block in blocks]), [block.count for block in blocks])
    fields = ("subject", "axis", "start")
    joined = (np.concatenate([getattr(block, name) for block in blocks]) for name in fields)
    return Patterns(design, matrix, kind, *joined)


def single_kinds(design: Design) -> list[str]:
    """Return the kinds of patterns of single observations."""
    return ["reading", "end", *(observation.word for observation in design.observations)]


class LinearisedDesign:
    """A design where it is linearised, with data for several kinds of patterns."""

    def __init__(
        self, design: Design, state: State, x: Array | None, every_start: bool = False
    ) -> None:
        self.design, self.state, self.every_start = design, state, every_start
        self.places = row_places(design)
        self.chosen = design.plate_readings
        self.readings = design.readings.select(self.chosen)
        self.weight = reading_weights(design, self.readings)
        self.x = expected_readings(design, state, design.readings) if x is None else x
        self.unit, self.white = length_directions(design, state, x), design.once(length_whitening)
        self.arm = locations(design, state, self.readings) - state.origins[self.readings.position]
        self.has_plate = design.plate_positions

    def reading_entries(
        self, rows: Integers, by_axis: Array, group: Integers | None = None
    ) -> tuple[Integers, Integers, Array]:
        """Return entries of a displacement `by_axis` (m, d, k) of the plate readings `rows` (m,),
        in k columns.

        With `group` (m,) each group has k columns of its own.
        """
        m, d, k = by_axis.shape
        value = self.weight[rows][:, :, None] * by_axis
        row = d * rows[:, None, None] + np.arange(d)[:, None] + np.zeros(k, np.int64)
        number = np.zeros(m, np.int64) if group is None else group
        column = np.broadcast_to(k * number[:, None, None] + np.arange(k), value.shape)
        used = value != 0.0
        return row[used], column[used], value[used]

    def along_lengths(self, displacement: Array) -> Array:
        """Return changes (lengths, k) of lengths by displacements (readings, d, k) of all
        readings.
        """
        lengths = self.design.of(Lengths)
        at_second = displacement[np.maximum(lengths.second, 0)]
        apart = displacement[lengths.first] - np.where(
            lengths.to_pivot[:, None, None], 0.0, at_second
        )
        return np.einsum("md,mdk->mk", self.unit, apart)

    def length_entries(self, columns: Array) -> tuple[Integers, Integers, Array]:
        """Return entries of changes (lengths, k) of measured minus known lengths."""
        white = self.white.whitened(columns)
        row, column = np.nonzero(white)
        return self.places["length"].start + row, column, white[row, column]

    def biases(self, displacement: Array) -> Array:
        """Return biases (rows, k) of all observations by displacements (readings, d, k) of all
        readings.
        """
        biases = np.zeros((row_count(self.design), displacement.shape[2]))
        white = self.weight[:, :, None] * displacement[self.chosen]
        biases[self.places["reading"]] = white.reshape(self.weight.size, displacement.shape[2])
        biases[self.places["length"]] = self.white.whitened(self.along_lengths(displacement))
        return biases


def _block(
    kind: str,
    entries: tuple[Integers, Integers, Array],
    subject: Any,
    axis: Any = -1,
    start: Any = -1,
) -> BiasPatterns:
    subject = np.atleast_1d(np.asarray(subject, np.int64))
    axis = np.broadcast_to(np.asarray(axis, np.int64), subject.shape)
    return BiasPatterns(
        kind, *entries, subject, axis, np.broadcast_to(np.asarray(start, np.int64), subject.shape)
    )


def _joined(*parts: tuple[Integers, Integers, Array]) -> tuple[Integers, Integers, Array]:
    row, column, value = (np.concatenate(part_arrays) for part_arrays in zip(*parts, strict=True))
    return row, column, value


def _single_readings(linearised: LinearisedDesign) -> Iterator[BiasPatterns]:
    row, axis = np.nonzero(linearised.weight)
    entries = (
        linearised.weight.shape[1] * row + axis,
        np.arange(len(row)),
        linearised.weight[row, axis],
    )
    yield _block("reading", entries, linearised.chosen[row], axis)


def _single_lengths(linearised: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Lengths that share no reading with others."""
    alone, white = linearised.white.alone, linearised.white.single
    row, column = _pairs_within(white, white.group)
    uncertainty, along = white.own[column], white.direction
    value = ((row == column) - along[row] * along[column]) / uncertainty
    yield _block("length", (linearised.places["length"].start + row, column, value), alone)


def _ends(linearised: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Readings of standards whose lengths are read together, along axes with different effects."""
    lengths = linearised.design.of(Lengths)
    joint = np.setdiff1d(np.arange(len(lengths)), linearised.white.alone)
    for reading in np.unique([lengths.first[joint], lengths.second[joint]]):
        sign = (lengths.first == reading).astype(float) - (lengths.second == reading)
        axes = _distinct_columns(sign[:, None] * lengths.direction)
        yield _block(
            "end",
            linearised.length_entries(sign[:, None] * linearised.unit[:, axes]),
            [reading] * len(axes),
            axes,
        )


def _distinct_columns(columns: Array) -> list[int]:
    """Return indices of columns that are neither slight nor multiples of a larger one."""
    size = np.linalg.norm(columns, axis=0)
    chosen: list[int] = []
    for k in np.argsort(-(size / size.max()).round(6), kind="stable").tolist():
        cosine = np.abs(columns[:, chosen].T @ columns[:, k]) / (
            size[chosen] * max(size[k], np.finfo(float).tiny)
        )
        if size[k] > SLIGHT * size.max() and not (cosine > 1.0 - SLIGHT**2).any():
            chosen.append(k)
    return sorted(chosen)


def _pairs_within(white: Whitening, group: Integers) -> tuple[Integers, Integers]:
    """Return all pairs of rows that whitening mixes, including each row with itself."""
    every = np.arange(len(group))
    if not white.direction.any():
        return every, every
    pairs = []
    for certificate in np.unique(group):
        members = np.flatnonzero(group == certificate)
        pairs.append(np.stack(np.meshgrid(members, members, indexing="ij")).reshape(2, -1))
    row, column = np.concatenate(pairs, axis=1)
    return row, column


def _single_items(linearised: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Certified values and priors."""
    # Information on the machine first, then on artefacts. A value stated too large makes residuals
    # smaller.
    for observation in reversed(linearised.design.observations):
        if isinstance(observation, Lengths):
            continue
        # A constraint leaves no residual.
        chosen = np.flatnonzero(~observation.is_exact)
        first, every = linearised.places[observation.word].start, np.arange(len(chosen))
        entries = (first + chosen, every, -1.0 / observation.uncertainty[chosen])
        if observation.is_joint:
            white = -observation.whitened(np.eye(len(observation))[:, chosen])
            row, column = np.nonzero(white)
            entries = (first + row, column, white[row, column])
        yield _block(observation.word, entries, chosen, observation.along[chosen])


def _dirty_balls(linearised: LinearisedDesign) -> Iterator[BiasPatterns]:
    """A ball that is read several times in a position, displaced there."""
    d = linearised.design.dimension
    key = (
        linearised.readings.ball * len(linearised.design.positions.names)
        + linearised.readings.position
    )
    _, first, group, count = np.unique(
        key, return_index=True, return_inverse=True, return_counts=True
    )
    # Of a ball read once, this would be the pattern of its reading.
    number = np.where(count > 1, np.cumsum(count > 1) - 1, -1)
    rows = np.flatnonzero(number[group] >= 0)
    row = d * rows[:, None] + np.arange(d)
    column = d * number[group[rows]][:, None] + np.arange(d)
    subject = np.repeat(linearised.chosen[first[count > 1]], d)
    axis = np.tile(np.arange(d), int((count > 1).sum()))
    yield _block(
        "ball", (row.ravel(), column.ravel(), linearised.weight[rows].ravel()), subject, axis
    )


def _moved_balls(linearised: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Balls displaced on their plate, along its axes, from one position on."""
    d, readings = linearised.design.dimension, linearised.readings
    rank = position_order(linearised.design)[readings.position]
    order = np.lexsort((np.arange(len(rank)), rank, readings.ball))
    ball, rank = readings.ball[order], rank[order]
    same_ball = np.diff(ball) == 0
    starts = 1 + np.flatnonzero(same_ball & (np.diff(rank) > 0))
    end = np.searchsorted(ball, ball[starts], side="right")
    group, rows = _runs(starts, end)
    rows = order[rows]
    turn = linearised.state.rotations[readings.position[rows]]
    first = np.repeat(linearised.chosen[order[starts]], d)
    yield _block(
        "moved",
        linearised.reading_entries(rows, turn, group),
        first,
        np.tile(np.arange(d), len(starts)),
    )


def _runs(start: Integers, end: Integers) -> tuple[Integers, Integers]:
    """Return the indices in several ranges (g,), one range after the other, with the number of the
    range.

    >>> _runs(np.array([3, 7]), np.array([5, 8]))
    (array([0, 0, 1]), array([3, 4, 7]))
    """
    length = end - start
    group = np.repeat(np.arange(len(start)), length)
    return group, np.arange(len(group)) - np.repeat(np.cumsum(length) - length - start, length)


def position_order(design: Design) -> Integers:
    """Return the rank (positions,) of each position in the order of the readings."""
    order = np.full(len(design.positions.names), len(design.positions.names))
    read_positions, first = np.unique(design.readings.position, return_index=True)
    order[read_positions[np.argsort(first)]] = np.arange(len(read_positions))
    return order


def _slip_starts(linearised: LinearisedDesign, rows: Integers) -> Integers:
    """Return indices in a position's `rows` before which a slip may come."""
    if linearised.every_start:
        count = len(rows) - 2 * LEAST_PART + 1
        if count < 1:
            return np.zeros(0, np.int64)
        return np.unique(
            np.linspace(LEAST_PART, len(rows) - LEAST_PART, min(count, MOST_STARTS)).astype(
                np.int64
            )
        )
    probe = linearised.readings.probe[rows]
    changes = np.flatnonzero(np.diff(probe)) + 1
    # Between probes, if the readings of each are together.
    between = changes if len(changes) == len(np.unique(probe)) - 1 else changes[:0]
    return np.unique(np.append(between, len(rows) // 2))


def _slips(linearised: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Plates that slipped within a position."""
    d = linearised.design.dimension
    for k in linearised.has_plate:
        rows = np.flatnonzero(linearised.readings.position == k)
        starts = _slip_starts(linearised, rows)
        starts = starts[(starts > 0) & (starts < len(rows))]
        if not len(starts):
            continue
        group, late = _runs(starts, np.full(len(starts), len(rows)))
        moved = rows[late]
        first = linearised.chosen[rows[starts]]
        shifts = np.broadcast_to(np.eye(d), (len(moved), d, d))
        axes = np.tile(np.arange(d), len(starts))
        entries = linearised.reading_entries(moved, shifts, group)
        yield _block("shift", entries, [k] * len(axes), axes, np.repeat(first, d))
        turns = rotation_sensitivity(linearised.arm[moved] - linearised.arm[rows].mean(axis=0))
        about = np.tile(np.arange(3) if d == 3 else np.array([2]), len(starts))
        entries = linearised.reading_entries(moved, turns, group)
        yield _block("turn", entries, [k] * len(about), about, np.repeat(first, turns.shape[2]))


def _probes(linearised: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Probes with offsets stated too large."""
    design, state = linearised.design, linearised.state
    d, offsets = design.dimension, state.probes[design.readings.probe]
    all_rates = offset_sensitivity(design.model, linearised.x, state.a, offsets)
    probes = np.unique(design.readings.probe)
    # A task may use a probe without readings, of which a fit has no residual.
    if not linearised.every_start:
        probes = np.union1d(probes, design.tasks.probes)
    for probe in probes:
        # Of an estimated offset only the prior can be in error.
        fixed = np.ones(d, bool) if not design.probes.free.any() else ~design.probes.free[probe]
        if not fixed.any():
            continue
        rate = np.where((design.readings.probe == probe)[:, None, None], all_rates, 0.0)[
            :, :, fixed
        ]
        rows = np.flatnonzero(linearised.readings.probe == probe)
        of_lengths = linearised.length_entries(linearised.along_lengths(rate))
        entries = _joined(
            linearised.reading_entries(rows, rate[linearised.chosen[rows]]), of_lengths
        )
        yield _block("probe", entries, [probe] * int(fixed.sum()), np.flatnonzero(fixed))


def _length_values(linearised: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Certified lengths stated too long that are read several times, or together with others."""
    lengths = linearised.design.of(Lengths)
    is_known = lengths.is_known
    numbers, first, count = np.unique(
        lengths.certificate[is_known], return_index=True, return_counts=True
    )
    is_alone = np.isin(np.flatnonzero(is_known)[first], linearised.white.alone)
    for number in numbers[(count > 1) | ~is_alone]:
        entries = linearised.length_entries(-1.0 * (lengths.certificate == number)[:, None])
        yield _block("length value", entries, int(np.flatnonzero(lengths.certificate == number)[0]))


def _scales(linearised: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Certificates of an artefact with all values too long by one ratio."""
    design = linearised.design
    lengths = design.of(Lengths)
    of_length = design.balls.artefact[design.readings.ball[lengths.first]]
    scaled = [
        observation
        for observation in design.observations
        if observation.scales and len(observation)
    ]
    for artefact in range(len(design.artefacts.names)):
        rows_of_artefact = [
            np.flatnonzero(design.balls.artefact[scale_observation.balls[:, 0]] == artefact)
            for scale_observation in scaled
        ]
        of_lengths = lengths.is_known & (of_length == artefact)
        if sum(map(len, rows_of_artefact)) + len(np.unique(lengths.certificate[of_lengths])) < 2:
            continue
        parts = []
        for observation, rows in zip(scaled, rows_of_artefact, strict=True):
            bias = np.zeros(len(observation))
            bias[rows] = observation.scaled()[rows]
            white = -observation.whitened(bias)
            row = np.flatnonzero(white)
            parts.append(
                (linearised.places[observation.word].start + row, np.zeros_like(row), white[row])
            )
        columns = -np.where(of_lengths, lengths.value, 0.0)[:, None]
        yield _block("scale", _joined(*parts, linearised.length_entries(columns)), artefact)


def _expansions(linearised: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Artefacts that are larger in one position."""
    design = linearised.design
    values = length_values(design, linearised.state)
    of_lengths = design.readings.position[design.of(Lengths).first]
    for k in range(len(design.positions.names)):
        rows = np.flatnonzero(linearised.readings.position == k)
        if not len(rows) and not (of_lengths == k).any():
            continue
        away = (
            linearised.arm[rows] - linearised.arm[rows].mean(axis=0)
            if len(rows)
            else linearised.arm[rows]
        )
        columns = np.where(of_lengths == k, values, 0.0)[:, None]
        yield _block(
            "expansion",
            _joined(
                linearised.reading_entries(rows, away[:, :, None]),
                linearised.length_entries(columns),
            ),
            k,
        )


def _drifts(linearised: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Drifts from the first reading to the last, of the reference point and of the scales."""
    if linearised.every_start:
        return
    design, readings, d = linearised.design, linearised.design.readings, linearised.design.dimension
    # By the stated clock, or in order.
    clocks = [influence.clock for influence in design.influences if isinstance(influence, Drift)]
    clock = clocks[0] if clocks else even_clock(len(design.positions.names))
    time = clock.hours(readings)[:, None]
    if not np.ptp(time) > 0.0:
        return
    time /= np.ptp(time)
    for kind, displacement, axes in (
        ("drift", time[:, :, None] * np.eye(d), np.arange(d)),
        ("scale drift", (time * linearised.x)[:, :, None], np.array([-1])),
    ):
        rows = np.arange(len(linearised.chosen))
        entries = linearised.reading_entries(rows, displacement[linearised.chosen])
        of_lengths = linearised.length_entries(linearised.along_lengths(displacement))
        yield _block(kind, _joined(entries, of_lengths), np.zeros(len(axes), np.int64), axes)


BUILDERS: tuple[Callable[[LinearisedDesign], Iterator[BiasPatterns]], ...] = (
    _single_readings,
    _single_lengths,
    _single_items,
    _ends,
    _dirty_balls,
    _moved_balls,
    _slips,
    _probes,
    _length_values,
    _scales,
    _expansions,
    _drifts,
)
