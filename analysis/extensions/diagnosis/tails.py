"""Logarithms of tail probabilities of sums of squares, which may underflow."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.machines import Array

# Smaller probabilities come from the leading term of their series.
SMALLEST = 1e-280


def log_chance(
    square: Array | float, total: float, dimensions: Array | float, freedom: float, given: bool
) -> Array:
    """Return logarithms (k,) of the p-value of a sum of squares in `dimensions` of the residuals'
    `freedom`.

    With `given` sigma by chi-squared of `square`; otherwise by Fisher's F of its share in `total`.

    >>> log_chance(np.array([3.841459]), 100.0, 1.0, 90.0, True).round(6)
    array([-2.995732])
    >>> log_chance(np.array([4.0]), 94.0, 1.0, 91.0, False).round(4)
    array([-3.0259])
    """
    from scipy.special import betainc, betaln, chdtrc, gammaln

    square, q = np.broadcast_arrays(np.asarray(square, float), np.asarray(dimensions, float))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        if given:
            chance = chdtrc(q, square)
            half = 0.5 * square
            # Gamma(a, h) = h^(a-1) exp(-h) (1 + (a-1)/h + ...) < that / (1 - (a-1)/h).
            leading = (0.5 * q - 1.0) * np.log(half) - half - gammaln(0.5 * q)
            leading -= np.log1p(-np.clip((0.5 * q - 1.0) / half, 0.0, 0.5))
        else:
            a, b = 0.5 * (freedom - q), 0.5 * q
            remaining_share = np.clip(1.0 - square / total, 1e-300, 1.0)
            chance = betainc(np.maximum(a, 1e-9), b, remaining_share)
            leading = (
                a * np.log(remaining_share)
                + b * np.log1p(-remaining_share)
                - np.log(a)
                - betaln(a, b)
            )
        logarithm = np.where(chance > SMALLEST, np.log(np.maximum(chance, SMALLEST)), leading)
    return np.where((q <= 0) | (freedom - q < 1) & (not given), 0.0, np.minimum(logarithm, 0.0))
