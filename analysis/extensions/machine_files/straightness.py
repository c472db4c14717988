"""The reference line of a straightness error: least squares, end points or minimum zone."""

from __future__ import annotations

from typing import Literal

import numpy as np
from ballplate.simulator.machines import Array

Criterion = Literal["end points", "least squares", "minimum zone"]


def reference_line(t: Array, y: Array, criterion: Criterion) -> tuple[float, float]:
    """Return intercept and slope of the reference line of y (m,) at ascending t (m,), m at least
    2.

    Least squares minimises the sum of squared deviations, end points joins first and last, and the
    minimum zone is the middle of the narrowest strip with all points.

    >>> t, y = np.array([0.0, 0.5, 1.0]), np.array([0.0, 1.0, 0.0])
    >>> [tuple(round(value, 9) for value in reference_line(t, y, criterion)) for criterion in
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
    """Return the Chebyshev line, by linear programming: least h with |y - intercept - slope t| <=
    h.
    """
    # SciPy takes longer to import than most experiments to check.
    from scipy.optimize import linprog

    # The solver's tolerances are absolute: scale residuals of the line through the ends to one.
    start, tilt = reference_line(t, y, "end points")
    residuals = y - start - tilt * t
    size = float(np.abs(residuals).max())
    if size == 0.0:
        return start, tilt
    s = (t - t[0]) / (t[-1] - t[0])
    ones = np.ones_like(s)
    rows = np.concatenate([np.column_stack([ones, s, -ones]), np.column_stack([-ones, -s, -ones])])
    solution = linprog(
        (0.0, 0.0, 1.0),
        rows,
        np.concatenate([residuals, -residuals]) / size,
        bounds=[(None, None)] * 2 + [(0.0, None)],
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    if not solution.success:
        raise ArithmeticError(f"the minimum zone was not found: {solution.message}")
    slope = size * float(solution.x[1]) / float(t[-1] - t[0])
    return start + size * float(solution.x[0]) - slope * float(t[0]), tilt + slope
