"""Drawings of lengths against a target: slices through the volume, and uncertainties over the
length.
"""

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
    drawing,
    legend_above,
    percent,
    placed_axes,
    save,
)
from ballplate.simulator.computing import evenly_spread
from ballplate.simulator.design import Flags
from ballplate.simulator.machines import Array

from .length_groups import GroupedLengths, target_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Points: of the drawing and what stands around its parts.
WIDTH, LEFT, RIGHT, BELOW, ABOVE = 480.0, 56.0, 16.0, 44.0, 26.0
CURVES = 200.0
# Room for the numbers and names below the slices.
UNDER = 54.0
# Slices that are drawn of a grid, in rows of three, and the room between them and for the scale of
# colours.
MOST_SLICES, IN_A_ROW, BETWEEN, SCALE = 6, 3, 10.0, 62.0


def draw_lengths(lengths: GroupedLengths, path: str | Path | None = None) -> Figure:
    """A picture of the largest ratio of u to the target at each point, and of u over the length;
    it is written to the path, if there is one.

    :raises OSError: the file cannot be written.
    """
    counts = lengths.settings.grid
    factor = lengths.settings.target_factor
    ratios = factor * lengths.by_point.maximum_ratio.reshape(counts)
    marked, meaning = marks(ratios)
    levels = np.zeros(1, np.int64)
    if len(counts) == 3:
        levels = evenly_spread(counts[2], MOST_SLICES)
    columns = min(len(levels), IN_A_ROW) if len(levels) != 4 else 2
    rows = -(-len(levels) // columns)
    span = lengths.design.machine.volume.size
    side = (WIDTH - LEFT - RIGHT - SCALE - (IN_A_ROW - 1) * BETWEEN) / IN_A_ROW
    side = side if columns == IN_A_ROW else 1.5 * side
    high = float(np.clip(side * span[1] / span[0], 0.4 * side, 1.6 * side))
    maps = rows * high + (rows - 1) * ABOVE
    total = BELOW + CURVES + UNDER + maps + 2 * ABOVE
    under = BELOW + CURVES + UNDER
    with drawing(total, WIDTH) as figure:
        determined = ratios[np.isfinite(ratios)]
        limits = (
            (float(determined.min()), float(determined.max())) if len(determined) else (0.0, 1.0)
        )
        image = None
        for place, level in enumerate(levels):
            row, column = divmod(place, columns)
            bottom = under + maps - (row + 1) * high - row * ABOVE
            axes = placed_axes(figure, LEFT + column * (side + BETWEEN), bottom, side, high)
            here = (..., level) if len(counts) == 3 else (...,)
            image = _slice(axes, lengths, ratios[here], marked[here], limits)
            if len(counts) == 3:
                axes.set_title(f"z = {_millimetres(lengths, 2, int(level))} mm", loc="left")
            is_lowest = place + columns >= len(levels)
            axes.tick_params(
                bottom=is_lowest, labelbottom=is_lowest, left=column == 0, labelleft=column == 0
            )
            axes.set_xlabel("x, mm" if is_lowest else "")
            axes.set_ylabel("y, mm" if column == 0 else "")
        u = "u" if factor == 1.0 else f"{factor:g} u"
        head = f"largest {u} / target of the lengths from or to a point" + _mark_words(
            lengths, meaning
        )
        figure.text(LEFT / WIDTH, 1.0 - 14.0 / total, head, fontsize=10.5, va="center")
        if image is not None and len(determined):
            bar = placed_axes(figure, LEFT + columns * (side + BETWEEN) + 4.0, under, 10.0, maps)
            figure.colorbar(image, cax=bar)
        axes = placed_axes(figure, LEFT, BELOW, WIDTH - LEFT - RIGHT, CURVES - ABOVE)
        _curves(axes, lengths)
        shares = [percent(float(lengths.whole.share(expanded)[0])) for expanded in (False, True)]
        k = f"{lengths.settings.coverage_factor:g}"
        words = (
            f"target {target_words(lengths.settings.target)}: u within it for {shares[0]} of"
            " the lengths, "
        )
        return save(figure, path, f"{words}{k} u for {shares[1]}")


def marks(ratios: Array) -> tuple[Flags, str]:
    """Return the marked points by their ratios to the target, the smaller of both sets, and the
    meaning of marks.

    >>> marks(np.array([0.5, 0.6, 1.2]))
    (array([False, False,  True]), 'crosses: above 1')
    >>> marks(np.array([1.5, 0.6, 1.2]))
    (array([False,  True, False]), 'crosses: 1 or below')
    >>> marks(np.array([1.5, np.nan]))[1], marks(np.array([0.5, np.nan]))[1]
    ('above 1 everywhere', '')
    """
    with np.errstate(invalid="ignore"):
        missed, met = ratios > 1.0, ratios <= 1.0
    if not missed.any():
        return missed, ""
    if not met.any():
        return met, "above 1 everywhere"
    return (
        (missed, "crosses: above 1") if missed.sum() <= met.sum() else (met, "crosses: 1 or below")
    )


def _mark_words(lengths: GroupedLengths, meaning: str) -> str:
    words = f"; {meaning}" if meaning else ""
    return words + ("; undetermined ones left out" if lengths.whole.undetermined[0] else "")


def _slice(  # type: ignore[no-untyped-def]
    axes: Axes,
    lengths: GroupedLengths,
    ratios: Array,
    marked: Flags,
    limits: tuple[float, float],
):
    """Draw ratios (x, y) as colours, crosses where `marked`, dashes where undetermined."""
    sides = [_centres(lengths, axis) for axis in (0, 1)]
    image = axes.pcolormesh(
        *(_borders(side) for side in sides),
        np.ma.masked_invalid(ratios.T),
        cmap="viridis",
        vmin=limits[0],
        vmax=limits[1],
        rasterized=False,
    )
    x, y = np.meshgrid(*sides, indexing="ij")
    for chosen, marker in ((marked, "x"), (np.isnan(ratios), "_")):
        colour = PAPER if marker == "x" else MUTED
        axes.plot(
            x[chosen], y[chosen], linestyle="none", marker=marker, color=colour, markersize=4.0
        )
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_xticks([sides[0][0], sides[0][-1]])
    axes.set_yticks([sides[1][0], sides[1][-1]])
    axes.get_xticklabels()[0].set_horizontalalignment("left")
    axes.get_xticklabels()[-1].set_horizontalalignment("right")
    return image


def _centres(lengths: GroupedLengths, axis: int) -> Array:
    """Co-ordinates of the grid along an axis, in millimetres."""
    return np.unique(1e3 * lengths.points[:, axis].round(12))


def _millimetres(lengths: GroupedLengths, axis: int, level: int) -> str:
    return f"{_centres(lengths, axis)[level] + 0.0:.6g}"


def _borders(centres: Array) -> Array:
    half = 0.5 * (centres[1] - centres[0])
    return np.append(centres - half, centres[-1] + half)


def _curves(axes: Axes, lengths: GroupedLengths) -> None:
    """Average and largest u of each class of length, the largest k u, and the target."""
    groups, edges = lengths.by_length, 1e3 * lengths.edges
    middle = 0.5 * (edges[1:] + edges[:-1])
    k = f"{lengths.settings.coverage_factor:g}"
    axes.plot(
        edges,
        1e6 * lengths.settings.target.at(lengths.edges),
        color=INK,
        linewidth=1.2,
        label="target",
    )
    curves = [("u, average", groups.average), ("u, largest", groups.maximum)]
    curves.append((f"{k} u, largest", lengths.settings.coverage_factor * groups.maximum))
    for j, (label, values) in enumerate(curves):
        axes.plot(
            middle,
            1e6 * values,
            color=SERIES[j],
            linestyle=DASHES[j],
            marker=MARKERS[j],
            markersize=3.5,
            markerfacecolor=PAPER,
            label=label,
            clip_on=False,
            zorder=3,
        )
    axes.set_ylim(0.0)
    axes.set_xlim(0.0, edges[-1])
    axes.grid(True)
    axes.set_xlabel("length, mm")
    axes.set_ylabel("µm")
    legend_above(axes, 4)
