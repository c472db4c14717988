"""The volume of a drawing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array

from .scenes import Box
from .svg import MUTED

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# Share of the drawing's size below which an edge is too short for its name between its numbers.
SHORT = 0.25


def draw_box(axes: Axes, box: Box) -> list[Array]:
    """Draw a volume with the names and ends of its axes; return the labels' points."""
    for edge, is_hidden in zip(box.edges, box.hidden, strict=True):
        axes.plot(*edge.T, color=MUTED, linewidth=0.8, linestyle=":" if is_hidden else "-")
    return [point for axis in box.axes for point in _write_axis(axes, box, *axis)]


def _write_axis(
    axes: Axes, box: Box, name: str, ends: Array, low: float, high: float
) -> list[Array]:
    """Write the axis's name and ends next to its edge, away from the middle; return the points."""
    middle, size = box.edges.mean(axis=(0, 1)), box.size
    centre = ends.mean(axis=0)
    length = np.linalg.norm(ends[1] - ends[0])
    along = (ends[1] - ends[0]) / length
    out = np.array([along[1], -along[0]])
    out = out if out @ (centre - middle) > 0 else -out
    arrow = {"head_width": 0.015 * size, "overhang": 0.5, "linewidth": 0.8}
    axes.arrow(*ends[1], *0.03 * size * along, color=MUTED, **arrow)
    # Ends move inwards to separate those of two axes, except at a short edge.
    off, inward = (0.06, 0.05) if length > SHORT * size else (0.14, 0.0)
    written = []
    for start, text, away, shift in (
        (centre, f"{name}, mm", off, 0.0),
        (ends[0], _millimetres(low), 0.06, inward),
        (ends[1], _millimetres(high), 0.06, -inward),
    ):
        point = start + shift * size * along + away * size * out
        axes.text(point[0], point[1], text, ha="center", va="center")
        written.append(point)
    return written


def _millimetres(value: float) -> str:
    return f"{1000 * value + 0.0:.6g}"
