"""True machines: stated by coefficients in either form, or drawn at random with a stated size."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest
from ballplate.simulator.inputs.extensions import UnusableError
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.machines.kinematic import kinematic_model
from ballplate.simulator.machines.metric import MetricModel
from ballplate.simulator.machines.protocol import Corner, ErrorModel, TrueMachine
from ballplate.simulator.machines.settings import MetricSettings, build_error_model
from ballplate.simulator.machines.truth import (
    CoefficientSettings,
    FurtherTrueMachine,
    RandomSettings,
    TruthError,
    ZeroSettings,
    true_machine,
    true_parameters,
)

MODEL = kinematic_model(ARRANGEMENTS["MB2"], 5, 5, (0, 0, 0), (1, 1, 1))
ORIGIN = np.zeros((1, 3))


def test_monomial_coefficients() -> None:
    settings = CoefficientSettings(
        kind="coefficients",
        values={"EXX t^2": "3 um", "EYX t^1": "1 um", "EYX t^2": "-1 um", "EAX t^1": "2 urad"},
    )
    a = true_parameters(settings, MODEL)
    x = np.array([[0.5, 0.0, 0.0]])
    np.testing.assert_allclose(MODEL.error(x, a, ORIGIN), [[0.75e-6, 0.25e-6, 0.0]], atol=1e-18)
    np.testing.assert_allclose(
        MODEL.error(x, a, np.array([[0, 0, 0.1]])), [[0.75e-6, 0.15e-6, 0.1]], atol=1e-18
    )


def test_coefficients_of_all_sizes_are_met_beside_one_another() -> None:
    """Those of nothing, too, which rounding of the others must not make contradict themselves."""
    values = {
        "EYX t^1": "1000 um",
        "EYX t^2": "-1000.3 um",
        "EYX t^3": "0.3 um",
        "EYX t^4": "0 um",
        "EZX t^1": "0 um",
        "EXX t^1": "0.7 um",
        "EXX t^4": "0 um",
        "EAX t^1": "0.001 urad",
        "EAX t^2": "700 urad",
        "EAX t^3": "0 urad",
    }
    a = true_parameters(CoefficientSettings(kind="coefficients", values=values), MODEL)
    reported = MODEL.reported()
    found = dict(zip(reported.names, (1e6 * reported.matrix @ a).tolist(), strict=True))
    for name in reported.names:
        wanted = float(values.get(name, "0 um").split()[0])
        assert found[name] == pytest.approx(wanted, abs=1e-9)


def test_own_coefficients() -> None:
    a = true_parameters(CoefficientSettings(kind="coefficients", values={"EXX[2]": "3 um"}), MODEL)
    assert a[1] == 3e-6 and np.count_nonzero(a) == 1
    metric = CoefficientSettings(
        kind="coefficients", values={"alpha": "5 urad", "gamma": "13.7 ppm"}
    )
    np.testing.assert_allclose(
        true_parameters(metric, MetricModel("x")), [5e-6, 13.7e-6], rtol=1e-15
    )


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("EXQ t^1", "1 um", 'no parameter "EXQ t^1"; did you mean'),
        ("EXX t^2", "1 urad", "is an angle; a length is expected"),
        ("EYX t^2", "1 um", "EYX must be zero at both ends"),
    ],
)
def test_wrong_coefficients_are_named(name: str, value: str, words: str) -> None:
    with pytest.raises(TruthError) as caught:
        true_parameters(CoefficientSettings(kind="coefficients", values={name: value}), MODEL)
    assert [problem[0] for problem in caught.value.problems] == [name]
    assert words in caught.value.problems[0][1]


def test_random_errors_have_the_stated_size_and_seed() -> None:
    settings = RandomSettings.model_validate(
        {"kind": "random", "position": "2 um", "rotation": "3 urad", "seed": 5}
    )
    a = true_parameters(settings, MODEL)
    np.testing.assert_array_equal(a, true_parameters(settings, MODEL))
    t = np.linspace(0, 1, 2001)
    for function in MODEL.functions:
        curve = function.basis.values(t) @ a[MODEL.slices[function.name]]
        size = 3e-6 if function.rotation else 2e-6
        assert np.sqrt(np.trapezoid(curve**2, t)) == pytest.approx(size, rel=1e-4)


@pytest.mark.parametrize("terms", ["quadratic", "sums", {"centres": (2, 3, 2)}])
def test_random_errors_of_another_model_have_the_stated_size_in_the_volume(terms: object) -> None:
    settings = RandomSettings.model_validate(
        {
            "kind": "random",
            "position": "2 um",
            "rotation": "3 urad",
            "error_model": {"kind": "empirical", "terms": terms},
        }
    )
    machine = true_machine(settings, MODEL, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    assert machine.model is not MODEL and len(machine.a) == len(machine.model.parameters)
    places = np.random.default_rng(1).random((5000, 3))
    found = machine.model.functions(places, machine.a)  # type: ignore[attr-defined]
    sizes = np.sqrt((found**2).mean(axis=0)) / np.repeat([2e-6, 3e-6], 3)
    assert sizes.min() > 0.4 and sizes.max() < 1.6


def test_stated_errors_of_another_model() -> None:
    settings = CoefficientSettings.model_validate(
        {
            "kind": "coefficients",
            "values": {"EX y^2": "3 um", "EA z": "2 urad"},
            "error_model": {"kind": "empirical", "terms": "quadratic"},
        }
    )
    machine = true_machine(settings, MODEL, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    x, p = np.array([[0.3, 0.5, 0.2]]), np.array([[0.0, 0.0, -0.1]])
    np.testing.assert_allclose(
        machine.model.error(x, machine.a, p), p + [[0.75e-6, 0.04e-6, 0.0]], atol=1e-18
    )


def test_the_true_machine_is_of_the_estimated_model_by_default() -> None:
    machine = true_machine(ZeroSettings(), MODEL, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    assert machine.model is MODEL and not machine.a.any()


class OtherMachine(FurtherTrueMachine):
    """A true machine of an extension whose method returns something else."""

    kind: Literal["other"] = "other"
    values: tuple[float, ...] | None = None

    def true_machine(self, fitted: ErrorModel, lower: Corner, upper: Corner) -> TrueMachine:
        return None if self.values is None else TrueMachine(fitted, np.array(self.values))  # type: ignore[return-value]


@pytest.mark.parametrize("values", [None, (1e-6,), (float("nan"),) * 3])
def test_a_machine_of_an_extension_has_a_value_for_each_parameter(values: Any) -> None:
    model = build_error_model(MetricSettings(kind="metric", scale="split"), (0.0, 0.0), (1.0, 1.0))
    settings = OtherMachine.model_construct(kind="other", values=values)
    with pytest.raises(UnusableError, match="true_machine of OtherMachine"):
        true_machine(settings, model, (0.0, 0.0), (1.0, 1.0))
