"""Rows of readings from plain CSV files, one or several, with the names that the design has.

Tables of any other form, reports, and names that differ are read by an extension.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from ..design.arrays import Design
from ..experiment.readings_section import ReadingsSettings
from ..geometry.motions import AXIS_NAMES
from ..inputs.decoding import END_OF_FILE, refuse_long_lines, text_and_encoding
from ..inputs.extensions import optional_service
from ..inputs.messages import ExperimentError, Message, refused
from ..inputs.tables import FileRow, header_names, header_texts, read_table
from ..inputs.yamltree import GivenText, read_bytes
from ..machines.protocol import Array

Source = Path | GivenText
Units = Mapping[str, Mapping[str, Fraction]]
ROLES = ("position", "ball", "probe")


@dataclass(frozen=True)
class SourceText:
    """A table of readings as text: its file or name, what it says, and its encoding."""

    source: Source
    text: GivenText
    encoding: str


@dataclass(frozen=True)
class SourceRows:
    """Rows of all tables; `told` is how they were read and what was matched, `hints` what to say
    where names are not known, and `settings` those given, with what reports say of co-ordinates.
    `doubts` are about names that were matched.
    """

    rows: tuple[FileRow, ...]
    told: tuple[str, ...]
    settings: ReadingsSettings
    hints: tuple[Message, ...] = ()
    doubts: tuple[str, ...] = ()


def source_text(source: Source, encoding: str | None = None) -> SourceText:
    """The text of a table of readings.

    :raises ExperimentError: it cannot be read, or is no text.
    """
    if isinstance(source, GivenText):
        return SourceText(source, source, "")
    text, found = text_and_encoding(read_bytes(source), source, encoding)
    # A report in XML may be a single line.
    if not text.lstrip().startswith("<"):
        refuse_long_lines(text, source)
    return SourceText(source, GivenText(str(source), text.rstrip(END_OF_FILE)), found)


def source_rows(
    sources: Sequence[Source],
    design: Design,
    settings: ReadingsSettings,
    messages: list[Message],
    is_possible: Callable[[Array], bool],
    units: Units,
    empty: Collection[str] = (),
) -> SourceRows:
    """Rows of tables of readings: plain ones with the names of the design, or any others as far as
    they can be matched.

    Messages about rows of plain tables are added to `messages`, so that more can be said at once.

    :raises ExperimentError: a table that cannot be read, or names that could be several.
    """
    _refuse_named_twice(sources)
    tables = [source_text(source, settings.encoding) for source in sources]
    names = {
        "position": design.positions.names,
        "ball": design.balls.names,
        "probe": design.probes.names,
    }
    axes = AXIS_NAMES[: design.dimension]
    rows: list[FileRow] = []
    wrong: list[Message] = []
    others = [one for one in tables if not _has_own_columns(one, settings, axes, units)]
    read = optional_service("OtherTables")
    if not others:
        for one in tables:
            rows += plain_rows(one, names, axes, wrong, units, empty)
        known = [set(of_role) for of_role in names.values()]
        is_known = all(row.texts[k] in known[k] for row in rows for k in range(len(known)))
        # Which names are not is told of all rows together.
        if not wrong and (is_known or read is None):
            return SourceRows(tuple(rows), (), settings)
    if read is None:
        raise ExperimentError(wrong) if wrong else _not_plain(others[0])
    found: SourceRows = read.of_sources(
        tables, design, settings, messages, is_possible, units, empty
    )
    return found


def named_rows(
    source: Source,
    names: Mapping[str, Sequence[str]],
    settings: ReadingsSettings,
    dimension: int,
    empty: Collection[str] = (),
) -> tuple[FileRow, ...]:
    """Rows of one table with the names that it has.

    :raises ExperimentError: it cannot be read.
    """
    table, axes = source_text(source, settings.encoding), AXIS_NAMES[:dimension]
    wrong: list[Message] = []
    if _has_own_columns(table, settings, axes, {}):
        rows = plain_rows(table, names, axes, wrong, {}, empty)
        if not wrong:
            return rows
    messages: list[Message] = []
    read = optional_service("OtherTables")
    if read is None:
        raise ExperimentError(wrong) if wrong else _not_plain(table)
    found = read.of_table(table, names, settings, messages, lambda x: False, dimension, {}, empty)
    if messages:
        raise ExperimentError(messages)
    return tuple(found.rows)


def _not_plain(table: SourceText) -> ExperimentError:
    """The error of a table that only an extension reads, which is not installed."""
    text = (
        "these are not the columns of a plain table; other tables need the extension laboratory,"
        " which is not installed"
    )
    return refused(table.source, text)


def is_plain(table: SourceText, settings: ReadingsSettings, axes: Sequence[str]) -> bool:
    """Whether a table may be a plain CSV file, of which nothing is stated."""
    stated = (settings.columns, settings.separator, settings.decimal, settings.header)
    is_read = table.encoding in ("", "UTF-8") and header_names(table.text) & set(axes)
    return bool(is_read) and all(one is None for one in stated)


def _has_own_columns(
    table: SourceText, settings: ReadingsSettings, axes: Sequence[str], units: Units
) -> bool:
    """Whether a table has the columns of a plain CSV file and no others."""
    lengths = {*axes, "u", *units}
    return is_plain(table, settings, axes) and all(
        text in ROLES or ("_" in text and text.rpartition("_")[0] in lengths)
        for text in header_texts(table.text)
    )


def plain_rows(
    table: SourceText,
    names: Mapping[str, Sequence[str]],
    axes: Sequence[str],
    wrong: list[Message],
    units: Units,
    empty: Collection[str] = (),
) -> tuple[FileRow, ...]:
    """Rows of a plain CSV file; what is wrong with them is added to a list."""
    # One probe need not be named.
    defaults = {"probe": names["probe"][0]} if len(names["probe"]) == 1 else {}
    further = ["u", *units]
    try:
        return tuple(
            read_table(
                table.text, list(ROLES), axes, further, wrong, defaults, np.nan, units, empty
            )
        )
    except ExperimentError as error:
        wrong += [one for one in error.messages if one not in wrong]
        return ()


def _refuse_named_twice(sources: Sequence[Source]) -> None:
    """Refuse a file that is given more than once, by whatever paths.

    :raises ExperimentError: one is.
    """
    seen: dict[Path, Path] = {}
    for source in sources:
        if not isinstance(source, Path) or not source.is_file():
            continue
        place = source.resolve()
        if place in seen:
            known = "" if seen[place] == source else f", as {seen[place]} as well"
            raise refused(source, f"the file is named twice{known}; name it once")
        seen[place] = source
