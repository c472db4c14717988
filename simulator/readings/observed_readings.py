"""Readings as observations of a design; repeats of length standards are averaged."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from ballplate.simulator.design.arrays import Design, Readings
from ballplate.simulator.design.measurement import ensure_rows, in_sequence
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.geometry.motions import fit_sphere
from ballplate.simulator.inputs.extensions import MissingExtensionError, service
from ballplate.simulator.inputs.number_arrays import Array, Integers
from ballplate.simulator.inputs.settings import listing
from ballplate.simulator.inputs.yamltree import Mark

from .joining import ReadingKey, reading_keys, rows_of

# Directions of a gauge within this (rad) of the planned ones are taken as planned.
AS_PLANNED = 0.01


@dataclass(frozen=True)
class ObservedReadings:
    """A design whose readings are those of a file, with their scale readings x (readings, d) in
    metres.

    `missing` names planned readings that the file lacks, `unplanned` further readings of the file.
    `marks` are the readings' locations, the first of averaged ones. `table_notes` describes the
    reading of tables, `certificate_doubts` are doubts about values of a certificate.
    """

    design: Design
    x: Array
    missing: tuple[str, ...]
    unplanned: tuple[str, ...]
    marks: tuple[Mark, ...] = ()
    table_notes: tuple[str, ...] = ()
    certificate_doubts: tuple[str, ...] = ()

    @property
    def remarks(self) -> tuple[str, ...]:
        """Notes on tables that are no plain CSV files, and on unplanned and missing readings."""
        lists = (("planned but not read", self.missing), ("read but not planned", self.unplanned))
        notes = (f"{title} ({len(names)}): {listing(names)}" for title, names in lists if names)
        return (*self.table_notes, *notes)

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """Warnings of possible but improbable readings, or that these were not checked."""
        try:
            checks = service("ReadingChecks")
        except MissingExtensionError as error:
            doubts = (f"errors in readings were not looked for ({error})",)
        else:
            doubts = checks.doubts_about_readings(self.design, self.x, self.marks)
        return (*self.certificate_doubts, *doubts)


def observe(design: Design, readings: Readings, x: Array) -> ObservedReadings:
    """Return readings of a design, one row per repeat, with scale readings `x` (readings, d), as if
    read from a file.

    :raises UnmatchedReadingsError: `x` or `readings` are those of another design.
    """
    ensure_rows(design, readings, x)
    return combine_standards(design, readings, x, (), (), ())


def combine_standards(
    design: Design,
    readings: Readings,
    x: Array,
    missing: tuple[str, ...],
    unplanned: tuple[str, ...],
    marks: tuple[Mark, ...],
) -> ObservedReadings:
    """Average the repeats of each length standard, and connect its lengths to the means.

    A length with an unread end is omitted. Every reading of a Bryan gauge is a separate length,
    since its ball may have moved.
    """
    on_plate = design.artefacts.is_plate[design.balls.artefact[readings.ball]]
    # A length has one reading at each end, and repeats of standards are averaged for that. Repeats
    # on plates are observations themselves, and stay rows of their own.
    groups: dict[tuple[int, ReadingKey], list[int]] = {}
    keys = list(zip(rows_of(design, design, readings), reading_keys(readings), strict=True))
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
    # The last place is that of unplanned readings, and of none.
    row = np.full(len(design.readings) + 1, -1)
    row[[planned for planned, _ in groups]] = len(plate) + np.arange(len(groups))
    row[-1] = -1
    ends = row[design.of(Lengths).first], row[design.of(Lengths).second]
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
        # The mean is unweighted, regardless of the uncertainties.
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
    """Return lengths with those of the readings `carried` of Bryan gauges, in rows from `start`,
    added.

    Their directions are those of the readings about the centre of a sphere; the nearest planned
    ones, regardless of names, if all of a position agree with these, so that noise does not seem to
    determine anything that the plan leaves undetermined.
    """
    from scipy.spatial import cKDTree

    radii = design.of(Lengths)
    planned = np.flatnonzero(radii.to_pivot)
    planned_gauge = design.balls.artefact[design.readings.ball[radii.first[planned]]]
    gauge = design.balls.artefact[readings.ball[carried]]
    # All planned radii of a gauge agree except in direction: its first serves as a template.
    gauges, first = np.unique(planned_gauge, return_index=True)
    template = planned[first[np.searchsorted(gauges, gauge)]]
    points = x[carried] + design.probes.offsets[readings.probe[carried]]
    direction = np.empty_like(points)
    for k in np.unique(readings.position[carried]):
        rows = readings.position[carried] == k
        # From the pivot that the readings themselves show: about the nominal one directions would
        # be off by its error.
        away = points[rows] - fit_sphere(points[rows], design.positions.origins[k])[0]
        direction[rows] = away / np.sqrt((away**2).sum(axis=1))[:, None]
        nominal = radii.direction[planned[planned_gauge == gauge[rows][0]]]
        nearest = nominal[cKDTree(nominal).query(direction[rows])[1]]
        if np.abs(nearest - direction[rows]).max() < AS_PLANNED:
            direction[rows] = nearest
    first_rows = start + np.arange(len(carried))
    added = replace(radii.select(template), first=first_rows, direction=direction)
    columns: dict[str, Any] = {
        name: None if values is None else np.concatenate([values, getattr(added, name)])
        for name, values in vars(lengths).items()
    }
    return Lengths(**columns)
