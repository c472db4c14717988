"""Curves of a sweep's page: the average that cases are judged by, along each axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from ballplate.extensions.pages.interface import Chart, Html, Trace, chart_svg, figure, legend
from ballplate.simulator.inputs import number_of
from ballplate.simulator.machines import Array, Integers
from ballplate.uncertainty import DESCRIPTIONS

from .answer import WITHIN, best_first, described, quantity
from .cases import SweepCases, column_unit

# Styles of lines, which differ without colours, too.
STYLES = ("s0", "s1 dashed", "s2 dotted", "s3 heavy", "s4 heavy dashed", "s5 heavy dotted")

# Of a chart, and of a letter.
WIDTH, HEIGHT, LETTER = 800.0, 260.0, 6.0

# Texts of an axis that are drawn, and cases that are drawn as single points.
MOST_TEXTS, MOST_POINTS = 30, 1000


def curves(result: SweepCases, column: str, targets: Mapping[int, str]) -> list[Html]:
    """Return a chart of a column of averages along each axis with several values, if known; each
    dot leads to the element with the id that `targets` has for its row.
    """
    if not np.isfinite(result.figure(column)).any():
        return []
    return [
        _along(result, column, k, targets)
        for k, axis in enumerate(result.axes)
        if axis.labels[1:] and (axis.numbers or len(axis.labels) <= MOST_TEXTS)
    ]


def _along(result: SweepCases, column: str, k: int, targets: Mapping[int, str]) -> Html:
    axis, value = result.axes[k], 1e6 * result.figure(column)
    place = np.array(axis.numbers or range(len(axis.labels)), float)
    x = place[result.chosen[:, k]]
    lines, note = lines_along(result, k, x, value)
    traces, entries = [], []
    for style, (label, rows) in zip(STYLES, lines, strict=False):
        if label and axis.numbers:
            # Lines end where a case is missing.
            along = np.full(len(place), np.nan)
            along[result.chosen[rows, k]] = value[rows]
            order = np.argsort(place, kind="stable")
            traces.append(Trace("line", style, place[order], along[order]))
        traces.append(_dots(result, column, rows, x, style, targets))
        entries.append(("line" if axis.numbers else "dots", style, label))
    room = WIDTH / len(place)
    names = list(axis.labels)
    if not axis.numbers and LETTER * max(map(len, names)) > room:
        note += f" Numbers: {', '.join(f'{k + 1} {name}' for k, name in enumerate(names))}."
        names = [str(k + 1) for k in range(len(names))]
    gaps = np.diff(np.sort(place))
    is_sparse = gaps.min() * WIDTH > 6 * LETTER * np.ptp(place)
    across = f"{axis.name}, {axis.unit}" if axis.unit else axis.name
    chart = _chart(column, traces, across)
    if axis.numbers:
        chart = replace(chart, marked=place.tolist() if is_sparse else ())
    else:
        chart = replace(chart, places=list(enumerate(names)))
    shown = [legend(*entries)] if len(entries) > 1 else []
    return figure(f"{chart.words}.{note}", *shown, chart_svg(chart))


def frontier_chart(
    result: SweepCases, column: str, hours: Array, best: Integers, targets: Mapping[int, str]
) -> Html:
    """Return the chart of averages against hours with the `best` cases joined by steps."""
    value, share = 1e6 * result.figure(column), result.figure(WITHIN)
    steps = np.repeat(best, 2)
    traces = [Trace("line", "faint", hours[steps][1:], value[steps][:-1])]
    entries = [("line", "faint", "least average for the hours")]
    drawn = np.isfinite(hours) & np.isfinite(value)
    groups = (share == 1.0, "meets the target"), (share < 1.0, "does not meet the target")
    for style, (mask, words) in zip(
        ("s2", "s1", "s0"), (*groups, (np.isnan(share), "no target")), strict=True
    ):
        if (rows := np.flatnonzero(mask & drawn)).size:
            traces.append(_dots(result, column, rows, hours, style, targets))
            entries.append(("dots", style, words))
    chart = _chart(column, traces, "laboratory hours")
    left_out = result.summary.cells - int(drawn.sum())
    note = (
        f" Not drawn, since a figure is unknown: {number_of(left_out, 'case')}." if left_out else ""
    )
    return figure(f"{chart.words}.{note}", legend(*entries), chart_svg(chart))


def _chart(column: str, traces: Sequence[Trace], across: str) -> Chart:
    symbol, unit = quantity(column), column_unit(column.partition("_average_")[2])
    described_as = DESCRIPTIONS.get(symbol, "")
    words = ", ".join(filter(None, [f"{symbol} average", described_as]))
    return Chart(
        traces,
        across,
        f"{symbol} average, {unit}",
        f"{words}, against {across.partition(', ')[0]}",
        from_zero=True,
        height=HEIGHT,
        width=WIDTH,
    )


def _dots(
    result: SweepCases,
    column: str,
    rows: Integers,
    x: Array,
    style: str,
    targets: Mapping[int, str],
) -> Trace:
    """Return dots with their cases, if there are not too many."""
    notes = [
        (described(result, row, column), targets.get(row, ""))
        for row in rows[: MOST_POINTS * (len(rows) <= MOST_POINTS)].tolist()
    ]
    return Trace("dots", style, x[rows], 1e6 * result.figure(column)[rows], notes=notes)


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
