"""Columns of a table, each stated once for text, frames and data.

Columns map headings, with a unit if text has one, to values; equal headings need pairs instead.
Values are an attribute of the table's items (or an entry, or a dotted path of attributes), a
function of an item, or a list or array. Numbers are in metres, radians and ratios; text has them in
the unit of the heading or, without one, of the column "unit". A pair gives values and their form in
text: a number of significant digits, standard uncertainties that determine the digits, or a
function.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from itertools import repeat
from typing import TYPE_CHECKING, Any

from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.writing import CsvWriter

from .formatting import Data, aligned, amount_of, ascii_units, number, to_uncertainty, unit_of

if TYPE_CHECKING:
    import pandas

FACTORS = {"mm": 1e3, "µm": 1e6, "µrad": 1e6, "ppm": 1e6, "arcsec": math.degrees(3600.0)}
FACTORS |= {"mm (mrad)": 1e3, "µm (µrad)": 1e6}

# Lengths and angles below this, in metres and radians, are rounding.
ROUNDING = 1e-15

Columns = Mapping[str, Any] | Sequence[tuple[str, Any]]
# Columns of a table with the items of its rows, whose values its functions make.
MainTable = tuple[Columns, Sequence[Any]]


def table_lines(
    columns: Columns, items: Sequence[Any] = (), without: str | None = None, unknown: str = "-"
) -> list[str]:
    """Return a table as aligned lines of text, numbers to the right, `without` one of its columns.

    `unknown` replaces NaN.
    """
    return aligned(*table_texts(columns, items, without, unknown))


def table_texts(
    columns: Columns, items: Sequence[Any] = (), without: str | None = None, unknown: str = "-"
) -> tuple[list[tuple[str, ...]], list[bool]]:
    """Return the headings and cells of `table_lines`, row by row, and which columns are numbers."""
    texts, right = [], []
    for heading, _, values, form, factors in _columns_read(columns, items):
        if heading != without:
            is_one = callable(form) or isinstance(form, int)
            forms = repeat(form) if is_one else _values(form, items)
            texts.append([heading, *map(_text, values, forms, factors, repeat(unknown))])
            right.append(any(isinstance(v, int | float) and type(v) is not bool for v in values))
    return list(zip(*texts, strict=True)), right


def by_axis(heading: str, values: Array, form: Any = 4, letters: Sequence[str] = "xyz") -> Data:
    """Return a column for each axis of vectors (n, d), whose letter replaces `heading`'s braces."""
    forms = form.T if hasattr(form, "T") else repeat(form)
    # Three letters, any number of forms.
    columns = zip(letters, values.T, forms, strict=False)
    return {
        heading.format(axis): (values_along, form_along)
        for axis, values_along, form_along in columns
    }


def table_rows(columns: Columns, items: Sequence[Any] = (), in_units: bool = False) -> list[Data]:
    """Return a table as one mapping per row: in metres, radians and ratios, without units in the
    names, or in the units of the headings and of the column "unit".
    """
    used = {}
    for heading, name, values, form, factors in _columns_read(columns, items):
        if not in_units:
            used[name] = values
        elif form is unit_of:
            used[name] = list(map(unit_of, values))
        elif name != "unit":  # A list of units is that of rows in metres.
            cells = zip(values, factors, strict=False)
            used[heading] = [cell * by if isinstance(cell, float) else cell for cell, by in cells]
    return [dict(zip(used, row, strict=True)) for row in zip(*used.values(), strict=True)]


def table_csv(columns: Columns, items: Sequence[Any] = ()) -> list[str]:
    """Return a table as lines of CSV in the units of its headings, numbers with twelve digits; NaN
    and None are empty.

    >>> table_csv({"point": ["A"], "error x, µm": [2e-7], "k": [2.0]})
    ['point,error_x_um,k', 'A,0.2,2']
    """
    heads, cells = [], []
    for heading, _, values, _, factors in _columns_read(columns, items):
        heads.append(ascii_units(heading).replace(", ", "_").replace(" ", "_"))
        cells.append(map(_cell, values, factors))
    text = io.StringIO()
    CsvWriter(text).writerows([heads, *zip(*cells, strict=True)])
    return text.getvalue().splitlines()


def _cell(value: Any, factor: float) -> Any:
    if not isinstance(value, float):
        return value
    return "" if math.isnan(value) else f"{factor * value + 0.0:.12g}"


def _columns_read(
    columns: Columns, items: Sequence[Any]
) -> Iterator[tuple[str, str, list[Any], Any, Iterable[float]]]:
    """Yield headings of columns, names without units, values, forms, and factors to units."""
    of_rows: Iterable[float] = repeat(1.0)
    has_units = isinstance(dict(columns).get("unit"), str)
    if has_units:
        of_rows = [amount_of(1.0, unit)[0] for unit in _values("unit", items)]
    for heading, column in columns.items() if isinstance(columns, Mapping) else columns:
        source, form = column if isinstance(column, tuple) else (column, 4)
        form = unit_of if has_units and heading == "unit" else form
        name, _, unit = heading.rpartition(", ")
        values = _values(source, items)
        if unit in FACTORS:
            yield heading, name, values, form, repeat(FACTORS[unit])
        else:
            yield heading, heading, values, form, of_rows


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


def as_markdown(
    title: str, caption: str, frame: pandas.DataFrame, stubs: int, notes: Sequence[str]
) -> str:
    """Return a table of texts, whose first columns `stubs` head its rows, in the Markdown of GitHub
    and Pandoc.

    :raises ImportError: tabulate is missing.
    """
    parts = [f"# {_markdown(title)}", f"## {_markdown(caption)}"]
    if not frame.empty:
        texts = frame.map(_markdown).rename(columns=_markdown)
        sides = ["left"] * stubs + ["right"] * (len(frame.columns) - stubs)
        parts.append(texts.to_markdown(index=False, disable_numparse=True, colalign=sides))
    return "\n\n".join([*parts, *map(_markdown, notes)]) + "\n"


def _markdown(text: str) -> str:
    r"""Return text with Markdown's special characters escaped.

    >>> _markdown("a|b *c* <d>")
    'a\\|b \\*c\\* \\<d\\>'
    """
    return re.sub(r"([\\`*_{}\[\]<>|#$~])", r"\\\1", text)


def as_html(
    title: str, caption: str, frame: pandas.DataFrame, stubs: int, notes: Sequence[str]
) -> str:
    """Return a table of texts as HTML elements, below a title."""
    rows = [] if frame.empty else [frame.to_html(index=False, border=0)]
    above = [f"<p><strong>{escape(title)}</strong></p>", f"<p>{escape(caption)}</p>"]
    return "\n".join([*above, *rows, *(f"<p>{escape(note)}</p>" for note in notes)]) + "\n"


def as_latex(
    title: str, caption: str, frame: pandas.DataFrame, stubs: int, notes: Sequence[str]
) -> str:
    r"""Return a table of texts as a tabular for the package booktabs; title, caption and notes are
    comments.

    :raises ImportError: jinja2 is missing.
    """
    sides = "l" * stubs + "r" * (len(frame.columns) - stubs)
    rows = frame.to_latex(index=False, escape=True, column_format=sides).rstrip()
    shown = [] if frame.empty else [rows]
    return "\n".join([_comment(title), _comment(caption), *shown, *map(_comment, notes)]) + "\n"


def _comment(text: str) -> str:
    return f"% {' '.join(text.split())}"
