"""Points of grids."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array


def grid_points(sides: Iterable[Array]) -> Array:
    """Return points (n, d) of a grid with co-ordinates along each of d axes, the last fastest.

    >>> grid_points([np.array([1.0, 2.0]), np.array([3.0, 4.0])]).tolist()
    [[1.0, 3.0], [1.0, 4.0], [2.0, 3.0], [2.0, 4.0]]
    """
    axes = list(sides)
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))


def even_grid(
    lower: Sequence[float] | Array, upper: Sequence[float] | Array, counts: Iterable[int]
) -> Array:
    """Return grid points (n, d), `counts` along each axis, evenly spread between two corners (d,).

    >>> even_grid(np.zeros(2), np.ones(2), (2, 1)).tolist()
    [[0.0, 0.0], [1.0, 0.0]]
    """
    return grid_points(np.linspace(*side) for side in zip(lower, upper, counts, strict=True))
