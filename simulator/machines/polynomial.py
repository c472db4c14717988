"""Univariate polynomials on [0, 1] in a stable basis that meets its end conditions by construction."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev, polynomial

from .protocol import Array


@dataclass(frozen=True)
class Polynomial:
    """Polynomials with `coefficients` coefficients, the constant counted, that vanish at 0.

    With `zero_at_one` they vanish at 1 as well. The basis is t T_k(2t - 1), or t (1 - t) T_k(2t - 1),
    with T_k the Chebyshev polynomials, which stays well conditioned at degrees where monomials do not
    (NPL Report CISE 15/98, section 2.6).

    >>> Polynomial(5).size, Polynomial(5, zero_at_one=True).size
    (4, 3)
    """

    coefficients: int
    zero_at_one: bool = False

    @property
    def size(self) -> int:
        """Number of free coefficients."""
        return max(self.coefficients - 1 - int(self.zero_at_one), 0)

    def values(self, t: Array) -> Array:
        """Basis functions at t (m,), as (m, size)."""
        envelope = t * (1.0 - t) if self.zero_at_one else t
        if self.size == 0:
            return np.zeros((len(t), 0))
        return np.asarray(chebyshev.chebvander(2.0 * t - 1.0, self.size - 1) * envelope[:, None])

    @cached_property
    def monomials(self) -> Array:
        """Matrix (coefficients - 1, size) from this basis to the monomials t, t^2, ... on [0, 1].

        >>> Polynomial(3).monomials
        array([[ 1., -1.],
               [ 0.,  2.]])
        """
        envelope = [0.0, 1.0, -1.0] if self.zero_at_one else [0.0, 1.0]
        matrix = np.zeros((max(self.coefficients - 1, 0), self.size))
        for k in range(self.size):
            in_s = chebyshev.cheb2poly([0.0] * k + [1.0])
            in_t = np.array([0.0])
            for power, coefficient in enumerate(in_s):
                in_t = polynomial.polyadd(in_t, coefficient * polynomial.polypow([-1.0, 2.0], power))
            product = polynomial.polymul(in_t, envelope)
            matrix[: len(product) - 1, k] = product[1:]
        return matrix
