"""Contents of a report: a sweep of a store with its axes, figures and texts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from ballplate.simulator.computing import comparable
from ballplate.simulator.inputs import QUANTITY, exact_number, in_one_line
from ballplate.uncertainty import RECORDED
from numpy.typing import NDArray

from ..frame import frame_of
from ..store import Store, chosen_sweep, results
from ..store_columns import MORE, symbol_column
from ..stored import StoredResults as Found

if TYPE_CHECKING:
    import pandas

Integers = NDArray[np.int64]

# The quantities whose average makes one cell better than another; the first of these that is
# recorded.
PREFERRED = ("U6", "U4", "U5", "U1", "U3_lengths", "U2_lengths", "U3", "U2")
CRITERIA = (*PREFERRED, *(symbol for symbol in RECORDED if symbol not in PREFERRED))


@dataclass(frozen=True)
class ReportAxis:
    """An axis of the sweep; `numbers` are its values in `unit` as the file writes them, none where
    they are texts.
    """

    name: str
    column: str
    labels: tuple[str, ...]
    numbers: tuple[float, ...]
    unit: str

    @property
    def title(self) -> str:
        """The name, with the unit where there is one."""
        return f"{self.name}, {self.unit}" if self.unit else self.name

    @property
    def short_labels(self) -> tuple[str, ...]:
        """Labels without the unit that `title` has, and no longer than tells them apart."""
        if not self.numbers:
            return self.labels
        short = tuple(f"{number:.4g}" for number in self.numbers)
        is_enough = len(set(short)) == len(short) and not any("e" in text for text in short)
        return short if is_enough else tuple(f"{number:.10g}" for number in self.numbers)


@dataclass(frozen=True, eq=False)
class ReportedSweep:
    """A sweep and its results.

    `cells` (cells, axes) are the indices of the values that make up each cell, `frame` has the rows
    of those that are done or have failed, `chosen` (rows, axes) their indices, and `texts` what was
    told of them, by cell. `found` is what the store holds of them.
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
        """Number of cells of a status."""
        return self.statuses.count(status)

    @property
    def left(self) -> int:
        return len(self.cells) - len(self.frame) - len(self.found.damaged)

    def label(self, cell: int) -> str:
        """A cell in words."""
        return ", ".join(
            f"{axis.name} {axis.labels[k]}"
            for axis, k in zip(self.axes, self.cells[cell].tolist(), strict=True)
        )

    def value(self, name: str, row: int) -> float:
        """A figure of a row of the frame; NaN where none was recorded."""
        return float(self.frame[name].to_numpy()[row]) if name in self.frame else math.nan

    @cached_property
    def statuses(self) -> list[str]:
        """Status of each row of the frame."""
        return [str(status) for status in self.frame["status"]]

    @cached_property
    def done(self) -> NDArray[np.bool_]:
        """Which rows of the frame are of cells that are done."""
        return np.array([status == "done" for status in self.statuses], bool)

    def figure(self, name: str) -> NDArray[np.float64]:
        """A column of the frame (rows,); NaN where none was recorded."""
        return (
            np.asarray(self.frame[name], float)
            if name in self.frame
            else np.full(len(self.frame), np.nan)
        )


def read_results(store: Store, sweep: int | None) -> ReportedSweep:
    """Results of a sweep of a store, the newest by default.

    :raises StoreError: there is no such sweep, or the store cannot be read.
    """
    number, definition = chosen_sweep(store, sweep)
    axes = tuple(_axis(one) for one in definition["axes"])
    cells = np.array(definition["cells"], np.int64).reshape(len(definition["cells"]), len(axes))
    found = results(store, number, len(cells))
    texts = {row.number: row.details for row in found.rows}
    return ReportedSweep(
        number,
        definition,
        axes,
        cells,
        frame_of(found, definition),
        cells[found.cells],
        texts,
        found,
    )


def _axis(stored: dict[str, Any]) -> ReportAxis:
    labels = tuple(map(in_one_line, stored["labels"]))
    if not stored["unit"]:
        return ReportAxis(in_one_line(stored["name"]), stored["column"], labels, (), "")
    # The unit as it was written, where all values have the same; otherwise metres or radians.
    found = [QUANTITY.fullmatch(label.strip()) for label in labels]
    units = {(one[2] or "").strip() for one in found if one is not None}
    numbers = tuple(float(value) for value in stored["values"])
    unit = "" if stored["unit"] == "1" else stored["unit"]
    if len(units) == 1 and all(found):
        unit = units.pop()
        numbers = tuple(float(exact_number(one[1])) for one in found if one is not None)
    return ReportAxis(in_one_line(stored["name"]), stored["column"], labels, numbers, unit)


def partly_open(results: ReportedSweep, symbol: str) -> NDArray[np.bool_]:
    """Rows of the frame (rows,) in which some of a quantity's values are undetermined, so that
    others stand for all.
    """
    column = f"{symbol_column(symbol.rstrip(MORE))}_undetermined"
    if column not in results.frame:
        return np.zeros(len(results.frame), bool)
    return results.figure(column) > 0


def criterion(results: ReportedSweep) -> tuple[str, str] | None:
    """Column of the average that cells are judged by, and its quantity; None where none is
    recorded.
    """
    for name in CRITERIA:
        for column in results.frame.columns:
            if column.startswith(f"{name}_average_"):
                return column, name
    return None


def best_and_worst(results: ReportedSweep) -> tuple[int, ...]:
    """The cell with the smallest average uncertainty, and that with the largest; those that leave
    less open come first.

    One cell if there is only one, none if none is done or nothing is recorded.
    """
    rows = ranked(results)
    cells = results.frame["cell"].to_numpy()[rows]
    return tuple(dict.fromkeys((int(cells[0]), int(cells[-1])))) if len(rows) else ()


def ranked(results: ReportedSweep) -> Integers:
    """Rows of the cells that are done, best first: those that leave less open, then of smaller
    average uncertainty.
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
    """Order of places by the first of `keys` (m,), then by the next: smallest first and NaN last.
    Values of the last key that are equal but for rounding stay in the order in which they are.

    >>> best_first(np.array([1, 0, 0, 0]), np.array([0.1, 0.1 + 0.2, 0.3, np.nan])).tolist()
    [1, 2, 3, 0]
    """
    *before, value = keys
    return np.asarray(np.lexsort([comparable(value), *reversed(before)]))


def cell_list(cells: Iterable[int], most: int = 12) -> str:
    """Numbers of cells, neighbours put together.

    >>> cell_list([0, 1, 2, 5, 7, 8]), cell_list(range(0, 40, 2), 3)
    ('0 to 2, 5, 7 to 8', '0, 2, 4 and 17 more')
    """
    runs: list[list[int]] = []
    for cell in cells:
        if runs and cell == runs[-1][-1] + 1:
            runs[-1] = [runs[-1][0], cell]
        else:
            runs.append([cell, cell])
    told = [f"{first} to {last}" if last > first else f"{first}" for first, last in runs[:most]]
    more = sum(last - first + 1 for first, last in runs[most:])
    return ", ".join(told) + (f" and {more} more" if more else "")


def common_values(results: ReportedSweep, cells: Sequence[int]) -> str:
    """Values of axes that a set of cells has and no other cell: what tells it from the others, if
    anything does.
    """
    inside = np.zeros(len(results.cells), bool)
    inside[list(cells)] = True
    words = []
    for k, axis in enumerate(results.axes):
        mine, others = (
            set(results.cells[inside, k].tolist()),
            set(results.cells[~inside, k].tolist()),
        )
        if len(others) and not mine & others and len(mine) <= 6:
            words.append(f"{axis.name} " + " or ".join(axis.labels[i] for i in sorted(mine)))
    return ", ".join(words)
