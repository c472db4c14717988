"""Turns of a set of points onto itself."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.geometry import fit_motion
from ballplate.simulator.machines import Array

# Pairs of points that a turn may lead to, which are tried at most.
MOST_PAIRS = 4000


def turns_onto_itself(places: Array, limit: float) -> list[Array]:
    """Rotations (d, d) that bring every one of the points (n, d) within `limit` of another one, the
    identity left out; of points in one line, none.

    >>> len(turns_onto_itself(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), 0.1))
    3
    """
    from scipy.spatial import cKDTree

    local = places - places.mean(axis=0)
    radius = np.sqrt((local**2).sum(axis=1))
    first = int(radius.argmax())
    across = local - np.outer(local @ local[first], local[first]) / max(radius[first] ** 2, 1e-300)
    second = int((across**2).sum(axis=1).argmax())
    if np.sqrt((across[second] ** 2).sum()) <= limit:
        return []
    between = float(np.sqrt(((local[first] - local[second]) ** 2).sum()))
    tree, turns = cKDTree(local), dict[tuple[int, ...], Array]()
    to_first = np.flatnonzero(np.abs(radius - radius[first]) <= limit)
    to_second = np.flatnonzero(np.abs(radius - radius[second]) <= limit)
    i, j = (grid.ravel() for grid in np.meshgrid(to_first, to_second, indexing="ij"))
    distance = np.sqrt(((local[i] - local[j]) ** 2).sum(axis=1))
    fitting = np.flatnonzero(np.abs(distance - between) <= 2.0 * limit)[:MOST_PAIRS]
    for k in fitting.tolist():
        # About the middle, which stays where it is.
        corners = np.array([np.zeros(local.shape[1]), local[first], local[second]])
        there = np.array([np.zeros(local.shape[1]), local[i[k]], local[j[k]]])
        rotation, _ = fit_motion(corners, there)
        apart, nearest = tree.query(local @ rotation.T)
        if apart.max() <= limit and len(np.unique(nearest)) == len(local):
            turns.setdefault(tuple(nearest.tolist()), rotation)
    turns.pop(tuple(range(len(local))), None)
    return list(turns.values())
