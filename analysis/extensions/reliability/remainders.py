"""Residuals and biases that remain after the estimate and the removal of suspects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.design import Design, shared_layout
from ballplate.simulator.estimation import Linearisation
from ballplate.simulator.machines import Array, Integers

from .hat import hat_rows, row_count, whitened_residuals

if TYPE_CHECKING:
    from scipy.sparse import csc_array, csr_array

# A direction of which no more than this share is left in the residuals is not tested.
HIDDEN = 1e-8

# Entries of the root of the hat matrix; with what is tested, some 95 bytes are taken for each.
MOST_ENTRIES = 20_000_000


@dataclass(frozen=True)
class Leftover:
    """Residuals (n,), whitened, orthogonal to the columns of Q, the root of the hat matrix, of
    which rows have a part `common` (n, r) and a part `own` (n, d) in the columns of `ball` (n,), -1
    without one. What has been taken out stands in further columns of `common`. `freedom` are the
    degrees of freedom.
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
        """What is left of biases (n, k)."""
        own = self.own_columns
        return columns - self.common @ (self.common.T @ columns) - own @ (own.T @ columns)

    def without(self, columns: Array) -> Leftover:
        """The same after biases (n, k) have been taken out, those that are not hidden."""
        unit = orthonormal(self.of(columns), np.linalg.norm(columns, axis=0))
        residual = self.residual - unit @ (unit.T @ self.residual)
        common = np.concatenate([self.common, unit], axis=1)
        return replace(self, residual=residual, common=common, freedom=self.freedom - unit.shape[1])

    @cached_property
    def own_columns(self) -> csr_array:
        """The parts of single balls as a matrix (n, balls d)."""
        return columns_of_balls(self.own, self.ball, self.balls)


def columns_of_balls(own: Array, ball: Integers, balls: int) -> csr_array:
    """A matrix (n, balls d) of parts `own` (n, d), each in the columns of its `ball`, if any."""
    from scipy.sparse import csr_array

    d = own.shape[1]
    at = np.flatnonzero(ball >= 0)
    columns = d * ball[at][:, None] + np.arange(d)
    entries = (own[at].ravel(), (np.repeat(at, d), columns.ravel()))
    return csr_array(entries, shape=(len(ball), d * balls))


def entries(design: Design) -> tuple[int, int]:
    """Rows of all observations of a design, and columns that they may have in common.

    Those are the shared parameters and the co-ordinates of balls that certificates of distances tie
    together.
    """
    shared = len(design.once(shared_layout))
    return row_count(design), shared + design.dimension * len(design.tied_balls)


def too_many_entries(design: Design) -> str:
    """Why there is no memory to look for mistakes in so many observations of so many parameters;
    otherwise empty.
    """
    rows, columns = entries(design)
    if rows * columns <= MOST_ENTRIES:
        return ""
    text = (
        f"{rows} observations, each co-ordinate counted, are too many to test for gross errors; at"
        " most "
    )
    return (
        text
        + f"{MOST_ENTRIES // columns} are possible with {columns} parameters of machine, poses and"
        " tied balls"
    )


def orthonormal(left: Array, size: Array, most: int | None = None) -> Array:
    """An orthonormal basis (n, q) of what is left (n, k) of columns of some size (k,), of the
    directions of which `most` is left.
    """
    use = size > 0.0
    u, values, _ = np.linalg.svd(left[:, use] / size[use], full_matrices=False)
    return u[:, values**2 > HIDDEN][:, :most]


def leftover(at: Linearisation, x: Array | None, freedom: int) -> Leftover:
    """What an estimate from scale readings x (readings, d), or error-free ones, leaves, to first
    order.
    """
    design = at.design
    n, d = row_count(design), design.dimension
    common, own, ball = np.zeros((n, at.balls.common.shape[2])), np.zeros((n, d)), np.full(n, -1)
    for some in hat_rows(at, x):
        common[some.rows], own[some.rows], ball[some.rows] = some.common, some.own, some.ball
    residual = whitened_residuals(design, at.state, x)
    found = Leftover(residual, common, own, ball, len(design.balls.places), freedom)
    return replace(found, residual=found.of(residual[:, None])[:, 0])


@dataclass(frozen=True)
class Explained:
    """Sums of squares (g,) that groups of columns explain, and in how many `dimensions` (g,)."""

    square: Array
    dimensions: Array


class Columns:
    """Products of the columns of a sparse matrix (n, k) with residuals and with the root of the hat
    matrix.

    `groups` are arrays (g, q) of columns that are tested together, in no more dimensions than are
    left of them in the design as `drawn`.
    """

    information: Array

    def __init__(
        self,
        matrix: csc_array,
        groups: Sequence[Integers],
        of: Leftover,
        drawn: Columns | None = None,
    ) -> None:
        self.most = [
            np.full(len(index), index.shape[1])
            if drawn is None
            else drawn.explained(number).dimensions
            for number, index in enumerate(groups)
        ]
        self.is_determined = np.ones(matrix.shape[1], bool)
        if drawn is not None:
            self.is_determined = drawn.information > 0.0
        self.rows = matrix.T.tocsr()
        self.square = np.asarray(self.rows.power(2).sum(axis=1)).ravel()
        self.size = np.sqrt(np.maximum(self.square, np.finfo(float).tiny))
        common = self.rows @ of.common
        own = (self.rows @ of.own_columns).tocsr()
        private = np.asarray(own.power(2).sum(axis=1)).ravel()
        self._information = self.square - (common**2).sum(axis=1) - private
        self._width = of.common.shape[1]
        self._grams = [
            self._gram(index, common, own) if index.shape[1] > 1 else None for index in groups
        ]
        self.groups = groups
        self.update(of)

    def update(self, of: Leftover) -> None:
        """Work out the products with another leftover of the same estimate."""
        self.product = np.asarray(self.rows @ of.residual)
        self.further = np.asarray(self.rows @ of.common[:, self._width :])
        information = self._information - (self.further**2).sum(axis=1)
        shows = self.is_determined & (information > HIDDEN * self.square)
        self.information = np.where(shows, information, 0.0)

    def tests(self) -> int:
        """Number of groups that can be tested."""
        return sum(
            int((self.explained(number).dimensions > 0).sum()) for number in range(len(self.groups))
        )

    def statistics(self) -> Array:
        """Estimated biases (k,) in their standard uncertainties, 0 for what cannot be tested."""
        can = self.information > 0.0
        return np.where(can, self.product / np.sqrt(np.where(can, self.information, 1.0)), 0.0)

    def _gram(self, index: Integers, common: Array, own: csr_array) -> Array:
        """Products (g, q, q) of what is left of the columns of groups (g, q), each column in units
        of its size.
        """
        g, q = index.shape
        scaled = common[index] / self.size[index][:, :, None]
        found = -scaled @ scaled.transpose(0, 2, 1)
        first, second = np.triu_indices(q)
        one, other = index[:, first], index[:, second]

        def products(of: csr_array) -> Array:
            both = of[one.ravel()].multiply(of[other.ravel()])
            return np.asarray(both.sum(axis=1)).reshape(one.shape)

        values = (products(self.rows) - products(own)) / (self.size[one] * self.size[other])
        found[:, first, second] += values
        is_beside = first != second
        found[:, second[is_beside], first[is_beside]] += values[:, is_beside]
        return found

    def explained(self, number: int) -> Explained:
        """What the groups of some number explain together."""
        index, gram = self.groups[number], self._grams[number]
        if gram is None:
            single = index[:, 0]
            return Explained(
                self.statistics()[single] ** 2, (self.information[single] > 0.0).astype(float)
            )
        further = self.further[index] / self.size[index][:, :, None]
        values, vectors = np.linalg.eigh(gram - further @ further.transpose(0, 2, 1))
        along = np.einsum("gij,gi->gj", vectors, self.product[index] / self.size[index])
        q = index.shape[1]
        known = (values > HIDDEN) & (np.arange(q) >= q - self.most[number][:, None])
        square = np.where(known, along**2 / np.where(known, values, 1.0), 0.0).sum(axis=1)
        return Explained(square, known.sum(axis=1).astype(float))
