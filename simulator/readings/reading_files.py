"""Readings as a CSV file: one row for each reading, lengths with their unit in the column's
name.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from ..design.arrays import Design, Readings, in_sequence, measured, nominal_state
from ..design.observations.readings import expected_readings
from ..experiment.readings_section import ReadingsSettings, no_settings
from ..inputs.extensions import optional_service, service
from ..inputs.messages import MORE_ERRORS, MOST_MESSAGES, ExperimentError, Message, refused
from ..inputs.settings import hint, listing, number_of
from ..inputs.spreadsheets import CsvWriter
from ..inputs.tables import FileRow
from ..inputs.yamltree import GivenText, Mark
from ..machines.protocol import Array, Integers
from .observed_readings import ObservedReadings, combine_standards, reading_keys
from .reading_sources import Source, source_rows

AXES = ("x", "y", "z")

Thinning = Callable[[Sequence[FileRow], Design], tuple[tuple[FileRow, ...], tuple[str, ...]]]


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
    thinned: Thinning | None = None,
) -> ObservedReadings:
    """Readings of a file, or of several, as observations of a design.

    A plain CSV file has the columns position, ball, probe, x_mm, y_mm and z_mm; how other tables
    are written is found, or said by the `settings`, which also tell what their co-ordinates are of.
    The probe's column may be left out where there is one probe only. An optional column u, with a
    unit as in u_um, states the standard uncertainty of each co-ordinate of a reading; without it a
    reading has the uncertainty that the design plans for it, and one that is not planned the
    machine's repeatability. Influence quantities have further columns. A reading stands in the file
    no more often than the design plans it; one that is not planned, once. Unless `every_ball` has
    to be read, some may be missing. `thinned` tells which rows count, and in words what was
    left out, which is `redone`.

    Whether readings can be of the ball that they name, and their co-ordinates of the stated kind,
    the extension judges that reads other tables.

    :raises ExperimentError: a wrong table, names that the design does not know, or readings that
        cannot be of the ball they name; all of a kind at once.
    :raises MissingExtensionError: what the settings ask for needs that extension.
    """
    d, asked = design.dimension, settings or no_settings()
    sources = [source] if isinstance(source, Path | GivenText) else list(source)
    messages: list[Message] = []
    units = {name: one for kind in design.influences for name, one in kind.columns.items()}
    empty = AXES[:d] if design.positions.across is not None else ()

    def is_possible(x: Array) -> bool:
        return asked.coordinates == "part" or not design.machine.volume.far_outside(x).any()

    found = source_rows(sources, design, asked, messages, is_possible, units, empty)
    settings = found.settings
    rows, redone = thinned(found.rows, design) if thinned else (found.rows, ())
    index, unknown = _indices(rows, design)
    lengths = np.array([row.lengths for row in rows])
    has_uncertainty = not np.isnan(lengths[:, d]).all()
    if has_uncertainty:
        text = "a standard uncertainty must be above zero; correct it, or leave the column out"
        wrong = [row.mark for row in rows if row.lengths[d] <= 0.0]
        messages += [mark.message("", text) for mark in wrong[:MOST_MESSAGES]]
    for k, name in enumerate(("standard uncertainty", *units), start=d):
        blank = np.isnan(lengths[:, k])
        if blank.any() and not blank.all():
            text = f"no {name}, and other rows have one; write it, or leave the column out"
            without = [rows[i].mark for i in np.flatnonzero(blank)[:MOST_MESSAGES].tolist()]
            messages += [mark.message("", text) for mark in without]
    if messages or unknown:
        hints = found.hints if unknown else ()
        raise ExperimentError([*sorted([*messages, *unknown]), *hints])
    given, stated = lengths[:, :d], lengths[:, d]
    beside = None
    if design.influences:
        beside = dict(zip(units, lengths[:, d + 1 :].T, strict=True))
    readings = Readings(index[:, 0], index[:, 1], index[:, 2], np.ones(len(rows), np.int64))
    is_plain = settings.coordinates in (None, "scale readings")
    x = given
    if not is_plain or settings.compensation not in (None, "off", "on"):
        kinds = service("ReadingChecks")
        x = kinds.as_scale_readings(design, readings, given, settings, sources[0])
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
    marks = tuple(row.mark for row in rows)
    swapped: tuple[str, ...] = ()
    if settings.swap_names:
        swap = service("ReadingChecks").with_names_swapped
        readings, swapped = swap(design, readings, x, marks)
    missing, unplanned = _compare(design, readings, marks)
    unread = np.setdiff1d(design.plate_balls, readings.ball)
    if len(unread) and every_ball:
        names = listing(f'"{design.ball_label(int(ball))}"' for ball in unread)
        raise refused(
            sources[0], f"no reading of the balls {names}; read each at least once", line=1
        )
    told, doubt = (*found.told, *swapped), found.doubts
    checks = optional_service("ReadingChecks")
    if checks is not None:
        own = stated if has_uncertainty else None
        doubt += checks.doubts_about_table(design, readings, given, own, settings, rows[0].mark)
        told += checks.said_of(settings)
    observed = combine_standards(design, readings, x, missing, unplanned, marks)
    observed = replace(observed, told=told, of_offsets=doubt, redone=redone)
    if checks is not None:
        checks.refuse_gross_errors(observed.design, observed.x, observed.marks, settings)
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
        more = f" (and in {number_of(len(found) - 1, 'line')} more)" if len(found) > 1 else ""
        messages.append(found[0].mark.message("", text + more))
    return np.array(index, np.int64).reshape(-1, 3), messages


def _refuse_far_outside(rows: tuple[FileRow, ...], x: Array, design: Design) -> None:
    """Refuse readings far outside the volume: their unit is not what it says."""
    messages: list[Message] = []
    for i, axis in np.argwhere(design.machine.volume.far_outside(x)).tolist():
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
    planned = Counter(reading_keys(design.readings.expanded()))
    places: dict[tuple[int, int, int], list[FileRow]] = {}
    for key, row in zip(reading_keys(readings), rows, strict=True):
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


def _planned_uncertainty(design: Design, readings: Readings) -> Array | None:
    """Standard uncertainties (m, d) that the design plans for the readings, None where it plans
    none in particular. Repeats that differ in them count in the order of their groups.
    """
    if design.readings.uncertainty is None:
        return None
    planned = design.readings.expanded()
    assert planned.uncertainty is not None
    of_key: dict[tuple[int, int, int], list[Array]] = {}
    for key, u in zip(reading_keys(planned), planned.uncertainty, strict=True):
        of_key.setdefault(key, []).append(u)
    read: Counter[tuple[int, int, int]] = Counter()
    uncertainties = []
    for key in reading_keys(readings):
        stated = of_key.get(key, [design.machine.repeatability])
        uncertainties.append(stated[min(read[key], len(stated) - 1)])
        read[key] += 1
    return np.array(uncertainties)


def _compare(
    design: Design, readings: Readings, marks: Sequence[Mark]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    planned, found = reading_keys(design.readings.expanded()), reading_keys(readings)

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
