"""Drawings of a design and of the error map through its volume."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.machines.protocol import Array

from .scenes import Box, DrawnPosition, Scene, scene
from .svg import (
    DASHES,
    INK,
    MUTED,
    PAPER,
    SERIES,
    blank_axes,
    drawing,
    save,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Points around a map.
LEFT, RIGHT, BELOW, ABOVE = 50.0, 18.0, 40.0, 10.0

# Part of the drawing's size below which an edge is too short for its name between its numbers.
SHORT = 0.25


def draw_design(design: Design, words: str, path: str | Path | None = None) -> Figure:
    """The positions of a design in the volume as a picture of its own, which is written to the path
    if there is one.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the name ends in none of the kinds of pictures.
    :raises OSError: the file cannot be written.
    """
    with scene_figure(scene(design)) as figure:
        return save(figure, path, words)


@contextmanager
def scene_figure(drawn: Scene) -> Iterator[Figure]:
    with drawing(330.0) as figure:
        draw_scene(blank_axes(figure), drawn, not drawn.is_named)
        yield figure


def draw_scene(axes: Axes, drawn: Scene, by_number: bool) -> None:
    """The volume with the positions in it, which are told by their names or numbers, on axes
    without a frame.
    """
    taken, size = draw_box(axes, drawn.box), drawn.box.size
    for place in drawn.places:
        _place(axes, place)
    for place in drawn.places:
        _name(axes, place, taken, size, by_number)
    # Room for what is written around the volume and for plates that stand out of it.
    drawn_points = np.concatenate(
        [drawn.box.edges.reshape(-1, 2), *(place.outline for place in drawn.places)]
    )
    low = np.minimum(drawn_points.min(axis=0) - 0.11 * size, np.min(taken, axis=0) - 0.05 * size)
    high = drawn_points.max(axis=0) + 0.11 * size
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])


def draw_box(axes: Axes, box: Box) -> list[Array]:
    """A volume with the names and ends of its axes; where these stand."""
    for edge, is_hidden in zip(box.edges, box.hidden, strict=True):
        axes.plot(*edge.T, color=MUTED, linewidth=0.8, linestyle=":" if is_hidden else "-")
    return [at for axis in box.axes for at in _write_axis(axes, box, *axis)]


def _write_axis(
    axes: Axes, box: Box, name: str, ends: Array, low: float, high: float
) -> list[Array]:
    """Write the axis's name and ends beside its edge, away from the middle; where they stand."""
    middle, size = box.edges.mean(axis=(0, 1)), box.size
    centre = ends.mean(axis=0)
    length = np.linalg.norm(ends[1] - ends[0])
    along = (ends[1] - ends[0]) / length
    out = np.array([along[1], -along[0]])
    out = out if out @ (centre - middle) > 0 else -out
    # Ends are drawn in, so that those of two axes keep apart; beside a short edge they stand there,
    # and the name outside of them.
    off, inward = (0.06, 0.05) if length > SHORT * size else (0.14, 0.0)
    written: list[Array] = []
    for place, text, away, shift in (
        (centre, f"{name}, mm", off, 0.0),
        (ends[0], _millimetres(low), 0.06, inward),
        (ends[1], _millimetres(high), 0.06, -inward),
    ):
        at = place + shift * size * along + away * size * out
        axes.text(at[0], at[1], text, ha="center", va="center")
        written.append(at)
    return written


def _millimetres(value: float) -> str:
    return f"{1000 * value + 0.0:.6g}"


def _place(axes: Axes, place: DrawnPosition) -> None:
    colour = SERIES[(place.number - 1) % len(SERIES)]
    dash = DASHES[(place.number - 1) % len(DASHES)]
    if len(place.outline) > 2:
        axes.fill(*place.outline.T, facecolor=colour, alpha=0.10, linewidth=0)
        closed = np.concatenate([place.outline, place.outline[:1]])
        axes.plot(*closed.T, color=colour, linestyle=dash, linewidth=1.3)
    else:
        axes.plot(*place.outline.T, color=colour, linestyle=dash, linewidth=1.3)
    size = 3.0 if len(place.balls) <= 50 else 2.0
    axes.plot(
        *place.balls.T,
        color=colour,
        linestyle="none",
        marker="o",
        markersize=size,
        markeredgewidth=0.6,
        markerfacecolor=PAPER,
    )
    for stylus in place.styli:
        axes.plot(*stylus.T, color=INK, linewidth=1.4)
        axes.plot(*stylus[1], color=INK, marker="s", markersize=3.2)


def _name(
    axes: Axes, place: DrawnPosition, taken: list[Array], size: float, by_number: bool
) -> None:
    """A position's name at the corner of its outline that is furthest from other names."""
    centre = place.outline.mean(axis=0)
    corners = place.outline if len(place.outline) > 1 else np.array([centre])
    between = 0.5 * (corners + np.roll(corners, 1, axis=0))
    text = str(place.number) if by_number else place.name
    places = np.concatenate([corners, between])
    places = places + 0.05 * size * _unit(places - centre)
    # Names are wide and low: a difference in height counts for more.
    apart = [
        min((float(np.hypot(*((at - other) * [1.0, 3.0]))) for other in taken), default=0.0)
        for at in places
    ]
    at = places[int(np.argmax(apart))]
    taken.append(at)
    edge = SERIES[(place.number - 1) % len(SERIES)] if by_number else "none"
    box = {"facecolor": PAPER, "alpha": 0.8, "edgecolor": edge, "boxstyle": "square,pad=0.12"}
    axes.text(at[0], at[1], text, ha="center", va="center", bbox=box)


def _unit(vectors: Array) -> Array:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(np.where(lengths > 0, vectors / np.where(lengths > 0, lengths, 1.0), 0.0))
