"""Tables of the average that cells are judged by, over each pair of axes, shaded by size."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from ballplate.presentation import Entry, number
from ballplate.simulator.machines import Array, Integers

from .measures import Measure, uncertainty_measures
from .results import ReportAxis, ReportedSweep, criterion, ranked
from .series import evenly
from .tables import DIGITS, NOT_DONE

# Limits: values of an axis, distinguishable shades, pairs of axes.
MOST_VALUES, SHADES, MOST_PAIRS = 12, 8, 10

# Instead of a shade: something is undetermined; no value.
DEFICIENT, BLANK = -2, -1
STAR = "*"


@dataclass(frozen=True)
class Heat:
    """A measure over two axes; `shades` from 0, the smallest, to SHADES - 1, DEFICIENT or BLANK."""

    rows: ReportAxis
    columns: ReportAxis
    measure: Measure
    row_labels: tuple[str, ...]
    column_labels: tuple[str, ...]
    entries: tuple[tuple[Entry, ...], ...]
    shades: tuple[tuple[int, ...], ...]
    note: str


def heat_maps(results: ReportedSweep) -> list[Heat]:
    """Return a map of the averages that cells are judged by, for each pair of axes with several
    values.
    """
    judged, best = criterion(results), ranked(results)
    measures = [
        m for m in uncertainty_measures(results) if judged is not None and m.figure == judged[0]
    ]
    if not measures or not len(best):
        return []
    maps: list[Heat] = []
    for i, j in combinations(range(len(results.axes)), 2):
        if min(len(results.axes[k].labels) for k in (i, j)) > 1 and len(maps) < MOST_PAIRS:
            heat = _heat(results, i, j, measures[0], int(best[0]))
            maps += [] if heat is None else [heat]
    return maps


def _heat(results: ReportedSweep, i: int, j: int, measure: Measure, best: int) -> Heat | None:
    """Return the map at a cell's values of all further axes; None if fewer than four cells are
    there.
    """
    rows, columns = results.axes[i], results.axes[j]
    further = [k for k in range(len(results.axes)) if k not in (i, j)]
    common = results.chosen[best, further]
    here = np.flatnonzero((results.chosen[:, further] == common).all(axis=1))
    planned = results.cells[(results.cells[:, further] == common).all(axis=1)]
    pairs = map(tuple, results.chosen[here][:, [i, j]].tolist())
    places = dict(zip(pairs, here.tolist(), strict=True))
    wanted = set(map(tuple, planned[:, [i, j]].tolist()))
    row_values, column_values = evenly(rows, MOST_VALUES), evenly(columns, MOST_VALUES)
    grid = [[(a, b) for b in column_values] for a in row_values]
    if sum(place in places for line in grid for place in line) < 4:
        return None
    open_ = np.isnan(results.figure(measure.figure)) | (results.figure("rank_deficiency") > 0)
    values = np.full((len(row_values), len(column_values)), np.nan)
    is_open = np.zeros(values.shape, bool)
    entries = []
    for r, line in enumerate(grid):
        line_entries = []
        for c, place in enumerate(line):
            row = places.get(place)
            if row is None:
                line_entries.append(Entry(NOT_DONE if place in wanted else ""))
                continue
            entry, is_open[r, c] = _entry(results, row, measure, bool(open_[row]))
            line_entries.append(entry)
            if entry.value is not None and not is_open[r, c]:
                values[r, c] = entry.value
        entries.append(tuple(line_entries))
    shades = np.where(is_open, DEFICIENT, _shades(values.ravel()).reshape(values.shape))
    notes = []
    if further:
        notes.append(f"All with {results.words(further, common)}, as in the best case.")
    notes += [
        f"{len(shown)} of {len(axis.labels)} values of {axis.name}."
        for axis, shown in ((rows, row_values), (columns, column_values))
        if len(shown) < len(axis.labels)
    ]
    notes += [f"Hatched, and marked {STAR}: something is undetermined."] if is_open.any() else []
    return Heat(
        rows,
        columns,
        measure,
        tuple(rows.short_labels[k] for k in row_values),
        tuple(columns.short_labels[k] for k in column_values),
        tuple(entries),
        tuple(tuple(line) for line in shades.tolist()),
        " ".join(notes),
    )


def _entry(results: ReportedSweep, row: int, measure: Measure, is_open: bool) -> tuple[Entry, bool]:
    """Return a cell's entry, and whether something is undetermined."""
    cell = results.cell(row)
    if not results.done[row]:
        return Entry(results.statuses[row], None, cell, measure.figure), False
    figure = results.value(measure.figure, row)
    text = number(measure.factor * figure, DIGITS) + (STAR if is_open else "")
    return Entry(text, figure, cell, measure.figure), is_open


def _shades(values: Array) -> Integers:
    """Return shades by size, on a logarithmic scale if all values are positive."""
    finite = np.isfinite(values)
    shades = np.full(len(values), BLANK)
    if not finite.any():
        return shades
    scaled = np.log(values[finite]) if values[finite].min() > 0 else values[finite]
    low, size = scaled.min(), np.ptp(scaled)
    # Values that differ only by rounding get the same shade.
    share = (scaled - low) / size if size > 1e-9 else np.zeros(len(scaled))
    shades[finite] = np.minimum((SHADES * (share + 1e-9)).astype(int), SHADES - 1)
    return shades
