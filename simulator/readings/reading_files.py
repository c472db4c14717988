"""Readings as a CSV file: one row for each reading, lengths with their unit in the column's
name.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from ..design.arrays import Design, Readings, in_sequence, measured, nominal_state
from ..design.observations.lengths import Lengths
from ..design.observations.readings import expected_readings
from ..estimation.spheres import fit_sphere
from ..experiment.readings_section import ReadingsSettings, no_settings
from ..inputs.messages import MORE_ERRORS, MOST_MESSAGES, ExperimentError, Message, refused
from ..inputs.settings import hint, listing
from ..inputs.spreadsheets import CsvWriter
from ..inputs.tables import FileRow
from ..inputs.yamltree import GivenText, Mark
from ..machines.protocol import Array, Integers
from .common_causes import doubts_about_poses
from .coordinate_kinds import as_scale_readings, doubts_about_copies
from .gross_error_messages import (
    doubts_about_lengths,
    doubts_about_volume,
    refuse_gross_errors,
)
from .offsets_applied import doubt_about_offsets, said_of
from .reading_sources import Source, source_rows

AXES = ("x", "y", "z")

# A gauge whose directions are no further from the planned ones than this (rad) has them.
AS_PLANNED = 0.01


@dataclass(frozen=True)
class ObservedReadings:
    """A design whose readings are those of a file, with their scale readings x (readings, d) in
    metres.

    `missing` names planned readings that the file lacks, `unplanned` those in the file that the
    design did not foresee. `marks` tell where each reading stands; of the mean of several, where
    the first does. `told` is how tables were read, `of_offsets` what is doubtful about offsets of
    probes in them, and about part co-ordinates that two positions have alike.
    """

    design: Design
    x: Array
    missing: tuple[str, ...]
    unplanned: tuple[str, ...]
    marks: tuple[Mark, ...] = ()
    told: tuple[str, ...] = ()
    of_offsets: tuple[str, ...] = ()

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
        """What of them is possible, and unlikely to be meant: lengths and places."""
        of_volume = doubts_about_volume(self.design, self.x, self.marks)
        of_poses = doubts_about_poses(self.design, self.x)
        return (
            *self.of_offsets,
            *of_poses,
            *doubts_about_lengths(self.design, self.x),
            *of_volume,
        )


def reading_columns(design: Design, readings: Readings, x: Array) -> dict[str, list[Any]]:
    """Readings in millimetres as the columns of their file: position, ball, probe, x_mm, y_mm and
    z_mm, NaN where a co-ordinate is not read.
    """
    names = {
        "position": [design.positions.names[k] for k in readings.position],
        "ball": [design.balls.names[k] for k in readings.ball],
        "probe": [design.probes.names[k] for k in readings.probe],
    }
    x = np.where(measured(design, readings), x, np.nan)
    lengths = zip(AXES[: design.dimension], (1e3 * x).T.tolist(), strict=True)
    return names | {f"{axis}_mm": column for axis, column in lengths}


def write_readings(stream: TextIO, design: Design, readings: Readings, x: Array) -> None:
    """Write the columns of readings with all digits, empty where a co-ordinate is not read."""
    writer = CsvWriter(stream)
    columns = reading_columns(design, readings, x)
    writer.writerow(list(columns))
    for row in zip(*columns.values(), strict=True):
        writer.writerow([*row[:3], *("" if v != v else repr(v) for v in row[3:])])


# In one piece: what is refused, in which order, each before what relies on it.
def read_readings(
    source: Source | Sequence[Source],
    design: Design,
    every_ball: bool = True,
    settings: ReadingsSettings | None = None,
) -> ObservedReadings:
    """Readings of a file, or of several, as observations of a design.

    A plain CSV file has the columns position, ball, probe, x_mm, y_mm and z_mm; how other tables
    are written is found, or said by the `settings`, which also tell what their co-ordinates are of.
    The probe's column may be left out where there is one probe only. An optional column u, with a
    unit as in u_um, states the standard uncertainty of each co-ordinate of a reading; without it a
    reading has the uncertainty that the design plans for it, and one that is not planned the
    machine's repeatability. Influence quantities have further columns. A reading stands in the file
    no more often than the design plans it; one that is not planned, once. Unless `every_ball` has
    to be read, some may be missing.

    :raises ExperimentError: a wrong table, names that the design does not know, or readings that
        cannot be of the ball they name (`readings.gross_errors`); all of a kind at once.
    """
    d, settings = design.dimension, settings or no_settings()
    sources = [source] if isinstance(source, Path | GivenText) else list(source)
    messages: list[Message] = []
    units = {name: one for kind in design.influences for name, one in kind.columns.items()}
    empty = AXES[:d] if design.positions.across is not None else ()

    def is_possible(x: Array) -> bool:
        return settings.coordinates == "part" or not far_outside(x, design).any()

    found = source_rows(sources, design, settings, messages, is_possible, units, empty)
    rows = found.rows
    index, unknown = _indices(rows, design)
    lengths = np.array([row.lengths for row in rows])
    has_uncertainty = not np.isnan(lengths[:, d]).all()
    if has_uncertainty:
        text = "a standard uncertainty must be above zero; correct it, or leave the column out"
        wrong = [row.mark for row in rows if row.lengths[d] <= 0.0]
        messages += [mark.message("", text) for mark in wrong[:MOST_MESSAGES]]
    if messages or unknown:
        hints = found.hints if unknown else ()
        raise ExperimentError([*sorted([*messages, *unknown]), *hints])
    given, stated = lengths[:, :d], lengths[:, d]
    beside = None
    if design.influences:
        beside = dict(zip(units, lengths[:, d + 1 :].T, strict=True))
    readings = Readings(index[:, 0], index[:, 1], index[:, 2], np.ones(len(rows), np.int64))
    if empty and (
        settings.coordinates == "part" or settings.compensation not in (None, "off", "on")
    ):
        text = "part co-ordinates, and a correction to be taken off, need all co-ordinates of balls"
        raise refused(sources[0], f"{text}; give scale readings")
    x = as_scale_readings(design, readings, given, settings, sources[0])
    x = _where_not_read(rows, x, design, readings)
    if settings.coordinates != "part":
        _refuse_far_outside(rows, x if empty else given, design)
    uncertainty = (
        np.repeat(stated[:, None], d, axis=1)
        if has_uncertainty
        else _planned_uncertainty(design, readings)
    )
    readings = replace(readings, uncertainty=uncertainty, beside=beside)
    readings = in_sequence(readings, design.influences)
    missing, unplanned = _compare(design, readings, [row.mark for row in rows])
    unread = np.setdiff1d(design.plate_balls, readings.ball)
    if len(unread) and every_ball:
        names = listing(f'"{design.ball_label(int(ball))}"' for ball in unread)
        raise ExperimentError(
            [
                Message(
                    str(sources[0]),
                    1,
                    1,
                    "",
                    f"no reading of the balls {names}; read each at least once",
                )
            ]
        )
    marks = tuple(row.mark for row in rows)
    doubt = () if empty else doubt_about_offsets(design, readings, given, settings, rows[0].mark)
    if settings.coordinates == "part":
        doubt += doubts_about_copies(design, readings, given)
    observed = _combine_standards(design, readings, x, missing, unplanned, marks)
    observed = replace(observed, told=(*found.told, *said_of(settings)), of_offsets=doubt)
    refuse_gross_errors(observed.design, observed.x, observed.marks)
    _refuse_repeated(rows, readings, design)
    return observed


def _indices(rows: tuple[FileRow, ...], design: Design) -> tuple[Integers, list[Message]]:
    """Indices (rows, 3) of ball, position and probe, and the messages about names unknown."""
    positions = {name: k for k, name in enumerate(design.positions.names)}
    probes = {name: k for k, name in enumerate(design.probes.names)}
    balls = [
        {design.balls.names[b]: int(b) for b in design.balls.of(artefact)}
        for artefact in range(len(design.artefacts.names))
    ]
    # Rows of the same names, of which there are many, are looked up once.
    places: dict[tuple[str, ...], tuple[int, int, int]] = {}
    wrong: dict[tuple[str, ...], list[str]] = {}
    index: list[tuple[int, int, int]] = []
    unknown: dict[str, list[FileRow]] = {}
    for row in rows:
        if len(unknown) >= MOST_MESSAGES:
            unknown.setdefault(MORE_ERRORS, []).append(row)
            break
        if row.texts not in places:
            position, ball, probe = row.texts
            texts = wrong.setdefault(row.texts, [])
            own: dict[str, int] = {}
            if position not in positions:
                texts.append(f'unknown position "{position}"; {hint(position, positions)}')
            else:
                own = balls[design.positions.artefact[positions[position]]]
                texts += [] if ball in own else [f'unknown ball "{ball}"; {hint(ball, own)}']
                texts += (
                    [] if probe in probes else [f'unknown probe "{probe}"; {hint(probe, probes)}']
                )
            places[row.texts] = own.get(ball, 0), positions.get(position, 0), probes.get(probe, 0)
        for text in wrong[row.texts]:
            unknown.setdefault(text, []).append(row)
        index.append(places[row.texts])
    messages = []
    for text, found in unknown.items():
        more = (
            f" (and in {len(found) - 1} line{'s' * (len(found) > 2)} more)"
            if len(found) > 1
            else ""
        )
        messages.append(found[0].mark.message("", text + more))
    return np.array(index, np.int64).reshape(-1, 3), messages


def far_outside(x: Array, design: Design) -> NDArray[np.bool_]:
    """Which co-ordinates (n, d) lie outside the volume by more than its own size: they are in
    another unit.
    """
    volume = design.machine.volume
    size = float(volume.size.max())
    return np.asarray((x < volume.lower - size) | (x > volume.upper + size))


def _refuse_far_outside(rows: tuple[FileRow, ...], x: Array, design: Design) -> None:
    """Refuse readings far outside the volume: their unit is not what it says."""
    messages: list[Message] = []
    for i, axis in np.argwhere(far_outside(x, design)).tolist():
        if len(messages) >= MOST_MESSAGES:
            messages.append(rows[i].mark.message("", MORE_ERRORS))
            break
        text = (
            f"{AXES[axis]} is {x[i, axis]:.6g} m, far outside the volume; check the unit, and"
            " that it is a co-ordinate of the machine, not of a part (readings: coordinates)"
        )
        messages.append(rows[i].mark.message("", text))
    if messages:
        raise ExperimentError(messages)


def _where_not_read(
    rows: tuple[FileRow, ...], x: Array, design: Design, readings: Readings
) -> Array:
    """Scale readings (n, d) with those of the drawing in place of co-ordinates that are not read.

    :raises ExperimentError: a co-ordinate is missing, or stands where it is not read.
    """
    is_read = measured(design, readings)
    messages: list[Message] = []
    for i, axis in np.argwhere(np.isnan(x) == is_read)[:MOST_MESSAGES].tolist():
        position = design.positions.names[readings.position[i]]
        text = f"no {AXES[axis]}; write a number, or remove the line"
        if not is_read[i, axis]:
            text = (
                f'{AXES[axis]} is across the plane of "{position}", which is read in its plane;'
                " leave the cell empty"
            )
        messages.append(rows[i].mark.message("", text))
    if messages:
        raise ExperimentError(messages)
    drawn = expected_readings(design, nominal_state(design), readings)
    return np.where(is_read, x, drawn)


def _refuse_repeated(rows: tuple[FileRow, ...], readings: Readings, design: Design) -> None:
    """Refuse readings that stand in the file more often than planned: a copied line counts as
    knowledge otherwise.
    """
    planned = Counter(_key(design.readings.expanded()))
    places: dict[tuple[int, int, int], list[FileRow]] = {}
    for key, row in zip(_key(readings), rows, strict=True):
        places.setdefault(key, []).append(row)
    messages = []
    for (position, ball, probe), found in places.items():
        allowed = max(planned[position, ball, probe], 1)
        # Some of each ball's, so that no ball is left out and no list is endless.
        for row in found[allowed : allowed + 10]:
            text = (
                f'ball "{design.ball_label(ball)}" is repeated in position'
                f' "{design.positions.names[position]}" with probe "{design.probes.names[probe]}"'
                f" (first in line {found[0].mark.line}); remove the line, or state repeats:"
                f" {len(found)} for that position in the experiment"
            )
            messages.append(row.mark.message("", text))
    if messages:
        raise ExperimentError(messages)


def _key(readings: Readings) -> list[tuple[int, int, int]]:
    table = np.stack([readings.position, readings.ball, readings.probe], axis=1)
    return [(row[0], row[1], row[2]) for row in table.tolist()]


def _planned_uncertainty(design: Design, readings: Readings) -> Array | None:
    """Standard uncertainties (m, d) that the design plans for the readings, None where it plans
    none in particular.
    """
    planned = design.readings
    if planned.uncertainty is None:
        return None
    of_key = dict(zip(_key(planned), planned.uncertainty, strict=True))
    return np.array([of_key.get(key, design.machine.repeatability) for key in _key(readings)])


def _compare(
    design: Design, readings: Readings, marks: list[Mark]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    planned, found = _key(design.readings.expanded()), _key(readings)

    def name(key: tuple[int, int, int]) -> str:
        position, ball, probe = key
        return (
            f"{design.positions.names[position]}: ball {design.ball_label(ball)} with"
            f" {design.probes.names[probe]}"
        )

    def without(these: list[tuple[int, int, int]], others: list[tuple[int, int, int]]) -> list[int]:
        left = Counter(others)
        surplus = []
        for i, key in enumerate(these):
            if left[key]:
                left[key] -= 1
            else:
                surplus.append(i)
        return surplus

    missing = tuple(name(planned[i]) for i in without(planned, found))
    several = len({mark.file for mark in marks}) > 1
    where = [f"{mark.file}, " if several else "" for mark in marks]
    return missing, tuple(
        f"{name(found[i])} ({where[i]}line {marks[i].line})" for i in without(found, planned)
    )


def observe(design: Design, readings: Readings, x: Array) -> ObservedReadings:
    """Readings of a design, one row for each repeat, with scale readings `x` (readings, d), as if a
    file had them.
    """
    return _combine_standards(design, readings, x, (), (), ())


def _combine_standards(
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
    keys = _key(readings)
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
    planned = _key(design.readings)

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
