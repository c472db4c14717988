"""One check of derivatives for every model and every observation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]


def complex_step(function: Callable[[Real], Real], at: Real) -> Real:
    """Derivative (..., n) of an analytic function at `at` (n,), exact to rounding."""
    columns = []
    for k in range(len(at)):
        shifted = at.astype(complex)
        shifted[k] += 1e-30j
        columns.append(np.asarray(function(shifted)).imag / 1e-30)  # type: ignore[arg-type]
    return np.stack(columns, axis=-1)


def central_difference(function: Callable[[Real], Real], at: Real, step: float) -> Real:
    """Derivative (..., n) by Richardson's extrapolation of central differences, for what cannot be
    complex.
    """

    def plain(h: float) -> Real:
        columns = []
        for k in range(len(at)):
            shift = np.zeros(len(at))
            shift[k] = h
            columns.append((function(at + shift) - function(at - shift)) / (2 * h))
        return np.stack(columns, axis=-1)

    return (4.0 * plain(step / 2) - plain(step)) / 3.0


def assert_derivative(found: Real, expected: Real, relative: float) -> None:
    """Fail where `found` differs from `expected` by more than `relative` times the largest
    element.
    """
    assert found.shape == expected.shape
    size = float(np.abs(expected).max(initial=0.0))
    assert size > 0.0, "a derivative that is zero everywhere tests nothing"
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=relative * size)
