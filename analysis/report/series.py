"""Data of a report's plots: an uncertainty along a swept axis, for each setting of the other
axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..sweeps.columns import symbol_column
from .measures import Measure, trial_symbols, uncertainty_measures
from .results import ReportAxis, ReportedSweep, partly_open

Floats = NDArray[np.float64]

# Lines that can be told apart, and places along an axis that can.
MOST_LINES, MOST_PLACES = 6, 24


@dataclass(frozen=True, eq=False)
class SeriesLine:
    """Values along an axis; `low` and `high` their range where they are medians over several cells.

    `actual` and `error` are what Monte Carlo makes of it and its standard error, empty where no
    trials were made.
    """

    label: str
    x: Floats
    y: Floats
    low: Floats
    high: Floats
    actual: Floats
    error: Floats


@dataclass(frozen=True, eq=False)
class Panel:
    """Lines of one measure."""

    measure: Measure
    lines: tuple[SeriesLine, ...]


@dataclass(frozen=True, eq=False)
class Plot:
    """Average and maximum of a quantity against an axis; `note` says what the lines are."""

    axis: ReportAxis
    symbol: str
    unit: str
    panels: tuple[Panel, ...]
    note: str


def plots(results: ReportedSweep) -> list[Plot]:
    """A plot for each axis with numbers and each quantity of one unit."""
    measures = [
        m
        for m in uncertainty_measures(results)
        if not m.is_count and m.statistic in ("average", "maximum")
    ]
    measures = [m for m in measures if " or " not in m.unit]
    found = []
    for k, axis in enumerate(results.axes):
        if len(axis.numbers) < 2:
            continue
        for symbol in dict.fromkeys(m.symbol for m in measures):
            mine = {m.statistic: m for m in measures if m.symbol == symbol}
            if len(mine) < 2:
                continue
            plot = _plot(results, k, symbol, [mine["average"], mine["maximum"]])
            if any(np.isfinite(line.y).any() for panel in plot.panels for line in panel.lines):
                found.append(plot)
    return found


def _plot(results: ReportedSweep, k: int, symbol: str, measures: Sequence[Measure]) -> Plot:
    axis = results.axes[k]
    done = results.done
    others = [i for i in range(len(results.axes)) if i != k]
    settings, which = np.unique(results.chosen[done][:, others], axis=0, return_inverse=True)
    which = which.ravel()
    places = results.chosen[done, k]
    groups, note = _places(axis, places)
    is_apart = len(settings) <= MOST_LINES and groups is None
    panels = []
    left_out = partly_open(results, symbol)[done]
    for measure in measures:
        values = np.where(left_out, np.nan, measure.factor * results.figure(measure.figure)[done])
        actual, error = _actual(results, measure, done)
        lines = []
        if is_apart:
            for number, setting in enumerate(settings.tolist()):
                chosen = np.flatnonzero(which == number)
                # By what is plotted, which the file may have in any order.
                chosen = chosen[np.argsort(np.array(axis.numbers)[places[chosen]], kind="stable")]
                x, y = np.array(axis.numbers)[places[chosen]], values[chosen]
                words = ", ".join(
                    f"{results.axes[i].name} {results.axes[i].labels[j]}"
                    for i, j in zip(others, setting, strict=True)
                )
                empty = np.zeros(0)
                here = (actual[chosen], error[chosen]) if len(actual) else (empty, empty)
                lines.append(SeriesLine(words, x, y, empty, empty, *here))
        else:
            lines.append(_median(axis, places, groups, values))
        panels.append(Panel(measure, tuple(lines)))
    if not is_apart:
        over = (
            f"the {len(settings)} settings of the other axes"
            if len(settings) > 1
            else "these values"
        )
        note = f"Median, with bars from the smallest to the largest, over {over}{note}."
    if left_out.any():
        note = f"{note} Cells in which some of it is undetermined are left out.".strip()
    return Plot(axis, symbol, measures[0].unit, tuple(panels), note)


def _places(axis: ReportAxis, places: NDArray[np.int64]) -> tuple[NDArray[np.int64] | None, str]:
    """Groups of neighbouring values by index, where there are too many to show each; None where
    there are not.
    """
    count = len(axis.numbers)
    if count <= MOST_PLACES or not len(places):
        return None, ""
    order = np.argsort(np.argsort(np.array(axis.numbers), kind="stable"), kind="stable")
    return (
        order * MOST_PLACES // count,
        f", and over groups of neighbouring ones of the {count} values",
    )


def _median(
    axis: ReportAxis, places: NDArray[np.int64], groups: NDArray[np.int64] | None, values: Floats
) -> SeriesLine:
    """Median and range at each place."""
    import pandas

    numbers = np.array(axis.numbers)
    key = places if groups is None else groups[places]
    table = (
        pandas.DataFrame({"key": key, "x": numbers[places], "y": values}).dropna().groupby("key")
    )
    found = pandas.DataFrame(
        {
            "x": table["x"].median(),
            "y": table["y"].median(),
            "low": table["y"].min(),
            "high": table["y"].max(),
        }
    ).sort_values("x")
    x, y, low, high = (found[name].to_numpy(float) for name in ("x", "y", "low", "high"))
    return SeriesLine("median", x, y, low, high, np.zeros(0), np.zeros(0))


def _actual(
    results: ReportedSweep, measure: Measure, done: NDArray[np.bool_]
) -> tuple[Floats, Floats]:
    """What Monte Carlo makes of an average, and its standard error; nothing where there is none.

    It is the average times the ratio of actual to linearised errors: where Monte Carlo follows a
    sample of the distances only, the average of these may differ from that of all, the ratio does
    not.
    """
    name = symbol_column(measure.symbol)
    if measure.statistic != "average" or measure.symbol not in trial_symbols(results):
        return np.zeros(0), np.zeros(0)
    average = measure.factor * results.figure(measure.figure)[done]
    ratio, error = (
        results.figure(f"{name}_actual_ratio{end}")[done] for end in ("", "_standard_error")
    )
    return average * ratio, average * error
