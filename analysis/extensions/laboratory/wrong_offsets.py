"""Probe offsets that are stated wrongly: a sign, two probes exchanged, or one that is off.

Readings of one position with two probes determine the difference of their offsets, however the
artefact is placed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain, combinations

import numpy as np
from ballplate.simulator.computing import lstsq
from ballplate.simulator.design import (
    Design,
    Priors,
    measured,
    read_in_positions,
    seen_places,
)
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import listing
from ballplate.simulator.machines import Array

from .consensus import consensus_motion
from .gross_errors import AGAINST_DRAWING, ball_pitches


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
        """What is wrong, of a sign or an exchange."""
        names = [design.probes.names[k] for k in self.probes]
        if len(names) > 1:
            return f"the offsets of probes {' and '.join(names)} are exchanged"
        letters = listing(AXIS_NAMES[k] for k in self.axes)
        return f"offset {letters} of probe {names[0]} has the wrong sign"


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


def offset_shifts(design: Design, x: Array) -> Array:
    """Return the least change (l, d) of the offsets with which readings of plates by several probes
    in one position agree best, from scale readings x (m, d).
    """
    pitch, readings = ball_pitches(design), design.readings
    is_read, places_seen = measured(design, readings), seen_places(design, readings, x)
    by_probe, apart, read = [], [], []
    for k, mine, nominal in read_in_positions(design, readings):
        probe = readings.probe[mine]
        several = np.unique(probe)
        if len(several) < 2 or not design.artefacts.is_plate[design.positions.artefact[k]]:
            continue
        is_common = probe == int(np.argmax(np.bincount(probe)))
        reach = AGAINST_DRAWING * pitch[readings.ball[mine[is_common]]]
        rotation, _, _ = consensus_motion(nominal[is_common], places_seen[mine[is_common]], reach)
        off = places_seen[mine] - nominal @ rotation.T
        places = np.array([np.median(off[probe == each], axis=0) for each in several])
        columns = np.eye(len(design.probes.names))[several]
        by_probe.append(columns - columns.mean(axis=0))
        apart.append(places - places.mean(axis=0))
        read.append(np.tile(is_read[mine[0]], (len(several), 1)))
    shifts = np.zeros_like(design.probes.offsets)
    if apart:
        columns, places, is_axis_read = (np.concatenate(each) for each in (by_probe, apart, read))
        for axis, rows in enumerate(is_axis_read.T):
            shifts[:, axis] = -lstsq(columns[rows], places[rows, axis], rcond=1e-9)[0]
    return shifts
