"""Residuals of a plate's readings in two dimensions, as magnified vectors where the balls were
read.
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.machines.protocol import Array

from .svg import INK, MARKERS, MUTED, SERIES, WIDTH, drawing, placed_axes, round_number, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Of the drawing's extent, the longest vector takes this part at most.
LONGEST = 0.2
MARGIN, LINE, MARKER = 56.0, 15.0, 3.5
TITLE = 52
# More names would lie on one another.
MOST_NAMES = 60


@dataclass(frozen=True, eq=False)
class Vectors:
    """What is drawn alike: `residuals` (m, 2) of readings at `places` (m, 2), both in metres.

    `names` (m,) are those of the balls; empty where there are none to be drawn.
    """

    label: str
    places: Array
    residuals: Array
    names: tuple[str, ...] = ()


def magnification(groups: tuple[Vectors, ...], extent: float) -> float:
    """The largest of 1, 2, 5, 10, ... with which the longest vector takes no more than its part of
    `extent` metres.

    >>> one = Vectors("", np.zeros((1, 2)), np.array([[3e-7, 4e-7]]))
    >>> magnification((one,), 0.5)
    200000.0
    """
    longest = max(
        (float(np.sqrt((g.residuals**2).sum(axis=1)).max(initial=0.0)) for g in groups), default=0.0
    )
    if longest == 0.0 or extent == 0.0:
        return 1.0
    return round_number(LONGEST * extent / longest)


def draw_vectors(groups: tuple[Vectors, ...], title: str, path: str | Path | None = None) -> Figure:
    """Residual vectors as a picture, each from the place that was read, with a bar of known length
    below.

    It is written to the path, if there is one.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the name ends in none of the kinds of pictures.
    :raises OSError: the file cannot be written.
    """
    places = np.concatenate([g.places for g in groups])
    extent = float(np.ptp(places, axis=0).max())
    times = magnification(groups, extent)
    drawn = np.concatenate([places, *(g.places + times * g.residuals for g in groups)])
    lower, upper = drawn.min(axis=0), drawn.max(axis=0)
    named = _named(groups)
    pad = (0.1 if named else 0.06) * extent
    heading = textwrap.wrap(title, TITLE)
    across, up = upper - lower + 2.0 * pad
    width = WIDTH - MARGIN - 10.0
    height = width * up / across
    below = 34.0 + LINE * (len(groups) + 1)
    with drawing(height + below + 10.0 + LINE * len(heading)) as figure:
        axes = placed_axes(figure, MARGIN, below, width, height)
        axes.set_xlim(1e3 * (lower[0] - pad), 1e3 * (upper[0] + pad))
        axes.set_ylim(1e3 * (lower[1] - pad), 1e3 * (upper[1] + pad))
        axes.set_xlabel("x, mm")
        axes.set_ylabel("y, mm")
        axes.grid(True)
        axes.set_axisbelow(True)
        axes.set_title("\n".join(heading), loc="left")
        for k, group in enumerate(groups):
            colour, marker = _style(k)
            ends = group.places + times * group.residuals
            segments = np.stack([group.places, ends, np.full_like(ends, np.nan)], axis=1).reshape(
                -1, 2
            )
            axes.plot(*1e3 * segments.T, color=colour)
            axes.plot(
                *1e3 * group.places.T,
                color=colour,
                marker=marker,
                markersize=MARKER,
                linestyle="none",
            )
        for text, place, away in named:
            axes.annotate(
                text,
                tuple(1e3 * place),
                (5.0 * away[0], 7.0 * away[1]),
                textcoords="offset points",
                ha="left" if away[0] > 0.5 else "right" if away[0] < -0.5 else "center",
                va="center",
                color=MUTED,
                fontsize=7.0,
            )
        _legend(figure, groups, times, width / (1e3 * across))
        return save(figure, path, f"{title}: residuals as vectors, magnified {times:g} times")


def _named(groups: tuple[Vectors, ...]) -> list[tuple[str, Array, Array]]:
    """Each ball's name once for each group, its place and the direction (2,) away from its
    vector.
    """
    found: dict[tuple[int, str], tuple[str, Array, Array]] = {}
    for k, group in enumerate(groups):
        for name, place, residual in zip(group.names, group.places, group.residuals, strict=False):
            length = float(np.hypot(*residual))
            away = -residual / length if length > 0.0 else np.array([0.0, 1.0])
            found.setdefault((k, name), (name, place, away))
    return list(found.values()) if len(found) <= MOST_NAMES else []


def _style(k: int) -> tuple[str, str]:
    """Colour and marker of a group; where colours begin again, other markers go with them."""
    return SERIES[k % len(SERIES)], MARKERS[(k + k // len(SERIES)) % len(MARKERS)]


def _legend(
    figure: Figure, groups: tuple[Vectors, ...], times: float, per_millimetre: float
) -> None:
    """Names of the groups, and a bar of one, two or five of some unit, that long in the drawing as
    a residual is.
    """
    longest = max(float(np.sqrt((g.residuals**2).sum(axis=1)).max()) for g in groups)
    length = round_number(longest) if longest > 0.0 else 1e-6
    w, h = 72.0 * figure.get_size_inches()
    scale = placed_axes(figure, 0.0, 0.0, w, LINE * (len(groups) + 1) + 4.0)
    scale.set_axis_off()
    scale.set_xlim(0.0, w)
    scale.set_ylim(0.0, LINE * (len(groups) + 1) + 4.0)
    for k, group in enumerate(groups):
        y = LINE * (len(groups) - k) + 6.0
        colour, marker = _style(k)
        scale.plot([MARGIN, MARGIN + 22.0], [y, y], color=colour)
        scale.plot([MARGIN], [y], color=colour, marker=marker, markersize=MARKER)
        scale.text(MARGIN + 30.0, y, group.label, va="center", color=INK)
    bar = 1e3 * length * times * per_millimetre
    scale.plot([MARGIN, MARGIN + bar], [6.0, 6.0], color=MUTED, linewidth=3.0)
    scale.text(
        MARGIN + bar + 8.0,
        6.0,
        f"{1e6 * length:g} µm, magnified {times:,.0f} times",
        va="center",
        color=INK,
    )
