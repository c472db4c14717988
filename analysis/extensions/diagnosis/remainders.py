"""Residuals and biases that remain after the estimate and the removal of suspects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.computing import eigh, svd
from ballplate.simulator.design import Design, shared_layout
from ballplate.simulator.estimation import Linearisation
from ballplate.simulator.machines import Array, Integers

from .hat import hat_rows, row_count, whitened_residuals

if TYPE_CHECKING:
    from scipy.sparse import csc_array, csr_array

# Directions with at most this share in the residuals are not tested.
HIDDEN = 1e-8

# Entries of the root of the hat matrix; with the tests, each needs some 95 bytes.
MOST_ENTRIES = 20_000_000


@dataclass(frozen=True)
class Leftover:
    """Whitened residuals (n,), orthogonal to the columns of Q, the root of the hat matrix.

    Rows of Q have a part `common` (n, r) and a part `own` (n, d) in the columns of `ball` (n,), -1
    without one. Removed directions are further columns of `common`. `freedom` are the degrees of
    freedom.
    """

    residual: Array
    common: Array
    own: Array
    ball: Integers
    balls: int
    freedom: int

    @property
    def sum_of_squares(self) -> float:
        return float(self.residual @ self.residual)

    def of(self, columns: Array) -> Array:
        """Return the remainder of biases (n, k)."""
        own = self.own_columns
        return columns - self.common @ (self.common.T @ columns) - own @ (own.T @ columns)

    def without(self, columns: Array) -> Leftover:
        """Return the remainder after removal of the visible biases among (n, k)."""
        unit = orthonormal(self.of(columns), np.linalg.norm(columns, axis=0))
        residual = self.residual - unit @ (unit.T @ self.residual)
        common = np.concatenate([self.common, unit], axis=1)
        return replace(self, residual=residual, common=common, freedom=self.freedom - unit.shape[1])

    @cached_property
    def own_columns(self) -> csr_array:
        """Parts of single balls as a matrix (n, balls d)."""
        return columns_of_balls(self.own, self.ball, self.balls)


def columns_of_balls(own: Array, ball: Integers, balls: int) -> csr_array:
    """Return a matrix (n, balls d) of parts `own` (n, d) in the columns of `ball` (n,), -1
    without one.
    """
    from scipy.sparse import csr_array

    d = own.shape[1]
    rows = np.flatnonzero(ball >= 0)
    columns = d * ball[rows][:, None] + np.arange(d)
    entries = (own[rows].ravel(), (np.repeat(rows, d), columns.ravel()))
    return csr_array(entries, shape=(len(ball), d * balls))


def entries(design: Design) -> tuple[int, int]:
    """Return the number of rows of all observations, and of columns that they may have in common.

    Those are the shared parameters and the co-ordinates of balls that certificates of distances tie
    together.
    """
    shared = len(design.once(shared_layout))
    return row_count(design), shared + design.dimension * len(design.tied_balls)


def too_many_entries(design: Design) -> str:
    """Return why the memory does not suffice for tests of gross errors; otherwise empty."""
    rows, columns = entries(design)
    if rows * columns <= MOST_ENTRIES:
        return ""
    return (
        f"{rows} observations, each co-ordinate counted, are too many to test for gross errors; at"
        f" most {MOST_ENTRIES // columns} are possible with {columns} parameters of machine, poses"
        " and tied balls"
    )


def orthonormal(remainder: Array, size: Array, most: int | None = None) -> Array:
    """Return an orthonormal basis (n, q) of the remainder (n, k) of columns of some size (k,).

    With `most`, it has only that number of the most visible directions.
    """
    use = size > 0.0
    u, values, _ = svd(remainder[:, use] / size[use], full_matrices=False)
    return u[:, values**2 > HIDDEN][:, :most]


def leftover(linearisation: Linearisation, x: Array | None, freedom: int) -> Leftover:
    """Return the residuals of an estimate from scale readings x (readings, d), or error-free
    ones, to first order.
    """
    design = linearisation.design
    n, d = row_count(design), design.dimension
    common, own, ball = (
        np.zeros((n, linearisation.balls.common.shape[2])),
        np.zeros((n, d)),
        np.full(n, -1),
    )
    for some in hat_rows(linearisation, x):
        common[some.rows], own[some.rows], ball[some.rows] = some.common, some.own, some.ball
    residual = whitened_residuals(design, linearisation.state, x)
    start = Leftover(residual, common, own, ball, len(design.balls.places), freedom)
    return replace(start, residual=start.of(residual[:, None])[:, 0])


@dataclass(frozen=True)
class Explained:
    """Sums of squares (g,) that groups of columns explain, in `dimensions` (g,)."""

    square: Array
    dimensions: Array


class Columns:
    """Products of the columns of a sparse matrix (n, k) with residuals and with the root of the hat
    matrix.

    `groups` are arrays (g, q) of columns that are tested together.
    """

    information: Array

    def __init__(
        self,
        matrix: csc_array,
        groups: Sequence[Integers],
        remainder: Leftover,
    ) -> None:
        self.rows = matrix.T.tocsr()
        self.square = np.asarray(self.rows.power(2).sum(axis=1)).ravel()
        self.size = np.sqrt(np.maximum(self.square, np.finfo(float).tiny))
        common = self.rows @ remainder.common
        own = (self.rows @ remainder.own_columns).tocsr()
        private = np.asarray(own.power(2).sum(axis=1)).ravel()
        self._information = self.square - (common**2).sum(axis=1) - private
        self._width = remainder.common.shape[1]
        self._grams = [
            self._gram(index, common, own) if index.shape[1] > 1 else None for index in groups
        ]
        self.groups = groups
        self.update(remainder)

    def update(self, remainder: Leftover) -> None:
        """Compute the products with another remainder of the same estimate."""
        self.product = np.asarray(self.rows @ remainder.residual)
        self.further = np.asarray(self.rows @ remainder.common[:, self._width :])
        information = self._information - (self.further**2).sum(axis=1)
        shows = information > HIDDEN * self.square
        self.information = np.where(shows, information, 0.0)

    def tests(self) -> int:
        """Return the number of groups that can be tested."""
        return sum(
            int((self.explained(number).dimensions > 0).sum()) for number in range(len(self.groups))
        )

    def statistics(self) -> Array:
        """Return estimated biases (k,) in their standard uncertainties, 0 if untestable."""
        can = self.information > 0.0
        return np.where(can, self.product / np.sqrt(np.where(can, self.information, 1.0)), 0.0)

    def _gram(self, index: Integers, common: Array, own: csr_array) -> Array:
        """Return products (g, q, q) of the remainders of the columns of groups (g, q), in units
        of their sizes.
        """
        g, q = index.shape
        scaled = common[index] / self.size[index][:, :, None]
        gram = -scaled @ scaled.transpose(0, 2, 1)
        first, second = np.triu_indices(q)
        left_columns, right_columns = index[:, first], index[:, second]

        def products(matrix: csr_array) -> Array:
            elementwise = matrix[left_columns.ravel()].multiply(matrix[right_columns.ravel()])
            return np.asarray(elementwise.sum(axis=1)).reshape(left_columns.shape)

        values = (products(self.rows) - products(own)) / (
            self.size[left_columns] * self.size[right_columns]
        )
        gram[:, first, second] += values
        is_beside = first != second
        gram[:, second[is_beside], first[is_beside]] += values[:, is_beside]
        return gram

    def explained(self, number: int) -> Explained:
        """Return the sums of squares of the groups of some number."""
        index, gram = self.groups[number], self._grams[number]
        if gram is None:
            single = index[:, 0]
            return Explained(
                self.statistics()[single] ** 2, (self.information[single] > 0.0).astype(float)
            )
        further = self.further[index] / self.size[index][:, :, None]
        values, vectors = eigh(gram - further @ further.transpose(0, 2, 1))
        along = np.einsum("gij,gi->gj", vectors, self.product[index] / self.size[index])
        is_visible = values > HIDDEN
        square = np.where(is_visible, along**2 / np.where(is_visible, values, 1.0), 0.0).sum(axis=1)
        return Explained(square, is_visible.sum(axis=1).astype(float))
