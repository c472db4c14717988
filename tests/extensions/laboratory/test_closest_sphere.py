"""The sphere closest to points, beside SciPy's optimiser and Monte Carlo."""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.extensions.laboratory.closest_sphere import closest_sphere
from scipy.optimize import least_squares


def cap(count: int, generator: np.random.Generator, height: float = 0.0) -> np.ndarray:
    """Directions on a sphere above a height."""
    z = generator.uniform(height, 1.0, count)
    angle = generator.uniform(0, 2 * np.pi, count)
    return np.column_stack(
        [np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z]
    )


@pytest.mark.parametrize("count", [5, 9, 200])
@pytest.mark.parametrize("height", [-1.0, 0.0, 0.8])
def test_it_is_where_an_optimiser_finds_it(count: int, height: float) -> None:
    generator = np.random.default_rng(count)
    centre, radius = np.array([0.4, -0.2, 0.9]), 0.011
    # Errors large enough for the sphere not to be that of the squares' differences.
    points = centre + (radius + 2e-5 * generator.standard_normal(count))[:, None] * cap(
        count, generator, height
    )
    fit = closest_sphere(points)
    assert fit is not None
    found = least_squares(
        lambda p: np.linalg.norm(points - p[:3], axis=1) - p[3],
        [*points.mean(axis=0), radius],
        x_scale=1e-3,
        **dict.fromkeys(("xtol", "ftol", "gtol"), 1e-15),
    )
    np.testing.assert_allclose(fit.centre, found.x[:3], atol=2e-9)
    assert fit.radius == pytest.approx(found.x[3], abs=2e-9)
    inverse = np.linalg.inv(found.jac.T @ found.jac)[:3, :3]
    np.testing.assert_allclose(fit.cofactor, inverse, rtol=1e-3, atol=1e-3)


def test_its_covariance_is_the_spread_of_centres() -> None:
    generator = np.random.default_rng(2)
    directions, sigma = cap(9, generator), 1e-6
    centres, squares = [], 0.0
    for _ in range(4000):
        errors = sigma * generator.standard_normal(9)
        fit = closest_sphere((0.011 + errors)[:, None] * directions)
        assert fit is not None and fit.degrees_of_freedom == 5
        centres.append(fit.centre)
        squares += float((fit.residuals**2).sum()) / fit.degrees_of_freedom
    spread = np.cov(np.array(centres).T)
    # Variances of 4000 values are known to 2.2 %, three times that for each of three.
    np.testing.assert_allclose(np.diag(spread), sigma**2 * np.diag(fit.cofactor), rtol=0.07)
    assert squares / 4000 == pytest.approx(sigma**2, rel=0.05, abs=0.0)


def test_points_that_tell_no_sphere_have_none() -> None:
    generator = np.random.default_rng(1)
    assert closest_sphere(cap(4, generator)) is None
    flat = cap(20, generator)
    flat[:, 2] = 0.3
    assert closest_sphere(flat) is None
    assert closest_sphere(np.zeros((9, 3))) is None
