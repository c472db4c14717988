"""A word for the shape of a curve."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.computing.numerics import lstsq
from ballplate.simulator.machines.protocol import Array

# Highest degree of polynomial tried for a curve before it is called irregular.
HIGHEST = 10

SHAPES = {1: "linear", 2: "quadratic", 3: "cubic"}


def shape(t: Array, values: Array) -> str:
    """Return a word for a curve's shape: the lowest degree of polynomial, up to 10, that describes
    it; empty for a constant.

    >>> t = np.linspace(0, 1, 50)
    >>> shape(t, 3 * t), shape(t, t - t**2), shape(t, t**5), shape(t, 0 * t + 2)
    ('linear', 'quadratic', 'of degree 5', '')
    """
    if not np.ptp(values):
        return ""
    basis = np.asarray(np.polynomial.chebyshev.chebvander(2 * t - 1, HIGHEST), float)
    size = float(np.abs(values).max())
    for degree in range(1, HIGHEST + 1):
        part = basis[:, : degree + 1]
        residual = values - part @ lstsq(part, values, rcond=None)[0]
        if np.abs(residual).max() <= 1e-3 * size:
            return SHAPES.get(degree, f"of degree {degree}")
    return "irregular"
