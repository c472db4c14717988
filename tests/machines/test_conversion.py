"""Kinematic models within empirical ones, and kinematic models from values along the axes."""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.machines.bases import Basis, Monomial, Polynomial, Spline
from ballplate.simulator.machines.conversion import (
    NotContainedError,
    along_axes,
    containing,
    linear_map,
)
from ballplate.simulator.machines.empirical import empirical_model
from ballplate.simulator.machines.kinematic import kinematic_model, kinematic_model_of
from ballplate.simulator.machines.terms import quadratic, sums

LOWER, UPPER = (-0.2, 0.1, 0.0), (0.8, 0.7, 1.3)


def places(count: int) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(5)
    return generator.uniform(LOWER, UPPER, (count, 3)), 0.1 * generator.standard_normal((count, 3))


@pytest.mark.parametrize("name", sorted(ARRANGEMENTS))
@pytest.mark.parametrize(
    ("position", "rotation"),
    [
        (Polynomial(5), Polynomial(4)),
        (Spline(4, (0.5,)), Monomial(3)),
        (Spline(3, (0.3,)), Spline(3, (0.3, 0.6))),
        (Spline(4, (0.5, 0.5), ends="zero slopes"), Spline(4, (0.3,), ends="periodic")),
    ],
)
def test_an_empirical_model_contains_every_kinematic_one(
    name: str, position: Basis, rotation: Basis
) -> None:
    kinematic = kinematic_model_of(ARRANGEMENTS[name], position, rotation, LOWER, UPPER)
    empirical = containing(kinematic)
    matrix = linear_map(kinematic, empirical)
    a = 1e-5 * np.random.default_rng(1).standard_normal(len(kinematic.parameters))
    x, p = places(40)
    np.testing.assert_allclose(
        empirical.error(x, matrix @ a, p), kinematic.error(x, a, p), rtol=0, atol=1e-14
    )
    held = 9 if not kinematic.arrangement.workpiece_side else 6
    assert 6 * len(empirical.terms.names) - len(empirical.parameters) >= held


def test_the_reports_two_models() -> None:
    """NDEL = NEPS = 3 lies within sums of cubic splines, as section 5.2 uses them."""
    kinematic = kinematic_model(ARRANGEMENTS["MB2"], 3, 3, LOWER, UPPER)
    matrix = linear_map(kinematic, empirical_model(sums(Spline(4, (0.5,))), LOWER, UPPER))
    assert np.linalg.matrix_rank(matrix) == len(kinematic.parameters)


def test_what_is_not_contained_is_named() -> None:
    kinematic = kinematic_model(ARRANGEMENTS["MB2"], 4, 2, LOWER, UPPER)
    with pytest.raises(NotContainedError, match=r"EXX\[3\]") as caught:
        linear_map(kinematic, empirical_model(quadratic(), LOWER, UPPER))
    assert not any(name.startswith("EC") for name in caught.value.parameters)
    with pytest.raises(NotContainedError):
        linear_map(empirical_model(quadratic(), LOWER, UPPER), kinematic)


@pytest.mark.parametrize("name", ["MB2", "MB1", "FH2", "CX1"])
def test_along_the_axes_the_kinematic_model_has_the_same_errors(name: str) -> None:
    empirical = empirical_model(quadratic(), LOWER, UPPER)
    a = 1e-5 * np.random.default_rng(2).standard_normal(len(empirical.parameters))
    kinematic = kinematic_model(ARRANGEMENTS[name], 5, 5, LOWER, UPPER)
    found, deviation = along_axes(empirical, a, kinematic)
    if not kinematic.arrangement.workpiece_side:
        assert deviation < 1e-15
    t = np.linspace(0, 1, 7)[:, None]
    for axis in range(3):
        x = np.array(LOWER) + t * (np.array(UPPER) - LOWER) * np.eye(3)[axis]
        p = np.broadcast_to([0.02, 0.03, -0.05], x.shape)
        np.testing.assert_allclose(
            kinematic.error(x, found, p), empirical.error(x, a, p), atol=deviation + 1e-15
        )
    # Off the axes they differ: section 2.3.
    x, p = places(20)
    assert np.abs(kinematic.error(x, found, p) - empirical.error(x, a, p)).max() > 1e-6


def test_along_the_axes_and_back() -> None:
    kinematic = kinematic_model(ARRANGEMENTS["MB2"], 4, 4, LOWER, UPPER)
    empirical = containing(kinematic)
    a = 1e-5 * np.random.default_rng(3).standard_normal(len(kinematic.parameters))
    found, deviation = along_axes(empirical, linear_map(kinematic, empirical) @ a, kinematic)
    assert deviation < 1e-15
    np.testing.assert_allclose(found, a, rtol=0, atol=1e-14)
