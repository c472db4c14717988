"""The reference line of a straightness error: least squares, end points or minimum zone."""

from __future__ import annotations

from typing import Literal

import numpy as np

from .protocol import Array

Criterion = Literal["end points", "least squares", "minimum zone"]


def reference_line(t: Array, y: Array, criterion: Criterion) -> tuple[float, float]:
    """Intercept and slope of the line from which y (m,) at ascending t (m,) deviates, m at least 2.

    Least squares makes the sum of squared deviations smallest, the end points are the first and the
    last, and the minimum zone is the narrowest strip that holds all points, the line being in its
    middle.

    >>> t, y = np.array([0.0, 0.5, 1.0]), np.array([0.0, 1.0, 0.0])
    >>> [tuple(round(one, 9) for one in reference_line(t, y, criterion)) for criterion in
    ...  ("end points", "least squares", "minimum zone")]
    [(0.0, 0.0), (0.333333333, 0.0), (0.5, 0.0)]
    """
    if criterion == "end points":
        slope = float((y[-1] - y[0]) / (t[-1] - t[0]))
        return float(y[0] - slope * t[0]), slope
    if criterion == "least squares":
        middle = float(t.mean())
        slope = float((t - middle) @ (y - y.mean()) / ((t - middle) @ (t - middle)))
        return float(y.mean()) - slope * middle, slope
    return _minimum_zone(t, y)


def _minimum_zone(t: Array, y: Array) -> tuple[float, float]:
    """The Chebyshev line, by linear programming: least h with |y - intercept - slope t| <= h."""
    # SciPy takes longer to import than most experiments to check.
    from scipy.optimize import linprog

    # The solver's tolerances are absolute: residuals of the line through the ends, in units of
    # their size.
    start, tilt = reference_line(t, y, "end points")
    left = y - start - tilt * t
    size = float(np.abs(left).max())
    if size == 0.0:
        return start, tilt
    s = (t - t[0]) / (t[-1] - t[0])
    ones = np.ones_like(s)
    rows = np.concatenate([np.column_stack([ones, s, -ones]), np.column_stack([-ones, -s, -ones])])
    found = linprog(
        (0.0, 0.0, 1.0),
        rows,
        np.concatenate([left, -left]) / size,
        bounds=[(None, None)] * 2 + [(0.0, None)],
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    if not found.success:
        raise ArithmeticError(f"the minimum zone was not found: {found.message}")
    slope = size * float(found.x[1]) / float(t[-1] - t[0])
    return start + size * float(found.x[0]) - slope * float(t[0]), tilt + slope
