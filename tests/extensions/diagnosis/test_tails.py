"""Chances of sums of squares against SciPy's distributions and, where these are too small for a
number, mpmath.
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from ballplate.extensions.diagnosis.tails import log_chance
from scipy.stats import chi2, f


@pytest.mark.parametrize("dimensions", [1.0, 3.0, 6.0, 50.0])
def test_chances_that_are_numbers(dimensions: float) -> None:
    # A difference of a logarithm is a share of the chance.
    square = np.array([0.5, 8.0, 40.0, 90.0])
    np.testing.assert_allclose(
        log_chance(square, 200.0, dimensions, 190.0, True),
        chi2.logsf(square, dimensions),
        rtol=1e-9,
        atol=1e-12,
    )
    ratio = square / dimensions / ((200.0 - square) / (190.0 - dimensions))
    expected = f.logsf(ratio, dimensions, 190.0 - dimensions)
    np.testing.assert_allclose(
        log_chance(square, 200.0, dimensions, 190.0, False), expected, rtol=1e-7, atol=1e-12
    )


@pytest.mark.parametrize("dimensions", [1, 3, 6, 50])
def test_chances_too_small_for_a_number(dimensions: int) -> None:
    """Good to a part in ten thousand of the logarithm, by which they are compared."""
    with mpmath.workdps(40):
        upper = mpmath.log(
            mpmath.gammainc(mpmath.mpf(dimensions) / 2, 2000, mpmath.inf, regularized=True)
        )
        given = float(log_chance(4000.0, 1.0, dimensions, 600.0, True))
        assert given == pytest.approx(float(upper), rel=1e-4)
        half, rest = mpmath.mpf(dimensions) / 2, mpmath.mpf(600 - dimensions) / 2
        share = mpmath.log(mpmath.betainc(rest, half, 0, mpmath.mpf("0.01"), regularized=True))
        by_share = float(log_chance(99.0, 100.0, dimensions, 600.0, False))
        assert by_share == pytest.approx(float(share), rel=1e-4)


def test_nothing_can_be_said_without_dimensions_or_freedom() -> None:
    assert log_chance(np.array([5.0, 5.0]), 10.0, np.array([0.0, 7.0]), 7.0, False).tolist() == [
        0.0,
        0.0,
    ]
