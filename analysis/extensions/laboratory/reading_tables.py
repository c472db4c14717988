"""Rows of readings from one table or several, plain CSV files or any other, with the names and the
co-ordinates that the design has.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np
from ballplate.simulator.design import Design
from ballplate.simulator.experiment import ReadingsSettings
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import (
    ExperimentError,
    FileRow,
    GivenText,
    Message,
    header_names,
    header_texts,
    refused,
)
from ballplate.simulator.machines import Array
from ballplate.simulator.readings import Source, SourceRows, SourceText, Units, is_plain, plain_rows

from .any_table import AskedError, TableRows, read_any_table
from .clock_times import wrong_times
from .column_names import with_stated_names
from .coordinate_kinds import controller_offsets
from .heading_words import heading, is_clock
from .headings import Vocabulary
from .name_matching import with_known_names
from .uncertainty_headings import headed_uncertainty
from .workbooks import workbook_tables


def any_source_rows(
    tables_read: Sequence[SourceText],
    design: Design,
    settings: ReadingsSettings,
    messages: list[Message],
    units: Units,
    empty: Collection[str] = (),
) -> SourceRows:
    """Rows of tables of readings, or of reports of measuring programs, with the names of the
    design if they can be matched.

    Messages about rows of plain tables are added to `messages`, so that more can be said at once.

    :raises ExperimentError: a table that cannot be read, or names that could be several.
    """
    sources = [table_read.source for table_read in tables_read]
    names = {
        "position": design.positions.names,
        "ball": design.balls.names,
        "probe": (*design.probes.names, *(settings.probes or {})),
    }

    def of_report(source: Source, text: GivenText) -> TableRows | None:
        from .report_sources import report_rows

        return report_rows(source, text, design, settings, units)

    d = design.dimension
    tables = [
        any_table_rows(table_read, names, settings, messages, d, units, empty, of_report)
        for table_read in tables_read
    ]
    if messages:
        return SourceRows(tuple(row for table in tables for row in table.rows), (), settings)
    tables = [
        with_stated_names(table, str(source), design, settings)
        if table.coordinates is None
        else table
        for source, table in zip(sources, tables, strict=True)
    ]
    rows = [row for table in tables for row in table.rows]
    _refuse_wrong_times(sources, tables)
    notes: tuple[str, ...] = ()
    if any(table.coordinates is not None for table in tables):
        from .report_sources import with_coordinates

        settings, notes = with_coordinates(settings, sources, tables)

    def places(rows_of_source: Sequence[FileRow]) -> Array:
        return _places(rows_of_source, design, settings)

    named, names_found = with_known_names(
        rows, design, None if settings.coordinates == "part" else places
    )
    if names_found.asked:
        # How tables were read names the columns that are not used.
        told = (text for table in tables if table.coordinates is None for text in table.told)
        texts = (*names_found.asked, *told)
        raise ExperimentError([rows[0].mark.message("", text) for text in texts])
    notes_of_all = [*(text for table in tables for text in table.told), *notes]
    return SourceRows(named, (*notes_of_all, *names_found.told), settings)


def _refuse_wrong_times(sources: Sequence[Source], tables: Sequence[TableRows]) -> None:
    """Refuse clock times that may be of several days, or mixed with other times.

    :raises ExperimentError: in these cases.
    """
    times = [time for table in tables for time in table.times]
    for source, table in zip(sources, tables, strict=True):
        if times and not table.times:
            text = f"no clock times, which {times[0][0].file} has; write all times of one kind"
            raise refused(source, text)
    if messages := wrong_times(times):
        raise ExperimentError(messages)


def any_table_rows(
    table: SourceText,
    names: Mapping[str, Sequence[str]],
    settings: ReadingsSettings,
    messages: list[Message],
    dimension: int,
    units: Units,
    empty: Collection[str] = (),
    of_report: Callable[[Source, GivenText], TableRows | None] = lambda source, text: None,
) -> TableRows:
    """Rows of one table: of a plain CSV file where it is one; `units` are those of further columns,
    and cells of the columns `empty` may be so in plain files. What is no table may be a report.

    :raises ExperimentError: it cannot be read; messages about rows of a plain one are added to
        `messages`.
    """
    axes = AXIS_NAMES[:dimension]
    source, text, encoding = table.source, table.text, table.encoding
    heads = header_names(text)
    clocks = {name for name, unit in units.items() if is_clock("", unit)}
    # Plain tables have standard uncertainties only, and times in seconds or the like.
    has_others = any(headed_uncertainty(name, heading) for name in heads - {"u"})
    has_others |= not clocks.isdisjoint(header_texts(text))
    wrong: list[Message] = []
    rows: tuple[FileRow, ...] = ()
    if is_plain(table, settings, axes) and not has_others:
        rows = plain_rows(table, names, axes, wrong, units, empty)
        if not wrong:
            return TableRows(rows)
    words = Vocabulary(
        axes, tuple(names["probe"]), tuple(names["position"]), settings.columns, units, empty
    )
    try:
        return read_any_table(text, encoding, words, settings)
    except ExperimentError as error:
        if (report := of_report(source, text)) is not None:
            return report
        from .other_files import what_it_is

        # Who names columns knows what the file is.
        if settings.columns is None and (other_meaning := what_it_is(text)):
            raise refused(source, other_meaning, line=1) from None
        # Every line of a plain table would have the fault.
        if not wrong or isinstance(error, AskedError):
            raise
    if not rows:
        raise ExperimentError(wrong)
    messages += wrong
    return TableRows(rows)


def _places(rows: Sequence[FileRow], design: Design, settings: ReadingsSettings) -> Array:
    """Places (m, d) of the balls of rows, if the probe is known."""
    x = np.array([row.lengths[: design.dimension] for row in rows])
    added = design.probes.offsets
    if settings.coordinates == "ball centres":
        added = added - controller_offsets(design, settings)
    index = {name: k for k, name in enumerate(design.probes.names)}
    probe = np.array([index.get(row.texts[2], -1) for row in rows])
    return x + np.where((probe >= 0)[:, None], added[probe], 0.0)


class OtherTables:
    """The functions that read tables that are not plain."""

    of_sources = staticmethod(any_source_rows)
    of_table = staticmethod(any_table_rows)
    of_workbook = staticmethod(workbook_tables)
