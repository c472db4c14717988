"""Residuals in two dimensions as magnified vectors at the balls."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
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
MARGIN, LINE, MARKER = 56.0, 15.0, 3.5
TITLE = 52
# More names would overlap.
MOST_NAMES = 60


@dataclass(frozen=True, eq=False)
class Vectors:
    """Vectors of one colour: `residuals` (m, 2) of readings at `places` (m, 2), both in metres.

    `names` (m,) are those of the balls, or empty.
    """

    label: str
    places: Array
    residuals: Array
    names: tuple[str, ...] = ()


def magnification(groups: tuple[Vectors, ...], extent: float) -> float:
    """Return the largest of 1, 2, 5, 10, ... for which the longest vector stays within its share of
    `extent` metres.

    >>> one = Vectors("", np.zeros((1, 2)), np.array([[3e-7, 4e-7]]))
    >>> magnification((one,), 0.5)
    200000.0
    """
    longest = _longest(groups)
    if longest == 0.0 or extent == 0.0:
        return 1.0
    return round_number(LONGEST * extent / longest)


def draw_vectors(
    groups: tuple[Vectors, ...],
    title: str,
    path: str | Path | None = None,
    edges: Array | None = None,
    subject: str = "residuals",
) -> Figure:
    """Draw residuals, or another `subject`, as vectors from their points, with a scale bar below,
    and write the picture to the path, if given.

    `edges` (k, 2, 2) are those of the volume if the drawing is a projection of space.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the suffix is of no picture format.
    :raises OSError: the file cannot be written.
    """
    places = np.concatenate([g.places for g in groups])
    extent = float(np.ptp(places, axis=0).max())
    times = magnification(groups, extent)
    drawn = np.concatenate([places, *(g.places + times * g.residuals for g in groups)])
    drawn = drawn if edges is None else np.concatenate([drawn, edges.reshape(-1, 2)])
    lower, upper = drawn.min(axis=0), drawn.max(axis=0)
    named = _named(groups)
    pad = (0.1 if named else 0.06) * extent
    heading = textwrap.wrap(title, TITLE)
    across, up = upper - lower + 2.0 * pad
    width = WIDTH - MARGIN - 10.0
    height = width * up / across
    below = 50.0 + LINE * len(groups)
    with drawing(height + below + 10.0 + LINE * len(heading)) as figure:
        axes = placed_axes(figure, MARGIN, below, width, height)
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
        for k, group in enumerate(groups):
            sticks(
                axes,
                1e3 * group.places,
                1e3 * (group.places + times * group.residuals),
                color=SERIES[k % len(SERIES)],
                # Each repetition of the colours has other markers.
                marker=MARKERS[(k + k // len(SERIES)) % len(MARKERS)],
                markersize=MARKER,
                label=group.label,
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
        # A bar of 1, 2 or 5 units, drawn at the scale of the residuals.
        length = round_number(_longest(groups) or 1e-6)
        bar_text = f"{1e6 * length:g} µm, magnified {times:,.0f} times"
        scale_bar(axes, 1e3 * length * times, -42.0 / height, bar_text)
        if any(group.label for group in groups):
            axes.legend(loc="upper left", bbox_to_anchor=(0.0, -48.0 / height), borderaxespad=0.0)
        return save(figure, path, f"{title}: {subject} as vectors, magnified {times:g} times")


def _named(groups: tuple[Vectors, ...]) -> list[tuple[str, Array, Array]]:
    """Return each ball's name once per group, its point and the direction (2,) away from its
    vector.
    """
    labels: dict[tuple[int, str], tuple[str, Array, Array]] = {}
    for k, group in enumerate(groups):
        for name, place, residual in zip(group.names, group.places, group.residuals, strict=False):
            length = float(np.hypot(*residual))
            away = -residual / length if length > 0.0 else np.array([0.0, 1.0])
            labels.setdefault((k, name), (name, place, away))
    return list(labels.values()) if len(labels) <= MOST_NAMES else []


def _longest(groups: tuple[Vectors, ...]) -> float:
    return max(float(np.hypot(*g.residuals.T).max(initial=0.0)) for g in groups)
