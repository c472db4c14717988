"""Plot of changes between two maps: vectors in the volume, and E_n of all groups."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.presentation import (
    INK,
    MUTED,
    SERIES,
    box,
    draw_box,
    drawing,
    legend_above,
    placed_axes,
    projection,
    round_number,
    save,
    scale_bar,
    sticks,
)
from ballplate.simulator.computing import comparable

from .comparison import MapComparison
from .normalised_errors import FigureGroup

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Points of the drawing, and of what stands around its panels.
WIDTH, SCENE, ROW, LEFT, RIGHT, BELOW, ABOVE = 480.0, 330.0, 14.0, 150.0, 16.0, 46.0, 40.0
# Part of the volume's size that the longest vector takes.
LONGEST = 0.15
# E_n at which the axis ends at the least, and points of a row that are drawn one by one.
LEAST_END, MOST_MARKS = 2.0, 400


def draw_difference(
    comparison: MapComparison, words: str, path: str | Path | None = None
) -> Figure:
    """Draw differences at points of the volume and |E_n| of all groups, those of |E_n| > 1 in a
    colour; save to the path, if any.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the file name has no known picture format.
    :raises OSError: the file cannot be written.
    """
    groups = [group for group in comparison.groups if group.count]
    rows = ROW * len(groups) + BELOW + ABOVE
    with drawing(SCENE + rows, WIDTH) as figure:
        scene = placed_axes(figure, 0.0, rows, WIDTH, SCENE - 24.0)
        scene.set_axis_off()
        scene.set_aspect("equal")
        _vectors(scene, comparison)
        axes = placed_axes(figure, LEFT, BELOW, WIDTH - LEFT - RIGHT, rows - BELOW - ABOVE)
        _rows(axes, groups)
        return save(figure, path, words)


def _vectors(axes: Axes, comparison: MapComparison) -> None:
    points, d = comparison.points, len(comparison.volume.lower)
    view, _ = projection(d)
    volume = box(comparison.volume.lower, comparison.volume.upper)
    draw_box(axes, volume)
    moved = comparison.places.differences.reshape(points.shape)
    is_open = np.isnan(comparison.places.standard_uncertainties).reshape(points.shape).any(axis=1)
    changed = (np.abs(np.nan_to_num(comparison.places.normalised)) > 1.0).reshape(points.shape)
    is_changed = changed.any(axis=1) & ~is_open
    longest = float(np.linalg.norm(moved[~is_open], axis=1).max(initial=0.0))
    size = float(comparison.volume.size.max())
    times = round_number(LONGEST * size / longest) if longest else 1.0
    starts, tips = points @ view.T, (points + times * moved) @ view.T
    for is_shown, colour, marker, label in (
        (~is_changed & ~is_open, MUTED, "o", "|E_n| ≤ 1"),
        (is_changed, SERIES[1], "s", "|E_n| > 1 along an axis"),
    ):
        if is_shown.any():
            sticks(
                axes,
                starts[is_shown],
                tips[is_shown],
                color=colour,
                marker=marker,
                markersize=3.0,
                linewidth=1.2,
                label=label,
            )
    if is_open.any():
        axes.plot(*starts[is_open].T, "x", color=INK, markersize=5.0, label="undetermined")
    ends = np.concatenate([volume.edges.reshape(-1, 2), starts[~is_open], tips[~is_open]])
    low, high = ends.min(axis=0), ends.max(axis=0)
    axes.set_xlim(low[0] - 0.14 * size, high[0] + 0.14 * size)
    axes.set_ylim(low[1] - 0.22 * size, high[1] + 0.06 * size)
    legend_above(axes, 3)
    length = round_number(longest or 1e-6)
    scale_words = (
        f"{1e6 * length:g} µm, magnified {times:,.0f} times; the frame's motion is taken out"
    )
    scale_bar(axes, length * times, 0.03, scale_words)


def _rows(axes: Axes, groups: list[FigureGroup]) -> None:
    """Draw one row per group: |E_n|, those above 1 in a colour."""
    largest = LEAST_END
    for k, group in enumerate(groups):
        values = np.sort(np.abs(group.normalised[group.is_compared]))[::-1]
        largest = max(largest, float(values[0]))
        # The largest of many, and every so many of the others.
        step = -(-len(values) // MOST_MARKS)
        shown = np.concatenate([values[:1], values[1::step]])
        for is_shown, colour in ((shown <= 1.0, MUTED), (shown > 1.0, SERIES[1])):
            axes.plot(
                shown[is_shown],
                np.full(int(is_shown.sum()), -k),
                color=colour,
                marker="|",
                markersize=8.0,
                linestyle="none",
            )
    axes.axvline(1.0, color=INK, linewidth=1.0, linestyle="--")
    axes.set_xlim(0.0, 1.05 * float(comparable(largest)))
    axes.set_ylim(0.6 - max(len(groups), 1), 0.6)
    axes.set_yticks([-k for k in range(len(groups))], [_short(group.kind) for group in groups])
    axes.grid(True, axis="x")
    axes.set_xlabel("|E_n|; without a change, about one in twenty exceeds 1")


def _short(name: str) -> str:
    return name.removesuffix(" of the volume").removesuffix(" through the volume")
