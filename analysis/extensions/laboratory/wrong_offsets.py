"""Probe offsets that are stated wrongly: a sign, two probes exchanged, or one that is off.

Readings of one position with two probes determine the difference of their offsets, however the
artefact is placed. These differences are compared before anything is fitted, to what the machine's
errors amount to.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain, combinations

import numpy as np
from ballplate.simulator.computing import lstsq
from ballplate.simulator.design import (
    Design,
    Flags,
    Lengths,
    Priors,
    Readings,
    measured,
    read_in_positions,
    seen_places,
)
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import format_length, listing
from ballplate.simulator.machines import Array, Integers

from .consensus import consensus_motion
from .gross_errors import AGAINST_DRAWING, AGAINST_READINGS, ball_pitches, find_gross_errors

# Readings with a probe, beside others in their positions, that show its offset: fewer may be wrong
# themselves.
LEAST_READINGS = 4

# Share of the differences, and of the wrong readings, that the right offsets may leave.
LEFT_WRONG = 0.1


@dataclass(frozen=True)
class WrongOffsets:
    """A mistake in the offsets of `probes`: `change` (l, d) is the true offsets less those stated.

    With two probes they are exchanged; of one the `axes` have the wrong sign, or without any it is
    off.
    """

    probes: tuple[int, ...]
    change: Array
    axes: tuple[int, ...] = ()

    @property
    def is_off(self) -> bool:
        return len(self.probes) == 1 and not self.axes

    def words(self, design: Design) -> str:
        """What is wrong."""
        names = [design.probes.names[k] for k in self.probes]
        if len(names) > 1:
            return f"the offsets of probes {' and '.join(names)} are exchanged"
        offset = stated_offsets(design)[self.probes[0]]
        if self.axes:
            letters = listing(AXIS_NAMES[k] for k in self.axes)
            return f"offset {letters} of probe {names[0]} has the wrong sign"
        change = self.change[self.probes[0]]
        shown = np.abs(change) > 0.01 * np.abs(change).max()
        parts = (
            f"{AXIS_NAMES[k]} is {format_length(float(f'{offset[k] + change[k]:.4g}'))}, not"
            f" {format_length(float(f'{offset[k]:.4g}'))}"
            for k in np.flatnonzero(shown).tolist()
        )
        return f"the offset of probe {names[0]} is another one ({listing(parts)})"


def stated_offsets(design: Design) -> Array:
    """Offsets (l, d) of probes as they are stated, of uncertain ones too."""
    offsets, priors = design.probes.offsets.copy(), design.of(Priors)
    known_priors = np.flatnonzero(priors.probe >= 0)
    offsets[priors.probe[known_priors], priors.component[known_priors]] = priors.value[known_priors]
    return offsets


def with_offsets(design: Design, change: Array) -> Design:
    """The design with other offsets by a change (l, d), as certain as they were."""
    priors = design.of(Priors)
    value, indices = priors.value.copy(), np.flatnonzero(priors.probe >= 0)
    value[indices] += change[priors.probe[indices], priors.component[indices]]
    probes = replace(design.probes, offsets=design.probes.offsets + change)
    return replace(design, probes=probes).observed(priors.given(value=value))


def discrete_mistakes(design: Design) -> Iterator[WrongOffsets]:
    """Every sign, or several of one probe, that may be wrong, and every exchange of two probes."""
    offsets_stated = stated_offsets(design)
    probes_read = np.unique(design.readings.probe[design.plate_readings]).tolist()
    for probe in probes_read:
        axes = np.flatnonzero(offsets_stated[probe]).tolist()
        for some in chain.from_iterable(combinations(axes, n + 1) for n in range(len(axes))):
            change = np.zeros_like(offsets_stated)
            change[probe, list(some)] = -2.0 * offsets_stated[probe, list(some)]
            yield WrongOffsets((probe,), change, some)
    for first, second in combinations(range(len(offsets_stated)), 2):
        change = np.zeros_like(offsets_stated)
        change[first], change[second] = (
            offsets_stated[second] - offsets_stated[first],
            offsets_stated[first] - offsets_stated[second],
        )
        if change.any() and {first, second} & set(probes_read):
            yield WrongOffsets((first, second), change)


@dataclass(frozen=True)
class OffsetDifferences:
    """How far places seen with each `probe` (g,) are off in each `position` (g,), by `places`
    (g, d) where an axis `is_read` (g, d); each from `count` (g,) readings. Only positions of plates
    that were read with several probes are among them.
    """

    position: Integers
    probe: Integers
    places: Array
    is_read: Flags
    count: Integers

    def _centred(self, values: Array) -> Array:
        """Values (g, ...) less their means in each position."""
        values = values.copy()
        for k in np.unique(self.position):
            mine = self.position == k
            values[mine] -= values[mine].mean(axis=0)
        return values

    def left(self, change: Array) -> Array:
        """What a change (l, d) of the offsets leaves of the differences (g, d) in each position."""
        return np.where(self.is_read, self._centred(self.places + change[self.probe]), 0.0)

    def shifts(self, probes: int) -> Array:
        """The least change (l, d) of the offsets that leaves least of the differences."""
        shifts_found = np.zeros((probes, self.places.shape[1]))
        by_probe = self._centred((self.probe[:, None] == np.arange(probes)).astype(float))
        plain = self.left(shifts_found)
        for axis, is_axis_read in enumerate(self.is_read.T):
            shifts_found[:, axis] = -lstsq(
                by_probe[is_axis_read], plain[is_axis_read, axis], rcond=1e-9
            )[0]
        return shifts_found

    def shift_of(self, probe: int, probes: int) -> Array:
        """The change (l, d) of one probe's offset alone that they call for, the median over its
        positions.
        """
        change = np.zeros((probes, self.places.shape[1]))
        mine = self.probe == probe
        apart = np.array(
            [
                np.median(self.places[(self.position == k) & ~mine], axis=0) - place
                for k, place in zip(self.position[mine], self.places[mine], strict=True)
            ]
        )
        for axis, is_axis_read in enumerate(self.is_read[mine].T):
            if is_axis_read.any():
                change[probe, axis] = np.median(apart[is_axis_read, axis])
        return change


def offset_differences(design: Design, x: Array) -> OffsetDifferences:
    """How far the offsets of probes that read plates in one position disagree there, from scale
    readings x (m, d).
    """
    pitch, readings = ball_pitches(design), design.readings
    is_read, places_seen = measured(design, readings), seen_places(design, readings, x)
    rows = []
    for k, mine, nominal in read_in_positions(design, readings):
        probe = readings.probe[mine]
        several = np.unique(probe)
        if len(several) < 2 or not design.artefacts.is_plate[design.positions.artefact[k]]:
            continue
        is_common = probe == int(np.argmax(np.bincount(probe)))
        reach = AGAINST_DRAWING * pitch[readings.ball[mine[is_common]]]
        rotation, _, _ = consensus_motion(nominal[is_common], places_seen[mine[is_common]], reach)
        apart = places_seen[mine] - nominal @ rotation.T
        for probe_index in several.tolist():
            of_one = probe == probe_index
            place = np.median(apart[of_one], axis=0)
            rows.append((k, probe_index, place, is_read[mine[0]], int(of_one.sum())))
    d = design.dimension
    return OffsetDifferences(
        np.array([row[0] for row in rows], np.int64),
        np.array([row[1] for row in rows], np.int64),
        np.array([row[2] for row in rows]).reshape(-1, d),
        np.array([row[3] for row in rows], bool).reshape(-1, d),
        np.array([row[4] for row in rows], np.int64),
    )


def wrong_offsets(design: Design, readings: Readings, x: Array) -> list[WrongOffsets]:
    """Single mistakes in the offsets that explain nearly all that is wrong with scale readings
    x (m, d) of plates: signs and exchanges, or, where none does, one probe's offset that is off.
    """
    plates = np.flatnonzero(design.artefacts.is_plate[design.balls.artefact[readings.ball]])
    x, none = x[plates], np.zeros(0, np.int64)
    design = replace(design, readings=readings.select(plates))
    design = design.observed(design.of(Lengths).select(none))
    differences, probes = offset_differences(design, x), len(design.probes.names)
    plain = np.abs(differences.left(np.zeros((probes, design.dimension)))).max(initial=0.0)
    pitch = float(ball_pitches(design)[design.readings.ball].min(initial=np.inf))
    limit = min(AGAINST_READINGS * pitch, LEFT_WRONG * float(plain))

    def wrong(mistake: Array) -> int:
        positions, other_errors = find_gross_errors(with_offsets(design, mistake), x)
        lost = np.isin(design.readings.position, [mistake.position for mistake in positions])
        return int(lost.sum()) + len(other_errors)

    def explains(mistake: WrongOffsets) -> bool:
        fits = np.abs(differences.left(mistake.change)).max(initial=0.0) <= limit
        return bool(fits) and wrong(mistake.change) <= most

    most = LEFT_WRONG * wrong(np.zeros_like(design.probes.offsets))
    count = np.bincount(differences.probe, differences.count, probes)
    shown = np.flatnonzero(count >= LEAST_READINGS).tolist()
    discrete = (
        mistake for mistake in discrete_mistakes(design) if set(mistake.probes) & set(shown)
    )
    single = (WrongOffsets((k,), differences.shift_of(k, probes)) for k in shown)
    return list(filter(explains, discrete)) or list(filter(explains, single))


def only_position(design: Design, probe: int) -> int:
    """The one position of a plate that was read with a probe and with others; -1 where there are
    several, or none.
    """
    position, probes = design.readings.position, design.readings.probe
    mine = np.unique(position[probes == probe])
    shared = [k for k in mine.tolist() if len(np.unique(probes[position == k])) > 1]
    return shared[0] if len(shared) == 1 else -1
