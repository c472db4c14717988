"""Errors at points as magnified vectors."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.machines.protocol import Array

from .svg import (
    MARKERS,
    MUTED,
    SERIES,
    WIDTH,
    drawing,
    placed_axes,
    round_number,
    save,
    scale_bar,
    sticks,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Length of the longest vector as a share of the drawing's extent.
LONGEST = 0.2
MARGIN, BELOW, LINE, MARKER = 56.0, 65.0, 15.0, 3.5
TITLE = 52


def magnification(vectors: Array, extent: float) -> float:
    """Return the largest of 1, 2, 5, 10, ... for which the longest of vectors (m, 2) stays within
    its share of `extent` metres.

    >>> magnification(np.array([[3e-7, 4e-7]]), 0.5)
    200000.0
    """
    longest = _longest(vectors)
    if longest == 0.0 or extent == 0.0:
        return 1.0
    return round_number(LONGEST * extent / longest)


def draw_vectors(
    places: Array,
    vectors: Array,
    title: str,
    path: str | Path | None = None,
    edges: Array | None = None,
) -> Figure:
    """Draw errors as vectors (m, 2) from their points (m, 2), both in metres, with a scale bar
    below, and write the picture to the path, if given.

    `edges` (k, 2, 2) are those of the volume if the drawing is a projection of space.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the suffix is of no picture format.
    :raises OSError: the file cannot be written.
    """
    extent = float(np.ptp(places, axis=0).max())
    times = magnification(vectors, extent)
    tips = places + times * vectors
    drawn = np.concatenate([places, tips, *([] if edges is None else [edges.reshape(-1, 2)])])
    lower, upper = drawn.min(axis=0), drawn.max(axis=0)
    pad = 0.06 * extent
    heading = textwrap.wrap(title, TITLE)
    across, up = upper - lower + 2.0 * pad
    width = WIDTH - MARGIN - 10.0
    height = width * up / across
    with drawing(height + BELOW + 10.0 + LINE * len(heading)) as figure:
        axes = placed_axes(figure, MARGIN, BELOW, width, height)
        axes.set_xlim(1e3 * (lower[0] - pad), 1e3 * (upper[0] + pad))
        axes.set_ylim(1e3 * (lower[1] - pad), 1e3 * (upper[1] + pad))
        if edges is None:
            axes.set_xlabel("x, mm")
            axes.set_ylabel("y, mm")
            axes.grid(True)
            axes.set_axisbelow(True)
        else:
            axes.set_axis_off()
            for edge in 1e3 * edges:
                axes.plot(*edge.T, color=MUTED, linewidth=0.8)
        axes.set_title("\n".join(heading), loc="left")
        marks = {"color": SERIES[0], "marker": MARKERS[0], "markersize": MARKER}
        sticks(axes, 1e3 * places, 1e3 * tips, **marks)
        # A bar of 1, 2 or 5 units, drawn at the scale of the errors.
        length = round_number(_longest(vectors) or 1e-6)
        bar_text = f"{1e6 * length:g} µm, magnified {times:,.0f} times"
        scale_bar(axes, 1e3 * length * times, -42.0 / height, bar_text)
        return save(figure, path, f"{title}: errors as vectors, magnified {times:g} times")


def _longest(vectors: Array) -> float:
    return float(np.hypot(*vectors.T).max(initial=0.0))
