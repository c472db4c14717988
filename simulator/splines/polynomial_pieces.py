"""A spline as polynomials, one for each piece, for a controller that evaluates these only.

NISTIR 6517, equations (27) to (33), has them in powers of x itself. Far from x = 0 their terms are
larger than their sum and cancel, so powers of the distance from the start of the piece are
preferable.
"""

from __future__ import annotations

from math import comb

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array

from .spline_fit import SplineFit


def pieces(fitted: SplineFit, local: bool = True) -> Array:
    """Return the coefficients (pieces, order) of 1, u, u², … between neighbouring `breaks` of the
    fitted curve's space, in metres and radians: u is x less the start of the piece, or x.
    """
    space = fitted.space
    coefficients = (space.pieces @ fitted.coefficients) * space.length ** -np.arange(space.order)
    if local:
        return coefficients
    shifted = np.zeros_like(coefficients)
    start = space.breaks[:-1]
    for k in range(space.order):
        for j in range(k + 1):
            shifted[:, j] += coefficients[:, k] * comb(k, j) * (-start) ** (k - j)
    return shifted
