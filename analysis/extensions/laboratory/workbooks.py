"""Tables of readings in sheets of workbooks (.xlsx)."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import suppress
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import ParseError, iterparse
from zipfile import ZipFile

from ballplate.simulator.inputs import GivenText, read_bytes, refused, shorten
from ballplate.simulator.readings import SourceText

from .heading_words import AXIS_WORDS, heading, quoted

# Bytes of the sheets as XML, and of their tables; cells up to the last rows and columns of the
# sheets; and cells in ranges, for each of which openpyxl makes an object.
MOST_BYTES = 30_000_000
MOST_CELLS = 2_000_000
MOST_IN_RANGES = 200_000
# Rows in which headings are looked for.
MOST_ABOVE = 200


def workbook_tables(source: Path, sheet: str | None) -> list[SourceText]:
    """Return the table of a workbook, or of the `sheet` named; with "all", those of all sheets with
    tables.

    Cells below a merged one have its entry. Each number is that of its cell, to the last bit.

    :raises ExperimentError: openpyxl is missing, the workbook is damaged or too large, or several
        sheets have tables.
    """
    try:
        from openpyxl import load_workbook
    except ImportError:
        text = "workbooks need openpyxl; install it with: python -m pip install 'ballplate[xlsx]'"
        raise refused(source, text) from None
    content = read_bytes(source)
    try:
        with ZipFile(BytesIO(content)) as archive, warnings.catch_warnings():
            if sum(entry.file_size for entry in archive.infolist()) > MOST_BYTES:
                raise ValueError(f"more than {MOST_BYTES} bytes")
            if sum(_cells_in_ranges(archive)) > MOST_IN_RANGES:
                raise ValueError(f"more than {MOST_IN_RANGES} cells are merged or linked")
            # Styles and macros that are not read.
            warnings.simplefilter("ignore")
            book = load_workbook(BytesIO(content), data_only=True)
        if sum(one.max_row * one.max_column for one in book.worksheets) > MOST_CELLS:
            raise ValueError(f"more than {MOST_CELLS} cells")
        sheets = {one.title: _rows(one) for one in book.worksheets}
    except Exception as error:
        # Damaged archives and XML raise errors of many kinds.
        text = (
            f"is no workbook, damaged or too large ({shorten(str(error))}); save its table as CSV"
        )
        raise refused(source, text) from None
    tabular = [name for name, rows in sheets.items() if _has_headings(rows)] or [*sheets]
    chosen = tabular if sheet in (None, "all") else [name for name in sheets if name == sheet]
    if not chosen:
        raise refused(source, f"no sheet {quoted([str(sheet)])}; tables: {quoted(tabular, 12)}")
    if len(chosen) > 1 and sheet is None:
        text = (
            f"the sheets {quoted(tabular, 12)} have tables; give --sheet with the name of one, or"
        )
        raise refused(source, f"{text} --sheet all; or readings: {{sheet: …}}")
    tables = []
    for name in chosen:
        # A position may be named by its sheet as by a file.
        title = f"{source}/{name}" if len(chosen) > 1 else str(source)
        table = GivenText(title, "\n".join(map("\t".join, sheets[name])))
        tables.append(SourceText(table, table, f'sheet "{shorten(name)}"'))
    return tables


def _rows(sheet: Any) -> list[list[str]]:
    rows = [[_text(value) for value in row] for row in sheet.iter_rows(values_only=True)]
    for merged in sheet.merged_cells.ranges:
        for row in rows[merged.min_row : merged.max_row]:
            row[merged.min_col - 1] = rows[merged.min_row - 1][merged.min_col - 1]
    if sum(map(len, chain(*rows))) > MOST_BYTES:
        raise ValueError(f"more than {MOST_BYTES} bytes")
    return rows


def _cells_in_ranges(archive: ZipFile) -> Iterator[int]:
    """Numbers of cells of the merged and the linked ranges of all sheets."""
    from openpyxl.utils import range_boundaries

    for entry in archive.infolist():
        # Pictures are no XML.
        with suppress(ParseError), archive.open(entry) as content:
            for _, element in iterparse(content):
                if element.tag.rpartition("}")[2] in ("mergeCell", "hyperlink"):
                    left, top, right, bottom = range_boundaries(element.get("ref", "A1"))
                    yield (right - left + 1) * (bottom - top + 1)
                element.clear()


def _text(value: object) -> str:
    text = "" if value is None else " ".join(str(value).split())
    return f'''"{text.replace('"', '""')}"''' if '"' in text else text


def _has_headings(rows: list[list[str]]) -> bool:
    """True if a row has headings of co-ordinates."""
    for row in rows[:MOST_ABOVE]:
        words = {word for cell in row for word in heading(cell)[0].split()}
        if words >= {"x", "y"} or not words.isdisjoint(AXIS_WORDS):
            return True
    return False
