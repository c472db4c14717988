"""Univariate functions on [0, 1]: Chebyshev polynomials, monomials and B-splines behind one
protocol.

Every family contains 1, t or a substitute for t, and interior functions, which vanish at both
ends. An error function that is zero at 0 uses those that vanish there; one that is zero at both
ends uses the interior functions alone. So end conditions hold by construction, as do zero slopes
and periodic ends. Other slopes would not survive multiplication by a coefficient; fits in
`simulator/splines` have them. NPL Report CISE 15/98, section 2.1.1, has the families, section 2.6
the ill-conditioning of monomials at high degrees.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Literal, Protocol

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array
from numpy.polynomial import chebyshev, polynomial


@dataclass(frozen=True)
class Quoted:
    """Functions in the form usual in the field: `matrix` (names, functions) gives the coefficients
    of `names`.
    """

    names: tuple[str, ...]
    matrix: Array


class Basis(Protocol):
    """Functions that vanish at 0 and, with `zero_at_one`, at 1."""

    def __hash__(self) -> int: ...

    @property
    def zero_at_one(self) -> bool: ...

    @property
    def size(self) -> int:
        """Number of functions."""
        ...

    def values(self, t: Array) -> Array:
        """Return the functions at t (m,), as (m, size)."""
        ...

    def interior(self) -> Basis:
        """Return the interior functions of the family."""
        ...

    def quoted(self, variable: str = "t") -> Quoted:
        """Return the functions by monomials or B-splines that are not zero throughout."""
        ...

    def quoted_whole(self, variable: str = "t") -> Quoted:
        """Return 1, t and the interior functions by monomials or B-splines."""
        ...


def whole_values(basis: Basis, t: Array) -> Array:
    """Return the whole family at t (m,): 1, t and the interior functions as columns.

    >>> whole_values(Polynomial(3), np.array([0.5]))
    array([[1.  , 0.5 , 0.25]])
    """
    return np.column_stack([np.ones_like(t), t, basis.interior().values(t)])


def power(variable: str, exponent: int) -> str:
    """Return the name of a monomial.

    >>> power("t", 1), power("x", 2)
    ('t^1', 'x^2')
    """
    return f"{variable}^{exponent}"


class SingleFunction:
    """A basis of one stated function; `kind` is its source."""

    kind: ClassVar[str]

    @property
    def zero_at_one(self) -> bool:
        return False

    @property
    def size(self) -> int:
        return 1

    def interior(self) -> Basis:
        raise TypeError(f"a {self.kind} function is a single one")

    def quoted(self, variable: str = "t") -> Quoted:
        """Return the function unchanged."""
        return Quoted((f"as {self.kind}",), np.eye(1))

    def quoted_whole(self, variable: str = "t") -> Quoted:
        raise TypeError(f"a {self.kind} function is a single one")


@dataclass(frozen=True)
class Polynomial:
    """Polynomials with `coefficients` coefficients, the constant included: t T_k(2t - 1), or t (1 -
    t) T_k(2t - 1), with T_k the Chebyshev polynomials, stable at any degree.

    >>> Polynomial(5).size, Polynomial(5, zero_at_one=True).size
    (4, 3)
    """

    coefficients: int
    zero_at_one: bool = False

    @property
    def size(self) -> int:
        """Number of free coefficients."""
        return max(self.coefficients - 1 - int(self.zero_at_one), 0)

    def interior(self) -> Basis:
        """Return the functions that vanish at both ends."""
        return replace(self, zero_at_one=True)

    def quoted(self, variable: str = "t") -> Quoted:
        """Return coefficients of t, t^2, ..."""
        return Quoted(
            tuple(power(variable, k + 1) for k in range(len(self.monomials))), self.monomials
        )

    def quoted_whole(self, variable: str = "t") -> Quoted:
        """Return coefficients of 1, t, t^2, ... for 1, t and the interior functions."""
        inner = self.interior().quoted().matrix
        matrix = np.zeros((max(self.coefficients, 2), 2 + inner.shape[1]))
        matrix[0, 0] = matrix[1, 1] = 1.0
        matrix[1 : len(inner) + 1, 2:] = inner
        return Quoted(("", *(power(variable, k) for k in range(1, len(matrix)))), matrix)

    def values(self, t: Array) -> Array:
        """Return the functions at t (m,), as (m, size)."""
        envelope = t * (1.0 - t) if self.zero_at_one else t
        if self.size == 0:
            return np.zeros((len(t), 0))
        s = 2.0 * t - 1.0
        columns = [np.ones_like(s), s][: self.size]
        while len(columns) < self.size:
            columns.append(2.0 * s * columns[-1] - columns[-2])
        return (np.stack(columns) * envelope).T

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
            # T_k as a polynomial of s = 2 t - 1, which is expanded in t and multiplied by the
            # envelope. Results are quoted so, while estimates keep the stable form.
            in_s = chebyshev.cheb2poly([0.0] * k + [1.0])
            in_t = np.array([0.0])
            for power_, coefficient in enumerate(in_s):
                in_t = polynomial.polyadd(
                    in_t, coefficient * polynomial.polypow([-1.0, 2.0], power_)
                )
            product = polynomial.polymul(in_t, envelope)
            matrix[: len(product) - 1, k] = product[1:]
        return matrix


@dataclass(frozen=True)
class Monomial(Polynomial):
    """t^k from k = 1, or t^k (1 - t).

    >>> Monomial(4).values(np.array([0.5])), Monomial(4, zero_at_one=True).values(np.array([0.5]))
    (array([[0.5  , 0.25 , 0.125]]), array([[0.25 , 0.125]]))
    """

    def values(self, t: Array) -> Array:
        """Return the functions at t (m,), as (m, size)."""
        envelope = 1.0 - t if self.zero_at_one else np.ones_like(t)
        return t[:, None] ** np.arange(1, self.size + 1) * envelope[:, None]

    @cached_property
    def monomials(self) -> Array:
        """Matrix (coefficients - 1, size) from this basis to the monomials t, t^2, ..."""
        matrix = np.eye(max(self.coefficients - 1, 0), self.size)
        if self.zero_at_one:
            matrix -= np.eye(*matrix.shape, k=-1)
        return matrix


Ends = Literal["free", "zero slope at start", "zero slope at end", "zero slopes", "periodic"]
"""End conditions of a spline at 0 and 1, beyond its value."""
# Derivatives grow with the inverse of the distance, and are compared between the ends.
SMALLEST_PIECE = 1e-4
