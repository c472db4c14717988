"""Possible errors of observations, single ones and events, each as a pattern over all rows.

A pattern is what one unit of the bias changes in the whitened residuals. Single observations come
first, in the order of their rows; the events after them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from ballplate.simulator.design import (
    Design,
    Drift,
    Lengths,
    State,
    even_clock,
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

# Axes along which a reading changes lengths by less than this share of the most are left out, and
# so are those that change all of them in a proportion equal to within the square of this.
SLIGHT = 1e-3
UNITS: dict[str, Literal["m", "rad", "1"]] = {
    "turn": "rad",
    "scale": "1",
    "expansion": "1",
    "scale drift": "1",
}

# Kinds that `fit` looks for among smooth errors, and not as these patterns.
DRIFTS: tuple[str, ...] = ("drift", "scale drift")

# A slip leaves at least so many readings of the position on either side, and is looked for before
# at most so many.
LEAST_PART, MOST_STARTS = 3, 60


@dataclass(frozen=True)
class BiasPatterns:
    """Patterns of one kind: entries `value` at `row` and `column` (each (e,)), `count` columns.

    `subject` (count,) is what is wrong: a reading, length, prior, co-ordinate, distance, position,
    probe or artefact; of a certified length, the first that has it, and of a ball, its first
    reading in that position, or from that position on. An `end` is a reading of a standard whose
    lengths are read together, with which several of them are wrong. `axis` (count,) is along or
    about which, -1 without one, the plate's own axis of a ball that moved; `start` (count,) the
    first reading after a slip, -1 without one.
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
    """Patterns as columns of `matrix` (rows, k), with `kind`, `subject`, `axis` and `start` (k,) as
    in `BiasPatterns`.
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
        """Which patterns (k,) are of rows that come together: of one ball at the most, or one
        kind.
        """
        wide = [one.word for one in self.design.observations if one.is_joint]
        local = [*single_kinds(self.design), "ball", "moved", "length value"]
        return np.isin(self.kind, local) & ~np.isin(self.kind, wide)

    def of_kind(self, *kinds: str) -> Integers:
        """Indices of the patterns of some kinds."""
        return np.flatnonzero(np.isin(self.kind, kinds))

    def unit(self, k: int) -> Unit:
        """Unit of the bias."""
        kind: str = self.kind[k]
        for one in self.design.observations:
            if one.word == kind:
                return one.unit(self.design, int(self.subject[k]))
        return UNITS.get(kind, "m")


def patterns(design: Design, state: State, x: Array | None, every_start: bool = False) -> Patterns:
    """All patterns of a design at `state`, with scale readings `x` (readings, d) or error-free
    ones.

    Slips are half-way and between probes, or with `every_start` at every reading, up to
    `MOST_STARTS` of a position.
    """
    from scipy.sparse import coo_array

    at = LinearisedDesign(design, state, x, every_start)
    blocks = [block for build in BUILDERS for block in build(at)]
    start = np.cumsum([0, *(block.count for block in blocks)])
    column = np.concatenate(
        [block.column + first for block, first in zip(blocks, start, strict=False)]
    )
    row = np.concatenate([block.row for block in blocks])
    value = np.concatenate([block.value for block in blocks])
    matrix = coo_array((value, (row, column)), shape=(row_count(design), int(start[-1]))).tocsc()
    kind = np.repeat(np.array([block.kind for block in blocks]), [block.count for block in blocks])
    return Patterns(
        design,
        matrix,
        kind,
        np.concatenate([block.subject for block in blocks]),
        np.concatenate([block.axis for block in blocks]),
        np.concatenate([block.start for block in blocks]),
    )


def single_kinds(design: Design) -> list[str]:
    """Kinds of patterns of single observations."""
    return ["reading", "end", *(one.word for one in design.observations)]


class LinearisedDesign:
    """A design where it is linearised, with what several kinds of patterns need."""

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
        turned = locations(design, state, self.readings) - state.origins[self.readings.position]
        self.arm = turned
        self.has_plate = design.plate_positions

    def of_readings(
        self, rows: Integers, by_axis: Array, group: Integers | None = None
    ) -> tuple[Integers, Integers, Array]:
        """Entries of a displacement `by_axis` (m, d, k) of the plate readings `rows` (m,), in k
        columns.

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
        """Changes (lengths, k) of lengths by displacements (readings, d, k) of all readings."""
        given = self.design.of(Lengths)
        other = displacement[np.maximum(given.second, 0)]
        apart = displacement[given.first] - np.where(given.to_pivot[:, None, None], 0.0, other)
        return np.einsum("md,mdk->mk", self.unit, apart)

    def of_lengths(self, columns: Array) -> tuple[Integers, Integers, Array]:
        """Entries of changes (lengths, k) of measured less known lengths."""
        white = self.white.whitened(columns)
        row, column = np.nonzero(white)
        return self.places["length"].start + row, column, white[row, column]


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
    row, column, value = (np.concatenate(one) for one in zip(*parts, strict=True))
    return row, column, value


def _single_readings(at: LinearisedDesign) -> Iterator[BiasPatterns]:
    row, axis = np.nonzero(at.weight)
    entries = at.weight.shape[1] * row + axis, np.arange(len(row)), at.weight[row, axis]
    yield _block("reading", entries, at.chosen[row], axis)


def _single_lengths(at: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Lengths that share no reading with others."""
    alone, white = at.white.alone, at.white.single
    row, column = _pairs_within(white, white.group)
    own, along = white.own[column], white.direction
    value = ((row == column) - along[row] * along[column]) / own
    yield _block("length", (at.places["length"].start + row, column, value), alone)


def _ends(at: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Readings of standards whose lengths are read together, each along the axes that change
    lengths differently.
    """
    given = at.design.of(Lengths)
    joint = np.setdiff1d(np.arange(len(given)), at.white.alone)
    for reading in np.unique([given.first[joint], given.second[joint]]):
        sign = (given.first == reading).astype(float) - (given.second == reading)
        axes = _different(sign[:, None] * given.direction)
        yield _block(
            "end", at.of_lengths(sign[:, None] * at.unit[:, axes]), [reading] * len(axes), axes
        )


def _different(columns: Array) -> list[int]:
    """Indices of columns that are neither slight nor multiples of a larger one, of equal ones of
    the first.
    """
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
    """All pairs of rows that whitening mixes, each with itself as well."""
    every = np.arange(len(group))
    if not white.direction.any():
        return every, every
    pairs = []
    for certificate in np.unique(group):
        own = np.flatnonzero(group == certificate)
        pairs.append(np.stack(np.meshgrid(own, own, indexing="ij")).reshape(2, -1))
    row, column = np.concatenate(pairs, axis=1)
    return row, column


def _single_items(at: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Certified values and priors: what is stated too large makes residuals smaller."""
    # What is known of the machine first, then of artefacts.
    for one in reversed(at.design.observations):
        if isinstance(one, Lengths):
            continue
        # Beside a constraint nothing of what is stated as exact is left in the residuals.
        chosen = np.flatnonzero(~one.is_exact)
        first, every = at.places[one.word].start, np.arange(len(chosen))
        entries = (first + chosen, every, -1.0 / one.uncertainty[chosen])
        if one.is_joint:
            white = -one.whitened(np.eye(len(one))[:, chosen])
            row, column = np.nonzero(white)
            entries = (first + row, column, white[row, column])
        yield _block(one.word, entries, chosen, one.along[chosen])


def _dirty_balls(at: LinearisedDesign) -> Iterator[BiasPatterns]:
    """A ball that is read several times in a position, displaced there; read once, it is the same
    as its reading.
    """
    d = at.design.dimension
    key = at.readings.ball * len(at.design.positions.names) + at.readings.position
    _, first, group, count = np.unique(
        key, return_index=True, return_inverse=True, return_counts=True
    )
    number = np.where(count > 1, np.cumsum(count > 1) - 1, -1)
    rows = np.flatnonzero(number[group] >= 0)
    row = d * rows[:, None] + np.arange(d)
    column = d * number[group[rows]][:, None] + np.arange(d)
    subject = np.repeat(at.chosen[first[count > 1]], d)
    axis = np.tile(np.arange(d), int((count > 1).sum()))
    yield _block("ball", (row.ravel(), column.ravel(), at.weight[rows].ravel()), subject, axis)


def _moved_balls(at: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Balls that have been displaced on their plate, along its axes, from one position on."""
    d, readings = at.design.dimension, at.readings
    place = position_order(at.design)[readings.position]
    order = np.lexsort((np.arange(len(place)), place, readings.ball))
    ball, place = readings.ball[order], place[order]
    same_ball = np.diff(ball) == 0
    starts = 1 + np.flatnonzero(same_ball & (np.diff(place) > 0))
    end = np.searchsorted(ball, ball[starts], side="right")
    group, rows = _runs(starts, end)
    rows = order[rows]
    turn = at.state.rotations[readings.position[rows]]
    first = np.repeat(at.chosen[order[starts]], d)
    yield _block(
        "moved", at.of_readings(rows, turn, group), first, np.tile(np.arange(d), len(starts))
    )


def _runs(start: Integers, end: Integers) -> tuple[Integers, Integers]:
    """All of several ranges (g,) one after the other: the number of each one's range, and what
    stands in it.

    >>> _runs(np.array([3, 7]), np.array([5, 8]))
    (array([0, 0, 1]), array([3, 4, 7]))
    """
    length = end - start
    group = np.repeat(np.arange(len(start)), length)
    return group, np.arange(len(group)) - np.repeat(np.cumsum(length) - length - start, length)


def position_order(design: Design) -> Integers:
    """Place (positions,) of each position in the order in which the readings were taken."""
    order = np.full(len(design.positions.names), len(design.positions.names))
    found, first = np.unique(design.readings.position, return_index=True)
    order[found[np.argsort(first)]] = np.arange(len(found))
    return order


def _slip_starts(at: LinearisedDesign, rows: Integers) -> Integers:
    """Places among a position's `rows` that a slip may come before."""
    if at.every_start:
        count = len(rows) - 2 * LEAST_PART + 1
        if count < 1:
            return np.zeros(0, np.int64)
        return np.unique(
            np.linspace(LEAST_PART, len(rows) - LEAST_PART, min(count, MOST_STARTS)).astype(
                np.int64
            )
        )
    probe = at.readings.probe[rows]
    changes = np.flatnonzero(np.diff(probe)) + 1
    # Between probes only where each has its readings together.
    between = changes if len(changes) == len(np.unique(probe)) - 1 else changes[:0]
    return np.unique(np.append(between, len(rows) // 2))


def _slips(at: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Plates that slipped within a position."""
    d = at.design.dimension
    for k in at.has_plate:
        rows = np.flatnonzero(at.readings.position == k)
        starts = _slip_starts(at, rows)
        starts = starts[(starts > 0) & (starts < len(rows))]
        if not len(starts):
            continue
        group, late = _runs(starts, np.full(len(starts), len(rows)))
        moved = rows[late]
        first = at.chosen[rows[starts]]
        shifts = np.broadcast_to(np.eye(d), (len(moved), d, d))
        axes = np.tile(np.arange(d), len(starts))
        entries = at.of_readings(moved, shifts, group)
        yield _block("shift", entries, [k] * len(axes), axes, np.repeat(first, d))
        turns = rotation_sensitivity(at.arm[moved] - at.arm[rows].mean(axis=0))
        about = np.tile(np.arange(3) if d == 3 else np.array([2]), len(starts))
        entries = at.of_readings(moved, turns, group)
        yield _block("turn", entries, [k] * len(about), about, np.repeat(first, turns.shape[2]))


def _probes(at: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Probes whose offsets are stated too large; of one that is estimated only its prior can be
    wrong.
    """
    design, state = at.design, at.state
    d, offsets = design.dimension, state.probes[design.readings.probe]
    all_rates = offset_sensitivity(design.model, at.x, state.a, offsets)
    probes = np.unique(design.readings.probe)
    # A fit tests what its readings may show; a task may also use a probe that reads nothing else.
    if not at.every_start:
        probes = np.union1d(probes, design.tasks.probes)
    for probe in probes:
        fixed = np.ones(d, bool) if not design.probes.free.any() else ~design.probes.free[probe]
        if not fixed.any():
            continue
        rate = np.where((design.readings.probe == probe)[:, None, None], all_rates, 0.0)[
            :, :, fixed
        ]
        rows = np.flatnonzero(at.readings.probe == probe)
        of_lengths = at.of_lengths(at.along_lengths(rate))
        entries = _joined(at.of_readings(rows, rate[at.chosen[rows]]), of_lengths)
        yield _block("probe", entries, [probe] * int(fixed.sum()), np.flatnonzero(fixed))


def _length_values(at: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Certified lengths that are stated too long and are read several times, or together with
    others.
    """
    given = at.design.of(Lengths)
    known = given.is_known
    numbers, first, count = np.unique(
        given.certificate[known], return_index=True, return_counts=True
    )
    is_alone = np.isin(np.flatnonzero(known)[first], at.white.alone)
    for number in numbers[(count > 1) | ~is_alone]:
        entries = at.of_lengths(-1.0 * (given.certificate == number)[:, None])
        yield _block("length value", entries, int(np.flatnonzero(given.certificate == number)[0]))


def _scales(at: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Certificates of an artefact of which all values are too long by one ratio."""
    design = at.design
    lengths = design.of(Lengths)
    of_length = design.balls.artefact[design.readings.ball[lengths.first]]
    scaled = [one for one in design.observations if one.scales and len(one)]
    for artefact in range(len(design.artefacts.names)):
        mine = [
            np.flatnonzero(design.balls.artefact[one.balls[:, 0]] == artefact) for one in scaled
        ]
        of_lengths = lengths.is_known & (of_length == artefact)
        if sum(map(len, mine)) + len(np.unique(lengths.certificate[of_lengths])) < 2:
            continue
        parts = []
        for one, rows in zip(scaled, mine, strict=True):
            bias = np.zeros(len(one))
            bias[rows] = one.scaled()[rows]
            white = -one.whitened(bias)
            row = np.flatnonzero(white)
            parts.append((at.places[one.word].start + row, np.zeros_like(row), white[row]))
        columns = -np.where(of_lengths, lengths.value, 0.0)[:, None]
        yield _block("scale", _joined(*parts, at.of_lengths(columns)), artefact)


def _expansions(at: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Artefacts that are larger in one position."""
    design = at.design
    values = length_values(design, at.state)
    of_lengths = design.readings.position[design.of(Lengths).first]
    for k in range(len(design.positions.names)):
        rows = np.flatnonzero(at.readings.position == k)
        if not len(rows) and not (of_lengths == k).any():
            continue
        away = at.arm[rows] - at.arm[rows].mean(axis=0) if len(rows) else at.arm[rows]
        columns = np.where(of_lengths == k, values, 0.0)[:, None]
        yield _block(
            "expansion", _joined(at.of_readings(rows, away[:, :, None]), at.of_lengths(columns)), k
        )


def _drifts(at: LinearisedDesign) -> Iterator[BiasPatterns]:
    """Drifts from the first reading to the last, of the reference point and of the scales: by the
    clock that is stated, or in order.
    """
    if at.every_start:
        return
    design, readings, d = at.design, at.design.readings, at.design.dimension
    stated = [one.clock for one in design.influences if isinstance(one, Drift)]
    clock = stated[0] if stated else even_clock(len(design.positions.names))
    time = clock.hours(readings)[:, None]
    if not np.ptp(time) > 0.0:
        return
    time /= np.ptp(time)
    for kind, displacement, axes in (
        ("drift", time[:, :, None] * np.eye(d), np.arange(d)),
        ("scale drift", (time * at.x)[:, :, None], np.array([-1])),
    ):
        rows = np.arange(len(at.chosen))
        entries = at.of_readings(rows, displacement[at.chosen])
        of_lengths = at.of_lengths(at.along_lengths(displacement))
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
