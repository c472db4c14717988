"""Curves of a sweep's page: the average that cases are judged by, along each axis."""

from __future__ import annotations

import numpy as np
from ballplate.extensions.pages.interface import Chart, Html, Trace, chart_svg, figure, legend
from ballplate.simulator.inputs import number_of
from ballplate.simulator.machines import Array, Integers
from ballplate.uncertainty import DESCRIPTIONS

from .answer import best_first, quantity
from .cases import SweepCases, column_unit

# Styles of lines, which differ without colours, too.
STYLES = ("s0", "s1 dashed", "s2 dotted", "s3 heavy", "s4 heavy dashed", "s5 heavy dotted")

# Texts of an axis that are drawn, and cases that are drawn as single points.
MOST_TEXTS, MOST_POINTS = 30, 1000


def curves(result: SweepCases, column: str) -> list[Html]:
    """Return a chart of a column of averages along each axis with several values, if known."""
    if not np.isfinite(result.figure(column)).any():
        return []
    return [
        _chart(result, column, k)
        for k, axis in enumerate(result.axes)
        if len(axis.labels) > 1 and (axis.numbers or len(axis.labels) <= MOST_TEXTS)
    ]


def _chart(result: SweepCases, column: str, k: int) -> Html:
    axis, value = result.axes[k], 1e6 * result.figure(column)
    x = np.array(axis.numbers or range(len(axis.labels)), float)[result.chosen[:, k]]
    kind = "line" if axis.numbers else "dots"
    lines, note = lines_along(result, k, x, value)
    traces, entries = [], []
    for style, (label, rows) in zip(STYLES, lines, strict=False):
        traces.append(Trace("dots", style, x[rows], value[rows]))
        if label:
            traces += [Trace("line", style, x[rows], value[rows])] if axis.numbers else []
            entries.append((kind, style, label))
    symbol = quantity(column)
    words = f"{symbol} average against {axis.name}"
    chart = Chart(
        traces,
        f"{axis.name}, {axis.unit}" if axis.unit else axis.name,
        column_unit(column.partition("_average_")[2]),
        words,
        places=() if axis.numbers else list(enumerate(axis.labels)),
        from_zero=True,
    )
    caption = f"{symbol} average, {DESCRIPTIONS.get(symbol, '')}, against {axis.name}.{note}"
    shown = [legend(*entries)] if len(entries) > 1 else []
    return figure(caption, *shown, chart_svg(chart))


def lines_along(
    result: SweepCases, k: int, x: Array, value: Array
) -> tuple[list[tuple[str, Integers]], str]:
    """Return rows of cases that differ in axis `k` only, sorted along it, with the values of the
    other axes; those with the smallest averages if there are too many.
    """
    rows = np.flatnonzero(result.done & np.isfinite(value))
    others = [i for i in range(len(result.axes)) if i != k]
    settings, which = np.unique(result.chosen[rows][:, others], axis=0, return_inverse=True)
    which = which.ravel()
    if len(settings) > len(STYLES) and np.bincount(which).max() < 2:
        note = " Each point is a case; the other axes differ from one to the next."
        return [("", rows[:: -(-len(rows) // MOST_POINTS)])], note
    least = np.full(len(settings), np.inf)
    np.minimum.at(least, which, value[rows])
    # In the order of the file.
    drawn = sorted(best_first(least)[: len(STYLES)].tolist())
    lines = []
    for i in drawn:
        line = rows[which == i]
        line = line[np.argsort(x[line], kind="stable")]
        lines.append((result.words(int(line[0]), others) or "average", line))
    if len(settings) <= len(STYLES):
        return lines, ""
    combinations = number_of(len(settings), "combination")
    return lines, f" Of {combinations} of the other axes, the {len(lines)} with the smallest."
