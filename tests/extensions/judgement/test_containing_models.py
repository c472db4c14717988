"""Kinematic models within empirical ones."""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.extensions.judgement.containing_models import NotContainedError, linear_map
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.machines.bases import Basis, Monomial, Polynomial, Spline
from ballplate.simulator.machines.empirical import empirical_model
from ballplate.simulator.machines.kinematic import kinematic_model, kinematic_model_of
from ballplate.simulator.machines.terms import quadratic, sums

LOWER, UPPER = (-0.2, 0.1, 0.0), (0.8, 0.7, 1.3)


def places(count: int) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(5)
    return generator.uniform(LOWER, UPPER, (count, 3)), 0.1 * generator.standard_normal((count, 3))


@pytest.mark.parametrize("name", sorted(ARRANGEMENTS))
@pytest.mark.parametrize(
    ("position", "rotation", "outer"),
    [
        (Polynomial(5), Polynomial(4), Polynomial(5)),
        (Spline(4, (0.5,)), Monomial(3), Spline(4, (0.5, 0.5))),
        (Spline(3, (0.3,)), Spline(3, (0.3, 0.6)), Spline(4, (0.3, 0.3, 0.6, 0.6))),
        (
            Spline(4, (0.5, 0.5), ends="zero slopes"),
            Spline(4, (0.3,), ends="periodic"),
            Spline(5, (0.3, 0.3, 0.5, 0.5, 0.5)),
        ),
    ],
)
def test_an_empirical_model_contains_every_kinematic_one(
    name: str, position: Basis, rotation: Basis, outer: Basis
) -> None:
    """Where an axis on the workpiece's side carries its own co-ordinate, rotations have a degree
    more, and move the corner by which the frame is held.
    """
    kinematic = kinematic_model_of(ARRANGEMENTS[name], position, rotation, LOWER, UPPER)
    empirical = empirical_model(sums(outer), LOWER, UPPER, frame=())
    matrix = linear_map(kinematic, empirical)
    a = 1e-5 * np.random.default_rng(1).standard_normal(len(kinematic.parameters))
    x, p = places(40)
    np.testing.assert_allclose(
        empirical.error(x, matrix @ a, p), kinematic.error(x, a, p), rtol=0, atol=1e-14
    )


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
