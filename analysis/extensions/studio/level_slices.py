"""Values on grids of x and y at levels of the volume."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from ballplate.presentation import Data
from ballplate.simulator.design import Design
from ballplate.simulator.estimation import Linearisation, displacements
from ballplate.simulator.machines import Array
from ballplate.uncertainty import evaluation_points

# From the bottom of the volume to its top, evenly spaced.
LEVELS = ("low", "middle", "high")


def point_map(at: Linearisation, nodes: int) -> Data:
    """Return the standard uncertainty of the error function at `nodes` points along x and y, in
    metres: the root mean square over the co-ordinates, so that it compares with U4.
    """
    x, y, levels = _sides(at.design, nodes)
    sides = [y, x] if at.design.dimension == 2 else [np.array([z for _, z in levels]), y, x]
    grid = np.stack(np.meshgrid(*sides, indexing="ij")[::-1], axis=-1)
    evaluation = replace(at.design.evaluation, points=grid.reshape(-1, at.design.dimension))
    # The grid does not change what readings determine.
    on_grid = replace(at, design=replace(at.design, evaluation=evaluation))
    values = displacements(on_grid, evaluation_points(on_grid.design)).uncertainties
    return in_slices(at.design, np.sqrt((values**2).mean(axis=1)).reshape(-1, nodes, nodes))


def in_slices(design: Design, values: Array) -> Data:
    """Return values (levels, y, x) with their grid's x and y in metres, by levels of the volume."""
    x, y, levels = _sides(design, values.shape[-1])
    slices = [
        {"name": name, "level": level, "values": level_values}
        for (name, level), level_values in zip(levels, values, strict=True)
    ]
    return {"x": x, "y": y, "slices": slices}


def _sides(design: Design, nodes: int) -> tuple[Array, Array, list[tuple[str, float | None]]]:
    """Return the grid's x and y, and its levels with their names."""
    volume = design.machine.volume
    x, y = (np.linspace(volume.lower[k], volume.upper[k], nodes) for k in (0, 1))
    if design.dimension == 2:
        return x, y, [("", None)]
    heights = np.linspace(volume.lower[2], volume.upper[2], len(LEVELS))
    return x, y, list(zip(LEVELS, heights.tolist(), strict=True))
