"""What a fitted map tells of its machine in another campaign."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..machines.protocol import Array, Integers
from .fitted_map import FittedMap, determined_only

# Standard deviations below this part of the largest are rounding, and have this size.
LEAST = 1e-9


@dataclass(frozen=True, eq=False)
class MapMarginal:
    """Some of what a map holds: `estimates` (m,), their `covariance` (m, m), `undetermined`
    directions (m, k) and `scale` (m,), as in the map.
    """

    estimates: Array
    covariance: Array
    undetermined: Array
    scale: Array


def marginal_of(fitted: FittedMap, kept: Integers) -> MapMarginal:
    """The marginal of the parameters `kept` (m,), by their places in b."""
    scale = fitted.scale[kept]
    return MapMarginal(
        fitted.estimates[kept],
        fitted.covariance[np.ix_(kept, kept)],
        determined_only(fitted.undetermined[kept], scale),
        scale,
    )


def determined_combinations(
    known: MapMarginal, inflation: float = 1.0, drift: float = 0.0
) -> tuple[Array, Array, Array]:
    """Combinations of parameters of which a map tells values that are not correlated: rows (r, m),
    the values (r,) and their standard uncertainties (r,), in metres.

    There is one for each direction that the map determines, across all that it does not.
    Uncertainties are `inflation` times those of the map, and each parameter has moved by a random
    `drift` of its effect since, in metres.
    """
    spread = known.covariance / np.outer(known.scale, known.scale)
    null = known.undetermined / known.scale[:, None]
    m, k = null.shape
    across = np.linalg.qr(null, mode="complete")[0][:, k:] if k else np.eye(m)
    variances, vectors = np.linalg.eigh(across.T @ spread @ across)
    rows = (across @ vectors).T / known.scale
    least = (LEAST**2) * float(variances.max(initial=0.0))
    variances = inflation**2 * np.maximum(variances, least) + drift**2
    return rows, rows @ known.estimates, np.sqrt(variances)
