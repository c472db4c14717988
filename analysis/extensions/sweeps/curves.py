"""Charts of a sweep: the average that cases are judged by, against hours and along each axis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from ballplate.extensions.pages.interface import Chart, Trace
from ballplate.simulator.inputs import number_of
from ballplate.simulator.machines import Array
from ballplate.uncertainty import DESCRIPTIONS

from .answer import WITHIN, quantity
from .axis_effects import averages_along
from .cases import SweepCases, column_unit, described

# Styles of dots, and their words.
STYLES = {"s0": "meets the target", "s1": "does not meet the target", "s2": "no target"}

COLOURS = "Blue: meets the target; orange: does not; green: no target."

# Of a chart, and of a letter.
WIDTH, HEIGHT, LETTER = 800.0, 260.0, 6.0

# Texts of an axis that are drawn, lines of a chart, and dots that state their case.
MOST_TEXTS, MOST_LINES, MOST_POINTS = 30, 40, 1000


def charts(
    result: SweepCases, column: str, best: Sequence[int], targets: Mapping[int, str]
) -> list[Chart]:
    """Return charts of a column of averages: against hours if there are `best` rows, and along each
    axis with several values. Dots lead to the elements with the ids that `targets` has for their
    rows.
    """
    value, share = 1e6 * result.figure(column), result.figure(WITHIN)
    texts = described(result, range(len(value))) if len(value) <= MOST_POINTS else []
    notes = [(text, targets.get(row, "")) for row, text in enumerate(texts)]
    symbol, unit = quantity(column), column_unit(column.partition("_average_")[2])
    found = []
    for x, chart in _frames(result, value, best):
        dots = []
        for style, mask in zip(STYLES, (share == 1.0, share < 1.0, np.isnan(share)), strict=True):
            if len(rows := np.flatnonzero(mask & np.isfinite(x + value))):
                mine = [notes[k] for k in rows] if notes else ()
                dots.append(Trace("dots", style, x[rows], value[rows], notes=mine))
        drawn = np.isfinite(x + value).sum()
        words = f"{symbol} average, {DESCRIPTIONS.get(symbol, '')}, against {chart.words}"
        words += f" Drawn: {drawn} of {number_of(result.summary.cells, 'case')}. {COLOURS}"
        traces, up = [*chart.traces, *dots], f"{symbol} average, {unit}"
        found += [replace(chart, traces=traces, up=up, words=words)] if drawn else []
    return found


def _frames(result: SweepCases, value: Array, best: Sequence[int]) -> Iterator[tuple[Array, Chart]]:
    """Yield charts with lines and without dots, which are over `x` (rows,)."""
    if best:
        hours, steps = result.figure("hours"), np.repeat(best, 2)
        line = Trace("line", "ink", hours[steps][1:], value[steps][:-1])
        words = "hours. The line is of the smallest for the hours."
        yield hours, Chart([line], "laboratory time, h", "", words, (), True, HEIGHT, WIDTH)
    for k, axis in enumerate(result.axes):
        count, words, lines = len(axis.labels), f"{axis.name}.", []
        if count < 2 or not axis.numbers and count > MOST_TEXTS:
            continue
        names = [f"{number:g}" for number in axis.numbers] or list(axis.labels)
        place = np.array(axis.numbers or range(count), float)
        order = np.argsort(place)
        gap = np.diff(place[order]).min() / np.ptp(place)
        fits = gap * WIDTH > LETTER * max(map(len, names))
        if axis.numbers:
            averages = averages_along(result, value, k)[:, order]
            lines = [Trace("line", "faint thin", place[order], y) for y in averages[:MOST_LINES]]
            words += f" Lines: {len(lines)} of {len(averages)} combinations of the other axes."
        else:
            words += f" In order: {'; '.join(names)}."
        places = list(zip(place.tolist(), names, strict=True))
        across = f"{axis.name}, {axis.unit}" if axis.unit else axis.name
        shown = places if fits or not axis.numbers else ()
        chart = Chart(lines, across, "", words, shown, True, HEIGHT, WIDTH)
        yield place[result.chosen[:, k]], chart
