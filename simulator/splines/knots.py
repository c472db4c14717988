"""Locations of knots: at every r-th point, and at the boundaries of features."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array

# With fewer points between a knot and a boundary the curvature, which jumps there, is hardly
# determined.
NEXT_TO_BOUNDARY = 3


def at_every(
    x: Array, r: int, lower: float, upper: float, boundaries: Sequence[float] = ()
) -> tuple[float, ...]:
    """Return knots at every r-th of the points x between neighbouring boundaries, as in NISTIR
    6517, equation (5).

    A knot without a point of its feature beyond it would be undetermined, and is omitted. So is
    one with fewer than three points from it to a boundary, the knot's own not counted. Points of
    the same x count as one, a point on a boundary in both features.

    >>> at_every(np.arange(1.0, 9.0), 3, 1.0, 8.0)
    (3.0, 6.0)
    >>> at_every(np.arange(1.0, 17.0), 3, 1.0, 16.0, [8.0])
    (3.0, 13.0)
    >>> at_every(np.arange(1.0, 17.0), 5, 1.0, 16.0, [8.0])
    (5.0, 12.0)
    """
    distinct = np.unique(x)
    knots_found = []
    ends = [lower, *boundaries, upper]
    for start, end in zip(ends, ends[1:], strict=False):
        inside = distinct[(distinct >= start) & (distinct <= end)]
        before = 0 if start == lower else NEXT_TO_BOUNDARY
        beyond = 1 if end == upper else NEXT_TO_BOUNDARY
        chosen = range(r - 1, len(inside) - beyond, r)
        knots_found += [float(inside[k]) for k in chosen if k >= before and start < inside[k] < end]
    return tuple(knots_found)


def with_boundaries(
    knots: Sequence[float],
    boundaries: Sequence[float],
    order: int,
    corners: Sequence[float] = (),
) -> tuple[float, ...]:
    """Return all knots in order, with multiplicities for continuous value and slope at the
    boundaries, and no continuity at the corners.

    >>> with_boundaries((1.0, 3.0), (2.0,), 4)
    (1.0, 2.0, 2.0, 3.0)
    """
    doubled = [boundary for boundary in boundaries for _ in range(order - 2)]
    broken = [corner for corner in corners for _ in range(order)]
    return tuple(sorted([*knots, *doubled, *broken]))
