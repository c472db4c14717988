"""Readings as observations of a design: each as it was read, but of length standards, whose
repeats are taken together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..design.arrays import Design, Readings, in_sequence
from ..design.observations.lengths import Lengths
from ..estimation.spheres import fit_sphere
from ..inputs.extensions import MissingExtensionError, service
from ..inputs.settings import listing
from ..inputs.yamltree import Mark
from ..machines.protocol import Array, Integers

# A gauge whose directions are no further from the planned ones than this (rad) has them.
AS_PLANNED = 0.01


@dataclass(frozen=True)
class ObservedReadings:
    """A design whose readings are those of a file, with their scale readings x (readings, d) in
    metres.

    `missing` names planned readings that the file lacks, `unplanned` those in the file that the
    design did not foresee. `marks` tell where each reading stands; of the mean of several, where
    the first does. `told` is how tables were read, `redone` what was left out of them because it
    was read again, and `of_offsets` what is doubtful about offsets of probes in them, and about
    part co-ordinates that two positions have alike; `of_certificate` what is doubtful about values
    of a certificate that came with them.
    """

    design: Design
    x: Array
    missing: tuple[str, ...]
    unplanned: tuple[str, ...]
    marks: tuple[Mark, ...] = ()
    told: tuple[str, ...] = ()
    of_offsets: tuple[str, ...] = ()
    of_certificate: tuple[str, ...] = ()
    redone: tuple[str, ...] = ()

    @property
    def remarks(self) -> tuple[str, ...]:
        """How tables that are no plain CSV files were read, and how far the readings are those that
        were planned, in words; nothing where they are.
        """
        both = (("planned but not read", self.missing), ("read but not planned", self.unplanned))
        differ = (f"{what} ({len(names)}): {listing(names)}" for what, names in both if names)
        return (*self.told, *differ)

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """What of them is possible, and unlikely to be meant: lengths, places, temperatures; or
        that nobody looked.
        """
        try:
            checks = service("ReadingChecks")
        except MissingExtensionError as error:
            found: tuple[str, ...] = (f"mistakes in readings were not looked for ({error})",)
        else:
            found = checks.doubts_about_readings(self.design, self.x, self.marks)
        return (*self.of_certificate, *self.of_offsets, *found)


def reading_keys(readings: Readings) -> list[tuple[int, int, int]]:
    """Position, ball and probe of each reading."""
    table = np.stack([readings.position, readings.ball, readings.probe], axis=1)
    return [(row[0], row[1], row[2]) for row in table.tolist()]


def observe(design: Design, readings: Readings, x: Array) -> ObservedReadings:
    """Readings of a design, one row for each repeat, with scale readings `x` (readings, d), as if a
    file had them.
    """
    return combine_standards(design, readings, x, (), (), ())


def combine_standards(
    design: Design,
    readings: Readings,
    x: Array,
    missing: tuple[str, ...],
    unplanned: tuple[str, ...],
    marks: tuple[Mark, ...],
) -> ObservedReadings:
    """Take the mean of what a length standard's repeats read, and let its lengths point to it.

    A length of which an end was not read drops out. Every reading of a Bryan gauge is a length of
    its own, since its ball need not be where it was before.
    """
    on_plate = design.artefacts.is_plate[design.balls.artefact[readings.ball]]
    groups: dict[tuple[int, int, int], list[int]] = {}
    keys = reading_keys(readings)
    of_gauge = np.isin(readings.position, design.gauge_positions)
    for i in np.flatnonzero(~on_plate & ~of_gauge):
        groups.setdefault(keys[i], []).append(int(i))
    carried = np.flatnonzero(of_gauge)
    plate = np.flatnonzero(on_plate)
    means = np.array([x[members].mean(axis=0) for members in groups.values()]).reshape(
        -1, x.shape[1]
    )
    first = np.array([members[0] for members in groups.values()], np.int64)
    repeats = np.array([len(members) for members in groups.values()], np.int64)
    place = {key: len(plate) + i for i, key in enumerate(groups)}
    planned = reading_keys(design.readings)

    def moved(old: Integers) -> Integers:
        return np.array([place.get(planned[i], -1) for i in old], np.int64)

    ends = moved(design.of(Lengths).first), moved(design.of(Lengths).second)
    present = ~design.of(Lengths).to_pivot & (ends[0] >= 0) & (ends[1] >= 0)
    lengths = replace(design.of(Lengths), first=ends[0], second=ends[1]).select(present)
    if len(carried):
        lengths = _with_radii(design, lengths, readings, x, carried, len(plate) + len(first))
    chosen = np.concatenate([plate, first, carried])
    ones = np.ones(len(readings), np.int64)
    combined = replace(
        readings.select(chosen), repeats=np.concatenate([ones[plate], repeats, ones[carried]])
    )
    if readings.uncertainty is not None:
        variance = readings.uncertainty**2
        # The mean is a plain one, whatever the uncertainties of its parts.
        of_means = np.sqrt([variance[members].mean(axis=0) for members in groups.values()]).reshape(
            -1, x.shape[1]
        )
        of_others = readings.uncertainty
        combined = replace(
            combined, uncertainty=np.concatenate([of_others[plate], of_means, of_others[carried]])
        )
    combined = in_sequence(combined, design.influences)
    observed = replace(design, readings=combined).observed(lengths)
    chosen_marks = tuple(marks[i] for i in chosen) if marks else ()
    return ObservedReadings(
        observed, np.concatenate([x[plate], means, x[carried]]), missing, unplanned, chosen_marks
    )


def _with_radii(
    design: Design, lengths: Lengths, readings: Readings, x: Array, carried: Integers, start: int
) -> Lengths:
    """Lengths with those of the readings `carried` of Bryan gauges added, which stand from `start`
    on.

    Their directions are those of the readings about the centre of a sphere; the nearest planned
    ones, whatever their names, if all of a position are met, so that noise and errors do not seem
    to tell what the plan leaves open.
    """
    from scipy.spatial import cKDTree

    given = design.of(Lengths)
    planned = np.flatnonzero(given.to_pivot)
    # Of the same gauge all are alike.
    of_gauge = design.balls.artefact[design.readings.ball[given.first[planned]]]
    own = design.balls.artefact[readings.ball[carried]]
    gauges, first = np.unique(of_gauge, return_index=True)
    like = planned[first[np.searchsorted(gauges, own)]]
    seen = x[carried] + design.probes.offsets[readings.probe[carried]]
    direction = np.empty_like(seen)
    for k in np.unique(readings.position[carried]):
        rows = readings.position[carried] == k
        away = seen[rows] - fit_sphere(seen[rows], design.positions.origins[k])[0]
        direction[rows] = away / np.sqrt((away**2).sum(axis=1))[:, None]
        drawn = given.direction[planned[of_gauge == own[rows][0]]]
        nearest = drawn[cKDTree(drawn).query(direction[rows])[1]]
        if np.abs(nearest - direction[rows]).max() < AS_PLANNED:
            direction[rows] = nearest
    added = replace(given.select(like), first=start + np.arange(len(carried)), direction=direction)
    both: dict[str, Any] = {
        name: None if values is None else np.concatenate([values, getattr(added, name)])
        for name, values in vars(lengths).items()
    }
    return Lengths(**both)
