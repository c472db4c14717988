"""Readings from tables in any form that is not ambiguous, and as text how each was read."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ballplate.simulator.experiment import Coordinate, ReadingsSettings
from ballplate.simulator.inputs import (
    LENGTH_UNITS,
    LINE_END,
    MORE_ERRORS,
    MOST_MESSAGES,
    MOST_ROWS,
    ExperimentError,
    FileRow,
    GivenText,
    Mark,
    Message,
    QuantityError,
    listing,
    metres_or_radians,
    parse_positive_length,
    refuse_controls,
    refused,
    shorten,
    text_of_cell,
)

from .above_headings import said_above
from .clock_times import ReadTime, clock_time
from .column_units import units_of_columns
from .heading_words import NOTHING, quoted
from .headings import TEXTS, Group, HeadedColumn, HeadingError, Vocabulary
from .merged_cells import question
from .missing_columns import missing_columns
from .table_forms import (
    DECIMALS,
    SEPARATORS,
    Form,
    NoFormError,
    chosen_form,
    forms_of,
    holds_nothing,
)

TEMPERATURES = (
    "temperature_artefact_degC and temperature_scales_degC are used where the experiment has"
    " influences of kind: temperature for them"
)


@dataclass(frozen=True)
class TableRows:
    """Rows of tables of readings: the names of position, ball and probe, lengths in metres (x, y,
    z and u), and further columns; NaN if not stated.

    `told` describes how each table was read.
    `coordinates` is the type of a report's co-ordinates, None for a table. `times` are those of
    rows with clock times.
    """

    rows: tuple[FileRow, ...]
    told: tuple[str, ...] = ()
    coordinates: Coordinate | None = None
    times: tuple[ReadTime, ...] = ()


def read_any_table(
    source: GivenText,
    encoding: str,
    words: Vocabulary,
    settings: ReadingsSettings,
) -> TableRows:
    """Return rows of a table whose form is detected, or stated in the experiment.

    Names are those of the table; the probe is empty if not stated.

    :raises ExperimentError: the table is ambiguous, lacks columns or units, or has invalid
        entries.
    """
    refuse_controls(source.text, source)
    texts = LINE_END.split(source.text)
    lines = [
        (number, text)
        for number, text in enumerate(texts, start=1)
        if not re.fullmatch(r"[\s;,|]*", text)
    ]
    if not lines:
        columns = ["position", "ball", "probe", *(f"{axis}_mm" for axis in words.axes)]
        text = f"the file is empty; its first line should be {','.join(columns)}"
        raise refused(source, text, line=1)
    if len(lines) > MOST_ROWS:
        raise refused(source, f"more than {MOST_ROWS} rows; leave some out")
    try:
        form = chosen_form(forms_of(lines, words, settings))
    except NoFormError as error:
        text = error.text or missing_columns(error.cells, words, words.axes)
        raise refused(source, text, line=error.line) from None
    return _Reader(source, encoding, words, settings, form).read()


class AskedError(ExperimentError):
    """A question about a table, whose answer may make it readable."""


@dataclass(frozen=True)
class _Reader:
    """Reads the rows of a table whose form is known."""

    source: GivenText
    encoding: str
    words: Vocabulary
    settings: ReadingsSettings
    form: Form

    def error(self, text: str, line: int = 0) -> ExperimentError:
        return refused(self.source, text, line=line or max(self.form.header, 1))

    def read(self) -> TableRows:
        form = self.form
        above, units = self._asked()
        texts, texts_above = self._texts(above)
        rows = [row for group in form.headings.groups for row in self._rows(group, texts, units)]
        # In the order that they were read in, also where several stand side by side.
        rows.sort(key=lambda row: row.mark.line)
        notes = (self._told(units, texts_above),)
        times = tuple(
            (Mark(str(self.source), line, 1), cells[column.place], *clock_time(cells[column.place]))
            for name, column in form.headings.roles.items()
            if name in self.words.further and column.unit is None
            for line, cells in form.rows
            if cells[column.place].casefold() not in NOTHING
        )
        return TableRows(tuple(rows), notes, times=times)

    def _asked(self) -> tuple[dict[str, str], dict[int, str]]:
        """Return texts above the headings, and units by index of the columns of lengths.

        :raises ExperimentError: wrong rows, or columns, names or units that are missing, all at
            once.
        """
        form, headings = self.form, self.form.headings
        asked = [Message(str(self.source), line, 1, "", text) for line, text in form.wrong]
        if len(asked) > MOST_MESSAGES:
            asked = [*asked[:MOST_MESSAGES], replace(asked[-1], text=MORE_ERRORS)]
        if not (asked or form.rows or form.blank):
            text = "no rows below the names of the columns; add at least one"
            if form.empty:
                text = f"{listing(self.words.axes)} are empty in all rows; enter values,"
                text += " and remove rows without any"
            raise self.error(text, *form.empty[:1])
        if form.blank:
            # Faults of rows below may be of the blank cells.
            lines = sorted({line for line, _ in form.blank})
            names = dict.fromkeys(headings.name(place) for _, place in form.blank)
            text = question(names, lines, bool(self.settings.fill_down))
            asked = [*self.error(text, lines[0]).messages]
        if "ball" not in headings.roles and not headings.nominal:
            asked[:0] = self.error(missing_columns(headings.cells, self.words)).messages
        try:
            above = said_above(form.above)
            units = units_of_columns(form, self.settings, above)
        except HeadingError as error:
            # The unit may be in a column that is read wrongly.
            if form.blank or not form.wrong:
                asked[:0] = self.error(str(error)).messages
        if asked:
            raise (AskedError if form.blank else ExperimentError)(asked)
        return above, units

    def _texts(self, above: Mapping[str, str]) -> tuple[dict[str, str], list[str]]:
        """Return texts that apply to all rows without a column for them, and their sources.

        :raises ExperimentError: the position is not stated.
        """
        texts, notes = {}, []
        every = {role for group in self.form.headings.groups for role in group.texts}
        for role in ("position", "probe"):
            column = self.form.headings.roles.get(role)
            names_known = getattr(self.words, f"{role}s")
            if column is not None:
                if column.constant is not None:
                    texts[role] = column.constant
            elif f"{{{role}}}" in (self.settings.names or ""):
                continue
            elif role in above:
                texts[role] = above[role]
                notes.append(f'{role} "{shorten(above[role])}" above the headings')
            elif role in every:
                continue
            elif len(names_known) == 1:
                texts[role] = names_known[0]
            elif role == "position":
                name = Path(self.source.name).stem
                if name == self.source.name:
                    raise self.error(missing_columns(self.form.headings.cells, self.words))
                texts[role] = name
                notes.append(f'position "{shorten(name)}" by the name of the file')
        return texts, notes

    def _rows(
        self, group: Group, texts: Mapping[str, str], units: Mapping[int, str]
    ) -> list[FileRow]:
        """Return rows of the readings of a group of columns."""
        roles, file = self.form.headings.roles, str(self.source)
        sign = DECIMALS[self.form.decimal]
        axes = [axis.place for axis in group.axes]
        factors = {i: LENGTH_UNITS[u] for i, u in units.items()}
        further = [roles.get(name) for name in self.words.further]
        for name, names_known in self.words.further.items():
            if name in roles and (unit := roles[name].unit) is not None:
                factors[roles[name].place] = names_known[unit]
        constants = {**texts, **group.texts}
        places = self.form.headings.places
        rows: list[FileRow] = []
        messages: list[Message] = []

        def number(cells: Sequence[str], i: int, mark: Mark) -> float:
            factor, cell = factors.get(i), cells[i].replace(sign, ".")
            if cell.casefold() in NOTHING:
                return math.nan
            try:
                if factor is None:
                    return clock_time(cells[i])[1]
                return metres_or_radians(cell, factor)
            except QuantityError as error:
                messages.append(mark.message("", str(error)))
                return math.nan

        u = roles["u"].place if "u" in roles else None
        of_all = math.nan
        if u is not None and (constant := roles["u"].constant) is not None:
            u, of_all = None, parse_positive_length(constant)
        for line, cells in self.form.rows:
            if len(messages) >= MOST_MESSAGES:
                break
            if holds_nothing(cells, axes):
                continue
            mark = Mark(file, line, 1)
            names = tuple(
                text_of_cell(cells[places[role]]) if role in places else constants.get(role, "")
                for role in TEXTS
            )
            if nominal := self.form.headings.nominal:
                # Where it should be is the name of a ball, which its place then identifies.
                where = " ".join(cells[i] for i in nominal)
                names = names[0], f"{names[0]}: {where}", names[2]
            x = [number(cells, i, mark) for i in axes]
            x.append(of_all if u is None else number(cells, u, mark))
            if "k" in roles and not math.isnan(x[-1]):
                x[-1] /= _coverage_factor(roles["k"], cells, sign, mark, messages)
            x += [
                math.nan if column is None else number(cells, column.place, mark)
                for column in further
            ]
            rows.append(FileRow(mark, names, tuple(x)))
        if messages:
            raise ExperimentError(messages)
        return rows

    def _told(self, units: Mapping[int, str], notes_above: Sequence[str]) -> str:
        """Return a sentence on how the table was read."""
        form, headings = self.form, self.form.headings
        parts = [SEPARATORS[form.separator][1], f"decimal {form.decimal}s"]
        parts += [self.encoding] if self.encoding else []
        parts.append(f"header in line {form.header}" if form.header else "without header")
        parts.append(" and ".join(dict.fromkeys(units.values())))
        parts += ["one row per axis"] if headings.by_axis else []
        parts += [f"{form.between} between thousands"] if form.between else []
        parts += [f"{form.filled} blank cells as above"] if form.filled else []
        parts += [
            f'{role} from "{shorten(headings.cells[column.place])}"'
            for role, column in headings.roles.items()
            if column.place >= 0
            and headings.cells
            and (headings.cells[column.place].strip().casefold() != role or role == "k")
            and (role != "unit" or form.units_of_rows)
        ]
        if "k" in headings.roles:
            parts.append("u is the expanded uncertainty divided by its coverage factor k")
        if "u" in headings.roles and (u := headings.roles["u"].constant) is not None:
            parts.append(f"u is {u} in all rows")
        if len(headings.groups) > 1:
            groups_text = listing((" ".join(group.texts.values()) for group in headings.groups), 6)
            parts.append(f"co-ordinates of {groups_text} side by side")
        parts += ["balls by nominal co-ordinates"] if headings.nominal else []
        parts += notes_above
        if headings.unused:
            names = quoted(headings.unused)
            warm = any("temp" in cell.casefold() for cell in headings.unused)
            parts.append(f"not used: {names}{f' ({TEMPERATURES})' if warm else ''}")
        if form.others:
            counts = (f'"{shorten(name)}" ({count})' for name, count in form.others)
            parts.append(f"rows of no axis, left out: {listing(counts, 8)}")
        if form.empty:
            parts.append(f"without co-ordinates, left out: line{_numbers(form.empty)}")
        return f"{self.source}: read as: {', '.join(parts)}"


def _coverage_factor(
    column: HeadedColumn, cells: Sequence[str], sign: str, mark: Mark, messages: list[Message]
) -> float:
    """The coverage factor of a row; NaN after reporting faults."""
    cell = cells[column.place] if column.constant is None else column.constant
    try:
        factor = float(cell.replace(sign, "."))
    except ValueError:
        factor = math.nan
    if 0.0 < factor < math.inf:
        return factor
    text = f'the coverage factor is "{shorten(cell)}"; it must be above 0'
    messages.append(mark.message("", text))
    return math.nan


def _numbers(lines: Sequence[int]) -> str:
    return f"{'s' if len(lines) > 1 else ''} {listing(map(str, lines))}"
