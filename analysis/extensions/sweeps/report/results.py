"""Contents of a report: a sweep of a store with its axes, values and texts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from ballplate.simulator.computing import comparable
from ballplate.simulator.design import Flags
from ballplate.simulator.inputs import QUANTITY, exact_number, in_one_line
from ballplate.simulator.machines import Array, Integers
from ballplate.uncertainty import RECORDED
from numpy.typing import NDArray

from ..frame import frame_of
from ..store import Store, chosen_sweep, results
from ..stored import StoredResults as Found

if TYPE_CHECKING:
    import pandas


# Quantities to judge cells by: the average of the first that is recorded.
PREFERRED = ("U6", "U4", "U5", "U1", "U3_lengths", "U2_lengths", "U3", "U2")
CRITERIA = (*PREFERRED, *(symbol for symbol in RECORDED if symbol not in PREFERRED))


@dataclass(frozen=True)
class ReportAxis:
    """An axis of the sweep; `numbers` are its values in `unit` as written, empty for texts."""

    name: str
    column: str
    labels: tuple[str, ...]
    numbers: tuple[float, ...]
    unit: str

    @property
    def title(self) -> str:
        """Name, with the unit if there is one."""
        return f"{self.name}, {self.unit}" if self.unit else self.name

    @property
    def short_labels(self) -> tuple[str, ...]:
        """Labels without the unit, and no longer than distinct labels need."""
        if not self.numbers:
            return self.labels
        short = tuple(f"{number:.4g}" for number in self.numbers)
        is_enough = len(set(short)) == len(short) and not any("e" in text for text in short)
        return short if is_enough else tuple(f"{number:.10g}" for number in self.numbers)


@dataclass(frozen=True, eq=False)
class ReportedSweep:
    """A sweep and its results.

    `cells` (cells, axes) are the indices of each cell's values. `frame` has the rows of finished
    and failed cells, `chosen` (rows, axes) their indices, `texts` their details by cell. `found`
    are the results in the store.
    """

    number: int
    definition: dict[str, Any]
    axes: tuple[ReportAxis, ...]
    cells: Integers
    frame: pandas.DataFrame
    chosen: Integers
    texts: dict[int, dict[str, Any]]
    found: Found

    @property
    def title(self) -> str:
        return str(self.definition["title"])

    def count(self, status: str) -> int:
        """Return the number of cells of a status."""
        return self.statuses.count(status)

    @property
    def left(self) -> int:
        return len(self.cells) - len(self.frame) - len(self.found.damaged)

    def label(self, cell: int) -> str:
        """Return a cell's axes with their values."""
        return self.words(range(len(self.axes)), self.cells[cell])

    def words(self, axes: Iterable[int], values: Integers) -> str:
        """Return some axes with values by index."""
        return ", ".join(
            f"{self.axes[i].name} {self.axes[i].labels[k]}"
            for i, k in zip(axes, values.tolist(), strict=True)
        )

    def cell(self, row: int) -> int:
        """Return the cell of a row of the frame."""
        return int(self.frame["cell"].to_numpy()[row])

    def labels(self, row: int) -> tuple[str, ...]:
        """Return the axes' values in a row of the frame."""
        return tuple(
            axis.labels[k] for axis, k in zip(self.axes, self.chosen[row].tolist(), strict=True)
        )

    def value(self, name: str, row: int) -> float:
        """Return a value in a row of the frame; NaN if it is not recorded."""
        return float(self.frame[name].to_numpy()[row]) if name in self.frame else math.nan

    @cached_property
    def statuses(self) -> list[str]:
        """Status of each row of the frame."""
        return [str(status) for status in self.frame["status"]]

    @cached_property
    def done(self) -> Flags:
        """Mask (rows,) of finished cells."""
        return np.array([status == "done" for status in self.statuses], bool)

    def figure(self, name: str) -> Array:
        """Return a column of the frame (rows,); NaN if it is not recorded."""
        return (
            np.asarray(self.frame[name], float)
            if name in self.frame
            else np.full(len(self.frame), np.nan)
        )


def read_results(store: Store, sweep: int | None) -> ReportedSweep:
    """Return the results of a sweep of a store, the newest by default.

    :raises StoreError: there is no such sweep, or the store cannot be read.
    """
    number, definition = chosen_sweep(store, sweep)
    axes = tuple(_axis(stored_axis) for stored_axis in definition["axes"])
    cells = np.array(definition["cells"], np.int64).reshape(len(definition["cells"]), len(axes))
    stored = results(store, number, len(cells))
    texts = {row.number: row.details for row in stored.rows}
    return ReportedSweep(
        number,
        definition,
        axes,
        cells,
        frame_of(stored, definition),
        cells[stored.cells],
        texts,
        stored,
    )


def _axis(stored: dict[str, Any]) -> ReportAxis:
    labels = tuple(map(in_one_line, stored["labels"]))
    if not stored["unit"]:
        return ReportAxis(in_one_line(stored["name"]), stored["column"], labels, (), "")
    # The unit as written, if common to all values; otherwise metres or radians.
    matches = [QUANTITY.fullmatch(label.strip()) for label in labels]
    units = {(match[2] or "").strip() for match in matches if match is not None}
    numbers = tuple(float(value) for value in stored["values"])
    unit = "" if stored["unit"] == "1" else stored["unit"]
    if len(units) == 1 and all(matches):
        unit = units.pop()
        numbers = tuple(float(exact_number(match[1])) for match in matches if match is not None)
    return ReportAxis(in_one_line(stored["name"]), stored["column"], labels, numbers, unit)


def given_sentences(results: ReportedSweep) -> list[str]:
    """Return a sentence on each condition that figures of finished cells take for granted."""
    return [f"Given {text}: {cells}." for text, cells in _with_cells(results, "given")]


def unspanned_sentences(results: ReportedSweep) -> list[str]:
    """Return a sentence on each part of the volume that plates of finished cells leave out."""
    return [
        f"Places do not follow the size in {cells}: {text}."
        for text, cells in _with_cells(results, "unspanned")
    ]


def texts_of_all(results: ReportedSweep) -> dict[str, str]:
    """Return conditions, and what plates span, with the cells that they are of."""
    return {
        name: "; ".join(f"{cells}: {text}" for text, cells in _with_cells(results, name))
        for name in ("given", "unspanned")
    }


def texts_of_cell(results: ReportedSweep, cell: int) -> dict[str, str]:
    """Return a cell's conditions, and what its plates span."""
    return {name: "; ".join(_texts(results, cell, name)) for name in ("given", "unspanned")}


def _texts(results: ReportedSweep, cell: int, name: str) -> list[str]:
    found = results.texts.get(cell, {}).get(name, ())
    return [found] if isinstance(found, str) else [str(text) for text in found]


def _with_cells(results: ReportedSweep, name: str) -> list[tuple[str, str]]:
    """Return the texts of finished cells, each with words for its cells."""
    cells_of: dict[str, list[int]] = {}
    done = [results.cell(row) for row in np.flatnonzero(results.done).tolist()]
    for cell in done:
        for text in _texts(results, cell, name):
            cells_of.setdefault(text, []).append(cell)
    return [
        (text, "all cases" if len(cells) == len(done) else f"cases {cell_list(cells)}")
        for text, cells in cells_of.items()
    ]


def criterion(results: ReportedSweep) -> tuple[str, str] | None:
    """Return the column of the average that cells are judged by, and its quantity; None without
    one.
    """
    for name in CRITERIA:
        for column in results.frame.columns:
            if column.startswith(f"{name}_average_"):
                return column, name
    return None


def best_and_worst(results: ReportedSweep) -> tuple[int, ...]:
    """Return the first and the last of the ranked cells, which may be the same, or missing."""
    rows = ranked(results)
    cells = results.frame["cell"].to_numpy()[rows]
    return tuple(dict.fromkeys((int(cells[0]), int(cells[-1])))) if len(rows) else ()


def ranked(results: ReportedSweep) -> Integers:
    """Return the rows of finished cells, best first: fewest undetermined values, then smallest
    average.
    """
    judged = criterion(results)
    done = np.flatnonzero(results.done)
    if judged is None:
        return done[:0]
    column, name = judged
    average = np.nan_to_num(results.figure(column)[done], nan=math.inf)
    open_ = results.figure(f"{name}_undetermined")[done]
    return done[best_first(open_, average)]


def best_first(*keys: NDArray[np.generic]) -> Integers:
    """Return an order by the first of `keys` (m,), then by the next: smallest first and NaN last.

    Values of the last key that differ only by rounding keep their order.

    >>> best_first(np.array([1, 0, 0, 0]), np.array([0.1, 0.1 + 0.2, 0.3, np.nan])).tolist()
    [1, 2, 3, 0]
    """
    *before, value = keys
    return np.lexsort([comparable(value), *reversed(before)])


def cell_list(cells: Iterable[int], most: int = 12) -> str:
    """Return numbers of cells as text, with ranges.

    >>> cell_list([0, 1, 2, 5, 7, 8]), cell_list(range(0, 40, 2), 3)
    ('0 to 2, 5, 7 to 8', '0, 2, 4 and 17 more')
    """
    runs: list[list[int]] = []
    for cell in cells:
        if runs and cell == runs[-1][-1] + 1:
            runs[-1] = [runs[-1][0], cell]
        else:
            runs.append([cell, cell])
    parts = [f"{first} to {last}" if last > first else f"{first}" for first, last in runs[:most]]
    more = sum(last - first + 1 for first, last in runs[most:])
    return ", ".join(parts) + (f" and {more} more" if more else "")


def common_values(results: ReportedSweep, cells: Sequence[int]) -> str:
    """Return values of axes that distinguish a set of cells from all others; empty without such
    values.
    """
    inside = np.zeros(len(results.cells), bool)
    inside[list(cells)] = True
    words = []
    for k, axis in enumerate(results.axes):
        own_values, outside = (
            set(results.cells[inside, k].tolist()),
            set(results.cells[~inside, k].tolist()),
        )
        if len(outside) and not own_values & outside and len(own_values) <= 6:
            words.append(f"{axis.name} " + " or ".join(axis.labels[i] for i in sorted(own_values)))
    return ", ".join(words)
