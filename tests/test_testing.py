"""The checks that users call in their tests: right code passes, each error is noticed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.machines.kinematic import kinematic_model
from ballplate.simulator.machines.metric import MetricModel
from ballplate.testing import check_ball_functions, check_influence, check_model, check_observations

from tests.extensions.influences.test_influence_checks import Long
from tests.extensions.own_models.test_python_values import module


@pytest.mark.parametrize(
    "model",
    [kinematic_model(ARRANGEMENTS["CX1"], 5, 5, (0, 0, 0), (1, 1, 1), True), MetricModel("x")],
)
def test_models(model: Any) -> None:
    lower, upper = np.zeros(model.dimension), np.ones(model.dimension)
    check_model(model, lower, upper)
    kind = type(model)

    class Scaled(kind):  # type: ignore[misc, valid-type]
        def jacobian(self, *given: Any) -> Any:
            return 1.001 * super().jacobian(*given)

    class Shifted(kind):  # type: ignore[misc, valid-type]
        def error(self, *given: Any) -> Any:
            return super().error(*given) + 1e-9

    for wrong, words in ((Scaled, "jacobian: not the derivative"), (Shifted, "is not p")):
        other = object.__new__(wrong)
        other.__dict__.update(model.__dict__)
        with pytest.raises(AssertionError, match=words):
            check_model(other, lower, upper)


@dataclass(frozen=True)
class Height:
    """A height of one ball, which depends on the frame, and a squared one, which is not linear."""

    power: int

    def values(self, balls: np.ndarray) -> np.ndarray:
        return (balls[:1, -1] - 1.0) ** self.power

    def derivatives(self, balls: np.ndarray) -> np.ndarray:
        found = np.zeros((1, *balls.shape))
        found[0, 0, -1] = 1.0
        return found


@pytest.mark.parametrize("dimension", [2, 3])
def test_ball_functions(dimension: int) -> None:
    balls = np.random.default_rng(2).uniform(0, 0.5, (4, dimension))
    own: dict[str, Any] = {}
    names = ("a", "b", "c", "d")
    for factor in ("", "1.001 * "):
        text = module().replace("along = sign * along", f"along = {factor}sign * along")
        exec(text, own)
        built = own["build"](names, balls, [[["a", "b"], ["c", "d"]]])
        if not factor:
            check_ball_functions(built, balls)
            continue
        with pytest.raises(AssertionError, match="derivatives: not the derivative"):
            check_ball_functions(built, balls)
    for power, words in ((1, "where the frame"), (2, "not the derivative")):
        with pytest.raises(AssertionError, match=words):
            check_ball_functions(Height(power), balls)  # type: ignore[arg-type]


def test_observations() -> None:
    design = bp.lay_out(bp.quickstart())
    given = design.of(CalibratedDistances)
    check_observations(given, design)

    class Wrong(CalibratedDistances):
        def rows(self, *of: Any) -> Any:
            found = super().rows(*of)
            return replace(found, by_ball=found.by_ball[:, ::-1])

    with pytest.raises(AssertionError, match="rows: not the derivative"):
        check_observations(Wrong(**vars(given)), design)


def test_influences() -> None:
    design = bp.lay_out(bp.quickstart())
    check_influence(lambda value: Long(value, {}), 1e-4, design)
    for factor in (-1.0, 1.01, 0.0):
        with pytest.raises(AssertionError, match="shifts: not the derivative"):
            check_influence(lambda value, by=factor: Long(value, {"factor": by}), 1e-4, design)  # type: ignore[misc]
