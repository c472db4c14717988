"""Jacobians of all error models, and what every error model promises."""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.extensions.machine_files.description import fitted_volumetric, true_volumetric
from ballplate.extensions.machine_files.framing import FramedModel
from ballplate.extensions.machine_files.machine_file import load_machine
from ballplate.montecarlo.experiments import JoinedModel
from ballplate.simulator.machines._empirical import empirical_model
from ballplate.simulator.machines._terms import (
    RADIAL,
    Radial,
    no_terms,
    quadratic,
    sums,
    tensor,
    univariate,
)
from ballplate.simulator.machines.arrangement import ARRANGEMENTS, Arrangement
from ballplate.simulator.machines.bases import Monomial, Polynomial
from ballplate.simulator.machines.kinematic import (
    PlaneModel,
    in_plane,
    kinematic_model,
    kinematic_model_of,
)
from ballplate.simulator.machines.metric import MetricModel, SpatialMetricModel
from ballplate.simulator.machines.protocol import ErrorModel, HasLines
from ballplate.simulator.machines.spline_basis import Spline
from hypothesis import given, strategies as st

from tests.reference.derivatives import assert_derivative, complex_step

LOWER, UPPER = (-0.2, 0.1, 0.0), (0.8, 0.7, 1.3)

OWN = (("EXX", Spline(3, (0.4,))), ("EXY", Polynomial(2)), ("EAZ", None), ("EBX", Monomial(5)))

MODELS: dict[str, ErrorModel] = {
    **{
        f"{name} {'full' if full else 'linearised'}": kinematic_model(
            arrangement, 5, 4, LOWER, UPPER, full
        )
        for name, arrangement in ARRANGEMENTS.items()
        for full in (False, True)
    },
    "few coefficients": kinematic_model(ARRANGEMENTS["MB2"], 2, 1, LOWER, UPPER),
    **{
        f"kinematic of {name} {'full' if full else 'linearised'}": kinematic_model_of(
            ARRANGEMENTS["MB2"], basis, Monomial(3), LOWER, UPPER, full
        )
        for name, basis in {
            "monomials": Monomial(4),
            "splines": Spline(4, (0.3, 0.5)),
            "splines of zero slopes": Spline(4, (0.5, 0.5), ends="zero slopes"),
        }.items()
        for full in (False, True)
    },
    **{
        f"empirical {name} {'full' if full else 'linearised'}": empirical_model(
            terms, LOWER, UPPER, full
        )
        for name, terms in {
            "sums of polynomials": sums(Polynomial(4)),
            "sums of splines": sums(Spline(4, (0.5,))),
            "sums of periodic splines": sums(Spline(4, (0.3, 0.5), ends="periodic")),
            "quadratic": quadratic(),
            "tensor": tensor(Spline(3, (0.5,))),
            "radial": Radial((3, 3, 2), 0.5),
        }.items()
        for full in (False, True)
    },
    **{
        f"{form} {'full' if full else 'linearised'}": kinematic_model_of(
            ARRANGEMENTS[arrangement], Polynomial(4), Polynomial(3), LOWER, UPPER, full, own, square
        )
        for form, arrangement, own, square in (
            ("21 parameters of MB2", "MB2", (), True),
            ("21 parameters of CX1", "CX1", (), True),
            ("own functions", "FB1", OWN, False),
            ("21 parameters and own functions", "MB1", OWN, True),
        )
        for full in (False, True)
    },
    **{
        f"empirical with other rotations {'full' if full else 'linearised'}": empirical_model(
            univariate(Polynomial(4)), LOWER, UPPER, full, of_rotations=sums(Spline(3, (0.5,)))
        )
        for full in (False, True)
    },
    "empirical without rotations": empirical_model(
        sums(Monomial(3)), LOWER, UPPER, of_rotations=no_terms()
    ),
    **{
        f"radial {function}": empirical_model(Radial((3, 2, 2), 0.5, function), LOWER, UPPER)
        for function in RADIAL
    },
    **{
        f"plane of {name}": PlaneModel(
            in_plane(
                kinematic_model_of(
                    ARRANGEMENTS[name], Polynomial(4), Polynomial(3), LOWER, UPPER, full, (), square
                )
            ),
            0.0,
        )
        for name, full, square in (("MB2", False, True), ("MB1", True, False), ("CY1", True, True))
    },
    "plane of a machine file in another frame": FramedModel(
        PlaneModel(true_volumetric(load_machine("designs/park/machines/npl-like.yaml")).model, 0.2),
        LOWER[:2],
    ),
    "joined": JoinedModel(
        kinematic_model(ARRANGEMENTS["MB2"], 3, 3, LOWER, UPPER),
        empirical_model(quadratic(), LOWER, UPPER, True),
    ),
    "volumetric stated": (
        true_volumetric(load_machine("designs/park/machines/measured-errors.yaml")).model
    ),
    "volumetric with droop": (
        true_volumetric(load_machine("designs/park/machines/gec-like.yaml")).model
    ),
    "volumetric in another frame": FramedModel(
        true_volumetric(load_machine("designs/park/machines/npl-like.yaml")).model, LOWER
    ),
    **{
        f"volumetric fitted {name}": fitted_volumetric(
            load_machine(f"designs/park/machines/{name}.yaml"), LOWER, UPPER, 2
        )
        for name in ("measured-errors", "gec-like", "npl-like")
    },
    **{f"metric {scale}": MetricModel(scale) for scale in ("none", "x", "y", "split")},
    **{
        f"spatial metric {scales}": SpatialMetricModel(scales, LOWER, UPPER)
        for scales in (True, False)
    },
}

models = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)


def draw(model: ErrorModel, seed: int, size: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    generator = np.random.default_rng(seed)
    d = model.dimension
    x = generator.uniform(LOWER[:d], UPPER[:d], (6, d))
    return (
        x,
        size * generator.standard_normal(len(model.parameters)),
        0.1 * generator.standard_normal((6, d)),
    )


@models
def test_jacobian_is_the_derivative_of_the_error(model: ErrorModel) -> None:
    for size in (0.0, 1e-2):
        x, a, p = draw(model, 1, size)
        assert_derivative(
            model.jacobian(x, a, p),
            complex_step(lambda b, x=x, p=p: model.error(x, b, p), a),
            1e-13,
        )
    # Without errors the correction is the probe offset.
    np.testing.assert_allclose(model.error(x, 0.0 * a, p), p, rtol=0, atol=1e-15)


@models
def test_parameters_have_names_and_lines_and_as_many_reported_values(model: ErrorModel) -> None:
    names = [parameter.name for parameter in model.parameters]
    assert len(set(names)) == len(names)
    assert all(parameter.effect > 0 and parameter.meaning for parameter in model.parameters)
    reported = model.reported()
    assert reported.matrix.shape == (len(reported.names), len(names))
    assert len(set(reported.names)) == len(reported.names) == len(reported.units)
    assert np.linalg.matrix_rank(reported.matrix) == len(names)
    functions = [parameter.function for parameter in model.parameters]
    for name in set(functions) if isinstance(model, HasLines) else ():
        lines = model.lines(name, np.linspace(0, 1, 5))  # type: ignore[attr-defined]
        assert lines and {line.basis.shape for line in lines} == {(5, functions.count(name))}
        assert len({line.words for line in lines}) == len(lines)


@given(st.sampled_from(sorted(ARRANGEMENTS)), st.integers(0, 10_000))
def test_full_and_linearised_rotations_differ_to_second_order(name: str, seed: int) -> None:
    linearised = kinematic_model(ARRANGEMENTS[name], 4, 4, LOWER, UPPER)
    full = kinematic_model(ARRANGEMENTS[name], 4, 4, LOWER, UPPER, True)
    x, a, p = draw(full, seed, 1e-3)
    large = np.abs(full.error(x, a, p) - linearised.error(x, a, p)).max()
    small = np.abs(full.error(x, a / 10, p) - linearised.error(x, a / 10, p)).max()
    assert 90 < large / small < 111


def test_kinematic_model_keeps_the_frame() -> None:
    model = kinematic_model(ARRANGEMENTS["MB2"], 6, 5, LOWER, UPPER)
    _, a, p = draw(model, 3, 1e-5)
    corner = np.array([LOWER])
    np.testing.assert_allclose(model.error(corner, a, p[:1]), p[:1], atol=1e-18)
    along_x = np.array([[UPPER[0], LOWER[1], LOWER[2]]])
    np.testing.assert_allclose(model.error(along_x, a, 0 * p[:1])[0, 1:], 0.0, atol=1e-18)
    along_y = np.array([[LOWER[0], UPPER[1], LOWER[2]]])
    assert abs(model.error(along_y, a, 0 * p[:1])[0, 2]) < 1e-18
    assert abs(model.error(along_y, a, 0 * p[:1])[0, 0]) > 1e-7


def test_an_arrangement_has_each_axis_once() -> None:
    with pytest.raises(ValueError, match="exactly once"):
        Arrangement(("x", "y"), ("x",))


def test_metric_scales_share_the_difference() -> None:
    point, p = np.array([[2.0, 3.0]]), np.zeros((1, 2))
    for scale, expected in (("x", (-2e-5, 0.0)), ("y", (0.0, 3e-5)), ("split", (-1e-5, 1.5e-5))):
        model = MetricModel(scale)  # type: ignore[arg-type]
        np.testing.assert_allclose(
            model.error(point, np.array([0.0, 1e-5]), p)[0], expected, atol=1e-9
        )
