"""Columns of a table, each stated once for text, frames and data.

Columns are a mapping from headings, with a unit where text has one, to values: an attribute of the
items that a table has as rows, a function of an item, or a list or an array of values. Numbers are
in metres, radians and ratios; text has them in the unit of the heading or, without one, in that of
the column "unit". A pair gives values and how text shows them: with so many significant digits, to
the third digit of standard uncertainties, or by a function.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import repeat
from typing import Any

from .formatting import aligned, amount_of, number, to_uncertainty, unit_of

FACTORS = {"mm": 1e3, "µm": 1e6, "ppm": 1e6}

Columns = Mapping[str, Any]


def table_lines(columns: Columns, items: Sequence[Any] = (), without: str = "") -> list[str]:
    """A table as aligned lines of text, numbers to the right, `without` one of its columns."""
    texts, right = [], []
    has_units = columns.get("unit") == "unit"
    for heading, column in columns.items():
        if heading == without:
            continue
        source, form = column if isinstance(column, tuple) else (column, 4)
        values, unit = _values(source, items), heading.split(", ")[-1]
        factors = repeat(FACTORS.get(unit, 1.0))
        if has_units and unit == "unit":
            form = unit_of
        elif has_units and unit not in FACTORS:
            factors = (amount_of(1.0, item.unit)[0] for item in items)
        forms = repeat(form) if callable(form) or isinstance(form, int) else _values(form, items)
        texts.append([heading, *map(_text, values, forms, factors)])
        right.append(any(isinstance(value, (int, float)) for value in values))
    return aligned(list(zip(*texts, strict=True)), right)


def table_rows(columns: Columns, items: Sequence[Any] = ()) -> list[dict[str, Any]]:
    """A table as a mapping for each row, without units in the names."""
    names = [re.sub(", (mm|µm|ppm)$", "", heading) for heading in columns]
    sources = (one[0] if isinstance(one, tuple) else one for one in columns.values())
    values = (_values(source, items) for source in sources)
    return [dict(zip(names, row, strict=True)) for row in zip(*values, strict=True)]


def _values(source: Any, items: Sequence[Any]) -> list[Any]:
    if isinstance(source, str):
        return [getattr(item, source) for item in items]
    if callable(source):
        return list(map(source, items))
    return list(source.tolist() if hasattr(source, "tolist") else source)


def _text(value: Any, form: Any, factor: float) -> str:
    """A value, by a function, with so many digits, or to those of a standard uncertainty."""
    if value is None:
        return ""
    if callable(form):
        return str(form(value))
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, float):
        return str(value)
    if isinstance(form, int):
        return number(factor * value, form)
    return to_uncertainty(factor * value, factor * form)
