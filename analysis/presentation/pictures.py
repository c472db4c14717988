"""Drawings of a design and of the error map through its volume."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.machines.protocol import Array

from ..uncertainty.error_map_uncertainty import ErrorMap, Slice
from .formatting import number
from .scenes import Box, DrawnPosition, Scene, scene
from .svg import (
    DASHES,
    INK,
    MUTED,
    PAPER,
    SERIES,
    WIDTH,
    as_svg,
    blank_axes,
    drawing,
    placed_axes,
    save,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Points around a map.
LEFT, RIGHT, BELOW, ABOVE = 50.0, 18.0, 40.0, 10.0

# Part of the drawing's size below which an edge is too short for its name between its numbers.
SHORT = 0.25

# Bands between lines of the error map at most, from the first of these colours to the second: light
# enough for dark letters everywhere.
MOST_BANDS = 10
LIGHT = ("#f6f9fc", "#79a4cb")
DARK = "#101010"


def scene_svg(drawn: Scene, name: str, words: str) -> str:
    """The volume with the positions in it."""
    with _drawn(drawn) as figure:
        return as_svg(figure, name, words)


def draw_design(design: Design, words: str, path: str | Path | None = None) -> Figure:
    """The positions of a design in the volume as a picture of its own, which is written to the path
    if there is one.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the name ends in none of the kinds of pictures.
    :raises OSError: the file cannot be written.
    """
    with _drawn(scene(design)) as figure:
        return save(figure, path, words)


@contextmanager
def _drawn(drawn: Scene) -> Iterator[Figure]:
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


def probes_svg(drawn: Scene, name: str, words: str) -> str:
    """The tips about the reference point, enlarged."""
    with drawing(200.0) as figure:
        axes = blank_axes(figure)
        size = max(float(np.abs(tip).max()) for _, tip in drawn.tips) or 1.0
        axes.plot(0.0, 0.0, color=INK, marker="s", markersize=6.0)
        groups: list[tuple[Array, list[str]]] = []
        for probe, tip in drawn.tips:
            same = next(
                (names for at, names in groups if np.abs(at - tip).max() < 0.02 * size), None
            )
            if same is None:
                groups.append((tip, [probe]))
            else:
                same.append(probe)
        for tip, names in groups:
            axes.plot([0.0, tip[0]], [0.0, tip[1]], color=INK, linewidth=1.4)
            axes.plot(*tip, color=INK, marker="o", markersize=8.0, markerfacecolor=PAPER)
            away = tip / np.linalg.norm(tip) if np.linalg.norm(tip) > 0 else np.array([0.0, 1.0])
            side = "left" if away[0] > 0.3 else "right" if away[0] < -0.3 else "center"
            height = "bottom" if away[1] > 0.5 else "top" if away[1] < -0.5 else "center"
            text = ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
            axes.annotate(
                text,
                (tip[0], tip[1]),
                (9.0 * away[0], 9.0 * away[1]),
                textcoords="offset points",
                ha=side,
                va=height,
            )
        axes.set_xlim(-2.2 * size, 2.2 * size)
        axes.set_ylim(-1.5 * size, 1.3 * size)
        return as_svg(figure, name, words)


def slice_svg(drawn: ErrorMap, one: Slice, name: str, words: str) -> str:
    """A level of the error map: shades with the same limits in all levels, and lines with their
    values.
    """
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.ticker import MaxNLocator

    values = 1e6 * one.values
    every = 1e6 * np.concatenate([level.values.ravel() for level in drawn.slices])
    every = every[np.isfinite(every)]
    low, high = (float(every.min()), float(every.max())) if len(every) else (0.0, 1.0)
    levels = MaxNLocator(nbins=MOST_BANDS, steps=[1, 2, 2.5, 5, 10]).tick_values(
        low, max(high, low + 1e-9)
    )
    span = np.array([np.ptp(drawn.x), np.ptp(drawn.y)])
    width = WIDTH - LEFT - RIGHT
    height = min(max(width * float(span[1] / span[0]), 150.0), 450.0)
    with drawing(height + BELOW + ABOVE) as figure:
        axes = placed_axes(figure, LEFT, BELOW, width, height)
        axes.set_aspect("equal")
        axes.set_xlabel("x, mm")
        axes.set_ylabel("y, mm")
        x, y = 1e3 * drawn.x, 1e3 * drawn.y
        axes.set_xlim(x[0], x[-1])
        axes.set_ylim(y[0], y[-1])
        hatched = np.isnan(values)
        if hatched.any():
            axes.contourf(
                x, y, hatched.astype(float), levels=[0.5, 1.5], colors="none", hatches=["///"]
            )
        if not hatched.all():
            colours = LinearSegmentedColormap.from_list("light", LIGHT)(
                np.linspace(0.0, 1.0, len(levels) - 1)
            )
            axes.contourf(x, y, np.ma.masked_invalid(values), levels=levels, colors=colours)
            if ((np.nanmin(values) < levels) & (levels < np.nanmax(values))).any():
                lines = axes.contour(
                    x, y, np.ma.masked_invalid(values), levels=levels, colors=DARK, linewidths=0.8
                )
                axes.clabel(lines, fmt=lambda value: f"{value:.3g}", fontsize=9.5, colors=DARK)
        return as_svg(figure, name, words)


def slice_words(drawn: Slice) -> str:
    """A level of the error map for those who do not see it."""
    known = drawn.values[np.isfinite(drawn.values)]
    at = (
        f"{drawn.name} level, z {_millimetres(drawn.level)} mm: " if drawn.level is not None else ""
    )
    if not len(known):
        return f"{at}the error map is undetermined everywhere"
    told = f"{at}{number(1e6 * known.min(), 3)} to {number(1e6 * known.max(), 3)} µm"
    left = 1.0 - len(known) / drawn.values.size
    return told + (f"; undetermined at {number(100 * left, 3)} % of the points" if left else "")
