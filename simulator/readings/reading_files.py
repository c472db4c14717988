"""Readings as a CSV file: one row per reading, lengths with their unit in the column's name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from ballplate.simulator.design.arrays import Design, Readings, measured
from ballplate.simulator.design.measurement import in_sequence, nominal_state
from ballplate.simulator.design.observations.readings import expected_readings
from ballplate.simulator.experiment.readings_section import ReadingsSettings, no_settings
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.extensions import optional_service, service
from ballplate.simulator.inputs.messages import (
    MORE_ERRORS,
    MOST_MESSAGES,
    ExperimentError,
    Message,
    refused,
)
from ballplate.simulator.inputs.number_arrays import Array, Integers
from ballplate.simulator.inputs.settings import hint, listing, number_of
from ballplate.simulator.inputs.tables import FileRow
from ballplate.simulator.inputs.units import LENGTH_UNITS
from ballplate.simulator.inputs.writing import CsvWriter
from ballplate.simulator.inputs.yamltree import GivenText, Mark

from .joining import ReadingKey, reading_keys, rows_of
from .observed_readings import ObservedReadings, combine_standards
from .reading_sources import Source, source_rows


def reading_columns(design: Design, readings: Readings, x: Array) -> dict[str, list[Any]]:
    """Return readings as the columns of their file: position, ball, probe, x_mm, y_mm and z_mm, NaN
    for unread co-ordinates.
    """
    names = {
        "position": [design.positions.names[k] for k in readings.position],
        "ball": [design.balls.names[k] for k in readings.ball],
        "probe": [design.probes.names[k] for k in readings.probe],
    }
    x = np.where(measured(design, readings), x, np.nan)
    lengths = zip(AXIS_NAMES[: design.dimension], (1e3 * x).T.tolist(), strict=True)
    return names | {f"{axis}_mm": column for axis, column in lengths}


def write_readings(stream: TextIO, design: Design, readings: Readings, x: Array) -> None:
    """Write the columns of readings with all digits; unread co-ordinates are empty."""
    writer = CsvWriter(stream)
    columns = reading_columns(design, readings, x)
    writer.writerow(list(columns))
    for row in zip(*columns.values(), strict=True):
        # NaN, which differs from itself, is what is not read.
        writer.writerow([*row[:3], *("" if v != v else repr(v) for v in row[3:])])


# In one piece: each refusal precedes code that relies on it, in this order.
def read_readings(
    source: Source | Sequence[Source],
    design: Design,
    every_ball: bool = True,
    settings: ReadingsSettings | None = None,
) -> ObservedReadings:
    """Return readings of one or several files as observations of a design.

    A plain CSV file has the columns position, ball, probe, x_mm, y_mm and z_mm; the layout of other
    tables is detected, or stated by the `settings`, as are the points that co-ordinates refer to.
    The column probe is optional for a single probe, as is a column u, with a unit as in u_um: the
    standard uncertainty of each co-ordinate of a reading, by default that planned or, for an
    unplanned reading, the machine's repeatability; u_x, u_y and u_z are those of single
    co-ordinates. Influence quantities have further columns. A
    reading may occur as often as planned; an unplanned one, once. Without `every_ball`, some balls
    may be unread.

    The extension that reads other tables also checks that readings belong to their balls and their
    co-ordinates are of the stated type.

    :raises ExperimentError: an invalid table, names that the design lacks, or readings that cannot
        be of the ball they name; all errors of one type at once.
    :raises MissingExtensionError: the settings need that extension.
    """
    d, settings = design.dimension, settings or no_settings()
    sources = [source] if isinstance(source, Path | GivenText) else list(source)
    messages: list[Message] = []
    beside_units = {name: unit for kind in design.influences for name, unit in kind.columns.items()}
    units = dict.fromkeys([f"u_{axis}" for axis in AXIS_NAMES[:d]], LENGTH_UNITS) | beside_units
    empty = AXIS_NAMES[:d] if design.positions.across is not None else ()

    table = source_rows(sources, design, settings, messages, units, empty)
    # Reports state some settings themselves.
    settings = table.settings
    rows = table.rows
    index, unknown = _indices(rows, design)
    lengths = np.array([row.lengths for row in rows])
    coordinates, of_axes = lengths[:, :d], lengths[:, d + 1 : 2 * d + 1]
    uncertainty = np.where(np.isnan(of_axes), lengths[:, d, None], of_axes)
    has_uncertainty = not np.isnan(uncertainty).all()
    # What is not read has none.
    uncertainty = np.where(np.isnan(coordinates), design.machine.repeatability, uncertainty)
    if has_uncertainty:
        text = "a standard uncertainty must be above zero; correct it, or leave the column out"
        zero = np.flatnonzero((uncertainty <= 0.0).any(axis=1))[:MOST_MESSAGES].tolist()
        messages += [rows[i].mark.message("", text) for i in zero]
    if not np.isnan(of_axes).all() and settings.coordinates == "part":
        text = "u_x, u_y and u_z are along the machine's axes, and co-ordinates are those of a part"
        messages.append(rows[0].mark.message("", f"{text}; state one u for all axes"))
    beside_columns = lengths[:, 2 * d + 1 :].T
    columns = (uncertainty.sum(axis=1) if has_uncertainty else np.zeros(len(rows)), *beside_columns)
    for name, column in zip(("standard uncertainty", *beside_units), columns, strict=True):
        blank = np.isnan(column)
        if blank.any() and (name not in beside_units or not blank.all()):
            text = f"no {name}, and other rows have one; write it, or leave the column out"
            without = [rows[i].mark for i in np.flatnonzero(blank)[:MOST_MESSAGES].tolist()]
            messages += [mark.message("", text) for mark in without]
    if messages or unknown:
        raise ExperimentError(sorted([*messages, *unknown]))
    beside = None
    if design.influences:
        beside = dict(zip(beside_units, beside_columns, strict=True))
    readings = Readings(index[:, 0], index[:, 1], index[:, 2], np.ones(len(rows), np.int64))
    x = coordinates
    are_scale_readings = settings.coordinates in (None, "scale readings")
    if not are_scale_readings or settings.compensation not in (None, "off", "on"):
        convert = service("ReadingChecks").as_scale_readings
        x = convert(design, readings, coordinates, settings, sources[0])
    x = _where_not_read(rows, x, design, readings)
    if settings.coordinates != "part":
        _refuse_far_outside(rows, x if empty else coordinates, design)
    uncertainties = uncertainty if has_uncertainty else _planned_uncertainty(design, readings)
    readings = replace(readings, uncertainty=uncertainties, beside=beside)
    readings = in_sequence(readings, design.influences)
    marks = tuple(row.mark for row in rows)
    swapped = ()
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
    table_notes = (*table.notes, *swapped)
    checks = optional_service("ReadingChecks")
    if checks is not None:
        table_notes += checks.said_of(settings)
    observed = combine_standards(design, readings, x, missing, unplanned, marks)
    observed = replace(observed, table_notes=table_notes)
    if checks is not None:
        checks.refuse_gross_errors(observed.design, observed.x, observed.marks)
    _refuse_repeated(rows, readings, design)
    return observed


def _indices(rows: tuple[FileRow, ...], design: Design) -> tuple[Integers, list[Message]]:
    """Return indices (rows, 3) of ball, position and probe, and messages about unknown names."""
    positions = {name: k for k, name in enumerate(design.positions.names)}
    probes = {name: k for k, name in enumerate(design.probes.names)}
    balls = [
        {design.balls.names[b]: int(b) for b in design.balls.of(artefact)}
        for artefact in range(len(design.artefacts.names))
    ]
    # Equal names, which are frequent, are looked up once.
    indices = {}
    faults: dict[tuple[str, ...], list[str]] = {}
    index = []
    unknown: dict[str, list[FileRow]] = {}
    for row in rows:
        if len(unknown) >= MOST_MESSAGES:
            unknown.setdefault(MORE_ERRORS, []).append(row)
            break
        if row.texts not in indices:
            position, ball, probe = row.texts
            texts = faults.setdefault(row.texts, [])
            balls_of_plate = {}
            if position in design.positions.switched_off:
                texts.append(f'position "{position}" is switched off; leave its rows out')
            elif position not in positions:
                texts.append(f'unknown position "{position}"; {hint(position, positions)}')
            else:
                balls_of_plate = balls[design.positions.artefact[positions[position]]]
                texts += (
                    []
                    if ball in balls_of_plate
                    else [f'unknown ball "{ball}"; {hint(ball, balls_of_plate)}']
                )
                texts += (
                    [] if probe in probes else [f'unknown probe "{probe}"; {hint(probe, probes)}']
                )
            indices[row.texts] = (
                balls_of_plate.get(ball, 0),
                positions.get(position, 0),
                probes.get(probe, 0),
            )
        for text in faults[row.texts]:
            unknown.setdefault(text, []).append(row)
        index.append(indices[row.texts])
    messages = []
    for text, rows_with_text in unknown.items():
        more = (
            f" (and in {number_of(len(rows_with_text) - 1, 'line')} more)"
            if len(rows_with_text) > 1
            else ""
        )
        messages.append(rows_with_text[0].mark.message("", text + more))
    return np.array(index, np.int64).reshape(-1, 3), messages


def _refuse_far_outside(rows: tuple[FileRow, ...], x: Array, design: Design) -> None:
    """Refuse readings far outside the volume: their unit is wrongly stated."""
    messages: list[Message] = []
    for i, axis in np.argwhere(design.machine.volume.far_outside(x)).tolist():
        if len(messages) >= MOST_MESSAGES:
            messages.append(rows[i].mark.message("", MORE_ERRORS))
            break
        text = (
            f"{AXIS_NAMES[axis]} is {x[i, axis]:.6g} m, far outside the volume; check the unit, and"
            " that it is a co-ordinate of the machine, not of a part (readings: coordinates)"
        )
        messages.append(rows[i].mark.message("", text))
    if messages:
        raise ExperimentError(messages)


def _where_not_read(
    rows: tuple[FileRow, ...], x: Array, design: Design, readings: Readings
) -> Array:
    """Return scale readings (n, d) with nominal ones for unread co-ordinates.

    :raises ExperimentError: a co-ordinate is missing, or present although unread.
    """
    is_read = measured(design, readings)
    messages = []
    for i, axis in np.argwhere(np.isnan(x) == is_read)[:MOST_MESSAGES].tolist():
        position = design.positions.names[readings.position[i]]
        text = f"no {AXIS_NAMES[axis]}; write a number, or remove the line"
        if not is_read[i, axis]:
            text = (
                f'{AXIS_NAMES[axis]} is across the plane of "{position}", which is read in its'
                " plane; leave the cell empty"
            )
        messages.append(rows[i].mark.message("", text))
    if messages:
        raise ExperimentError(messages)
    nominal = expected_readings(design, nominal_state(design), readings)
    return np.where(is_read, x, nominal)


def _refuse_repeated(rows: tuple[FileRow, ...], readings: Readings, design: Design) -> None:
    # A copied line would count as further information.
    planned = Counter(reading_keys(design.readings.expanded()))
    rows_by_key: dict[ReadingKey, list[FileRow]] = {}
    for key, row in zip(reading_keys(readings), rows, strict=True):
        rows_by_key.setdefault(key, []).append(row)
    again = {
        key: occurrences
        for key, occurrences in rows_by_key.items()
        if len(occurrences) > max(planned[key], 1)
    }
    for (position, ball, probe), occurrences in again.items():
        # Of a table read twice all are: the first says it.
        others = f", and {number_of(len(again) - 1, 'other reading')}" if len(again) > 1 else ""
        text = (
            f'ball "{design.ball_label(ball)}" is repeated in position'
            f' "{design.positions.names[position]}" with probe "{design.probes.names[probe]}"'
            f" (first in line {occurrences[0].mark.line}){others}; remove the"
            f" line{'s' * (len(again) > 1)}, or state repeats: {len(occurrences)} for that position"
            " in the experiment"
        )
        raise occurrences[max(planned[position, ball, probe], 1)].mark.refused(text)


def _planned_uncertainty(design: Design, readings: Readings) -> Array | None:
    """Return the planned standard uncertainties (m, d) of readings; None if the plan has only the
    machine's repeatability.

    Repeats with different uncertainties are matched in the order of their groups.
    """
    if design.readings.uncertainty is None:
        return None
    rows = rows_of(design, design, readings)
    planned = design.readings.uncertainty[rows]
    return np.where(rows[:, None] < 0, design.machine.repeatability, planned)


def _compare(
    design: Design, readings: Readings, marks: Sequence[Mark]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    planned, actual = reading_keys(design.readings.expanded()), reading_keys(readings)

    def name(key: ReadingKey) -> str:
        position, ball, probe = key
        return (
            f"{design.positions.names[position]}: ball {design.ball_label(ball)} with"
            f" {design.probes.names[probe]}"
        )

    def without(keys: list[ReadingKey], matches: list[ReadingKey]) -> list[int]:
        remaining = Counter(matches)
        surplus = []
        for i, key in enumerate(keys):
            if remaining[key]:
                remaining[key] -= 1
            else:
                surplus.append(i)
        return surplus

    missing = tuple(name(planned[i]) for i in without(planned, actual))
    several = len({mark.file for mark in marks}) > 1
    files = [f"{mark.file}, " if several else "" for mark in marks]
    return missing, tuple(
        f"{name(actual[i])} ({files[i]}line {marks[i].line})" for i in without(actual, planned)
    )
