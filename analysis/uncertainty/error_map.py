"""Standard uncertainty of the error map through the volume, and of distances corrected by it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.protocol import Array

from .summaries import point_pairs

# Points along x and y of a slice.
POINTS = 21

# From the bottom of the volume to its top, evenly spaced.
LEVELS = ("low", "middle", "high")


@dataclass(frozen=True, eq=False)
class Slice:
    """A level of the volume; `values` (y, x) in metres, NaN where the observations leave the error
    open.
    """

    name: str
    level: float | None
    values: Array


@dataclass(frozen=True, eq=False)
class ErrorMap:
    """Standard uncertainty of the error function at a grid of x and y in metres, one or three
    slices.

    A value is the root mean square over the co-ordinates, so that it compares with U4. `within` is
    the share of the distances between points of the grid that are within the target uncertainty,
    None without one.
    """

    x: Array
    y: Array
    slices: tuple[Slice, ...]
    within: float | None


@single_threaded
def error_map(experiment: Experiment, nodes: int = POINTS) -> ErrorMap:
    """The error map's uncertainty at `nodes` points along x and y, with the probe with which the
    experiment is evaluated, at zero machine error.
    """
    design = lay_out(experiment)
    volume = design.machine.volume
    x, y = (np.linspace(volume.lower[k], volume.upper[k], nodes) for k in (0, 1))
    levels: list[tuple[str, float | None]] = [("", None)]
    sides = [y, x]
    if design.dimension == 3:
        heights = np.linspace(volume.lower[2], volume.upper[2], len(LEVELS))
        levels = list(zip(LEVELS, heights.tolist(), strict=True))
        sides = [heights, y, x]
    grid = np.stack(np.meshgrid(*sides, indexing="ij")[::-1], axis=-1)
    points = grid.reshape(-1, design.dimension)
    design = replace(design, evaluation=replace(design.evaluation, points=points))
    target = experiment.target_uncertainty
    limit = None if target is None else target.standard
    of_points, pairs = point_pairs(linearise(design), limit)
    values = np.sqrt((of_points**2).mean(axis=1)).reshape(len(levels), len(y), len(x))
    slices = [
        Slice(name, level, found) for (name, level), found in zip(levels, values, strict=True)
    ]
    within = None if target is None else pairs.within / pairs.count
    return ErrorMap(x, y, tuple(slices), within)
