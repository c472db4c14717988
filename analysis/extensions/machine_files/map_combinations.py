"""What a map determines: uncorrelated combinations of its parameters, and the sigma of its
campaign.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing import eigh
from ballplate.simulator.experiment import LEAST_SIGMA, EarlierCampaign
from ballplate.simulator.machines import Array, Integers

from .fitted_map import FittedMap, determined_only

# Standard deviations below this part of the largest are rounding, and have this size.
LEAST = 1e-9


def campaign_of(fitted: FittedMap, file: str) -> EarlierCampaign:
    """The campaign of a map."""
    freedom = fitted.degrees_of_freedom
    is_rounding = fitted.sum_of_squares < LEAST_SIGMA**2 * freedom
    squares = None if is_rounding else fitted.sum_of_squares
    return EarlierCampaign(file, fitted.sigma, freedom, squares, fitted.lack_of_fit.caution)


@dataclass(frozen=True, eq=False)
class MapMarginal:
    """Part of a map: `estimates` (m,), their `covariance` (m, m), `undetermined` directions (m, k)
    and `scale` (m,), as in the map.
    """

    estimates: Array
    covariance: Array
    undetermined: Array
    scale: Array


def marginal_of(fitted: FittedMap, kept_indices: Integers) -> MapMarginal:
    """Return the marginal of parameters by their indices (m,) in b."""
    scale = fitted.scale[kept_indices]
    return MapMarginal(
        fitted.estimates[kept_indices],
        fitted.covariance[np.ix_(kept_indices, kept_indices)],
        determined_only(fitted.undetermined[kept_indices], scale),
        scale,
    )


def determined_combinations(marginal: MapMarginal) -> tuple[Array, Array, Array]:
    """Return uncorrelated combinations of parameters that a map determines: rows (r, m), the
    values (r,) and their standard uncertainties (r,), in metres.

    There is one for each determined direction, across all undetermined ones.
    """
    spread = marginal.covariance / np.outer(marginal.scale, marginal.scale)
    null = marginal.undetermined / marginal.scale[:, None]
    m, k = null.shape
    across = np.linalg.qr(null, mode="complete")[0][:, k:] if k else np.eye(m)
    variances, vectors = eigh(across.T @ spread @ across)
    rows = (across @ vectors).T / marginal.scale
    least = (LEAST**2) * float(variances.max(initial=0.0))
    return rows, rows @ marginal.estimates, np.sqrt(np.maximum(variances, least))
