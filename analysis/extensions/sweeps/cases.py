"""Cases of a sweep of a store, and columns of their tables."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from ballplate.presentation import number, shown_unit, table_rows
from ballplate.simulator.design import Flags
from ballplate.simulator.inputs import QUANTITY, exact_number, in_one_line, number_of
from ballplate.simulator.machines import Array, Integers
from ballplate.uncertainty import DESCRIPTIONS

from .execute import Summary
from .store_columns import symbol_column

if TYPE_CHECKING:
    import pandas

# Rows of a table in text and on the page.
MOST_ROWS = 200

# Values that tables show, with their headings, and those of text, which is narrow; the data frame
# has all.
SHOWN = {
    "maximum": "maximum",
    "average": "average",
    "within_target": "within target, %",
    "spread_ratio": "spread / U",
    "coverage_sigma_given": "covered, %",
}
SILENT = ("", "done")
# Costs and rank, with their headings.
COSTS = {
    "positions": "positions",
    "readings": "readings",
    "hours": "hours",
    "observations": "observations",
    "rank_deficiency": "rank deficiency",
    "criterion_m": "criterion, µm",
    "bound_m": "bound, µm",
    "distance_error_rms_m": "rms error of distances, µm",
    "distance_error_bias_m": "bias of distances, µm",
}
IN_TEXT = ("average", "within_target")
FIGURE = re.compile(rf"(.+?)_({'|'.join(SHOWN)})(?:_(m|rad|m_or_rad|ratio))?")
# Quantities, without their parts.
WHOLE = {symbol_column(symbol) for symbol in DESCRIPTIONS if " " not in symbol}


@dataclass(frozen=True)
class ShownAxis:
    """An axis of the sweep; `numbers` are its values in `unit` as written, empty for texts."""

    name: str
    labels: tuple[str, ...]
    numbers: tuple[float, ...]
    unit: str


@dataclass(frozen=True, repr=False)
class SweepCases:
    """A sweep as computed so far: a row of the store for each case.

    `number` is the sweep's in its store and `definition` its content there; `shortcomings` are
    reasons of failed cases and differences of versions.
    """

    label: str
    store: Path | None
    number: int
    definition: dict[str, Any]
    summary: Summary
    table: pandas.DataFrame
    shortcomings: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        return str(self.definition["title"])

    @cached_property
    def axes(self) -> tuple[ShownAxis, ...]:
        """The axes, as the sweep file has them."""
        return tuple(map(_axis, self.definition["axes"]))

    @cached_property
    def chosen(self) -> Integers:
        """Indices (rows, axes) of each row's values."""
        cells = np.array(self.definition["cells"], np.int64).reshape(-1, len(self.axes))
        return cells[self.table["cell"].to_numpy(np.int64)]

    @cached_property
    def done(self) -> Flags:
        """Mask (rows,) of finished cases."""
        return np.array(self.table["status"] == "done", bool)

    def figure(self, name: str) -> Array:
        """Return a column of the table (rows,); NaN if it is not recorded."""
        # Axes of earlier stores may have names that are figures now.
        if name not in self.table or any(
            name == axis["column"] for axis in self.definition["axes"]
        ):
            return np.full(len(self.table), math.nan)
        return np.asarray(self.table[name], float)

    def headline(self) -> str:
        """Numbers of cases."""
        summary = self.summary
        remaining = f", {summary.left} left" if summary.left else ""
        cases = number_of(summary.cells, "case")
        return f"{cases}, {summary.done} done, {summary.failed} failed{remaining}"


def columns_of(
    result: SweepCases, rows: Iterable[int], shown: Collection[str] = SHOWN
) -> list[tuple[str, list[Any]]]:
    """Return columns of some rows: axes, costs, rank, the values `shown`, and what these take for
    granted.
    """
    table, chosen = result.table.iloc[list(rows)], result.chosen[list(rows)]
    columns: list[tuple[str, list[Any]]] = [
        (axis.name, [axis.labels[k] for k in places.tolist()])
        for axis, places in zip(result.axes, chosen.T, strict=True)
    ]
    if not result.done.all():
        columns.append(("status", table["status"].tolist()))
    for name, heading in COSTS.items():
        if (result.figure(name) > 0).any():
            costs = result.figure(name)[table.index].tolist()
            values = [None if math.isnan(v) else int(v) if v.is_integer() else v for v in costs]
            columns.append((heading, values))
    for name in table.columns:
        match = FIGURE.fullmatch(name)
        if match is None or match[2] not in shown or match[1].removesuffix("_more") not in WHOLE:
            continue
        heading, values = f"{match[1]} {SHOWN[match[2]]}", table[name].to_numpy(float)
        is_open = result.figure(f"{match[1]}_undetermined")[table.index] > 0
        if heading.endswith("%"):
            # Never rounded up: 100 % means all.
            values = np.floor(1e4 * values + 1e-9) / 100
        elif match[3] == "m_or_rad":
            heading, values = f"{heading}, µm or µrad", 1e6 * values
        elif match[3]:
            heading += f", {column_unit(match[3])}"
        # What is neither known nor undetermined has not been recorded.
        is_shown = (np.isfinite(values) | is_open).tolist()
        cells = zip(values.tolist(), is_shown, strict=True)
        columns.append((heading, [value if shows else None for value, shows in cells]))
    for name in ("given", "unspanned"):
        if name in table and table[name].any():
            columns.append((name, table[name].tolist()))
    return columns


def texts_of(
    result: SweepCases, rows: Iterable[int], shown: Collection[str]
) -> tuple[list[str], list[list[str]]]:
    """Return headings and texts of the cells of `columns_of` some rows."""
    columns = columns_of(result, rows, shown)
    texts = [
        ["" if v is None else number(v) if isinstance(v, float) else str(v) for v in row.values()]
        for row in table_rows(columns, in_units=True)
    ]
    return list(dict(columns)), texts


def described(result: SweepCases, rows: Iterable[int]) -> list[str]:
    """Return a line for each of some cases: its number, its values of the axes, and figures."""
    heads, texts = texts_of(result, rows, IN_TEXT)
    names, found = [head.partition(", ") for head in heads], []
    for cell, row in zip(result.table["cell"].iloc[list(rows)], texts, strict=True):
        pairs = zip(names, row, strict=True)
        words = (f"{name} {text} {unit}" for (name, _, unit), text in pairs if text not in SILENT)
        found.append(f"case {cell}: {'; '.join(map(str.rstrip, words))}")
    return found


def column_unit(suffix: str) -> str:
    """Return the printed unit of a column from the end of its name.

    >>> column_unit("m"), column_unit("m_or_rad")
    ('µm', 'µm or µrad')
    """
    unit = suffix.replace("_or_", ", ").replace("ratio", "1")
    return shown_unit(unit).replace(", ", " or ")


def _axis(stored: dict[str, Any]) -> ShownAxis:
    name, labels = in_one_line(stored["name"]), tuple(map(in_one_line, stored["labels"]))
    if not stored["unit"]:
        return ShownAxis(name, labels, (), "")
    unit = "" if stored["unit"] == "1" else stored["unit"]
    # The unit as written, if common to all values; otherwise metres or radians.
    matches = [QUANTITY.fullmatch(label.strip()) for label in labels]
    parts = [(match[1], (match[2] or "").strip()) for match in matches if match is not None]
    units = {each for _, each in parts}
    if len(units) == 1 and len(parts) == len(labels):
        numbers = tuple(float(exact_number(one)) for one, _ in parts)
        return ShownAxis(name, labels, numbers, units.pop() or unit)
    return ShownAxis(name, labels, tuple(map(float, stored["values"])), unit)
