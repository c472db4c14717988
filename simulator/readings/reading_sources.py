"""Rows of readings from one table or several, plain CSV files or any other, with the names and the
co-ordinates that the design has.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from ballplate.extensions.laboratory.any_table import TableRows, read_any_table, text_of
from ballplate.extensions.laboratory.clock_times import wrong_times
from ballplate.extensions.laboratory.heading_words import heading, is_clock
from ballplate.extensions.laboratory.headings import Vocabulary
from ballplate.extensions.laboratory.name_matching import with_known_names
from ballplate.extensions.laboratory.uncertainty_headings import headed_uncertainty

from ..design.arrays import Design
from ..experiment.readings_section import ReadingsSettings
from ..geometry.motions import AXIS_NAMES
from ..inputs.messages import ExperimentError, Message, refused
from ..inputs.quantities import format_length
from ..inputs.settings import listing
from ..inputs.tables import FileRow, header_names, header_texts, read_table
from ..inputs.yamltree import GivenText
from ..machines.protocol import Array
from .coordinate_kinds import controller_offsets

Source = Path | GivenText
Units = Mapping[str, Mapping[str, Fraction]]

# A diameter is told that is further from others of its ball than so many times their usual
# distance, and than this (m).
TIMES_USUAL = 10.0
LEAST_DEVIATION = 1e-6
# Readings of a ball that its median diameter is of.
ENOUGH = 3


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


def source_rows(
    sources: Sequence[Source],
    design: Design,
    settings: ReadingsSettings,
    messages: list[Message],
    is_possible: Callable[[Array], bool],
    units: Units,
    empty: Collection[str] = (),
) -> SourceRows:
    """Rows of tables of readings, or of reports of measuring programs, with the names of the design
    as far as they can be matched.

    Messages about rows of plain tables are added to `messages`, so that more can be said at once.

    :raises ExperimentError: a table that cannot be read, or names that could be several.
    """
    _refuse_named_twice(sources)
    names = {
        "position": design.positions.names,
        "ball": design.balls.names,
        "probe": design.probes.names,
    }

    def of_report(source: Source, text: GivenText) -> TableRows | None:
        from ballplate.extensions.laboratory.report_sources import report_rows

        return report_rows(source, text, design, settings, units)

    d = design.dimension
    tables = [
        read_source(source, names, settings, messages, is_possible, d, units, empty, of_report)
        for source in sources
    ]
    rows = [row for table in tables for row in table.rows]
    if messages:
        return SourceRows(tuple(rows), (), settings)
    _refuse_wrong_times(sources, tables)
    said: tuple[str, ...] = ()
    if any(table.coordinates is not None for table in tables):
        from ballplate.extensions.laboratory.report_sources import with_coordinates

        settings, said = with_coordinates(settings, sources, tables)
    diameters = [d for table in tables for d in table.diameters]

    def places(own: Sequence[FileRow]) -> Array:
        return _places(own, design, settings)

    hints = tuple(hint for table in tables for hint in table.hints)
    named, names_found = with_known_names(
        rows, design, None if settings.coordinates == "part" else places
    )
    if names_found.asked:
        asked = [rows[0].mark.message("", text) for text in names_found.asked]
        raise ExperimentError([*asked, *hints])
    told = [*(text for table in tables for text in table.told), *said]
    if len(diameters) == len(rows):
        told += _about_diameters(named, np.array(diameters))
    doubts = tuple(names_found.doubted)
    return SourceRows(named, (*told, *names_found.told), settings, hints, doubts)


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


def _refuse_wrong_times(sources: Sequence[Source], tables: Sequence[TableRows]) -> None:
    """Refuse clock times that may be of several days, or beside other times.

    :raises ExperimentError: there are such.
    """
    times = [time for table in tables for time in table.times]
    for source, table in zip(sources, tables, strict=True):
        if times and not table.times:
            text = f"no clock times, which {times[0][0].file} has; write all times of one kind"
            raise refused(source, text)
    if messages := wrong_times(times):
        raise ExperimentError(messages)


def read_source(
    source: Source,
    names: Mapping[str, Sequence[str]],
    settings: ReadingsSettings,
    messages: list[Message],
    is_possible: Callable[[Array], bool],
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
    text, encoding = text_of(source, settings.encoding)
    stated = (settings.columns, settings.separator, settings.decimal, settings.header)
    wrong: list[Message] = []
    rows: tuple[FileRow, ...] = ()
    heads = header_names(text)
    clocks = {name for name, one in units.items() if is_clock("", one)}
    looks_plain = encoding in ("", "UTF-8") and heads & set(axes)
    # Plain tables have standard uncertainties only, and times in seconds or the like.
    others = any(headed_uncertainty(name, heading) for name in heads - {"u"})
    others |= not clocks.isdisjoint(header_texts(text))
    if looks_plain and not others and all(one is None for one in stated):
        # One probe need not be named.
        defaults = {"probe": names["probe"][0]} if len(names["probe"]) == 1 else {}
        texts = ["position", "ball", "probe"]
        try:
            rows = read_table(
                text, texts, axes, ["u", *units], wrong, defaults, np.nan, units, empty
            )
        except ExperimentError as error:
            wrong = list(error.messages)
        if not wrong:
            return TableRows(rows)
    words = Vocabulary(
        axes, tuple(names["probe"]), tuple(names["position"]), settings.columns, units, empty
    )
    try:
        return read_any_table(text, encoding, words, settings, is_possible)
    except ExperimentError:
        if (report := of_report(source, text)) is not None:
            return report
        from ballplate.extensions.laboratory.other_files import what_it_is

        # Who names columns knows what the file is.
        if settings.columns is None and (other := what_it_is(text)):
            raise refused(source, other, line=1) from None
        if not wrong:
            raise
    if not rows:
        raise ExperimentError(wrong)
    messages += wrong
    return TableRows(rows)


def _places(rows: Sequence[FileRow], design: Design, settings: ReadingsSettings) -> Array:
    """Places (m, d) of the balls of rows, as far as the probe is known."""
    x = np.array([row.lengths[: design.dimension] for row in rows])
    added = design.probes.offsets
    if settings.coordinates == "ball centres":
        added = added - controller_offsets(design, settings)
    index = {name: k for k, name in enumerate(design.probes.names)}
    probe = np.array([index.get(row.texts[2], -1) for row in rows])
    return np.asarray(x + np.where((probe >= 0)[:, None], added[probe], 0.0))


def _about_diameters(rows: Sequence[FileRow], diameters: Array) -> list[str]:
    """In words which diameters of balls as measured are odd; nothing where none is stated."""
    known = np.flatnonzero(~np.isnan(diameters))
    if not len(known):
        return []
    by_ball: dict[str, list[int]] = {}
    for i in known.tolist():
        by_ball.setdefault(rows[i].texts[1], []).append(i)
    usual = float(np.median(diameters[known]))
    off = np.zeros(len(rows))
    for own in by_ball.values():
        off[own] = diameters[own] - (np.median(diameters[own]) if len(own) >= ENOUGH else usual)
    limit = max(TIMES_USUAL * 1.4826 * float(np.median(np.abs(off[known]))), LEAST_DEVIATION)
    odd = known[np.abs(off[known]) > limit]
    odd = odd[np.argsort(-np.abs(off[odd]), kind="stable")]
    text = f"sphere diameters, {format_length(float(f'{usual:.6g}'))} in the middle, are not used"
    if not len(odd):
        return [f"{text}; none is odd"]
    named = listing(
        (
            f"{rows[i].texts[1]} in {rows[i].texts[0]} (line {rows[i].mark.line}):"
            f" {format_length(float(f'{diameters[i]:.6g}'))}"
            for i in odd.tolist()
        ),
        5,
    )
    return [f"{text}; odd: {named}: check these readings for dirt, or for another feature"]
