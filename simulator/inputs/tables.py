"""CSV tables: columns by name, lengths with the unit as a suffix of the column's name.

Columns are separated by commas, semicolons or tabs; decimals have a point, or a comma where none of
the table has a point.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice, pairwise
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from .messages import MORE_ERRORS, MOST_MESSAGES, ExperimentError, Message, refused
from .quantities import QuantityError, metres_or_radians
from .settings import hint, listing, shorten
from .units import LENGTH_UNITS, Units, plain_unit
from .writing import text_of_cell
from .yamltree import GivenText, Mark, read_text

SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}
# A cell, quoted or plain, and what separates it from the next.
CELLS = {
    sign: re.compile(
        rf'(?:(?:(?!{sign})\s)*"((?:[^"]|"")*)"(?:(?!{sign})\s)*|([^{sign}"]*))({sign}|$)'
    )
    for sign in SEPARATORS
}
SEPARATOR = re.compile(r'(?:"[^"]*"|[^",;\t])*([,;\t])')
# How spreadsheets say which sign separates the columns.
SEPARATOR_LINE = re.compile(r"sep=(?:[,;]|\t)?")
DECIMALS = re.compile(r"[+-]?[0-9]*([.,])[0-9]*(?:[eE][+-]?[0-9]+)?")
MOST_ROWS = 1_000_000
# Far more than there are names for.
MOST_COLUMNS = 1000


@dataclass(frozen=True, slots=True)
class FileRow:
    """A line of a table: texts of its named columns, lengths (m) of its length columns."""

    mark: Mark
    texts: tuple[str, ...]
    lengths: tuple[float, ...]


class TableLine(NamedTuple):
    """A line of a table: its number, its text, and the sign that separates its cells."""

    number: int
    text: str
    separator: str

    def cells(self) -> list[tuple[int, str]] | None:
        """Return the cells with their columns, from 1; None if a quotation mark has no partner."""
        cells, start = [], 0
        while True:
            match = CELLS[self.separator].match(self.text, start)
            if match is None:
                return None
            quoted, plain, separator = match.groups()
            text = plain.strip() if quoted is None else quoted.replace('""', '"')
            blank = len(match[0]) - len(match[0].lstrip())
            cells.append((match.start() + (blank if text else 0) + 1, text))
            if not separator:
                return cells
            start = match.end()


def table_lines(path: Path | GivenText) -> list[TableLine]:
    """Return lines of a CSV file without empty lines and comments. The first sign that separates
    columns of the first line, a comma, a semicolon or a tab, is that of all lines.

    :raises ExperimentError: the file cannot be read.
    """
    return list(_lines(path))


def _lines(path: Path | GivenText) -> Iterator[TableLine]:
    separator = ""
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#") or SEPARATOR_LINE.fullmatch(line):
            continue
        if not separator:
            sign = SEPARATOR.match(line)
            separator = sign[1] if sign else ","
        yield TableLine(number, line, separator)


def decimal_sign(lines: Sequence[TableLine], columns: Collection[int]) -> str:
    """Return the decimal sign of the numbers in the `columns` (indices) of a table: a comma if some
    have one, and none has a point.
    """
    if not any(line.separator != "," or '"' in line.text for line in lines):
        return "."
    signs = {
        match[1]
        for line in lines
        for k, (_, cell) in enumerate(line.cells() or ())
        if k in columns and (match := DECIMALS.fullmatch(cell))
    }
    return "," if signs == {","} else "."


def read_table(
    path: Path | GivenText,
    texts: Sequence[str],
    lengths: Sequence[str],
    optional: Sequence[str] = (),
    problems: list[Message] | None = None,
    defaults: Mapping[str, str] = MappingProxyType({}),
    absent: float = 0.0,
    units: Units = MappingProxyType({}),
    empty: Collection[str] = (),
    decimal: str = "",
) -> tuple[FileRow, ...]:
    """Return the rows of a table whose first line names the columns.

    ``texts`` are required columns of text, ``lengths`` required columns of lengths with a unit such
    as ``x_mm``, and ``optional`` length columns, by default ``absent``. Columns of ``units`` have
    units of their own. ``defaults`` are texts of missing columns; empty cells of columns ``empty``
    are NaN. ``decimal`` is the decimal sign, by default detected. Empty lines and lines that begin
    with # are skipped. ``problems``, if given, collects
    messages about rows, whose invalid lengths are then NaN.

    :raises ExperimentError: the file cannot be read, a column is missing or unknown, a cell is not
        a number, there are no rows; all problems of the file at once.
    """
    file = str(path)
    messages = [] if problems is None else problems
    lines = table_lines(path)
    example = ",".join([*texts, *(f"{name}_mm" for name in lengths)])
    if not lines:
        raise refused(file, f"the file is empty; its first line should be {example}", line=1)
    columns, factors = _columns(file, lines[0], texts, lengths, optional, defaults, example, units)
    _refuse_unfilled(file, columns, lengths, lines)
    count, names = len(columns), (*lengths, *optional)
    lengths_at = [k for k, name in enumerate(columns) if name in factors]
    decimal = decimal or decimal_sign(lines[1:], lengths_at)
    columns += [name for name in defaults if name not in columns]
    constants = [defaults[name] for name in columns[count:]]
    rows = []
    for line in islice(lines, 1, MOST_ROWS + 1):
        mark = Mark(file, line.number, 1)
        if len(messages) >= MOST_MESSAGES:
            messages.append(mark.message("", MORE_ERRORS))
            break
        cells = line.cells()
        if cells is None or len(cells) != count:
            messages.append(mark.message("", wrong_count(line, cells, count)))
            continue
        by_name = dict(zip(columns, [*cells, *((1, text) for text in constants)], strict=True))
        for name in texts:
            if not by_name[name][1]:
                cell_mark = Mark(file, line.number, by_name[name][0])
                messages.append(cell_mark.message("", f"no {name}; write its name"))
        filled = {name: cell for name, cell in by_name.items() if cell[1] or name not in empty}
        values = tuple(
            math.nan
            if name in by_name and name not in filled
            else _length_of(mark, filled.get(name), name, factors, absent, messages, decimal)
            for name in names
        )
        rows.append(FileRow(mark, tuple(text_of_cell(by_name[name][1]) for name in texts), values))
    if len(lines) == 1:
        messages.append(
            Message(
                file,
                lines[0].number,
                1,
                "",
                "no rows below the names of the columns; add at least one",
            )
        )
    if len(lines) > MOST_ROWS + 1:
        messages.append(
            Message(
                file, lines[MOST_ROWS].number, 1, "", f"more than {MOST_ROWS} rows; leave some out"
            )
        )
    if messages and (problems is None or not rows):
        raise ExperimentError(messages)
    return tuple(rows)


def _refuse_unfilled(
    file: str, columns: Sequence[str], lengths: Sequence[str], lines: Sequence[TableLine]
) -> None:
    """Refuse a table without any length, in one message instead of one per cell.

    :raises ExperimentError: all required lengths are empty, in all rows.
    """
    required = [columns.index(name) for name in lengths]
    rows = (line.cells() for line in lines[1:])
    if (
        len(lines) > 1
        and required
        and all(
            cells is not None
            and len(cells) == len(columns)
            and not any(cells[k][1] for k in required)
            for cells in rows
        )
    ):
        text = f"nothing is filled in: {listing(lengths)} are empty in all {len(lines) - 1} rows"
        text += "; enter values, and remove rows without any"
        raise refused(file, text, line=lines[1].number)


def _length_of(
    mark: Mark,
    cell: tuple[int, str] | None,
    name: str,
    factors: Mapping[str, Fraction],
    absent: float,
    messages: list[Message],
    decimal: str,
) -> float:
    if cell is None:
        return absent
    cell_mark = Mark(mark.file, mark.line, cell[0])
    return read_number(cell[1], name, factors[name], cell_mark, messages, decimal=decimal)


def pointed(cell: str, decimal: str) -> str:
    """Return a number with a decimal point; other cells unchanged."""
    return cell.replace(decimal, ".") if "." not in cell else cell


def header_cells(
    file: str, header: TableLine, example: str
) -> Iterator[tuple[Mark, str, str, str]]:
    """Yield mark, text, name and unit of each cell of a first line.

    :raises ExperimentError: there are more than a thousand.
    """
    count = header.text.count(header.separator) + 1
    if count > MOST_COLUMNS:
        text = f"{count} columns are too many; the first line should be {example}"
        raise Mark(file, header.number, 1).refused(text)
    for column, cell in header.cells() or []:
        name, _, unit = cell.rpartition("_")
        yield Mark(file, header.number, column), cell, name, plain_unit(unit)


def header_line(path: Path | GivenText) -> TableLine:
    """Return the first line of a table, empty without any.

    :raises ExperimentError: the file cannot be read.
    """
    return next(_lines(path), TableLine(0, "", ","))


def header_texts(path: Path | GivenText) -> set[str]:
    """Return the texts of the first line's cells of a table; may be empty.

    :raises ExperimentError: the file cannot be read.
    """
    return {cell for _, cell in header_line(path).cells() or []}


def header_names(path: Path | GivenText) -> set[str]:
    """Return names of the columns of a table, without their units; may be empty.

    :raises ExperimentError: the file cannot be read.
    """
    return {cell.rpartition("_")[0] or cell for cell in header_texts(path)}


def read_number(
    cell: str,
    name: str,
    factor: Fraction,
    mark: Mark,
    messages: list[Message],
    kind: str = "length",
    decimal: str = ".",
) -> float:
    """Return the number in a cell, times its column's factor; NaN after adding a message."""
    try:
        return metres_or_radians(pointed(cell, decimal), factor, kind)
    except QuantityError as error:
        messages.append(mark.message("", wrong_number(cell, name) or str(error)))
        return math.nan


def wrong_number(cell: str, name: str) -> str:
    """Return the fault of a cell that is nearly a number, or an empty text."""
    if not cell:
        return f"no {name}; write a number, or remove the line"
    if (match := DECIMALS.fullmatch(cell)) and match[1] == ",":
        return f'"{cell}" has a decimal comma; write {cell.replace(",", ".")}'
    return (
        f'"{shorten(cell)}" is not a number; separate all columns by the same sign'
        if re.search("[;\t]", cell)
        else ""
    )


def wrong_count(line: TableLine, cells: list[tuple[int, str]] | None, expected: int) -> str:
    """Return the fault of a line with more or fewer cells than columns."""
    separator = SEPARATORS[line.separator]
    advice = f"write one line per row, its columns separated by {separator}"
    if cells is None:
        return f"a quotation mark too many; {advice}"
    fact = f"{len(cells)} columns instead of {expected}"
    halves = [
        f"{whole}.{decimals}"
        for (_, whole), (_, decimals) in pairwise(cells)
        if re.fullmatch(r"[+-]?[0-9]+", whole) and re.fullmatch(r"[0-9]+", decimals)
    ]
    if line.separator == "," and len(cells) > expected and halves:
        return (
            f"{fact}; if a comma is meant as the decimal point, write a point, as in"
            f" {shorten(halves[-1])}"
        )
    if len(cells) == 1 and re.search("[,;\t]", line.text):
        return f"{fact}; separate them by {separator}"
    return f"{fact}; {advice}"


def _columns(
    file: str,
    header: TableLine,
    texts: Sequence[str],
    lengths: Sequence[str],
    optional: Sequence[str],
    defaults: Mapping[str, str],
    example: str,
    units: Units,
) -> tuple[list[str], dict[str, Fraction]]:
    """Return the names of the columns without their units, and the factors of units."""
    messages = []
    names = []
    factors = {}
    for cell_mark, cell, name, unit in header_cells(file, header, example):
        its_units = units.get(name, LENGTH_UNITS)
        if cell in texts:
            name = cell
        elif name in (*lengths, *optional) and unit in its_units:
            factors[name] = its_units[unit]
        elif name in (*lengths, *optional):
            messages.append(
                cell_mark.message(
                    "", f'unknown unit in the column "{cell}"; {hint(unit, its_units)}'
                )
            )
        elif cell in (*lengths, *optional):
            name, example = cell, next(iter(units.get(cell, {"mm": 1})))
            text = f'the column "{cell}" has no unit; write for example {cell}_{example}'
            messages.append(cell_mark.message("", text))
        else:
            expected = [
                *texts,
                *(
                    f"{length}_{next(iter(units.get(length, {'mm': 1})))}"
                    for length in (*lengths, *optional)
                ),
            ]
            messages.append(
                cell_mark.message("", f'unknown column "{shorten(cell)}"; {hint(cell, expected)}')
            )
        if name in names:
            messages.append(
                cell_mark.message("", f'a second column "{shorten(cell)}"; remove one of them')
            )
        names.append(name)
    missing = [name for name in (*texts, *lengths) if name not in (*names, *defaults)]
    if missing:
        messages.append(
            Mark(file, header.number, 1).message(
                "", f"no column for {listing(missing)}; the first line should be {example}"
            )
        )
    if messages:
        raise ExperimentError(messages)
    return names, factors
