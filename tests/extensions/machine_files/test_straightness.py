"""Straight lines of reference against searches that cannot miss the best one."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

# Loaded beforehand, so that the first example does not take longer than examples may.
import scipy.optimize  # noqa: F401
from ballplate.extensions.machine_files.straightness import reference_line
from hypothesis import example, given, strategies as st

points = st.integers(3, 9).flatmap(
    lambda n: st.tuples(
        st.lists(st.floats(0.01, 1.0), min_size=n, max_size=n),
        st.lists(st.floats(-5e-6, 5e-6), min_size=n, max_size=n),
    )
)


def narrowest(t: np.ndarray, y: np.ndarray) -> float:
    """Height of the narrowest strip: one of its sides goes through two points."""
    widths = []
    for i, j in combinations(range(len(t)), 2):
        slope = (y[j] - y[i]) / (t[j] - t[i])
        widths.append(np.ptp(y - slope * t))
    return float(min(widths))


# Found by the search: a point almost on another one's level, which the solver's usual tolerance
# passes over.
@example(([1.0] * 7, [2.0791914768435884e-06, 3.5560969828674295e-06, 1e-12, 3.6041486960862267e-06,
                      9.474049520320464e-07, 0.0, 0.0]))  # fmt: skip
@given(points)
def test_minimum_zone_is_the_narrowest_strip(drawn: tuple[list[float], list[float]]) -> None:
    t, y = np.cumsum(drawn[0]), np.array(drawn[1])
    intercept, slope = reference_line(t, y, "minimum zone")
    left = y - intercept - slope * t
    assert np.ptp(left) == pytest.approx(narrowest(t, y), abs=1e-9 * np.ptp(y) + 1e-20)
    assert left.max() == pytest.approx(-left.min(), abs=1e-9 * np.ptp(y) + 1e-20)


@given(points)
def test_least_squares_is_that_of_polyfit(drawn: tuple[list[float], list[float]]) -> None:
    t, y = np.cumsum(drawn[0]), np.array(drawn[1])
    intercept, slope = reference_line(t, y, "least squares")
    np.testing.assert_allclose(
        intercept + slope * t, np.polyval(np.polyfit(t, y, 1), t), atol=1e-15
    )


def test_end_points_are_met() -> None:
    t, y = np.array([0.2, 0.5, 0.9]), np.array([1.0, 7.0, 3.0])
    intercept, slope = reference_line(t, y, "end points")
    np.testing.assert_allclose(intercept + slope * t[[0, -1]], [1.0, 3.0])


@pytest.mark.parametrize("criterion", ["end points", "least squares", "minimum zone"])
def test_a_straight_line_is_its_own_reference(criterion: str) -> None:
    t = np.linspace(0.0, 1.0, 5)
    intercept, slope = reference_line(t, 2e-6 - 3e-6 * t, criterion)  # type: ignore[arg-type]
    assert (intercept, slope) == (pytest.approx(2e-6, rel=1e-9), pytest.approx(-3e-6, rel=1e-9))
