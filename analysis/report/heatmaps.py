"""Averages over each pair of axes: tables whose entries are shaded by their size."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..presentation.formatting import number
from ..presentation.table import Entry
from .measures import Measure, uncertainty_measures
from .results import ReportAxis, ReportedSweep, criterion, partly_open
from .tables import DIGITS, NOT_DONE, STAR

# Values of an axis that are shown, shades that can be told apart, and pairs of axes.
MOST_VALUES, SHADES, MOST_PAIRS = 12, 8, 10


@dataclass(frozen=True)
class Heat:
    """A measure over two axes; `shades` from 0, the smallest, to SHADES - 1, or -1 where there is
    none.

    What is undetermined even in part has none.
    """

    rows: ReportAxis
    columns: ReportAxis
    measure: Measure
    row_labels: tuple[str, ...]
    column_labels: tuple[str, ...]
    entries: tuple[tuple[Entry, ...], ...]
    shades: tuple[tuple[int, ...], ...]
    note: str


def heat_maps(results: ReportedSweep) -> list[Heat]:
    """A map of the averages that cells are judged by, for each pair of axes with few or with
    ordered values.
    """
    judged = criterion(results)
    measures = [
        m for m in uncertainty_measures(results) if judged is not None and m.figure == judged[0]
    ]
    if not measures:
        return []
    pairs = [
        (i, j)
        for i, j in combinations(range(len(results.axes)), 2)
        if all(
            len(results.axes[k].labels) <= MOST_VALUES or results.axes[k].numbers for k in (i, j)
        )
        and min(len(results.axes[k].labels) for k in (i, j)) > 1
    ]
    return [_heat(results, i, j, measures[0]) for i, j in pairs[:MOST_PAIRS]]


def _heat(results: ReportedSweep, i: int, j: int, measure: Measure) -> Heat:
    rows, columns = results.axes[i], results.axes[j]
    row_of, column_of = rows.groups(MOST_VALUES), columns.groups(MOST_VALUES)
    row_labels, column_labels = _labels(rows, row_of), _labels(columns, column_of)
    shape = len(row_labels), len(column_labels)
    open_ = partly_open(results, measure.symbol)
    figures = np.where(results.done, results.figure(measure.figure), np.nan)
    values = np.where(open_, np.nan, figures)
    any_open = False
    place = row_of[results.chosen[:, i]] * shape[1] + column_of[results.chosen[:, j]]
    members = _members(place, shape[0] * shape[1])
    planned = np.bincount(
        row_of[results.cells[:, i]] * shape[1] + column_of[results.cells[:, j]], None, len(members)
    )
    entries, medians = [], np.full(len(members), np.nan)
    for k, here in enumerate(members):
        known = values[here][np.isfinite(values[here])]
        medians[k] = np.median(known) if len(known) else np.nan
        is_open = bool((open_ & results.done)[here].any())
        any_open |= is_open
        # A single figure that leaves something out is told, without a shade.
        told = figures[here[0]] if is_open and len(here) == 1 else medians[k]
        text = number(measure.factor * told, DIGITS) if len(here) else NOT_DONE
        text += STAR if is_open else ""
        if planned[k] == 1 and len(here):
            row, cells = here[0], results.frame["cell"].to_numpy()
            is_done = results.done[row]
            entries.append(
                Entry(
                    text if is_done else results.statuses[row],
                    float(figures[row]) if is_done else None,
                    int(cells[row]),
                    measure.figure,
                )
            )
        else:
            entries.append(Entry(text if planned[k] else ""))
    notes = [] if planned.max() <= 1 else ["Medians over all cells that share the two values."]
    notes += (
        [f"{STAR} marks what is undetermined, in part at least; it has no shade."]
        if any_open
        else []
    )
    return Heat(
        rows,
        columns,
        measure,
        row_labels,
        column_labels,
        tuple(tuple(entries[r * shape[1] : (r + 1) * shape[1]]) for r in range(shape[0])),
        tuple(tuple(row) for row in _shades(medians).reshape(shape).tolist()),
        " ".join(notes),
    )


def _members(place: NDArray[np.int64], count: int) -> list[NDArray[np.int64]]:
    """Rows at each place."""
    order = np.argsort(place, kind="stable")
    return np.split(order, np.searchsorted(place[order], np.arange(1, count)))


def _labels(axis: ReportAxis, group: NDArray[np.int64]) -> tuple[str, ...]:
    """Labels of values, or of groups of neighbouring ones where there are many."""
    if len(axis.labels) <= MOST_VALUES:
        return axis.short_labels
    numbers = np.array(axis.numbers)
    ends = [(numbers[group == k].min(), numbers[group == k].max()) for k in range(MOST_VALUES)]
    return tuple(f"{low:.5g} to {high:.5g}" if high > low else f"{low:.5g}" for low, high in ends)


def _shades(values: NDArray[np.float64]) -> NDArray[np.int64]:
    """Shades by size, on a logarithmic scale where all are above zero."""
    finite = np.isfinite(values)
    found = np.full(len(values), -1)
    if not finite.any():
        return found
    scaled = np.log(values[finite]) if values[finite].min() > 0 else values[finite]
    low, size = scaled.min(), np.ptp(scaled)
    # Equal values but for rounding have no order to show.
    share = (scaled - low) / size if size > 1e-9 else np.zeros(len(scaled))
    found[finite] = np.minimum((share * SHADES).astype(int), SHADES - 1)
    return found
