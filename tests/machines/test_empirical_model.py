"""The empirical model: how many functions, which vanish where, and what they are without."""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.simulator.machines._empirical import (
    FRAME,
    FUNCTIONS,
    EmpiricalModel,
    empirical_model,
)
from ballplate.simulator.machines._terms import Radial, Terms, quadratic, sums, tensor
from ballplate.simulator.machines.bases import Monomial, Polynomial
from ballplate.simulator.machines.spline_basis import Spline

LOWER, UPPER = (-0.2, 0.1, 0.0), (0.8, 0.7, 1.3)
TERMS: dict[str, Terms] = {
    "sums of quadratic splines": sums(Spline(3)),
    "sums of cubic splines": sums(Spline(4, (0.5,))),
    "sums of polynomials": sums(Polynomial(5)),
    "quadratic": quadratic(),
    "tensor": tensor(Monomial(3)),
    "radial": Radial((3, 2, 4), 0.4),
}
every = pytest.mark.parametrize("terms", TERMS.values(), ids=TERMS)


def random_places(count: int) -> np.ndarray:
    return np.random.default_rng(1).random((count, 3))


@pytest.mark.parametrize(
    ("terms", "count"),
    [
        (sums(Spline(3)), 7 + 9 * 1),
        (sums(Spline(4, (0.5,))), 7 + 9 * 3),
        (sums(Spline(4, (0.5,), ends="zero slopes")), 7 + 9 * 1),
        (sums(Spline(4, (0.3, 0.5), ends="periodic")), 7 + 9 * 2),
        (sums(Polynomial(2)), 7),
        (quadratic(), 10),
        (tensor(Spline(4, (0.5,))), 5**3),
        (Radial((3, 3, 3), 0.5), 27),
    ],
)
def test_number_of_functions(terms: Terms, count: int) -> None:
    assert len(terms.names) == len(set(terms.names)) == count
    model = empirical_model(terms, LOWER, UPPER)
    assert len(model.parameters) == 6 * count - len(FRAME)


@every
def test_functions_are_independent(terms: Terms) -> None:
    """No redundancy: the columns at random places have full rank by a wide margin."""
    values = terms.values(random_places(500))
    size = np.linalg.svd(values / np.abs(values).max(axis=0), compute_uv=False)
    assert size[-1] > 1e-4 * size[0]


@every
def test_the_frame_is_held(terms: Terms) -> None:
    model = empirical_model(terms, LOWER, UPPER)
    a = np.random.default_rng(2).standard_normal(len(model.parameters))
    lower, upper = np.array(LOWER), np.array(UPPER)
    for name, corner in FRAME:
        value = model.functions((lower + (upper - lower) * corner)[None], a)[
            0, list(FUNCTIONS).index(name)
        ]
        assert abs(value) < 1e-11, (name, corner)
    # Nothing else is held: with the frame's conditions the free terms span all that meets them.
    free = empirical_model(terms, LOWER, UPPER, frame=())
    assert len(free.parameters) - len(model.parameters) == len(FRAME)


@every
def test_quoted_form_gives_the_same_functions(terms: Terms) -> None:
    """Monomials as written in their names, where the terms are polynomials."""
    t = random_places(50)
    quoted = terms.quoted()
    if any(name.startswith("at") or "s1" in name for name in quoted.names):
        np.testing.assert_array_equal(quoted.matrix, np.eye(len(terms.names)))
        return
    x, y, z = t.T
    written = [
        eval(name.replace("^", "**"), {"x": x, "y": y, "z": z}) + 0 * x for name in quoted.names
    ]
    np.testing.assert_allclose(
        np.stack(written, axis=1) @ quoted.matrix, terms.values(t), atol=1e-12
    )


@every
def test_effects_are_the_largest_of_each_term_in_the_volume(terms: Terms) -> None:
    """In metres; of rotations with an arm of a tenth of the longest side, here 0.13 m."""
    model = empirical_model(terms, LOWER, UPPER)
    along = np.linspace(0.0, 1.0, 9)
    places = np.stack(np.meshgrid(along, along, along), axis=-1).reshape(-1, 3)
    x = np.array(LOWER) + places * (np.array(UPPER) - np.array(LOWER))
    for k, parameter in enumerate(model.parameters):
        largest = np.abs(model.functions(x, np.eye(len(model.parameters))[k])).max()
        arm = 0.13 if parameter.unit == "rad" else 1.0
        assert parameter.effect == pytest.approx(arm * largest, rel=1e-12), parameter.name


def test_quadratics_are_those_of_the_report() -> None:
    expected = {"1", "x", "y", "z", "x^2", "x*y", "x*z", "y^2", "y*z", "z^2"}
    assert set(quadratic().quoted().names) == expected


def test_rotations_turn_the_probe_right_handed() -> None:
    model = empirical_model(sums(Spline(3)), (0, 0, 0), (1, 1, 1))
    names = [parameter.name for parameter in model.parameters]
    a = np.zeros(len(names))
    a[names.index("EC x")] = 1e-5
    moved = model.error(np.array([[0.5, 0.2, 0.3]]), a, np.array([[0.1, 0.0, 0.0]]))
    np.testing.assert_allclose(moved, [[0.1, 0.1 * 0.5e-5, 0.0]], atol=1e-20)


def test_full_and_linearised_rotations_differ_to_second_order() -> None:
    linearised, full = (empirical_model(quadratic(), LOWER, UPPER, full) for full in (False, True))
    generator = np.random.default_rng(3)
    x, p = generator.uniform(LOWER, UPPER, (6, 3)), 0.1 * generator.standard_normal((6, 3))
    a = 1e-3 * generator.standard_normal(len(full.parameters))
    large = np.abs(full.error(x, a, p) - linearised.error(x, a, p)).max()
    small = np.abs(full.error(x, a / 10, p) - linearised.error(x, a / 10, p)).max()
    assert 90 < large / small < 111


def test_a_condition_that_mixes_terms_is_refused() -> None:
    with pytest.raises(ValueError, match="terms of EX"):
        empirical_model(sums(Spline(3)), LOWER, UPPER, frame=(("EX", (1.0, 1.0, 0.0)),))


def test_names_say_what_the_terms_are() -> None:
    model = empirical_model(sums(Spline(4, (0.5,))), LOWER, UPPER)
    names = [parameter.name for parameter in model.parameters]
    assert "EX x*y" in names and "EX s2(y)*x" in names and "EA z" in names
    assert "EX 1" not in names and "EY x" not in names and "EZ y" not in names
    assert isinstance(model, EmpiricalModel) and model.parameters[0].meaning == "error in X"
