"""Columns of a table, each stated once for text, frames and data.

Columns are a mapping from headings, with a unit where text has one, to values; pairs of these where
headings are alike. Values are an attribute of the items that a table has as rows (or an entry, or
an attribute of an attribute, with a dot), a function of an item, or a list or an array. Numbers are
in metres, radians and ratios; text has them in the unit of the heading or, without one, in that of
the column "unit". A pair gives values and how text shows them: with so many significant digits, to
the third digit of standard uncertainties, or by a function.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import repeat
from typing import Any

from ballplate.simulator.machines.protocol import Array

from .formatting import aligned, amount_of, number, to_uncertainty, unit_of

FACTORS = {"mm": 1e3, "µm": 1e6, "µrad": 1e6, "ppm": 1e6, "arcsec": math.degrees(3600.0)}

# Lengths and angles below this, in metres and radians, are rounding.
ROUNDING = 1e-15

Columns = Mapping[str, Any] | Sequence[tuple[str, Any]]


def table_lines(
    columns: Columns, items: Sequence[Any] = (), without: str | None = None, unknown: str = "-"
) -> list[str]:
    """A table as aligned lines of text, numbers to the right, `without` one of its columns.

    `unknown` stands for what is undetermined.
    """
    texts, right, used = [], [], [one for one in _pairs(columns) if one[0] != without]
    has_units = isinstance(dict(columns).get("unit"), str)
    of_rows = _factors_of_rows(columns, items)
    for heading, source, form in used:
        unit, values = heading.split(", ")[-1], _values(source, items)
        factors = repeat(FACTORS[unit]) if unit in FACTORS else of_rows
        form = unit_of if has_units and unit == "unit" else form
        is_one = callable(form) or isinstance(form, int)
        forms = repeat(form) if is_one else _values(form, items)
        texts.append([heading, *map(_text, values, forms, factors, repeat(unknown))])
        right.append(any(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values))
    return aligned(list(zip(*texts, strict=True)), right)


def by_axis(
    heading: str, values: Array, form: Any = 4, letters: Sequence[str] = "xyz"
) -> dict[str, Any]:
    """A column for each axis of vectors (n, d), whose letter `heading` has in braces."""
    forms = form.T if hasattr(form, "T") else repeat(form)
    # There are three letters and any number of forms.
    columns = zip(letters, values.T, forms, strict=False)
    return {heading.format(axis): (own, of_own) for axis, own, of_own in columns}


def table_rows(
    columns: Columns, items: Sequence[Any] = (), in_units: bool = False
) -> list[dict[str, Any]]:
    """A table as a mapping for each row: in metres, radians and ratios, without units in the names,
    or in the units of the headings and of the column "unit".
    """
    if in_units:
        used = _in_units(columns, items)
    else:
        unit = f", ({'|'.join(FACTORS)})$"
        used = {
            re.sub(unit, "", heading): _values(source, items)
            for heading, source, _ in _pairs(columns)
        }
    return [dict(zip(used, row, strict=True)) for row in zip(*used.values(), strict=True)]


def _in_units(columns: Columns, items: Sequence[Any]) -> dict[str, list[Any]]:
    """Values by headings; a list of units is that of rows in metres, and left out."""
    own, found = _factors_of_rows(columns, items), {}
    for heading, source, _ in _pairs(columns):
        unit, values = heading.split(", ")[-1], _values(source, items)
        if unit == "unit" and isinstance(source, str):
            values = list(map(unit_of, values))
        factors = repeat(FACTORS[unit]) if unit in FACTORS else own
        if heading != "unit" or isinstance(source, str):
            found[heading] = [
                factor * value if isinstance(value, float) else value
                for value, factor in zip(values, factors, strict=False)
            ]
    return found


def _factors_of_rows(columns: Columns, items: Sequence[Any]) -> Iterable[float]:
    """What takes values to the units that the column "unit" shows."""
    if not isinstance(dict(columns).get("unit"), str):
        return repeat(1.0)
    return [amount_of(1.0, unit)[0] for unit in _values("unit", items)]


def _pairs(columns: Columns) -> list[tuple[str, Any, Any]]:
    """Headings, values and forms."""
    pairs = columns.items() if isinstance(columns, Mapping) else columns
    return [(name, *(one if isinstance(one, tuple) else (one, 4))) for name, one in pairs]


def _value(item: Any, path: str) -> Any:
    for name in path.split("."):
        if item is not None:
            item = item[name] if isinstance(item, dict) else getattr(item, name)
    return item


def _values(source: Any, items: Sequence[Any]) -> list[Any]:
    if isinstance(source, str):
        return [_value(item, source) for item in items]
    if callable(source):
        return list(map(source, items))
    return list(source.tolist() if hasattr(source, "tolist") else source)


def _text(value: Any, form: Any, factor: float, unknown: str) -> str:
    """A value, by a function, with so many digits, or to those of a standard uncertainty."""
    if value is None:
        return ""
    if callable(form):
        return str(form(value))
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, float):
        return str(value)
    uncertainty = 0.0 if isinstance(form, int) else form
    if math.isnan(value) or math.isnan(uncertainty):
        return unknown
    if factor > 1.0:
        value, uncertainty = (
            0.0 if abs(v) < ROUNDING else factor * v for v in (value, uncertainty)
        )
    return number(value, form) if isinstance(form, int) else to_uncertainty(value, uncertainty)
