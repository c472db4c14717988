"""Where knots stand: at every r-th point, and at the boundaries of features."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .space import Array


def at_every(x: Array, r: int, lower: float, upper: float, boundaries: Sequence[float] = ()) -> tuple[float, ...]:
    """Knots at every r-th of the points x between neighbouring boundaries, as NISTIR 6517, equation (5), has them.

    A knot that no point of its feature lies beyond would have nothing to determine it, and is left out. Points of the
    same x count as one.

    >>> at_every(np.arange(1.0, 9.0), 3, 1.0, 8.0)
    (3.0, 6.0)
    """
    distinct = np.unique(x)
    found: list[float] = []
    ends = [lower, *boundaries, upper]
    for start, end in zip(ends, ends[1:], strict=False):
        inside = distinct[(distinct >= start) & (distinct <= end)]
        found += [knot for knot in inside[r - 1 : -1 : r].tolist() if start < knot < end]
    return tuple(found)


def with_boundaries(knots: Sequence[float], boundaries: Sequence[float], order: int) -> tuple[float, ...]:
    """All knots in order, with those that leave only value and slope continuous at the boundaries.

    >>> with_boundaries((1.0, 3.0), (2.0,), 4)
    (1.0, 2.0, 2.0, 3.0)
    """
    doubled = [boundary for boundary in boundaries for _ in range(order - 2)]
    return tuple(sorted([*knots, *doubled]))
