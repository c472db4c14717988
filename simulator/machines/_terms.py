"""Functions of three variables on [0, 1]^3, the terms of the empirical error model.

Products of one univariate function along each axis (redundancy-free sums, plain sums, quadratics,
full tensor products) and radial basis functions: NPL Report CISE 15/98, sections 2.1.1, 2.1.2 and
5.3, which does not prescribe the radial function.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from ballplate.simulator.geometry.ball_layouts import even_grid
from ballplate.simulator.inputs.number_arrays import Array

from ._basis_settings import VARIABLES, RadialName
from .bases import Basis, Monomial, Quoted, whole_values


@dataclass(frozen=True)
class Products:
    """Products of univariate functions: `factors` (terms, 3) index 1, t and the interior functions
    of an axis.

    >>> from .spline_basis import Spline
    >>> sums(Spline(3)).names[:8]
    ('1', 'x', 'y', 'z', 'x*y', 'x*z', 'y*z', 's1(x)')
    """

    axes: tuple[Basis, Basis, Basis]
    factors: tuple[tuple[int, int, int], ...]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names such as 1, x*y and s2(x)*z, with s1, s2, ... the interior functions."""
        written = []
        for indices in self.factors:
            parts = [
                variable if index == 1 else f"s{index - 1}({variable})"
                for variable, index in zip(VARIABLES, indices, strict=True)
                if index
            ]
            # The function of higher degree first, as in s1(z)*x.
            parts.sort(key=len, reverse=True)
            written.append("*".join(parts) or "1")
        return tuple(written)

    @cached_property
    def _by_axis(self) -> tuple[list[int], ...]:
        return tuple([indices[axis] for indices in self.factors] for axis in range(3))

    def values(self, t: Array) -> Array:
        """Return the functions at scaled positions t (m, 3), as (m, number of functions)."""
        result = whole_values(self.axes[0], t[:, 0])[:, self._by_axis[0]]
        for axis in (1, 2):
            result *= whole_values(self.axes[axis], t[:, axis])[:, self._by_axis[axis]]
        return result

    def quoted(self) -> Quoted:
        """Return coefficients of monomials; splines remain unchanged, with t and 1 among them."""
        from .spline_basis import Spline

        if all(isinstance(axis, Spline) for axis in self.axes):
            return Quoted(self.names, np.eye(len(self.names)))
        by_axis = list(map(_quoted, self.axes, VARIABLES))
        rows = {}
        for powers in product(*(range(len(quoted.names)) for quoted in by_axis)):
            row = np.array(
                [
                    np.prod(
                        [
                            quoted.matrix[power, index]
                            for quoted, power, index in zip(by_axis, powers, term, strict=True)
                        ]
                    )
                    for term in self.factors
                ]
            )
            if row.any():
                names = [
                    quoted.names[power].removesuffix("^1")
                    for quoted, power in zip(by_axis, powers, strict=True)
                ]
                rows["*".join(filter(None, names)) or "1"] = row
        matrix = np.array(list(rows.values())).reshape(len(rows), len(self.factors))
        return Quoted(tuple(rows), matrix)


def _quoted(basis: Basis, variable: str) -> Quoted:
    """Return 1, the variable and its interior functions by monomials, or as splines."""
    from .spline_basis import Spline

    if not isinstance(basis, Spline):
        return basis.quoted_whole(variable)
    size = basis.interior().size
    names = ("", variable, *(f"s{k + 1}({variable})" for k in range(size)))
    return Quoted(names, np.eye(2 + size))


def _axes(bases: tuple[Basis, ...]) -> tuple[tuple[Basis, Basis, Basis], list[range]]:
    """Return the families of x, y and z, of three or of one for all, and indices of the functions
    of each.
    """
    x, y, z = bases * (3 // len(bases))
    return (x, y, z), [range(2 + basis.interior().size) for basis in (x, y, z)]


def sums(*bases: Basis) -> Products:
    """Return sums of tensor products without redundancy: 1, x, y, z, xy, xz, yz and, for each
    interior function s and variable such as x, s(x), s(x) y, s(x) z.

    `bases` are one family for all axes or those of x, y and z.

    >>> from .spline_basis import Spline
    >>> sums(Spline(3), Monomial(2), Monomial(2)).names[7:]
    ('s1(x)', 's1(x)*y', 's1(x)*z')
    """
    axes, indices = _axes(bases)
    # Products of each axis's functions with linear factors have some of these terms in common: xy
    # is among those of x and of y. That is the redundancy of NPL Report CISE 15/98, equation (4).
    # Here they are listed once, and each axis adds its interior functions alone.
    factors = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1)]
    for axis in range(3):
        across = [k for k in range(3) if k != axis]
        for index in indices[axis][2:]:
            for linear in (None, *across):
                term = [0, 0, 0]
                term[axis] = index
                if linear is not None:
                    term[linear] = 1
                factors.append((term[0], term[1], term[2]))
    return Products(axes, tuple(factors))


def univariate(*bases: Basis) -> Products:
    """Return plain sums of univariate functions: 1, x, y, z and the interior functions of each.

    >>> from .spline_basis import Spline
    >>> univariate(Spline(3)).names
    ('1', 'x', 'y', 'z', 's1(x)', 's1(y)', 's1(z)')
    """
    axes, indices = _axes(bases)
    units = np.eye(3, dtype=int)
    rows = [np.zeros(3, int), *units]
    rows += [index * unit for unit, own in zip(units, indices, strict=True) for index in own[2:]]
    return Products(axes, tuple((int(i), int(j), int(k)) for i, j, k in rows))


def no_terms() -> Products:
    """Return no functions."""
    return Products(_axes((Monomial(2),))[0], ())


def quadratic() -> Products:
    """Return all polynomials of degree 2: 1, x, y, z, xy, xz, yz and s(x) = x - x^2, s(y),
    s(z).
    """
    products = tensor(Monomial(3))
    factors = sorted(
        (term for term in products.factors if sum(term) <= 2),
        key=lambda term: (max(term), sum(term)),
    )
    return Products(products.axes, tuple(factors))


def tensor(*bases: Basis) -> Products:
    """Return all products of a function of x, one of y and one of z."""
    axes, (x, y, z) = _axes(bases)
    return Products(axes, tuple(product(x, y, z)))


def _thin_plate(squared: Array, constant: float) -> Array:
    """Return r^2 log r of r^2; zero at r = 0."""
    return 0.5 * squared * np.log(np.where(squared == 0.0, 1.0, squared))


RADIAL: dict[str, Callable[[Array, float], Array]] = {
    "multiquadric": lambda squared, constant: np.sqrt(squared + constant**2),
    "inverse multiquadric": lambda squared, constant: 1.0 / np.sqrt(squared + constant**2),
    "gaussian": lambda squared, constant: np.exp(-squared / constant**2),
    "thin plate": _thin_plate,
    "linear": lambda squared, constant: np.sqrt(squared),
    "cubic": lambda squared, constant: squared * np.sqrt(squared),
}
"""Radial functions of r^2 and a constant.

Up to sign, each is definite on coefficients orthogonal to linear polynomials: interpolation at
centres that are not coplanar has one solution.
"""


@dataclass(frozen=True)
class Radial:
    """Interpolants of radial functions and a linear polynomial, by their values at centres.

    The centres are a regular grid over the volume, corners included. A function's coefficients are
    its values at the centres; the radial functions' coefficients are orthogonal to linear
    polynomials, so that linear functions are reproduced exactly. Distances and `constant` are in
    fractions of the volume.

    >>> Radial((2, 2, 2), 0.5).names[:2]
    ('at (0, 0, 0)', 'at (0, 0, 1)')
    """

    grid: tuple[int, int, int]
    constant: float
    function: RadialName = "multiquadric"

    @cached_property
    def centres(self) -> Array:
        """Centres (n, 3)."""
        return even_grid(np.zeros(3), np.ones(3), self.grid)

    @property
    def names(self) -> tuple[str, ...]:
        """Names such as at (0, 0.5, 1)."""
        return tuple(
            "at ({})".format(", ".join(f"{value:.4g}" for value in centre))
            for centre in self.centres
        )

    def _functions(self, t: Array) -> tuple[Array, Array]:
        distance = ((t[:, None, :] - self.centres) ** 2).sum(axis=2)
        kernel = RADIAL[self.function](distance, self.constant)
        return kernel, np.column_stack([np.ones(len(t)), t])

    @cached_property
    def _weights(self) -> tuple[Array, Array]:
        """Coefficients of the radial functions (n, n) and of 1, x, y, z (4, n) per value at a
        centre.
        """
        # Values at the centres are K r + L c, with L' r = 0. With an orthonormal basis N of what is
        # orthogonal to the linear polynomials L, r = N s: N' K N s is N' times the values, and c
        # follows from the rest. K itself may be singular or indefinite, N' K N is definite up to
        # sign.
        kernel, linear = self._functions(self.centres)
        q, r = np.linalg.qr(linear, mode="complete")
        null = q[:, 4:]
        radial = null @ np.linalg.solve(null.T @ kernel @ null, null.T)
        return radial, np.linalg.solve(r[:4], q[:, :4].T @ (np.eye(len(kernel)) - kernel @ radial))

    def values(self, t: Array) -> Array:
        """Return the functions at scaled positions t (m, 3), as (m, number of functions)."""
        kernel, linear = self._functions(t)
        radial, polynomial = self._weights
        return kernel @ radial + linear @ polynomial

    def quoted(self) -> Quoted:
        """Return the values at the centres."""
        return Quoted(self.names, np.eye(len(self.names)))


Terms = Products | Radial
"""Linearly independent functions of a position."""
