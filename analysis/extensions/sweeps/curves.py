"""Charts of a sweep: the average that cases are judged by, against hours and along each axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from ballplate.extensions.pages.interface import Chart, Html, Trace, chart_svg, figure, legend
from ballplate.simulator.computing import comparable
from ballplate.simulator.inputs import number_of
from ballplate.simulator.machines import Array
from ballplate.uncertainty import DESCRIPTIONS

from .answer import WITHIN, described, quantity
from .cases import MOST_ROWS, SweepCases, column_unit
from .effects import averages_along, frontier

# Styles of dots, and their words.
STYLES = {"s0": "meets the target", "s1": "does not meet the target", "s2": "no target"}

# Of a chart, and of a letter.
WIDTH, HEIGHT, LETTER = 800.0, 260.0, 6.0

# Texts of an axis that are drawn, lines of a chart, and dots that state their case.
MOST_TEXTS, MOST_LINES, MOST_POINTS = 30, 40, 1000


def least_for_hours(result: SweepCases, column: str | None) -> list[int]:
    """Return the rows of cases that no other beats in a column of averages and in hours, by hours;
    none unless hours differ.
    """
    hours = result.figure("hours")
    best = frontier(hours, result.figure(column or ""))[:MOST_ROWS]
    is_varied = np.unique(comparable(hours[np.isfinite(hours)])).size > 1
    return best.tolist() if is_varied else []


def curves(charts: Sequence[Chart]) -> list[Html]:
    """Return charts as figures with legends."""
    found = []
    for chart in charts:
        styles = [trace.style for trace in chart.traces if trace.kind == "dots"]
        entries = [("dots", style, STYLES[style]) for style in styles]
        shown = [legend(*entries)] if len(entries) > 1 else []
        found.append(figure(chart.words, *shown, chart_svg(chart)))
    return found


def charts(
    result: SweepCases, column: str, best: Sequence[int] = (), targets: Mapping[int, str] = {}
) -> list[Chart]:
    """Return charts of a column of averages: against hours if there are `best` rows, and along each
    axis with several values. Dots lead to the elements with the ids that `targets` has for their
    rows.
    """
    value, share = 1e6 * result.figure(column), result.figure(WITHIN)
    symbol, unit = quantity(column), column_unit(column.partition("_average_")[2])
    masks = (share == 1.0, share < 1.0, np.isnan(share))
    found: list[Chart] = []

    def add(
        across: str, x: Array, lines: list[Trace], places: list[tuple[float, str]], note: str
    ) -> None:
        dots = []
        for style, mask in zip(STYLES, masks, strict=True):
            rows = np.flatnonzero(mask & np.isfinite(x + value))
            texts = rows[: len(rows) * (len(rows) <= MOST_POINTS)].tolist()
            notes = [(described(result, row, column), targets.get(row, "")) for row in texts]
            if len(rows):
                dots.append(Trace("dots", style, x[rows], value[rows], notes=notes))
        words = f"{symbol} average, {DESCRIPTIONS.get(symbol, '')}, against {across}. {note}"
        if left_out := result.summary.cells - sum(len(trace.x) for trace in dots):
            words += f" Failed, missing or undetermined: {number_of(left_out, 'case')}."
        up = f"{symbol} average, {unit}"
        found.append(Chart([*lines, *dots], across, up, words, places, True, HEIGHT, WIDTH))

    if best:
        hours, steps = result.figure("hours"), np.repeat(best, 2)
        line = Trace("line", "ink", hours[steps][1:], value[steps][:-1])
        add("laboratory time, h", hours, [line], [], "The line is of the least for the time.")
    for k, axis in enumerate(result.axes if np.isfinite(value).any() else ()):
        count, names = len(axis.labels), list(axis.labels)
        if count < 2 or not axis.numbers and count > MOST_TEXTS:
            continue
        place = np.array(axis.numbers or range(count), float)
        order, lines, note = np.argsort(place), [], "Each dot is a case."
        if axis.numbers:
            names = [f"{number:g}" for number in axis.numbers]
            averages = averages_along(result, value, k)[:, order]
            shown = np.argsort(np.fmin.reduce(averages, axis=1), kind="stable")[:MOST_LINES]
            lines = [Trace("line", "faint thin", place[order], averages[i]) for i in shown]
            note = f"Lines join cases that differ in {axis.name} only"
            more = len(averages) > MOST_LINES
            note += f": the {MOST_LINES} of {len(averages)} with the smallest." if more else "."
        elif LETTER * max(map(len, names)) * count > WIDTH:
            note = "; ".join(f"{i + 1}: {name}" for i, name in enumerate(names))
            names = [str(i + 1) for i in range(count)]
        is_sparse = np.diff(place[order]).min() * WIDTH > 6 * LETTER * np.ptp(place)
        places = list(zip(place.tolist(), names, strict=True))
        across = f"{axis.name}, {axis.unit}" if axis.unit else axis.name
        add(across, place[result.chosen[:, k]], lines, places if is_sparse else [], note)
    return found
