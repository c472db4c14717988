"""A spline as polynomials, one for each piece, for a controller that evaluates these only.

NISTIR 6517, equations (27) to (33), has them in powers of x itself. Far from x = 0 their terms are
larger than their sum and cancel, so powers of the distance from the start of the piece are
preferable.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb
from typing import Literal

import numpy as np

from ..inputs.number_arrays import Array
from .spline_fit import SplineFit

Powers = Literal["local", "global"]
"""Of x less the start of the piece, or of x itself."""


@dataclass(frozen=True)
class Pieces:
    """`coefficients` (pieces, order) of 1, x, x², … from each of `breaks` (pieces + 1,) to the
    next.
    """

    breaks: Array
    coefficients: Array
    powers: Powers

    def values(self, x: Array) -> Array:
        """The polynomials at x (m,), those of the first and the last piece beyond the ends."""
        piece = np.clip(np.searchsorted(self.breaks, x, "right") - 1, 0, len(self.coefficients) - 1)
        u = x - self.breaks[piece] if self.powers == "local" else np.asarray(x, dtype=float)
        results = np.zeros(len(u))
        for k in range(self.coefficients.shape[1] - 1, -1, -1):
            results = results * u + self.coefficients[piece, k]
        return results

    def cancellation(self) -> float:
        """The largest sum of absolute terms over the curve's largest value: how many times rounding
        is magnified.
        """
        x = np.unique(np.linspace(self.breaks[:-1], self.breaks[1:], 17))
        return float(np.abs(_absolute(self, x)).max() / np.abs(self.values(x)).max())


def pieces(fitted: SplineFit, powers: Powers = "local") -> Pieces:
    """The fitted curve in powers of x less the start of each piece, or of x, in metres and
    radians.
    """
    space = fitted.space
    scale = space.length ** -np.arange(space.order)
    local = (space.pieces @ fitted.coefficients) * scale
    if powers == "local":
        return Pieces(space.breaks, local, powers)
    shifted = np.zeros_like(local)
    start = space.breaks[:-1]
    for k in range(space.order):
        for j in range(k + 1):
            shifted[:, j] += local[:, k] * comb(k, j) * (-start) ** (k - j)
    return Pieces(space.breaks, shifted, powers)


def _absolute(pieces: Pieces, x: Array) -> Array:
    piece = np.clip(np.searchsorted(pieces.breaks, x, "right") - 1, 0, len(pieces.coefficients) - 1)
    u = np.abs(x - pieces.breaks[piece] if pieces.powers == "local" else x)
    return sum(
        np.abs(pieces.coefficients[piece, k]) * u**k for k in range(pieces.coefficients.shape[1])
    )
