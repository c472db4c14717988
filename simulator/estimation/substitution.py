"""Solution of the triangular systems of a factor, each group of parameters in its own order."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.computing.threads import scipy_linalg
from ballplate.simulator.machines.protocol import Array, Integers

from .elimination import Factor


def solve_balls(factor: Factor, side: Array, transposed: bool = False) -> Array:
    """Solve the systems (e, d, d) of the balls eliminated singly for sides (e, d, m), all balls at
    once.
    """
    root = factor.ball_root
    order = None if factor.orders is None else factor.orders.ball[:, :, None]
    if not transposed:
        return _put(_by_substitution(root, side), order)
    if order is not None:
        side = np.take_along_axis(side, order, 1)
    return _by_substitution_transposed(root, side)


def solve_kept(factor: Factor, side: Array, transposed: bool = False) -> Array:
    """Solve the system of the balls that distances tie together for sides (d k, ...)."""
    return _solve(
        factor.kept_root, None if factor.orders is None else factor.orders.kept, side, transposed
    )


def solve_shared(factor: Factor, side: Array, transposed: bool = False) -> Array:
    """Solve the system of the shared parameters for sides (s, ...); of a design of full rank
    only.
    """
    return _solve(
        factor.root, None if factor.orders is None else factor.orders.shared, side, transposed
    )


def in_order(factor: Factor) -> Array:
    """The shared parameters' root (s, s) with its columns in the order of the parameters."""
    if factor.orders is None:
        return factor.root
    root = np.empty_like(factor.root)
    root[:, factor.orders.shared] = factor.root
    return root


def _solve(root: Array, order: Integers | None, side: Array, transposed: bool) -> Array:
    solve_triangular = scipy_linalg().solve_triangular
    if transposed:
        return solve_triangular(
            root, side if order is None else side[order], trans="T", check_finite=False
        )
    solution = solve_triangular(root, side, check_finite=False)
    if order is None:
        return solution
    result = np.empty_like(solution)
    result[order] = solution
    return result


def _put(solution: Array, order: Integers | None) -> Array:
    if order is None:
        return solution
    result = np.empty_like(solution)
    np.put_along_axis(result, order, solution, 1)
    return result


def _by_substitution(root: Array, side: Array) -> Array:
    """Solve upper triangular systems (n, d, d) for sides (n, d, m)."""
    d = root.shape[1]
    solution = np.array(side, dtype=float)
    for row in reversed(range(d)):
        for later in range(row + 1, d):
            solution[:, row] -= root[:, row, later, None] * solution[:, later]
        solution[:, row] /= root[:, row, row, None]
    return solution


def _by_substitution_transposed(root: Array, side: Array) -> Array:
    """Solve R' z = side for upper triangular R (n, d, d) and sides (n, d, m)."""
    solution = np.array(side, dtype=float)
    for row in range(root.shape[1]):
        for earlier in range(row):
            solution[:, row] -= root[:, earlier, row, None] * solution[:, earlier]
        solution[:, row] /= root[:, row, row, None]
    return solution
