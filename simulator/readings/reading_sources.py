"""Rows of readings from plain CSV files that use the design's names.

An extension reads other layouts, reports and other names.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.experiment.readings_section import ReadingsSettings
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.decoding import END_OF_FILE, refuse_long_lines, text_and_encoding
from ballplate.simulator.inputs.extensions import optional_service
from ballplate.simulator.inputs.messages import ExperimentError, Message, refused
from ballplate.simulator.inputs.settings import number_of
from ballplate.simulator.inputs.tables import (
    FileRow,
    header_line,
    header_names,
    header_texts,
    read_table,
)
from ballplate.simulator.inputs.units import Units
from ballplate.simulator.inputs.yamltree import GivenText, read_bytes

from .observed_readings import ObservedReadings

Source = Path | GivenText
# Endings of workbooks, which an extension reads.
WORKBOOKS = (".xlsx", ".xlsm")
ROLES = ("position", "ball", "probe")


@dataclass(frozen=True)
class SourceText:
    """A table of readings as text: its file or name, its content, and its encoding or sheet."""

    source: Source
    text: GivenText
    encoding: str


@dataclass(frozen=True)
class SourceRows:
    """Rows of all tables: `notes` describes how they were read and matched, `settings` are those
    stated, with the co-ordinates that reports state.
    """

    rows: tuple[FileRow, ...]
    notes: tuple[str, ...]
    settings: ReadingsSettings


def source_text(source: Source, encoding: str | None = None) -> SourceText:
    """Return the text of a table of readings.

    :raises ExperimentError: it cannot be read, or is no text.
    """
    if isinstance(source, GivenText):
        return SourceText(source, source, "")
    text, encoding_used = text_and_encoding(read_bytes(source), source, encoding)
    # A report in XML may be a single line.
    if not text.lstrip().startswith("<"):
        refuse_long_lines(text, source)
    return SourceText(source, GivenText(str(source), text.rstrip(END_OF_FILE)), encoding_used)


def source_texts(source: Source, settings: ReadingsSettings) -> list[SourceText]:
    """Return the tables of a file of readings: one, or those of a workbook's sheets.

    :raises ExperimentError: it cannot be read, or is no text nor workbook.
    """
    reader = optional_service("OtherTables")
    if reader and isinstance(source, Path) and source.suffix.lower() in WORKBOOKS:
        tables: list[SourceText] = reader.of_workbook(source, settings.sheet)
        return tables
    if settings.sheet is not None:
        raise refused(source, "is no workbook and has no sheets; leave readings.sheet out")
    return [source_text(source, settings.encoding)]


def source_rows(
    sources: Sequence[Source],
    design: Design,
    settings: ReadingsSettings,
    messages: list[Message],
    units: Units,
    empty: Collection[str] = (),
) -> SourceRows:
    """Return rows of tables of readings, plain ones with the names of the design or others that can
    be matched.

    `messages` collects errors in rows of plain tables, to be reported with later ones.

    :raises ExperimentError: an unreadable table, or ambiguous names.
    """
    _refuse_named_twice(sources)
    tables = [table for source in sources for table in source_texts(source, settings)]
    names = {
        "position": design.positions.names,
        "ball": design.balls.names,
        "probe": design.probes.names,
    }
    axes = AXIS_NAMES[: design.dimension]
    rows: list[FileRow] = []
    errors: list[Message] = []
    foreign = [table for table in tables if not _has_plain_columns(table, settings, axes, units)]
    reader = optional_service("OtherTables")
    if not foreign:
        for table in tables:
            rows += plain_rows(table, names, axes, errors, units, empty)
        rows, notes = _without_switched_off(rows, design.positions.switched_off)
        name_sets = [set(of_role) for of_role in names.values()]
        # Without the extension, `read_readings` reports unknown names of all rows together.
        if not errors and (
            reader is None
            or all(row.texts[k] in name_sets[k] for row in rows for k in range(len(name_sets)))
        ):
            return SourceRows(tuple(rows), notes, settings)
    if reader is None:
        raise ExperimentError(errors) if errors else _not_plain(foreign[0])
    matched: SourceRows = reader.of_sources(tables, design, settings, messages, units, empty)
    return matched


def _without_switched_off(
    rows: list[FileRow], names: Sequence[str]
) -> tuple[list[FileRow], tuple[str, ...]]:
    """Return rows of positions that are read, and notes on those left out."""
    counts = Counter(row.texts[0] for row in rows if row.texts[0] in names)
    notes = (
        f'position "{name}" is switched off: {number_of(count, "reading")} left out'
        for name, count in counts.items()
    )
    return [row for row in rows if row.texts[0] not in counts], tuple(notes)


def named_rows(
    source: Source,
    names: Mapping[str, Sequence[str]],
    settings: ReadingsSettings,
    dimension: int,
    empty: Collection[str] = (),
) -> tuple[FileRow, ...]:
    """Return rows of one table with the names in it.

    :raises ExperimentError: it cannot be read.
    """
    (table, *others), axes = source_texts(source, settings), AXIS_NAMES[:dimension]
    if others:
        raise refused(source, "has several tables; name one sheet: readings: {sheet: …}")
    errors: list[Message] = []
    if _has_plain_columns(table, settings, axes, {}):
        rows = plain_rows(table, names, axes, errors, {}, empty)
        if not errors:
            return rows
    messages: list[Message] = []
    reader = optional_service("OtherTables")
    if reader is None:
        raise ExperimentError(errors) if errors else _not_plain(table)
    result = reader.of_table(table, names, settings, messages, dimension, {}, empty)
    if messages:
        raise ExperimentError(messages)
    return tuple(result.rows)


def _not_plain(table: SourceText) -> ExperimentError:
    """Return the error of a table that needs an extension."""
    text = (
        "these are not the columns of a plain table; other tables need the extension laboratory,"
        " which is not installed"
    )
    return refused(table.source, text)


def is_plain(table: SourceText, settings: ReadingsSettings, axes: Sequence[str]) -> bool:
    """Return whether a table may be a plain CSV file; stated columns or formats exclude it."""
    layout = (settings.columns, settings.separator, settings.decimal, settings.header)
    has_axes = table.encoding in ("", "UTF-8") and header_names(table.text) & set(axes)
    is_usual = layout == (None,) * 4 and not settings.fill_down
    return bool(has_axes) and is_usual and header_line(table.text).separator == ","


def _has_plain_columns(
    table: SourceText, settings: ReadingsSettings, axes: Sequence[str], units: Units
) -> bool:
    """Return whether a table has the columns of a plain CSV file and no others."""
    lengths = {*axes, "u", *units}
    return (
        is_plain(table, settings, axes)
        and not settings.probes
        and all(
            text in ROLES or ("_" in text and text.rpartition("_")[0] in lengths)
            for text in header_texts(table.text)
        )
    )


def plain_rows(
    table: SourceText,
    names: Mapping[str, Sequence[str]],
    axes: Sequence[str],
    errors: list[Message],
    units: Units,
    empty: Collection[str] = (),
) -> tuple[FileRow, ...]:
    """Return rows of a plain CSV file, and add its errors to a list."""
    # A single probe need not be named.
    defaults = {"probe": names["probe"][0]} if len(names["probe"]) == 1 else {}
    further = ["u", *units]
    try:
        return tuple(
            read_table(
                *(table.text, list(ROLES), axes, further, errors, defaults, np.nan, units, empty),
                # What a comma means in readings is asked where it may be a sign of thousands.
                decimal=".",
            )
        )
    except ExperimentError as error:
        errors += [message for message in error.messages if message not in errors]
        return ()


def _refuse_named_twice(sources: Sequence[Source]) -> None:
    first_names: dict[Path, Path] = {}
    for source in sources:
        if not isinstance(source, Path) or not source.is_file():
            continue
        target = source.resolve()
        if target in first_names:
            also = "" if first_names[target] == source else f", as {first_names[target]} as well"
            raise refused(source, f"the file is named twice{also}; name it once")
        first_names[target] = source


# Hexadecimal digits of a position's fingerprint.
DIGITS = 16


def position_fingerprints(observed: ObservedReadings) -> dict[str, str]:
    """Return the beginning of the SHA-256 of each position's readings, by its name.

    Hashed are balls, probes and scale readings, independently of the order and form of tables and
    of the positions' names.
    """
    design, readings = observed.design, observed.design.readings
    balls = np.array(design.balls.names)[readings.ball]
    probes = np.array(design.probes.names)[readings.probe]
    order = np.lexsort((*observed.x.T[::-1], probes, balls, readings.position))
    position = readings.position[order]
    starts = np.flatnonzero(np.diff(position, prepend=-1)).tolist()
    fingerprints = {}
    for start, end in pairwise([*starts, len(order)]):
        rows = order[start:end]
        digest = hashlib.sha256("\n".join([*balls[rows], *probes[rows]]).encode())
        digest.update(np.ascontiguousarray(observed.x[rows], "<f8").tobytes())
        fingerprints[design.positions.names[int(position[start])]] = digest.hexdigest()[:DIGITS]
    return fingerprints


def fingerprint(observed: ObservedReadings) -> str:
    """Return the SHA-256 of all readings."""
    parts = sorted(position_fingerprints(observed).values())
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()
