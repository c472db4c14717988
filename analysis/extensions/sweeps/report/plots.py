"""Plots of uncertainties along swept axes."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np
from ballplate.extensions.pages.elements import Html
from ballplate.presentation import (
    DASHES,
    INK,
    MARKERS,
    PAPER,
    SERIES,
    WIDTH,
    common_legend,
    drawing,
    micro,
    number,
    placed_axes,
)

from .design_pictures import as_svg
from .series import Panel, Plot, SeriesLine

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Ratio of the largest to the smallest value above which an axis is logarithmic, unless its values
# are evenly spaced.
WIDE = 30.0

# Ratio below which a logarithmic axis has numbers between powers of ten.
FINE = 500.0

# Values of a line that are marked.
MOST_MARKERS = 12

# Letters of a legend's line.
LEGEND = 54

# Points: of a panel and around it, and of a line of the legend.
PANEL, ABOVE, LEFT, RIGHT, BELOW, LINE = 118.0, 22.0, 50.0, 16.0, 40.0, 15.0


def plot_svg(plot: Plot, name: str) -> Html:
    """Return a plot: average above, maximum below, over the same axis."""
    lines = plot.panels[0].lines
    has_legend = len(lines) > 1 or len(lines[0].actual) > 0
    columns = 2 if max((len(line.label) for line in lines), default=0) <= LEGEND // 2 - 6 else 1
    rows = -(-(len(lines) + (len(lines[0].actual) > 0)) // columns) if has_legend else 0
    wrapped = max(len(_wrapped(line.label).splitlines() or [""]) for line in lines)
    count = len(plot.panels)
    below = BELOW + LINE * rows * wrapped
    with drawing(below + count * (PANEL + ABOVE)) as figure:
        panels = []
        for k, panel in enumerate(plot.panels):
            bottom = below + (count - 1 - k) * (PANEL + ABOVE)
            panels.append(placed_axes(figure, LEFT, bottom, WIDTH - LEFT - RIGHT, PANEL))
            _panel(panels[k], plot, panel)
            panels[k].tick_params(labelbottom=k == count - 1)
        panels[-1].set_xlabel(micro(plot.axis.title))
        if has_legend:
            common_legend(figure, panels[0], loc="lower center", ncols=columns, borderaxespad=0.0)
        return as_svg(figure, name, words(plot))


def _panel(axes: Axes, plot: Plot, panel: Panel) -> None:
    from matplotlib.ticker import LogLocator, NullLocator

    axes.set_title(panel.measure.name, loc="left")
    axes.set_ylabel(plot.unit)
    axes.grid(True)
    for k, line in enumerate(panel.lines):
        _line(axes, line, k, plot.is_scattered)
    values = [np.concatenate([line.y, line.actual]) for line in panel.lines]
    finite = np.concatenate(values)
    finite = finite[np.isfinite(finite)]
    if len(finite) and finite.min() > 0 and finite.max() > WIDE * finite.min():
        axes.set_yscale("log")
        if finite.max() < FINE * finite.min():
            axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_locator(NullLocator())
    else:
        axes.set_ylim(0, 1.06 * float(finite.max(initial=0.0)) or 1.0)
    numbers = np.unique(plot.axis.numbers)
    if (
        numbers.min() > 0
        and numbers.max() > WIDE * numbers.min()
        and np.median(numbers) < 0.3 * numbers.max()
    ):
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_locator(NullLocator())
    elif 1 < len(numbers) <= 8 and np.diff(numbers).min() > 0.09 * np.ptp(numbers):
        axes.set_xticks(numbers, [f"{value:.6g}" for value in numbers])


def _line(axes: Axes, line: SeriesLine, k: int, is_scattered: bool) -> None:
    colour, marker = SERIES[k], MARKERS[k]
    if is_scattered:
        axes.plot(line.x, line.y, color=colour, linestyle="none", marker=".", markersize=3.0)
        return
    label = _wrapped(line.label) or "linearised"
    axes.plot(
        line.x,
        line.y,
        color=colour,
        linestyle=DASHES[k],
        # Markers of many values would hide the line.
        marker=marker if len(line.x) <= MOST_MARKERS else None,
        markerfacecolor=PAPER,
        label=label,
    )
    if len(line.actual):
        bar_label = "Monte Carlo, ± one standard error" if k == 0 else None
        axes.errorbar(
            line.x,
            line.actual,
            line.error,
            color=INK,
            linestyle="none",
            elinewidth=1.2,
            capsize=5.0,
            capthick=1.2,
            label=bar_label,
        )


def _wrapped(text: str) -> str:
    return textwrap.fill(text, LEGEND) if text else ""


def words(plot: Plot) -> str:
    """Return an accessible text on the plot."""
    parts = []
    for panel in plot.panels:
        for line in panel.lines:
            determined = np.flatnonzero(np.isfinite(line.y))
            if not len(determined):
                continue
            ends = [
                f"{number(line.y[k], 3)} {plot.unit} at {line.x[k]:.6g}"
                f" {micro(plot.axis.unit)}".rstrip()
                for k in sorted({determined[0], determined[-1]})
            ]
            parts.append(
                " ".join([panel.measure.statistic, line.label]).rstrip() + ": " + ", ".join(ends)
            )
    return f"{plot.symbol} against {plot.axis.name}. " + "; ".join(parts)
