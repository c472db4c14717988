"""Certified distances that follow from others, and so have no errors of their own."""

from __future__ import annotations

import numpy as np

from ..computing.decompositions import svd
from ..design.arrays import Design
from ..design.observations.distances import CalibratedDistances
from ..machines.protocol import Array

# Probability with which measured distances contradict each other as little as computed ones.
AGREEING = 1e-4

# Singular values, in parts of the largest one, of motions that do not change distances: those out
# of a plane.
UNSEEN = 1e-4

# Standard uncertainty (m) of distances without one.
LEAST = 1e-9


def implied_values(design: Design, balls: Array) -> int:
    """Return how many certified distances follow from the others of their artefact, where `balls`
    are (n, d).

    More distances than co-ordinates contradict each other by their errors. Those computed from
    co-ordinates, or drawn, do not, and S^2 has so many degrees of freedom fewer.
    """
    distances = design.of(CalibratedDistances)
    if not len(distances):
        return 0
    from scipy.special import chdtr

    values, slope = distances.values(balls)
    weight = 1.0 / np.maximum(distances.uncertainty, LEAST)
    misfit, artefact = weight * (distances.value - values), design.balls.artefact[distances.first]
    count = 0
    for one in np.unique(artefact):
        rows = np.flatnonzero(artefact == one)
        tied, place = np.unique(distances.balls[rows], return_inverse=True)
        matrix = np.zeros((len(rows), len(tied), balls.shape[1]))
        matrix[np.arange(len(rows))[:, None], place.reshape(-1, 2)] = slope[rows]
        u, sizes, _ = svd(weight[rows, None] * matrix.reshape(len(rows), -1), full_matrices=False)
        seen = u[:, sizes > UNSEEN * sizes[0]]
        square = misfit[rows] @ misfit[rows] - ((seen.T @ misfit[rows]) ** 2).sum()
        others = len(rows) - seen.shape[1]
        if others and chdtr(others, max(square, 0.0)) < AGREEING:
            count += others
    return count
