"""Orthogonal elimination of rows whose weights differ by many orders of magnitude.

If one row outweighs others a millionfold, a plain triangular decomposition mixes its rounding into
them, and their information is lost. With the rows sorted by weight, heaviest first, and the
columns in the order of their remaining norms, every row keeps its own relative accuracy: M. J. D.
Powell, J. K. Reid, *On applying Householder transformations to linear least squares problems*,
1968; A. J. Cox, N. J. Higham, *Stability of Householder QR factorization for weighted least
squares problems*, 1998.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.computing.processes import scipy_linalg
from ballplate.simulator.inputs.number_arrays import Array, Integers

# Rows that are collected, in multiples of the columns, before they are brought to a triangle.
COLLECTED = 8


@dataclass(frozen=True)
class Triangle:
    """Rows brought to a triangle: `root` (n, n) is upper triangular in the columns `order` (n,),
    `side` (n, m).

    `rest` (k, m) are the transformed right-hand sides of the remaining rows, zero in the columns.
    """

    root: Array
    order: Integers
    side: Array
    rest: Array

    @property
    def rows(self) -> Array:
        """The triangle with its columns in their own order."""
        rows = np.empty_like(self.root)
        rows[:, self.order] = self.root
        return rows


def triangle(rows: Array, sides: Array) -> Triangle:
    """Bring `rows` (k, n), scaled so that columns compare, to a triangle, with right-hand sides (k,
    m).
    """
    n = rows.shape[1]
    # Both orders are needed: the heaviest rows first, once, and at every step the largest remaining
    # column, which `dgeqp3` chooses.
    sorted_ = np.argsort(-np.abs(rows).max(axis=1, initial=0.0), kind="stable")
    rows, sides = rows[sorted_], sides[sorted_]
    if len(rows) < n:
        rows = np.concatenate([rows, np.zeros((n - len(rows), n))])
        sides = np.concatenate([sides, np.zeros((n - len(sides), sides.shape[1]))])
    if not n:
        return Triangle(np.zeros((0, 0)), np.zeros(0, np.int64), sides[:0], sides)
    lapack = scipy_linalg().lapack
    factored, order, reflectors, _, _ = lapack.dgeqp3(np.asfortranarray(rows))
    if sides.shape[1]:
        size = max(64 * sides.shape[1], 1)
        sides, _, _ = lapack.dormqr("L", "T", factored, reflectors, np.asfortranarray(sides), size)
    return Triangle(np.triu(factored[:n]), order.astype(np.int64) - 1, sides[:n], sides[n:])


class Collected:
    """A triangle of more rows than are to be held at once."""

    def __init__(self, columns: int, sides: int) -> None:
        self._waiting = [np.zeros((0, columns + sides))]
        self._columns = columns
        self._rest = [np.zeros((0, sides))]

    def add(self, rows: Array) -> None:
        """Add rows (k, columns + sides)."""
        self._waiting.append(rows[rows.any(axis=1)])
        if sum(map(len, self._waiting)) > COLLECTED * max(self._columns, 64):
            # A triangle stands for all rows that it came from, with their weights, and is sorted
            # among the next rows like any other. What is left below it has no columns any more and
            # is final.
            reduced = self._reduced()
            self._waiting = [np.concatenate([reduced.rows, reduced.side], axis=1)]
            self._rest.append(reduced.rest)

    def found(self) -> Triangle:
        """The triangle of all rows."""
        found = self._reduced()
        return replace(found, rest=np.concatenate([*self._rest, found.rest]))

    def _reduced(self) -> Triangle:
        rows = np.concatenate(self._waiting)
        return triangle(rows[:, : self._columns], rows[:, self._columns :])


def without_balls(
    by_ball: Array, by_rest: Array, weights: Array
) -> tuple[Array, Integers, Array, Array]:
    """Eliminate a batch of balls from rows by them (b, m, d) and by the rest (b, m, c), sorted by
    `weights` (b, m).

    Returns for each ball a root (b, d, d), triangular in its co-ordinates `order` (b, d), with the
    rest of its rows (b, d, c), and the remaining rows (b, m - d, c).
    """
    b, m, d = by_ball.shape
    # The same as `triangle` does, for all balls of a batch at once: LAPACK would be called once per
    # ball. Each ball has pivots of its own, since its heaviest rows may be along another axis.
    heaviest = np.argsort(-weights, axis=1, kind="stable")[:, :, None]
    by_ball, by_rest = (
        np.take_along_axis(by_ball, heaviest, 1),
        np.take_along_axis(by_rest, heaviest, 1),
    )
    order = np.tile(np.arange(d), (b, 1))
    ball = np.arange(b)
    for step in range(d):
        size = (by_ball[:, step:, step:] ** 2).sum(axis=1)
        pivot = step + size.argmax(axis=1)
        # The transpose is a view: columns are exchanged as entries of `order` are.
        for array in (by_ball.transpose(0, 2, 1), order):
            here, there = array[ball, step].copy(), array[ball, pivot].copy()
            array[ball, step], array[ball, pivot] = there, here
        column = by_ball[:, step:, step].copy()
        length = np.sqrt((column**2).sum(axis=1))
        # Householder's vector, with the sign that adds: a difference would lose digits.
        column[:, 0] += np.where(column[:, 0] < 0.0, -length, length)
        square = (column**2).sum(axis=1)
        # A column of zeros has no direction, and is left as it is.
        half = np.where(square > 0.0, 2.0 / np.where(square > 0.0, square, 1.0), 0.0)
        for array in (by_ball[:, step:, step:], by_rest[:, step:]):
            array -= (
                column[:, :, None]
                * (half[:, None] * np.einsum("bm,bmc->bc", column, array))[:, None]
            )
        by_ball[:, step + 1 :, step] = 0.0
    return by_ball[:, :d], order, by_rest[:, :d], by_rest[:, d:]
