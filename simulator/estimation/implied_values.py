"""Certified values that follow from others, and so have no errors of their own."""

from __future__ import annotations

import numpy as np

from ..computing.decompositions import eigvalsh
from ..design.arrays import Design, State
from ..design.observations.balls import BallObservations, slopes_apart

# Probability with which measured values contradict each other as little as computed ones.
AGREEING = 1e-2

# Singular values, in parts of the largest one, of motions that do not change values.
UNSEEN = 1e-4

# Standard uncertainty (m) of values without one.
LEAST = 1e-9


def implied_values(design: Design, state: State) -> int:
    """Return by how many degrees of freedom S^2 has fewer, at a state, because certified values of
    an artefact follow from others.

    More values than co-ordinates contradict each other by their errors. Those computed from
    co-ordinates, or drawn, do not, and their misfit counts for as much as it is.
    """
    kinds = [
        kind.loosened(LEAST)
        for kind in design.observations
        if isinstance(kind, BallObservations) and len(kind)
    ]
    tying = [kind for kind in kinds if kind.balls.shape[1] > 1]
    if not tying:
        return 0
    count = 0
    for artefact in np.unique(
        np.concatenate([design.balls.artefact[k.balls[:, 0]] for k in tying])
    ):
        groups = [kinds, *([kind] for kind in tying)] if len(kinds) > 1 else [kinds]
        count += max(_implied(design, state, group, artefact) for group in groups)
    return count


def _implied(design: Design, state: State, kinds: list[BallObservations], artefact: int) -> int:
    """Return the same of some kinds, of one artefact."""
    from scipy.sparse import block_array, csr_array, diags_array
    from scipy.sparse.linalg import lsmr
    from scipy.special import chdtr

    d, blocks, residuals = design.dimension, [], []
    for kind in kinds:
        rows = np.flatnonzero(
            (design.balls.artefact[kind.balls[:, 0]] == artefact)
            & np.isin(kind.balls, design.tied_balls).all(axis=1)
        )
        block = kind.rows(design, state, None)
        slope = slopes_apart(design, kind, block.by_ball)[rows]
        columns = d * kind.balls[rows][:, :, None] + np.arange(d)
        places = np.repeat(np.arange(len(rows)), columns[0].size if len(rows) else 0)
        shape = (len(rows), d * len(design.balls.places))
        blocks.append([csr_array((slope.ravel(), (places, columns.ravel())), shape=shape)])
        residuals.append(block.residual[rows])
    matrix, residual = block_array(blocks).tocsr(), np.concatenate(residuals)
    if not len(residual):
        return 0
    matrix = matrix[:, np.flatnonzero(np.abs(matrix).sum(axis=0) > 0.0)]
    sizes = np.sqrt(matrix.power(2).sum(axis=1))
    unit = diags_array(1.0 / np.where(sizes > 0.0, sizes, 1.0)) @ matrix
    # Squares keep eight digits of the ratio of singular values, of which four are needed.
    squares = eigvalsh((unit.T @ unit).toarray())
    others = len(residual) - int((squares > UNSEEN**2 * squares[-1]).sum())
    left = residual - matrix @ lsmr(matrix, residual, atol=1e-12, btol=1e-12, conlim=0.0)[0]
    square = float(left @ left)
    return round(others - square) if others and chdtr(others, square) < AGREEING else 0
