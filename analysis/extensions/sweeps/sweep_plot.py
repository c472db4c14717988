"""Picture of a sweep: the average that cases are judged by, against hours or along each axis."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.presentation import MARKERS, MUTED, SERIES, common_legend, drawing, save

from .answer import criterion
from .axis_effects import frontier
from .cases import SweepCases
from .curves import STYLES, charts

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Points: of the drawing of one chart.
HEIGHT, WIDTH = 280.0, 400.0


def draw_sweep(result: SweepCases, path: str | Path | None) -> Figure:
    """Draw a sweep; save to the path, if any.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: no averages can be compared, or the suffix of the path is unknown.
    """
    column = criterion(result) or ""
    best = frontier(result, result.figure(column))
    shown = charts(result, column, best, {})[: 1 if best else None] if column else []
    if not shown:
        raise ValueError(f"{result.label} has no averages to compare along an axis")
    looks = dict(zip(STYLES, zip(MARKERS, SERIES, strict=True), strict=False))
    with drawing(HEIGHT, WIDTH * len(shown)) as figure:
        for k, chart in enumerate(shown):
            axes = figure.add_subplot(1, len(shown), k + 1, xlabel=chart.across, ylabel=chart.up)
            for trace in chart.traces:
                form, colour = looks.get(trace.style, ("-", MUTED))
                axes.plot(trace.x, trace.y, form, color=colour, label=STYLES.get(trace.style))
            if chart.places:
                axes.set_xticks(*zip(*chart.places, strict=True))
            axes.set_ylim(bottom=0.0)
            axes.grid(True)
        common_legend(figure, axes, loc="upper center", ncols=len(STYLES))
        figure.subplots_adjust(top=0.88, bottom=0.17)
        return save(figure, path, shown[0].words)
