"""Drawings of volumetric errors: a displaced grid, and errors at points or along a line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.presentation import (
    DASHES,
    INK,
    MARKERS,
    MUTED,
    PAPER,
    SERIES,
    Vectors,
    blank_axes,
    box,
    box_edges,
    draw_box,
    draw_vectors,
    drawing,
    legend_above,
    number,
    placed_axes,
    projection,
    round_number,
    save,
)
from ballplate.simulator.computing import comparable, evenly_spread
from ballplate.simulator.design import Volume
from ballplate.simulator.machines import Array

from .volumetric_errors import LengthErrors, VolumetricErrors

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, LEFT, RIGHT, BELOW, ABOVE = 480.0, 56.0, 16.0, 44.0, 52.0

# Part of the volume's diagonal that the largest displacement is drawn as, about.
LARGEST = 0.06

# Lines that are drawn of a face of the grid in each direction, and points of each line; the table
# has them all.
MOST_LINES, MOST_ON_LINE = 41, 201

# Between the plot and its title, in points: the legend stands there and covers nothing.
TITLE_PAD = 26.0

# Points beyond which they are not marked one by one.
MOST_MARKS = 60


def magnification_of(errors: VolumetricErrors) -> float:
    """A round factor that makes the largest error well visible in the volume."""
    size = float(np.linalg.norm(np.ptp(errors.points, axis=0)))
    largest = float(np.nanmax(errors.resultant))
    return round_number(LARGEST * size / largest) if largest else 1.0


def draw_grid(
    errors: VolumetricErrors,
    lengths: LengthErrors,
    counts: tuple[int, ...],
    path: str | Path | None = None,
) -> Figure:
    """A picture of the grid's outside, nominal and displaced, which is written to the path if there
    is one.

    :raises OSError: the file cannot be written.
    """
    factor = magnification_of(errors)
    view, away = projection(3)
    nominal = errors.points.reshape(*counts, 3)
    moved = nominal + factor * errors.errors.reshape(*counts, 3)
    with drawing(430.0, WIDTH) as figure:
        axes = blank_axes(figure)
        volume = box(nominal[0, 0, 0], nominal[-1, -1, -1])
        draw_box(axes, volume)
        for axis in range(3):
            near = -1 if away[axis] < 0 else 0
            for side, is_near in ((near, True), (-1 - near, False)):
                # The front faces with all their lines, the rear ones by their edges, so that the
                # front stays readable.
                _face(axes, nominal.take(side, axis) @ view.T, MUTED, 0.5, is_near)
                _face(axes, moved.take(side, axis) @ view.T, SERIES[0], 1.1, is_near)
        size = volume.size
        drawn = np.concatenate([volume.edges.reshape(-1, 2), moved.reshape(-1, 3) @ view.T])
        low, high = np.nanmin(drawn, axis=0), np.nanmax(drawn, axis=0)
        middle = nominal.reshape(-1, 3).mean(axis=0) @ view.T
        for k, corner in enumerate(lengths.starts[:4] @ view.T):
            x, y = corner + 0.06 * size * (middle - corner) / np.linalg.norm(middle - corner)
            circle = {
                "boxstyle": "circle,pad=0.2",
                "facecolor": PAPER,
                "edgecolor": MUTED,
                "linewidth": 0.7,
            }
            axes.text(x, y, str(k + 1), ha="center", va="center", fontsize=8.5, bbox=circle)
        axes.plot([], [], color=MUTED, linewidth=0.9, label="nominal grid")
        axes.plot(
            [], [], color=SERIES[0], linewidth=1.1, label=f"with errors, magnified {factor:g} times"
        )
        axes.legend(loc="upper left", borderaxespad=0.8)
        legend = [
            f"{k + 1}: {number(1e6 * error, 3)} µm" for k, error in enumerate(lengths.errors[:4])
        ]
        words = f"length errors of the diagonals from the corners {', '.join(legend)}"
        figure.text(0.5, 0.025, words, ha="center", fontsize=8.5)
        axes.set_xlim(low[0] - 0.2 * size, high[0] + 0.16 * size)
        axes.set_ylim(low[1] - 0.16 * size, high[1] + 0.2 * size)
        return save(figure, path, f"Volumetric errors, magnified {factor:g} times; {words}")


def draw_points(
    errors: VolumetricErrors, volume: Volume, title: str, path: str | Path | None = None
) -> Figure:
    """A picture of magnified errors at points in a volume, in space seen from the front and above;
    undetermined ones are left out.

    :raises OSError: the file cannot be written.
    """
    is_determined = ~np.isnan(errors.resultant)
    view, edges = np.eye(2), None
    if len(volume.lower) == 3:
        view, towards = projection(3)
        edges = box_edges(volume.lower, volume.upper, towards)[0] @ view.T
    places, vectors = (array[is_determined] @ view.T for array in (errors.points, errors.errors))
    return draw_vectors((Vectors("", places, vectors),), title, path, edges, "errors")


def _face(axes: Axes, face: Array, colour: str, width: float, is_near: bool) -> None:
    """Lines of a face (n, m, 2) of the grid."""
    for lines in (face, face.transpose(1, 0, 2)):
        chosen = lines[evenly_spread(len(lines), MOST_LINES)] if is_near else lines[[0, -1]]
        for line in chosen[:, evenly_spread(lines.shape[1], MOST_ON_LINE)]:
            axes.plot(*line.T, color=colour, linewidth=width, linestyle="-" if is_near else ":")


def draw_line(errors: VolumetricErrors, factor: float, path: str | Path | None = None) -> Figure:
    """A picture of the errors along a line: components, resultant, and a coverage `factor` times
    the uncertainties about them; it is written to the path, if there is one.

    :raises OSError: the file cannot be written.
    """
    start, end = 1e3 * errors.points[0], 1e3 * errors.points[-1]
    moving = np.flatnonzero(start != end)
    if len(moving) == 1:
        axis = int(moving[0])
        name, positions = "xyz"[axis], 1e3 * errors.points[:, axis]
        fixed_axes = [k for k in range(len(start)) if k != axis]
        where = ", ".join(f"{'xyz'[k]} = {start[k] + 0.0:.6g} mm" for k in fixed_axes)
        along = f"along {name} at {where}"
    else:
        name, positions = "distance", 1e3 * np.linalg.norm(errors.points - errors.points[0], axis=1)
        ends = [f"({', '.join(f'{v + 0.0:.6g}' for v in point)})" for point in (start, end)]
        where = along = f"from {ends[0]} to {ends[1]} mm"
    with drawing(320.0, WIDTH) as figure:
        axes = placed_axes(figure, LEFT, BELOW, WIDTH - LEFT - RIGHT, 320.0 - BELOW - ABOVE)
        axes.set_title(where, loc="left", pad=TITLE_PAD)
        for k, letter in enumerate("XYZ"[: len(start)]):
            values, half = 1e6 * errors.errors[:, k], 1e6 * factor * errors.uncertainties[:, k]
            _band(axes, positions, values, half, k, letter)
        axes.plot(
            positions,
            1e6 * errors.resultant,
            color=INK,
            linewidth=1.2,
            linestyle=DASHES[3],
            label="resultant",
        )
        if errors.uncertainties.any():
            words = f"± U, k = {factor:g}"
            axes.fill_between([], [], [], color=MUTED, alpha=0.3, linewidth=0, label=words)
        axes.axhline(0.0, color=MUTED, linewidth=0.6)
        axes.grid(True)
        axes.margins(x=0.0)
        axes.set_xlabel(f"{name}, mm")
        axes.set_ylabel("error, µm")
        legend_above(axes, 5)
        worst = int(comparable(np.nan_to_num(errors.resultant)).argmax())
        subtitle = (
            f"largest resultant {number(1e6 * errors.resultant[worst])} µm at"
            f" {positions[worst]:.6g} mm"
        )
        return save(figure, path, f"Volumetric errors {along}: {subtitle}")


def _band(axes: Axes, x: Array, values: Array, half: Array, k: int, label: str) -> None:
    """A curve, and a band of `half` its width on either side."""
    marker = MARKERS[k] if len(x) <= MOST_MARKS else ""
    axes.plot(
        x,
        values,
        color=SERIES[k],
        linestyle=DASHES[k],
        marker=marker,
        markersize=3.5,
        markerfacecolor=PAPER,
        label=label,
        clip_on=not marker,
        zorder=3,
    )
    if half.any():
        low, high = values - half, values + half
        axes.fill_between(x, low, high, color=SERIES[k], alpha=0.1, linewidth=0)
        # Where bands overlap their edges tell whose they are.
        for edge in (low, high):
            axes.plot(x, edge, color=SERIES[k], linewidth=0.7, linestyle=DASHES[k])
