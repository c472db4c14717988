"""Elimination of rows whose weights differ by many orders of magnitude, against fractions, which have
no rounding.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from ballplate.simulator.estimation.graded import Collected, triangle, without_balls
from scipy.linalg import solve_triangular

GENERATOR = np.random.default_rng(6)
# Ten rows of four columns, of which those with large weights determine two directions only.
WEIGHTS = np.array([1.0, 1e-3, 1e9, 1.0, 1e-2, 1.0, 1e12, 1e-1, 1.0, 1e-3])
ROWS = WEIGHTS[:, None] * GENERATOR.standard_normal((10, 4))
SIDES = WEIGHTS[:, None] * GENERATOR.standard_normal((10, 3))


def exact(values: np.ndarray) -> Any:
    """The same numbers as fractions."""
    return np.array([Fraction(value) for value in values.ravel().tolist()], object).reshape(
        values.shape
    )


def solved(matrix: Any, sides: Any) -> Any:
    """Solution of a system of equations in fractions, by elimination."""
    left = np.concatenate([matrix, sides], axis=1)
    n = len(matrix)
    for k in range(n):
        pivot = k + next(i for i, value in enumerate(left[k:, k]) if value != 0)
        left[[k, pivot]] = left[[pivot, k]]
        left[k] = left[k] / left[k, k]
        for i in range(n):
            if i != k:
                left[i] = left[i] - left[i, k] * left[k]
    return left[:, n:]


def least_squares(rows: np.ndarray, sides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solution (n, m) and the products (m, m) of what is left of the sides, to all digits."""
    a, b = exact(rows), exact(sides)
    solution = solved(a.T @ a, a.T @ b)
    left = b - a @ solution
    return solution.astype(float), (left.T @ left).astype(float)


@pytest.mark.parametrize("size", [1.0, 1e-15])
@pytest.mark.parametrize("order", ["as they are", "lightest first", "heaviest first"])
def test_a_triangle_keeps_what_the_lightest_rows_tell(order: str, size: float) -> None:
    places = {
        "as they are": np.arange(10),
        "lightest first": np.argsort(WEIGHTS),
        "heaviest first": np.argsort(-WEIGHTS),
    }[order]
    found = triangle(size * ROWS[places], size * SIDES[places])
    solution, left = least_squares(size * ROWS, size * SIDES)
    ours = np.empty((4, 3))
    ours[found.order] = solve_triangular(found.root, found.side)
    np.testing.assert_allclose(ours, solution, rtol=1e-12)
    np.testing.assert_allclose(found.rest.T @ found.rest, left, rtol=1e-12)
    assert (np.tril(found.root, -1) == 0.0).all() and sorted(found.order) == [0, 1, 2, 3]
    # Each of its columns is no longer in what is below than the one before it.
    lengths = [np.linalg.norm(found.root[k:, k:], axis=0) for k in range(4)]
    assert all(one[0] >= one.max() * (1.0 - 1e-12) for one in lengths)
    np.testing.assert_array_equal(found.rows[:, found.order], found.root)


def test_rows_that_are_collected_give_the_triangle_of_all() -> None:
    generator = np.random.default_rng(2)
    parts = [generator.standard_normal((200, 5)) for _ in range(6)]
    collected = Collected(3, 2)
    for part in parts:
        collected.add(np.concatenate([part, np.zeros((20, 5))]))
    # Never more than the rows of one part beside those that are collected.
    assert max(len(part) for part in collected._waiting) <= 200
    assert sum(len(part) for part in collected._waiting) <= 8 * 64 + 200
    found = collected.found()
    rows = np.concatenate(parts)
    solution, left = least_squares(rows[:, :3], rows[:, 3:])
    ours = np.empty((3, 2))
    ours[found.order] = solve_triangular(found.root, found.side)
    np.testing.assert_allclose(ours, solution, atol=1e-14)
    np.testing.assert_allclose(found.rest.T @ found.rest, left, rtol=1e-12)


@pytest.mark.parametrize("size", [1.0, 1e-15])
def test_balls_are_eliminated_with_all_digits_of_the_lightest_rows(size: float) -> None:
    """Of three balls, one has a heavy row, one two, and one none; the rest has two columns."""
    weights = size * np.array(
        [
            [1.0, 1e-2, 1e10, 1.0, 1.0, 1e-1],
            [1e12, 1.0, 1.0, 1e-1, 1e10, 1.0],
            [1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
        ]
    )
    generator = np.random.default_rng(9)
    by_ball = weights[:, :, None] * generator.standard_normal((3, 6, 3))
    rest = weights[:, :, None] * generator.standard_normal((3, 6, 2))
    # Heavy rows of both signs, so that no sign of a pivot is the harmless one by chance.
    by_ball[0, 2] *= -np.sign(by_ball[0, 2, np.abs(by_ball[0, 2]).argmax()])
    root, order, top, left = without_balls(by_ball.copy(), rest.copy(), weights)
    for ball in range(3):
        solution, products = least_squares(by_ball[ball], rest[ball])
        ours = np.empty((3, 2))
        ours[order[ball]] = solve_triangular(root[ball], top[ball])
        np.testing.assert_allclose(ours, solution, rtol=1e-11)
        np.testing.assert_allclose(left[ball].T @ left[ball], products, rtol=1e-11)
        assert (np.tril(root[ball], -1) == 0.0).all() and sorted(order[ball]) == [0, 1, 2]
