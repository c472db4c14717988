"""Standard uncertainty of the error map through the volume, and of corrected distances."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import Design
from ballplate.simulator.estimation import Linearisation, displacements, linearise
from ballplate.simulator.experiment import Experiment, lay_out
from ballplate.simulator.machines import Array
from ballplate.uncertainty import evaluation_points, point_pairs

# Points along x and y of a slice.
POINTS = 21

# From the bottom of the volume to its top, evenly spaced.
LEVELS = ("low", "middle", "high")


@dataclass(frozen=True, eq=False)
class Slice:
    """A level of the volume; `values` (y, x) in metres, NaN if undetermined."""

    name: str
    level: float | None
    values: Array


@dataclass(frozen=True, eq=False)
class ErrorMap:
    """Standard uncertainty of the error function at a grid of x and y in metres, in one or three
    slices.

    A value is the root mean square over the co-ordinates, so that it compares with U4. `within` is
    the share of the distances between points of the grid within the target uncertainty, None
    without one.
    """

    x: Array
    y: Array
    slices: tuple[Slice, ...]
    within: float | None


@single_threaded
def error_map(experiment: Experiment, nodes: int = POINTS) -> ErrorMap:
    """Return the error map's uncertainty at `nodes` points along x and y, at zero machine error.

    The probe is the one with which the experiment is evaluated.
    """
    at = linearise(lay_out(experiment))
    drawn, target = point_map(at, nodes), experiment.target_uncertainty
    if target is None:
        return drawn
    pairs = point_pairs(_on_grid(at, nodes), target.standard)[1]
    return replace(drawn, within=pairs.within / pairs.count)


def point_map(at: Linearisation, nodes: int) -> ErrorMap:
    """Return the error map's uncertainty for a linearised design, without distances."""
    on_grid = _on_grid(at, nodes)
    values = displacements(on_grid, evaluation_points(on_grid.design)).uncertainties
    return in_slices(at.design, np.sqrt((values**2).mean(axis=1)).reshape(-1, nodes, nodes))


def in_slices(design: Design, values: Array) -> ErrorMap:
    """Return a map of values (levels, y, x) at the levels of the volume, without distances."""
    x, y, levels = _sides(design, values.shape[-1])
    slices = [
        Slice(name, level, slice_values)
        for (name, level), slice_values in zip(levels, values, strict=True)
    ]
    return ErrorMap(x, y, tuple(slices), None)


def _sides(design: Design, nodes: int) -> tuple[Array, Array, list[tuple[str, float | None]]]:
    """Return the grid's x and y, and its levels with their names."""
    volume = design.machine.volume
    x, y = (np.linspace(volume.lower[k], volume.upper[k], nodes) for k in (0, 1))
    if design.dimension == 2:
        return x, y, [("", None)]
    heights = np.linspace(volume.lower[2], volume.upper[2], len(LEVELS))
    return x, y, list(zip(LEVELS, heights.tolist(), strict=True))


def _on_grid(at: Linearisation, nodes: int) -> Linearisation:
    """Return the linearisation evaluated at the grid, which does not change what readings
    determine.
    """
    x, y, levels = _sides(at.design, nodes)
    sides = [y, x] if at.design.dimension == 2 else [np.array([z for _, z in levels]), y, x]
    grid = np.stack(np.meshgrid(*sides, indexing="ij")[::-1], axis=-1)
    evaluation = replace(at.design.evaluation, points=grid.reshape(-1, at.design.dimension))
    return replace(at, design=replace(at.design, evaluation=evaluation))
