"""Picture of the values that were tried of unknowns, with the limit below which a goal is met."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.presentation import (
    INK,
    MARKERS,
    MUTED,
    PAPER,
    SERIES,
    drawing,
    placed_axes,
    save,
    scaled_axis,
)
from ballplate.simulator.design import Flags
from ballplate.simulator.machines import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Points: of the drawing, of a panel and what stands around it.
WIDTH, PANEL, LEFT, RIGHT, BELOW, ABOVE = 480.0, 120.0, 60.0, 16.0, 46.0, 24.0


@dataclass(frozen=True, eq=False)
class TriedValues:
    """Values (m,) of an unknown that were tried in its `unit`, how far from the goal each is, and
    which meet it.
    """

    name: str
    unit: str
    values: Array
    distances: Array
    is_met: Flags


def draw_tried(
    panels: Sequence[TriedValues],
    axis: str,
    limit: float,
    words: str,
    path: str | Path | None = None,
) -> Figure:
    """Draw the distance from a goal by value tried, one panel per unknown, with the limit below
    which it is met.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the name has another suffix than pictures.
    :raises OSError: the file cannot be written.
    """
    height = PANEL + BELOW + ABOVE
    with drawing(len(panels) * height, WIDTH) as figure:
        for k, panel in enumerate(panels):
            bottom = (len(panels) - 1 - k) * height + BELOW
            axes = placed_axes(figure, LEFT, bottom, WIDTH - LEFT - RIGHT, PANEL)
            axes.plot(panel.values, panel.distances, color=MUTED, linewidth=0.8)
            for chosen, face, label in (
                (panel.is_met, SERIES[0], "met"),
                (~panel.is_met, PAPER, "not met"),
            ):
                axes.plot(
                    panel.values[chosen],
                    panel.distances[chosen],
                    color=SERIES[0],
                    marker=MARKERS[0],
                    linestyle="none",
                    markersize=4.0,
                    markerfacecolor=face,
                    label=label,
                )
            axes.axhline(limit, color=INK, linewidth=1.0, linestyle="--")
            scaled_axis(axes, panel.values, "x")
            scaled_axis(axes, panel.distances, "y")
            axes.grid(True)
            axes.set_xlabel(f"{panel.name}, {panel.unit}" if panel.unit else panel.name)
            axes.set_ylabel(axis)
            if k == 0:
                axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderpad=0.0)
        return save(figure, path, words)
