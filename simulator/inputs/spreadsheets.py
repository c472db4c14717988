"""Escaping of text in CSV files, where spreadsheets would compute names such as =A1 or @home."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TextIO

# Start of a formula, behind the apostrophes that protect it; a sign alone is none.
_FORMULA = re.compile(r"'*[=+\-@\t\r].", re.DOTALL)
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|[+-]?(?:inf|nan)")


def cell_of_text(text: str) -> str:
    """Return the cell of a text, with an apostrophe before a formula.

    >>> [cell_of_text(text) for text in ("z low", "=1+1", "-0.25", "'=1+1")]
    ['z low', "'=1+1", '-0.25', "''=1+1"]
    """
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text


def text_of_cell(cell: str) -> str:
    """Return the text of a cell.

    >>> [text_of_cell(cell) for cell in ("z low", "'=1+1", "-0.25", "''=1+1", "'quoted'")]
    ['z low', '=1+1', '-0.25', "'=1+1", "'quoted'"]
    """
    protected = cell.startswith("'") and _FORMULA.match(cell) and not _NUMBER.fullmatch(cell[1:])
    return cell[1:] if protected else cell


@dataclass(frozen=True)
class CsvWriter:
    """Writer of rows of cells; lines end with a line feed."""

    stream: TextIO

    def writerow(self, cells: Sequence[Any]) -> None:
        """Write one row."""
        self.writerows([cells])

    def writerows(self, rows: Iterable[Sequence[Any]]) -> None:
        """Write several rows."""
        shown = (
            [cell_of_text(cell) if isinstance(cell, str) else cell for cell in row] for row in rows
        )
        csv.writer(self.stream, lineterminator="\n").writerows(shown)
