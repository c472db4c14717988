"""Data of a report's plots: an uncertainty along an axis, for each setting of the other axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing import evenly_spread
from ballplate.simulator.machines import Array, Integers

from ..store_columns import symbol_column
from .measures import Measure, uncertainty_measures
from .results import ReportAxis, ReportedSweep, criterion, ranked

# Limits: distinguishable lines, values along an axis, pictures of one quantity for settings of
# further axes, cells drawn as points.
MOST_LINES, MOST_PLACES, MOST_PICTURES, MOST_POINTS = 6, 200, 4, 1000


@dataclass(frozen=True, eq=False)
class SeriesLine:
    """Values along an axis, each of a single cell.

    `actual` and `error` are Monte Carlo's value and its standard error, NaN without trials.
    """

    label: str
    x: Array
    y: Array
    actual: Array
    error: Array


@dataclass(frozen=True, eq=False)
class Plot:
    """Average of a quantity against an axis; `note` describes the lines.

    `is_scattered` if no two cells share the values of the other axes: then cells are points.
    """

    axis: ReportAxis
    measure: Measure
    lines: tuple[SeriesLine, ...]
    note: str
    is_scattered: bool = False


def plots(results: ReportedSweep) -> list[Plot]:
    """Return plots for each axis with numbers and each quantity with one unit.

    Lines are values of a second axis. The quantity that cells are judged by comes first, with a
    picture for each setting of the further axes.
    """
    judged = (criterion(results) or ("", ""))[0]
    measures = [
        measure
        for measure in uncertainty_measures(results)
        if measure.statistic == "average" and " or " not in measure.unit
    ]
    measures.sort(key=lambda measure: measure.figure != judged)
    drawn = []
    for k, axis in enumerate(results.axes):
        if len(axis.numbers) < 2:
            continue
        pictures = _pictures(results, k)
        for measure in measures:
            for picture in pictures if measure.figure == judged else pictures[:1]:
                plot = _plot(results, k, picture, measure)
                if any(np.isfinite(line.y).any() for line in plot.lines):
                    drawn.append(plot)
    return drawn


@dataclass(frozen=True, eq=False)
class _Picture:
    """Rows of the frame by line, with the lines' labels, and a note."""

    lines: tuple[tuple[str, Integers], ...]
    note: str
    is_scattered: bool = False


def _pictures(results: ReportedSweep, k: int) -> list[_Picture]:
    """Return the pictures against axis `k`, that of the best cell first."""
    best = ranked(results)
    rows = np.flatnonzero(results.done)
    other_axes = [i for i in range(len(results.axes)) if i != k]
    settings, which = np.unique(results.chosen[rows][:, other_axes], axis=0, return_inverse=True)
    which = which.ravel()
    if len(settings) <= MOST_LINES or not len(best):
        return [
            _picture(results, k, other_axes, [rows[which == i] for i in range(len(settings))], "")
        ]
    if np.bincount(which).max() < 2:
        thinned = rows[:: -(-len(rows) // MOST_POINTS)]
        note = "Each point is a case; the other axes differ from one to the next."
        note += f" {len(thinned)} of {len(rows)} are drawn." if len(thinned) < len(rows) else ""
        return [_Picture((("", thinned),), note, True)]
    second = max(
        other_axes, key=lambda i: (len(results.axes[i].labels) <= MOST_LINES, _count(results, i))
    )
    further = [i for i in other_axes if i != second]
    values = evenly(results.axes[second], MOST_LINES)
    apart, place = np.unique(results.chosen[rows][:, further], axis=0, return_inverse=True)
    best_setting = place.ravel()[np.flatnonzero(rows == best[0])[0]]
    order = [int(best_setting), *(i for i in range(len(apart)) if i != best_setting)][
        :MOST_PICTURES
    ]
    pictures = []
    for i in order:
        here = rows[place.ravel() == i]
        lines = [here[results.chosen[here, second] == value] for value in values]
        note = results.words(further, apart[i])
        note = f"With {note}" if note else ""
        if i == best_setting and len(apart) > 1:
            note += ", as in the best case"
        count = len(results.axes[second].labels)
        if len(values) < count:
            note += f"; {len(values)} of {count} values of {results.axes[second].name}"
        if i == order[-1] and len(order) < len(apart):
            note += f"; {len(apart) - len(order)} more combinations are in the store"
        pictures.append(
            _picture(results, k, [second], lines, f"{note}.".removeprefix("; ") if note else "")
        )
    return pictures


def _count(results: ReportedSweep, i: int) -> int:
    return len(results.axes[i].labels)


def evenly(axis: ReportAxis, most: int) -> list[int]:
    """Return indices of values of an axis in order, evenly spread if there are more than `most`."""
    order = (
        np.argsort(np.array(axis.numbers), kind="stable")
        if axis.numbers
        else np.arange(len(axis.labels))
    )
    return [int(i) for i in order[evenly_spread(len(order), most)]]


def _picture(
    results: ReportedSweep,
    k: int,
    axes: Sequence[int],
    lines: Sequence[Integers],
    note: str,
) -> _Picture:
    """Return lines of rows, each sorted along the plotted axis."""
    x = np.array(results.axes[k].numbers)[results.chosen[:, k]]
    shown = set(evenly(results.axes[k], MOST_PLACES))
    labelled_lines = []
    for line in lines:
        line_rows = line[[value in shown for value in results.chosen[line, k].tolist()]]
        if len(line_rows):
            label = results.words(axes, results.chosen[line_rows[0], axes])
            labelled_lines.append((label, line_rows[np.argsort(x[line_rows], kind="stable")]))
    return _Picture(tuple(labelled_lines), note)


def _plot(results: ReportedSweep, k: int, picture: _Picture, measure: Measure) -> Plot:
    axis = results.axes[k]
    x = np.array(axis.numbers)[results.chosen[:, k]]
    values = measure.factor * results.figure(measure.figure)
    actual, error = _actual(results, measure)
    lines = tuple(
        SeriesLine(label, x[rows], values[rows], actual[rows], error[rows])
        for label, rows in picture.lines
    )
    note = picture.note
    if any(np.isnan(line.y).any() for line in lines):
        note = f"{note} Cases with undetermined values are left out.".strip()
    return Plot(axis, measure, lines, note, picture.is_scattered)


def _actual(results: ReportedSweep, measure: Measure) -> tuple[Array, Array]:
    """Return Monte Carlo's value of an average and its standard error; NaN without trials."""
    name = symbol_column(measure.symbol)
    # Monte Carlo may follow a sample of the distances, with another average but the same ratio.
    average = measure.factor * results.figure(measure.figure)
    ratio, error = (results.figure(f"{name}_actual_ratio{end}") for end in ("", "_standard_error"))
    return average * ratio, average * error
