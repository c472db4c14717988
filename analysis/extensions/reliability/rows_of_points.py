"""A drawing of biases by position: values as points in rows, a panel for each quantity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.presentation.formatting import micro
from ballplate.presentation.svg import SERIES, drawing, placed_axes, save, scaled_axis
from ballplate.simulator.machines.protocol import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Points: of the drawing, of what stands around a panel, and of a row.
WIDTH, RIGHT, BELOW, ABOVE, ROW = 480.0, 16.0, 46.0, 24.0, 16.0

# Room for names of rows, and letters of a name that has it.
NAMES, LETTERS = 120.0, 20


@dataclass(frozen=True, eq=False)
class RowOfPoints:
    """A row's name and the values that stand in it."""

    name: str
    values: Array


def draw_rows(
    panels: Sequence[tuple[str, Sequence[RowOfPoints]]],
    words: str,
    path: str | Path | None = None,
) -> Figure:
    """Values as points in rows, a panel for each quantity.

    :raises ImportError: matplotlib is missing.
    :raises ValueError: the name ends in none of the kinds of pictures.
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
            every = np.concatenate([one.values for one in rows])
            for k, one in enumerate(rows):
                axes.plot(
                    one.values,
                    np.full(len(one.values), -k),
                    color=SERIES[k % len(SERIES)],
                    marker="|",
                    markersize=9.0,
                    linestyle="none",
                )
            axes.set_ylim(0.6 - max(len(rows), 2), 0.6)
            shown = [
                one.name if len(one.name) <= LETTERS else f"{one.name[: LETTERS - 1]}…"
                for one in rows
            ]
            axes.set_yticks([-k for k in range(len(rows))], shown)
            scaled_axis(axes, every, "x")
            axes.grid(True, axis="x")
            axes.set_xlabel(micro(name))
        return save(figure, path, words)
