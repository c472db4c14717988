"""Certified distances that follow from others, and so have no errors of their own."""

from __future__ import annotations

import numpy as np

from ..computing.decompositions import eigvalsh
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
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import lsmr
    from scipy.special import chdtr

    values, slope = distances.values(balls)
    weight = 1.0 / np.maximum(distances.uncertainty, LEAST)
    misfit, artefact = weight * (distances.value - values), design.balls.artefact[distances.first]
    columns = balls.shape[1] * distances.balls[:, :, None] + np.arange(balls.shape[1])
    count = 0
    for one in np.unique(artefact):
        rows = np.flatnonzero(artefact == one)
        tied, place = np.unique(columns[rows], return_inverse=True)
        entries = (weight[rows, None, None] * slope[rows]).ravel()
        ends = np.arange(0, len(entries) + 1, columns[0].size)
        matrix = csr_array((entries, place.ravel(), ends), shape=(len(rows), len(tied)))
        # Squares keep eight digits of the ratio of singular values, of which four are needed.
        squares = eigvalsh((matrix.T @ matrix).toarray())
        others = len(rows) - int((squares > UNSEEN**2 * squares[-1]).sum())
        solution = lsmr(matrix, misfit[rows], atol=1e-12, btol=1e-12, conlim=0.0)[0]
        left = misfit[rows] - matrix @ solution
        if others and chdtr(others, left @ left) < AGREEING:
            count += others
    return count
