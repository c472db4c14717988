"""Plots of uncertainties along swept axes."""

from __future__ import annotations

import numpy as np
from ballplate.extensions.pages.charts import Chart, Trace, chart_svg, figure, legend
from ballplate.extensions.pages.elements import Html
from ballplate.presentation import micro
from ballplate.uncertainty import DESCRIPTIONS

from .series import Plot

# Styles of lines, which differ without colours, too.
STYLES = ("s0", "s1 dashed", "s2 dotted", "s3 heavy", "s4 heavy dashed", "s5 heavy dotted")


def plot_figure(plot: Plot) -> Html:
    """Return a plot with its legend; bars are Monte Carlo's values, ± one standard error."""
    traces, entries = [], []
    for style, line in zip(STYLES, plot.lines, strict=False):
        traces.append(Trace("dots", style, line.x, line.y))
        if not plot.is_scattered:
            traces.append(Trace("line", style, line.x, line.y))
            entries.append(("line", style, line.label or "linearised"))
        ends = line.actual - line.error, line.actual + line.error, np.full(len(line.x), np.nan)
        if np.isfinite(line.actual).any():
            bars = np.stack(ends, axis=1).ravel()
            traces.append(Trace("line", "ink heavy", np.repeat(line.x, len(ends)), bars))
    if any(np.isfinite(line.actual).any() for line in plot.lines):
        entries.append(("line", "ink heavy", "Monte Carlo, ± one standard error"))
    symbol, axis = plot.measure.symbol, plot.axis
    words = f"{plot.measure.name} against {axis.name}"
    chart = Chart(traces, micro(axis.title), plot.measure.unit, words, from_zero=True)
    caption = f"{plot.measure.name}, {DESCRIPTIONS[symbol]}, against {axis.name}. {plot.note}"
    shown = [legend(*entries)] if len(entries) > 1 else []
    return figure(caption.rstrip(), *shown, chart_svg(chart))
