"""Errors at the nodes of a grid over the volume, for machines that are no chain of axes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from ballplate.simulator.geometry import grid_points
from ballplate.simulator.machines import Array, ErrorModel

# Of numerical derivatives by the probe offset, in metres: errors are nearly linear in it.
OFFSET = 0.1


@dataclass(frozen=True, eq=False)
class VolumeTable:
    """Errors at the `nodes` of each axis: `values` (n_x, n_y, n_z, 6), or (n_x, n_y, 6) in two
    dimensions, are the displacement of the probe's reference point and the turn of the probe about
    it, in metres and radians, as corrections to be added to scale readings.
    """

    nodes: tuple[Array, ...]
    values: Array

    @property
    def dimension(self) -> int:
        return len(self.nodes)

    @property
    def lower(self) -> tuple[float, ...]:
        return tuple(float(nodes[0]) for nodes in self.nodes)

    @property
    def upper(self) -> tuple[float, ...]:
        return tuple(float(nodes[-1]) for nodes in self.nodes)

    def error(self, x: Array, p: Array) -> Array:
        """Corrections (m, d) at scale readings x (m, d) with probe offsets p (m, d), linear in each
        co-ordinate between nodes.
        """
        errors = np.zeros((len(x), 6))
        cells, parts = [], []
        for k, nodes in enumerate(self.nodes):
            cell = np.clip(np.searchsorted(nodes, x[:, k], "right") - 1, 0, len(nodes) - 2)
            cells.append(cell)
            part = (x[:, k] - nodes[cell]) / (nodes[cell + 1] - nodes[cell])
            parts.append(np.clip(part, 0.0, 1.0))
        for corner in product((0, 1), repeat=self.dimension):
            weight = np.ones(len(x))
            for k, one in enumerate(corner):
                weight = weight * (parts[k] if one else 1.0 - parts[k])
            index = tuple(cell + one for cell, one in zip(cells, corner, strict=True))
            errors += weight[:, None] * self.values[index]
        offset = np.zeros((len(x), 3))
        offset[:, : self.dimension] = p
        turned = errors[:, :3] + np.cross(errors[:, 3:], offset)
        return turned[:, : self.dimension] + p


def volume_table(model: ErrorModel, a: Array, nodes: tuple[Array, ...], zero: Array) -> VolumeTable:
    """Errors of any model on a grid, less those at the point `zero` (d,).

    What a probe offset changes is taken as a turn of the probe; what it stretches is left out.
    """
    values = _at(model, a, grid_points(nodes)) - _at(model, a, zero[None])
    return VolumeTable(nodes, values.reshape(*(len(node) for node in nodes), 6))


def _at(model: ErrorModel, a: Array, x: Array) -> Array:
    """Displacement and turn (m, 6) at x (m, d)."""
    m, d = x.shape
    still = np.zeros((m, d))
    errors = np.zeros((m, 6))
    errors[:, :d] = model.error(x, a, still)
    by_offset = np.zeros((m, 3, 3))
    for k in range(d):
        p = np.tile(OFFSET * np.eye(d)[k], (m, 1))
        by_offset[:, :d, k] = (model.error(x, a, p) - p - errors[:, :d]) / OFFSET
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        errors[:, 3 + k] = 0.5 * (by_offset[:, j, i] - by_offset[:, i, j])
    return errors
