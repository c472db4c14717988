"""Signs between thousands in columns of numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence

from .heading_words import NOTHING

# Numbers with signs between thousands: with decimals behind them, or several of them.
_BETWEEN = r"'\u2019\s"
THOUSANDS = re.compile(
    rf"[+-]?[0-9]{{1,3}}(?:(?:[.{_BETWEEN}][0-9]{{3}})+,[0-9]*|(?:[,{_BETWEEN}][0-9]{{3}})+\.[0-9]*"
    rf"|(?:[{_BETWEEN}][0-9]{{3}})+|(?:\.[0-9]{{3}}){{2,}}|(?:,[0-9]{{3}}){{2,}})"
)
# Signs as a pattern → how they are told.
SIGNS = {r"\.": "points", ",": "commas", "['\u2019]": "apostrophes", r"\s": "blanks"}

Row = tuple[int, list[str]]


def without_thousands(
    rows: list[Row], places: Sequence[int], decimal: str, is_stated: bool
) -> tuple[list[Row], str]:
    """Return rows without the signs between thousands in the columns `places`, and what these are;
    empty if there are none.

    A column has them if all of its numbers of four digits or more do. Unless `decimal`, the sign
    of decimals, is stated, one number must be a `THOUSANDS`, which has no other meaning.
    """
    columns = {i: [cells[i] for _, cells in rows] for i in places}
    for between, told in SIGNS.items():
        number = rf"[+-]?[0-9]{{1,3}}(?:{between}[0-9]{{3}})*(?:{re.escape(decimal)}[0-9]*)?"
        grouped, sign = re.compile(number), re.compile(between)
        separated = {
            i
            for i, cells in columns.items()
            if sign.match(decimal) is None
            and sign.search("_".join(cells))
            and all(grouped.fullmatch(cell) or cell.casefold() in NOTHING for cell in cells)
        }
        of_one_meaning = is_stated or any(
            THOUSANDS.fullmatch(cell) for i in separated for cell in columns[i]
        )
        if separated and of_one_meaning:
            plain = [
                (line, [sign.sub("", c) if i in separated else c for i, c in enumerate(cells)])
                for line, cells in rows
            ]
            return plain, told
    return rows, ""
