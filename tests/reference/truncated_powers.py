"""NISTIR 6517 as it stands: truncated powers, pseudo-inverses by singular values, pieces by
recursion.
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def powers(x: Array, knots: Array, derivative: int = 0) -> Array:
    """1, x, x^2, x^3 and (x - t)+^3 for each knot, or their first derivatives, equations (2), (9),
    (13).
    """
    x = np.asarray(x, dtype=float)[:, None]
    beyond = np.where(x > knots, x - knots, 0.0)
    if derivative:
        return np.hstack([np.zeros_like(x), np.ones_like(x), 2 * x, 3 * x**2, 3 * beyond**2])
    return np.hstack([np.ones_like(x), x, x**2, x**3, beyond**3])


def constrained(
    x: Array, y: Array, knots: Array, rows: Array, values: Array, tolerance: float
) -> Array:
    """c = B+ f + (A Z)+ (y - A B+ f), Z = I - B+ B, equations (25) and (26); singular values below
    are zero, (22).
    """
    a = powers(x, knots)
    inverse = np.linalg.pinv(rows, rcond=tolerance)
    z = np.eye(a.shape[1]) - inverse @ rows
    start = inverse @ values
    return np.asarray(start + np.linalg.pinv(a @ z, rcond=tolerance) @ (y - a @ start))


def pieces(c: Array, knots: Array) -> Array:
    """Powers of x in each of the pieces (pieces, 4), equations (30) and (33)."""
    found = [np.array(c[:4])]
    for t, own in zip(knots, c[4:], strict=True):
        found.append(found[-1] + own * np.array([-(t**3), 3 * t**2, -3 * t, 1.0]))
    return np.array(found)
