"""Choices among floating-point numbers that rounding cannot change.

Linear algebra kernels differ in the order of their sums, and so in the last digits of a result. Numbers that are equal
but for rounding, as those of a symmetrical design, count as equal here, and the first of them is taken.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .design import Integers
from .machines.protocol import Array

# Relative difference up to which two numbers count as equal.
EQUAL = 1e-6


def first_largest(values: Array, equal: float = EQUAL, size: float | None = None) -> int:
    """Index of the first of `values` (m,) that is the largest, but for the fraction `equal` of it, or of `size`.

    NaN is passed over.

    :raises ValueError: there is no number.

    >>> first_largest(np.array([0.2, 0.3, 0.1 + 0.2])), first_largest(np.array([np.nan, 1.0]))
    (1, 1)
    """
    known = ~np.isnan(values)
    if not known.any():
        raise ValueError("no number to choose from")
    largest = float(values[known].max())
    if np.isinf(largest):
        return int(np.flatnonzero(values == largest)[0])
    slack = equal * (abs(largest) if size is None else size)
    with np.errstate(invalid="ignore"):
        return int(np.flatnonzero(known & (values >= largest - slack))[0])


def first_smallest(values: Array, equal: float = EQUAL, size: float | None = None) -> int:
    """Index of the first of `values` (m,) that is the smallest, in the same way.

    >>> first_smallest(np.array([0.4, 0.1 + 0.2, 0.3]))
    1
    """
    return first_largest(-np.asarray(values), equal, size)


def largest_first(values: Array, equal: float = EQUAL) -> Integers:
    """Indices of `values` (m,), the largest first, equal ones in their order, NaN last.

    >>> largest_first(np.array([0.3, np.nan, 0.5, 0.1 + 0.2])).tolist()
    [2, 0, 3, 1]
    """
    values = np.asarray(values, float)
    groups: list[list[int]] = []
    for k in np.argsort(-values, kind="stable").tolist():
        if groups and is_equal(values[k], values[groups[-1][0]], equal):
            groups[-1].append(k)
        else:
            groups.append([k])
    return np.array([k for group in groups for k in sorted(group)], np.int64)


def is_equal(one: float, other: float, equal: float = EQUAL) -> bool:
    """Whether two numbers are equal but for a fraction of the second.

    >>> is_equal(0.1 + 0.2, 0.3), is_equal(np.inf, np.inf), is_equal(1.0, np.inf)
    (True, True, False)
    """
    return bool(one == other or abs(one - other) <= equal * abs(other) < np.inf)


def above(values: Array, limit: float, equal: float = EQUAL) -> NDArray[np.bool_]:
    """Which of `values` exceed a limit by more than rounding.

    >>> above(np.array([0.1 + 0.2, 0.31, np.nan]), 0.3).tolist()
    [False, True, False]
    """
    return np.asarray(np.asarray(values) > limit + equal * abs(limit))


def without_rounding(value: float) -> float:
    """A number to nine significant digits, so that a half is rounded to fewer digits in one way.

    >>> without_rounding(0.1 + 0.2), f"{0.1875 - 1e-16:.3g}", f"{without_rounding(0.1875 - 1e-16):.3g}"
    (0.3, '0.187', '0.188')
    """
    return float(f"{value:.9g}")
