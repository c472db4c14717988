"""Drawings of a design."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.inputs.number_arrays import Array

from .scenes import Box, DrawnPosition, names_fit, scene
from .svg import INK, MUTED, PAPER, blank_axes, drawing, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Share of the drawing's size below which an edge is too short for its name between its numbers.
SHORT = 0.25


def draw_design(design: Design, words: str, path: str | Path | None = None) -> Figure:
    """Draw the positions of a design in the volume, and write the picture to the path, if given.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the suffix is of no picture format.
    :raises OSError: the file cannot be written.
    """
    drawn, places = scene(design)
    with drawing(330.0) as figure:
        axes = blank_axes(figure)
        label_points, size = draw_box(axes, drawn), drawn.size
        for place in places:
            _place(axes, place)
        # Numbers if names are too long.
        by_number = not names_fit([place.name for place in places])
        for place in places:
            _name(axes, place, label_points, size, by_number)
        # Room for labels around the volume and for plates that protrude from it.
        drawn_points = np.concatenate(
            [drawn.edges.reshape(-1, 2), *(place.outline for place in places)]
        )
        low = np.minimum(
            drawn_points.min(axis=0) - 0.11 * size, np.min(label_points, axis=0) - 0.05 * size
        )
        high = drawn_points.max(axis=0) + 0.11 * size
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        return save(figure, path, words)


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


def _place(axes: Axes, position: DrawnPosition) -> None:
    if len(position.outline) > 2:
        axes.fill(*position.outline.T, facecolor=MUTED, alpha=0.12, linewidth=0)
    closed = np.concatenate([position.outline, position.outline[:1]])
    axes.plot(*closed.T, color=MUTED, linewidth=1.3)
    size = 3.0 if len(position.balls) <= 50 else 2.0
    axes.plot(
        *position.balls.T,
        color=MUTED,
        linestyle="none",
        marker="o",
        markersize=size,
        markeredgewidth=0.6,
        markerfacecolor=PAPER,
    )
    for stylus in position.styli:
        axes.plot(*stylus.T, color=INK, linewidth=1.4)
        axes.plot(*stylus[1], color=INK, marker="s", markersize=3.2)


def _name(
    axes: Axes, position: DrawnPosition, label_points: list[Array], size: float, by_number: bool
) -> None:
    """Write a position's name at the corner of its outline that is furthest from other labels."""
    centre = position.outline.mean(axis=0)
    corners = position.outline if len(position.outline) > 1 else np.array([centre])
    text = str(position.number) if by_number else position.name
    candidates = corners + 0.05 * size * _unit(corners - centre)
    # Names are wide and low: a difference in height counts for more.
    distances = [
        min(
            (float(np.hypot(*((point - label) * [1.0, 3.0]))) for label in label_points),
            default=0.0,
        )
        for point in candidates
    ]
    point = candidates[int(np.argmax(distances))]
    label_points.append(point)
    edge = MUTED if by_number else "none"
    box = {"facecolor": PAPER, "alpha": 0.8, "edgecolor": edge, "boxstyle": "square,pad=0.12"}
    axes.text(point[0], point[1], text, ha="center", va="center", bbox=box)


def _unit(vectors: Array) -> Array:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(lengths > 0, vectors / np.where(lengths > 0, lengths, 1.0), 0.0)
