"""Panels of points below one another: what was tried of unknowns, and biases by position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.machines.protocol import Array
from numpy.typing import NDArray

from .formatting import micro
from .svg import INK, MARKERS, MUTED, PAPER, SERIES, drawing, placed_axes, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Points: of the drawing, of a panel and what stands around it, and of a row.
WIDTH, PANEL, LEFT, RIGHT, BELOW, ABOVE, ROW = 480.0, 120.0, 60.0, 16.0, 46.0, 24.0, 16.0

# Room for names of rows, and letters of a name that has it.
NAMES, LETTERS = 120.0, 20

# Ratio of the largest to the smallest value above which an axis is logarithmic.
WIDE = 20.0


@dataclass(frozen=True, eq=False)
class TriedValues:
    """Values (m,) of an unknown that were tried in its `unit`, how far from the goal each is, and
    which meet it.
    """

    name: str
    unit: str
    values: Array
    distances: Array
    is_met: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class RowOfPoints:
    """A row's name and the values that stand in it."""

    name: str
    values: Array


def draw_tried(
    panels: Sequence[TriedValues],
    axis: str,
    limit: float,
    words: str,
    path: str | Path | None = None,
) -> Figure:
    """How far from a goal the values tried are, a panel for each unknown, with the limit below
    which it is met.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the name ends in none of the kinds of pictures.
    :raises OSError: the file cannot be written.
    """
    height = PANEL + BELOW + ABOVE
    with drawing(len(panels) * height, WIDTH) as figure:
        for k, one in enumerate(panels):
            bottom = (len(panels) - 1 - k) * height + BELOW
            axes = placed_axes(figure, LEFT, bottom, WIDTH - LEFT - RIGHT, PANEL)
            axes.plot(one.values, one.distances, color=MUTED, linewidth=0.8)
            for chosen, face, label in (
                (one.is_met, SERIES[0], "met"),
                (~one.is_met, PAPER, "not met"),
            ):
                axes.plot(
                    one.values[chosen],
                    one.distances[chosen],
                    color=SERIES[0],
                    marker=MARKERS[0],
                    linestyle="none",
                    markersize=4.0,
                    markerfacecolor=face,
                    label=label,
                )
            axes.axhline(limit, color=INK, linewidth=1.0, linestyle="--")
            _scale(axes, one.values, "x")
            _scale(axes, one.distances, "y")
            axes.grid(True)
            axes.set_xlabel(f"{one.name}, {one.unit}" if one.unit else one.name)
            axes.set_ylabel(axis)
            if k == 0:
                axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderpad=0.0)
        return save(figure, path, words)


def draw_rows(
    panels: Sequence[tuple[str, Sequence[RowOfPoints]]],
    words: str,
    path: str | Path | None = None,
) -> Figure:
    """Values as points in rows, a panel for each quantity.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the name ends in none of the kinds of pictures.
    :raises OSError: the file cannot be written.
    """
    heights = [ROW * max(len(rows), 2) + BELOW + ABOVE for _, rows in panels]
    with drawing(sum(heights), WIDTH) as figure:
        top = sum(heights)
        for (name, rows), height in zip(panels, heights, strict=True):
            top -= height
            axes = placed_axes(
                figure, NAMES, top + BELOW, WIDTH - NAMES - RIGHT, height - BELOW - ABOVE
            )
            every = np.concatenate([one.values for one in rows])
            for k, one in enumerate(rows):
                axes.plot(
                    one.values,
                    np.full(len(one.values), -k),
                    color=SERIES[k % len(SERIES)],
                    marker="|",
                    markersize=9.0,
                    linestyle="none",
                )
            axes.set_ylim(0.6 - max(len(rows), 2), 0.6)
            shown = [
                one.name if len(one.name) <= LETTERS else f"{one.name[: LETTERS - 1]}…"
                for one in rows
            ]
            axes.set_yticks([-k for k in range(len(rows))], shown)
            _scale(axes, every, "x")
            axes.grid(True, axis="x")
            axes.set_xlabel(micro(name))
        return save(figure, path, words)


def _scale(axes: Axes, values: Array, axis: str) -> None:
    """A logarithmic axis for values that are far apart, otherwise one that starts at zero."""
    known = values[np.isfinite(values)]
    if not len(known):
        return
    if known.min() > 0.0 and known.max() > WIDE * known.min():
        from matplotlib.ticker import NullLocator

        (axes.set_xscale if axis == "x" else axes.set_yscale)("log")
        along = axes.xaxis if axis == "x" else axes.yaxis
        along.set_major_formatter("{x:g}")
        along.set_minor_locator(NullLocator())
    elif known.min() >= 0.0:
        (axes.set_xlim if axis == "x" else axes.set_ylim)(0.0, None)
