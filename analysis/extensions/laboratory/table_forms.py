"""Forms of tables as programs write them: what separates columns and decimals, and where the
headings stand.

Every form that can be is tried on the whole table. A table that only one of them reads, or that all
of them read alike, is in that form; one that they read differently is ambiguous, and refused.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from ballplate.simulator.experiment import ReadingsSettings
from ballplate.simulator.inputs import MOST_COLUMNS, MOST_MESSAGES, shorten

from .axis_rows import joined_axes
from .heading_words import LONGEST, NOTHING, unit_of
from .headings import (
    TEXTS,
    HeadedColumn,
    HeadingError,
    Headings,
    Vocabulary,
    numbered_columns,
    read_headings,
)
from .merged_cells import fill_down
from .thousands import THOUSANDS, Row, without_thousands

# What separates columns → how it is told. Blanks by themselves, and two or more where names have
# single ones.
SEPARATORS = {
    "comma": (",", "commas"),
    "semicolon": (";", "semicolons"),
    "tab": ("\t", "tabs"),
    "bar": ("|", "bars"),
    "wide": ("  ", "two or more blanks"),
    "space": (" ", "blanks"),
}
DECIMALS = {"point": ".", "comma": ","}
# Lines that headings are looked for in.
MOST_ABOVE = 200
_DIGITS = r"[+-]?(?:[0-9]+(?:{0})?|{1}[0-9]+)(?:[eE][+-]?[0-9]+)?"
# A comma at the end of a number separates it from the next.
NUMBERS = {
    "point": re.compile(_DIGITS.format(r"\.[0-9]*", r"\.")),
    "comma": re.compile(_DIGITS.format(",[0-9]+", ",")),
}

# How a number begins.
BEGINS = re.compile(r"[+-]?[.,]?[0-9]")

Line = tuple[int, str]


@dataclass(frozen=True)
class Form:
    """A table in one of the forms: its headings, and its rows of cells by the number of their line.

    `units` are those of a line of units below the headings, by place. `empty` are the lines without
    any co-ordinate, `wrong` what keeps rows from being read so, by line. `above` are the lines
    above the headings, `blank` the lines and columns of names without an entry. `filled` counts
    names that are those above, `between` says what is between thousands, `others` counts rows of
    other characteristics than axes.
    """

    separator: str
    decimal: str
    header: int
    headings: Headings
    units: dict[int, str]
    rows: Sequence[Row]
    empty: Sequence[int]
    wrong: Sequence[tuple[int, str]]
    above: tuple[str, ...]
    blank: tuple[tuple[int, int], ...]
    filled: int
    between: str = ""
    others: tuple[tuple[str, int], ...] = ()

    @cached_property
    def units_of_rows(self) -> frozenset[str]:
        """Units in a column of units; empty if there is none, or it has something else."""
        column = self.headings.roles.get("unit")
        units = {unit_of(cells[column.place]) for _, cells in self.rows if column is not None}
        return frozenset() if None in units else frozenset(map(str, units))

    def content(self) -> tuple[object, ...]:
        """What it reads; of two forms with the same content either will do."""
        places = [*self.headings.places.values(), *self.headings.axes]
        sign = DECIMALS[self.decimal]
        return tuple(tuple(cells[i].replace(sign, ".") for i in places) for _, cells in self.rows)


def split(text: str, separator: str) -> list[str] | None:
    """The cells of a line; None where its quotation marks do not match."""
    if separator in (" ", "  "):
        text = text.strip()
        blanks = r"\s+" if separator == " " else r"\s{2,}|\t"
        if '"' in text:
            pieces = re.findall(r'"([^"]*)"(?=\s|$)|(\S+)', text)
            return [quoted or plain for quoted, plain in pieces]
        return re.split(blanks, text)
    if '"' not in text:
        return [cell.strip() for cell in text.split(separator)]
    try:
        (cells,) = csv.reader([text], delimiter=separator, skipinitialspace=True, strict=True)
    except (csv.Error, ValueError):
        return None
    return [cell.strip() for cell in cells]


def _split_headings(text: str, separator: str) -> list[str] | None:
    """The cells of a line of headings, in which a blank before a unit in brackets separates
    nothing.
    """
    if separator == " ":
        text = re.sub(r"(?<!\s)\s+(?=[\[(][^\])]*[\])])", "_", text)
    return split(text.removeprefix("#").strip(), separator)


class NoFormError(Exception):
    """No form reads the table: why, of which line, with the headings that are there."""

    def __init__(self, line: int, text: str, cells: Sequence[str] = ()) -> None:
        self.line, self.text, self.cells = line, text, tuple(cells)
        super().__init__(text)


def forms_of(lines: Sequence[Line], words: Vocabulary, settings: ReadingsSettings) -> list[Form]:
    """The table in every form in which a line names co-ordinates.

    :raises NoFormError: there is none.
    """
    tried = [settings.separator] if settings.separator else list(SEPARATORS)
    if settings.separator == "space":
        tried = ["wide", "space"]
    decimals = [settings.decimal] if settings.decimal else list(DECIMALS)
    forms = []
    reasons = []
    for separator in tried:
        try:
            header, headings = _find_headings(lines, separator, words, settings)
        except NoFormError as error:
            reasons.append(error)
            continue
        cells = _form_without_decimals(lines, header, headings, separator, settings)
        # Of a table of commas, they separate columns unless quoted.
        is_stated = settings.decimal is not None
        forms += [_form(cells, decimal, words, is_stated) for decimal in decimals]
    if forms:
        return forms
    raise max(reasons, key=lambda error: len(error.cells))


def _find_headings(
    lines: Sequence[Line], separator: str, words: Vocabulary, settings: ReadingsSettings
) -> tuple[int, Headings]:
    """Which of the lines has the headings, -1 without any, and what these are.

    :raises NoFormError: none has.
    """
    sign = SEPARATORS[separator][0]
    if settings.header == 0:
        row = next((split(t, sign) for _, t in lines if not t.lstrip().startswith("#")), None)
        try:
            return -1, numbered_columns(words, len(row or ()))
        except HeadingError as error:
            raise NoFormError(1, str(error)) from None
    wrong = None
    widest = NoFormError(lines[0][0], "", ())
    comments = [i for i, (_, text) in enumerate(lines[:MOST_ABOVE]) if text.lstrip()[:1] == "#"]
    candidate_lines = [i for i in range(min(len(lines), MOST_ABOVE)) if i not in set(comments)]
    for i in (*candidate_lines, *comments):
        number, text = lines[i]
        if settings.header is not None and number != settings.header:
            continue
        cells = _split_headings(text, sign) if len(text) <= LONGEST * MOST_COLUMNS else None
        if not cells or len(cells) > MOST_COLUMNS:
            continue
        above = split(lines[i - 1][1], sign) if i else None
        try:
            headings = _of_two_lines(above or (), cells, words) or read_headings(cells, words)
        except HeadingError as error:
            if wrong is None or len(cells) > len(wrong.cells):
                wrong = NoFormError(number, str(error), cells)
            continue
        if headings and not headings.by_axis and all(BEGINS.match(cells[k]) for k in headings.axes):
            # Columns stated by number are those of a row of readings.
            return i - 1, replace(headings, cells=())
        if headings is not None:
            return i, headings
        if len(cells) > len(widest.cells) and not any(map(_is_number, cells)):
            widest = NoFormError(number, "", cells)
    raise wrong or widest


def _of_two_lines(above: Sequence[str], cells: Sequence[str], words: Vocabulary) -> Headings | None:
    """Return headings whose names are also in the line above them, as of merged cells that stand
    over several columns; None where one line has them.
    """
    if len(above) != len(cells) or any(map(_is_number, above)):
        return None
    left, joined = "", []
    for name, cell in zip(above, cells, strict=True):
        left = name or left * bool(cell)
        joined.append(f"{cell} {left}".strip())
    both: list[Headings | None] = []
    for names in (cells, joined):
        try:
            both.append(read_headings(names, words))
        except HeadingError:
            both.append(None)
    alone, with_above = both
    if with_above is None or not (with_above.nominal or "ball" in with_above.roles):
        return None
    is_more = alone is None or "ball" not in alone.roles
    return with_above if is_more or any(group.texts for group in with_above.groups) else None


def holds_nothing(cells: Sequence[str], places: Iterable[int]) -> bool:
    """True if none of these cells has an entry."""
    return all(cells[i].casefold() in NOTHING for i in places)


def _is_number(cell: str) -> bool:
    return any(pattern.fullmatch(cell) for pattern in NUMBERS.values())


def _form_without_decimals(
    lines: Sequence[Line],
    header: int,
    headings: Headings,
    separator: str,
    settings: ReadingsSettings,
) -> Form:
    """The cells below the headings, with names that continue those above if the settings say so;
    as `empty` lines of another width that hold no number.
    """
    sign = SEPARATORS[separator][0]
    roles, axes = headings.places, headings.axes
    places = [headings.by_axis[1]] if headings.by_axis else axes
    needed = [*places, *roles.values()]
    # Co-ordinates of rows per axis are written behind the cells of the table.
    width = len(headings.cells) - len(axes) * bool(headings.by_axis) or max(needed) + 1
    units: dict[int, str] = {}
    rows: list[Row] = []
    remarks: list[int] = []
    wrong: list[tuple[int, str]] = []
    for line_number, text in _below(lines, header):
        if len(wrong) > MOST_MESSAGES:
            break
        cells = split(text, sign)
        if cells is None:
            wrong.append((line_number, "a quotation mark too many; write one line per row"))
            continue
        if not rows and not units and (form := _units(cells, places)):
            units = form
            continue
        cells = _padded(cells, width, needed, sign)
        if len(cells) < width or (headings.cells and len(cells) > width):
            if _holds_no_number(cells, places):
                remarks.append(line_number)
            else:
                text = f"{len(cells)} columns instead of {width}; write one line per row"
                wrong.append((line_number, text))
            continue
        rows.append((line_number, cells))
    texts = [roles[role] for role in TEXTS if role in roles]
    may_fill = [*texts, *(roles[role] for role in ("unit",) if role in roles)]
    filled = fill_down(rows, may_fill) if settings.fill_down else 0
    blank = tuple(
        (line_number, place)
        for line_number, cells in rows
        for place in texts
        if not cells[place] and not holds_nothing(cells, places)
    )
    if headings.by_axis and units:
        units |= dict.fromkeys(axes, units[places[0]])
    above = tuple(text for _, text in lines[: header + (not headings.cells)] if header >= 0)
    line = lines[header][0] if header >= 0 and headings.cells else 0
    return Form(separator, "", line, headings, units, rows, remarks, wrong, above, blank, filled)


def _form(cells_below: Form, decimal: str, words: Vocabulary, is_stated: bool) -> Form:
    """The rows below the headings, and faults of them in this form; the decimal sign may be
    stated.
    """
    headings = cells_below.headings
    places = headings.axes
    joined, wrong_axes, others = joined_axes(cells_below.rows, headings, words.axes)
    joined, between = without_thousands(joined, places, DECIMALS[decimal], is_stated)
    rows: list[Row] = []
    empty: list[int] = []
    remarks, wrong = [*cells_below.empty], [*cells_below.wrong, *wrong_axes]
    ball = headings.roles.get("ball", HeadedColumn(0)).place
    for line_number, cells in joined:
        if len(wrong) > MOST_MESSAGES:
            break
        if holds_nothing(cells, places):
            (empty if cells[ball] else remarks).append(line_number)
            continue
        if reason := _wrong_row(cells, headings, NUMBERS[decimal], decimal, words.empty):
            wrong.append((line_number, reason))
        rows.append((line_number, cells))
    # In between they may say what is true of the rows below only.
    last = rows[-1][0] if rows else 0
    text = "a line without co-ordinates among the rows; remove it, or move its text to a column"
    wrong += [(line_number, text) for line_number in remarks if line_number < last]
    empty = sorted((*empty, *(line_number for line_number in remarks if line_number > last)))
    return replace(
        cells_below,
        decimal=decimal,
        rows=rows,
        empty=empty,
        wrong=sorted(wrong),
        between=between,
        others=tuple(others.items()),
    )


def _below(lines: Sequence[Line], header: int) -> Iterator[Line]:
    for line_number, text in lines[header + 1 :]:
        # A rule below the headings of a table of bars or blanks holds nothing.
        if text.lstrip()[:1] != "#" and not re.fullmatch(r"[\s|+:=_-]+", text):
            yield line_number, text


def _units(cells: Sequence[str], places: Sequence[int]) -> dict[int, str]:
    """Units by place where a line states that of every co-ordinate, and no number."""
    if any(i >= len(cells) or unit_of(cells[i]) is None for i in places):
        return {}
    return {i: unit for i, cell in enumerate(cells) if (unit := unit_of(cell)) is not None}


def _padded(cells: list[str], width: int, needed: Sequence[int], sign: str) -> list[str]:
    """A row with as many cells as there are headings, where those that are missing or too many are
    empty ones at its end.
    """
    while len(cells) > width and not cells[-1]:
        cells.pop()
    # Blanks do not tell which cell is missing.
    if max(needed) < len(cells) < width and sign not in (" ", "  "):
        cells += [""] * (width - len(cells))
    return cells


def _holds_no_number(cells: Sequence[str], places: Sequence[int]) -> bool:
    """True if a line of another width is a remark, and no row that was cut off."""
    filled = [cell for cell in cells if cell]
    return len(cells) <= min(places) or (
        not any(_is_number(cell) for cell in filled) and len(filled) <= 2
    )


def _wrong_row(
    cells: Sequence[str],
    headings: Headings,
    number: re.Pattern[str],
    decimal: str,
    may_be_empty: Collection[str],
) -> str:
    """Faults of a row; empty where nothing is."""
    for group in headings.groups:
        places = [axis.place for axis in group.axes]
        if len(headings.groups) > 1 and holds_nothing(cells, places):
            continue
        for name, cell in zip("xyz", (cells[i] for i in places), strict=False):
            if name in may_be_empty and cell.casefold() in NOTHING:
                continue
            if not number.fullmatch(cell):
                return wrong_number(cell, name, decimal)
    return ""


def wrong_number(cell: str, name: str, decimal: str) -> str:
    """Faults of a cell that should be a number."""
    if cell.casefold() in NOTHING:
        return f"no {name}; write a number, or remove the line"
    if THOUSANDS.fullmatch(cell[:LONGEST]):
        return f'"{shorten(cell)}" has signs between thousands; write it without them'
    other_name = "comma" if decimal == "point" else "point"
    if NUMBERS[other_name].fullmatch(cell):
        text = f'"{cell}" has a decimal {other_name}, and others have decimal {decimal}s'
        return f"{text}; write one kind"
    return f'"{shorten(cell)}" is not a number; write for example "500{DECIMALS[decimal]}0003"'


def chosen_form(forms: Sequence[Form]) -> Form:
    """The one form that reads a table; the nearest to it, with what is wrong, where none does.

    :raises NoFormError: several forms read it differently.
    """
    right = [form for form in forms if form.rows and not form.wrong]
    if not right:
        return min(
            forms, key=lambda form: len(form.wrong) / max(len(form.rows) + len(form.wrong), 1)
        )
    first = right[0]
    for alternative in right[1:]:
        if alternative.content() != first.content():
            separator, two = (SEPARATORS[form.separator] for form in (first, alternative))
            raise NoFormError(
                first.header,
                f"{separator[1]} and {two[1]} could both separate the columns; write which under"
                " readings: separator",
            )
    return first
