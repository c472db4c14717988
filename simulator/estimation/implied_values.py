"""Certified values that follow from others, and so have no errors of their own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.computing.numerics import eigvalsh
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.balls import BallObservations, slopes_apart
from ballplate.simulator.design.state import State
from ballplate.simulator.inputs.number_arrays import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Probability with which measured values contradict each other as little as computed ones.
AGREEING = 1e-2

# Singular values, in parts of the largest one, of motions that do not change values.
UNSEEN = 1e-4

# Standard uncertainty (m) of values without one.
LEAST = 1e-9


def implied_count(design: Design, state: State) -> int:
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
    tying = [number for number, kind in enumerate(kinds) if kind.balls.shape[1] > 1]
    if not tying:
        return 0
    from scipy.sparse import csr_array, vstack

    d, blocks, residuals, numbers, artefacts = design.dimension, [], [], [], []
    for number, kind in enumerate(kinds):
        rows = np.flatnonzero(np.isin(kind.balls, design.tied_balls).all(axis=1))
        block, balls = kind.rows(design, state, None), kind.balls[rows]
        slope = slopes_apart(design, kind, block.by_ball)[rows]
        columns = d * balls[:, :, None] + np.arange(d)
        ends = np.arange(len(rows) + 1) * d * balls.shape[1]
        shape = (len(rows), d * len(design.balls.places))
        blocks.append(csr_array((slope.ravel(), columns.ravel(), ends), shape=shape))
        residuals.append(block.residual[rows])
        numbers.append(np.full(len(rows), number))
        artefacts.append(design.balls.artefact[balls[:, 0]])
    matrix, residual = vstack(blocks, format="csr"), np.concatenate(residuals)
    of_kind, artefact = np.concatenate(numbers), np.concatenate(artefacts)
    # Each kind is judged on its own as well as all together: values of one kind may be computed
    # from one another, while the errors of another kind hide that in the common sum.
    count = 0
    for one in np.unique(artefact):
        here = artefact == one
        groups = [here] if len(kinds) == 1 else [here, *(here & (of_kind == k) for k in tying)]
        count += max(_implied(matrix[group], residual[group]) for group in groups if group.any())
    return count


def _implied(matrix: csr_array, residual: Array) -> int:
    """Return the same of some rows: derivatives by the balls (m, n d) with residuals (m,)."""
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import lsmr
    from scipy.special import chdtr

    # Least squares of the balls' places, with certified values only. Independent errors leave a sum
    # of squares with the chi-squared distribution, of as many degrees of freedom as there are
    # values beyond the rank. A sum so small that measured values have it in one of a hundred cases
    # means values that were computed from others. These add no degrees of freedom.
    matrix = matrix[:, np.flatnonzero(np.abs(matrix).sum(axis=0) > 0.0)]
    sizes = np.sqrt(matrix.power(2).sum(axis=1))
    # Rows of unit length: the rank must not depend on uncertainties that differ widely.
    unit = diags_array(1.0 / np.where(sizes > 0.0, sizes, 1.0)) @ matrix
    # Squares keep eight digits of the ratio of singular values, of which four are needed.
    squares = eigvalsh((unit.T @ unit).toarray())
    others = len(residual) - int((squares > UNSEEN**2 * squares[-1]).sum())
    left = residual - matrix @ lsmr(matrix, residual, atol=1e-12, btol=1e-12, conlim=0.0)[0]
    square = float(left @ left)
    return round(others - square) if others and chdtr(others, square) < AGREEING else 0
