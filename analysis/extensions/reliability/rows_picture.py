"""Picture of values by position: rows of points, a panel for each quantity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.presentation import SERIES, drawing, micro, placed_axes, save, scaled_axis
from ballplate.simulator.machines import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Points: width, margins of a panel, and height of a row.
WIDTH, RIGHT, BELOW, ABOVE, ROW = 480.0, 16.0, 46.0, 24.0, 16.0

# Room for names of rows, and letters of a name that has it.
NAMES, LETTERS = 120.0, 20


@dataclass(frozen=True, eq=False)
class RowOfPoints:
    """A row's name and its values."""

    name: str
    values: Array


def draw_rows(
    panels: Sequence[tuple[str, Sequence[RowOfPoints]]],
    words: str,
    path: str | Path | None = None,
) -> Figure:
    """Draw values as points in rows, a panel for each quantity.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the path has no ending of a picture.
    :raises OSError: the file cannot be written.
    """
    heights = [ROW * max(len(rows), 2) + BELOW + ABOVE for _, rows in panels]
    with drawing(sum(heights), WIDTH) as figure:
        top = sum(heights)
        for (name, rows), height in zip(panels, heights, strict=True):
            top -= height
            axes = placed_axes(
                figure, NAMES, top + BELOW, WIDTH - NAMES - RIGHT, height - BELOW - ABOVE
            )
            every = np.concatenate([row.values for row in rows])
            for k, row in enumerate(rows):
                axes.plot(
                    row.values,
                    np.full(len(row.values), -k),
                    color=SERIES[k % len(SERIES)],
                    marker="|",
                    markersize=9.0,
                    linestyle="none",
                )
            axes.set_ylim(0.6 - max(len(rows), 2), 0.6)
            shown = [
                row.name if len(row.name) <= LETTERS else f"{row.name[: LETTERS - 1]}…"
                for row in rows
            ]
            axes.set_yticks([-k for k in range(len(rows))], shown)
            scaled_axis(axes, every, "x")
            axes.grid(True, axis="x")
            axes.set_xlabel(micro(name))
        return save(figure, path, words)
