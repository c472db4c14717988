"""A kind of influence quantity that an extension provides, styli that are longer than stated: every
command knows it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load

from tests.extensions.influences import wording
from tests.reference import dense
from tests.reference.installed_extension import install, said_with
from tests.reference.small_quickstart import small_sections

TOP = Path(__file__).parents[3]
UNCERTAINTY = 2e-5
STYLI = {"kind": "styli", "value": "100 ppm", "standard_uncertainty": "20 ppm"}

SCRIPT = """
import json, sys
from pathlib import Path

import ballplate as bp
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.readings.simulated import simulated_readings

folder = Path(sys.argv[1])
start = bp.load(folder / "base.yaml")
free = bp.check(folder / "free.yaml")
seen = simulated_readings(start, seed=5)
fitted = bp.fit(start, bp.simulate(start, seed=5))
try:
    bp.load(folder / "wrong.yaml")
    refused = ""
except ExperimentError as error:
    refused = str(error)
print(json.dumps({
    "run": bp.run(start, trials=1024).to_dict(),
    "free": [free.to_dict(), [str(one) for one in free.verdict.null]],
    "truth": seen.truth.influences.tolist(),
    "estimates": [[one.name, one.value, one.standard_uncertainty] for one in fitted.estimates],
    "table": fitted.lines(),
    "reliability": bp.reliability(start, sigma="given").to_dict(),
    "refused": refused,
}))
"""


def sections(*influences: dict[str, Any]) -> str:
    """An experiment file, the quickstart with few coefficients and points."""
    found = small_sections(20, 1, true_machine={"kind": "zero"}, sigma="given")
    return str(yaml.safe_dump(found | ({"influences": list(influences)} if influences else {})))


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What is said where the extension is installed."""
    folder = install(tmp_path_factory.mktemp("package"))
    work = folder / "work"
    work.mkdir()
    for name, influences in {
        "base": [STYLI],
        "free": [{"kind": "styli"}],
        "wrong": [STYLI | {"value": "1 um"}],
    }.items():
        (work / f"{name}.yaml").write_text(sections(*influences), encoding="utf-8")
    return said_with(folder, SCRIPT, work)


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> dense.Problem:
    path = tmp_path_factory.mktemp("plain") / "plain.yaml"
    path.write_text(sections(), encoding="utf-8")
    return dense.planned(lay_out(load(path)[0]), 3, 3)


def spread(of: dense.Problem, weight: float) -> dense.Spread:
    """The dense covariance with a ratio of the styli as the last parameter."""
    readings = of.design.readings
    offsets = of.design.probes.offsets[readings.probe]

    def rows(step: Any) -> Any:
        found = dense.residuals(of, step[:-1])
        shift = -step[-1] * offsets / of.design.machine.repeatability
        found[: shift.size] = found[: shift.size] - shift.ravel()
        return np.append(found, step[-1] * weight)

    return dense.spread(dense.jacobian(rows, of.parameters + 1))


def test_uncertainties_are_those_of_the_dense_computation(
    told: dict[str, Any], problem: dense.Problem
) -> None:
    found = spread(problem, 1.0 / UNCERTAINTY)
    for symbol in ("U1", "U5", "U6"):
        function = dense.quantities(problem)[symbol]
        rows = np.pad(dense.jacobian(function, problem.parameters), ((0, 0), (0, 1)))
        values = found.of(rows)
        given = told["run"]["quantities"][symbol]
        assert given["average"] == pytest.approx(values.mean(), rel=1e-7)
        assert given["maximum"] == pytest.approx(values.max(), rel=1e-7)
    (own,) = [one for one in told["estimates"] if one[0] == "ratio of the styli"]
    expected = np.sqrt(found.covariance[-1, -1])
    assert own[2] == pytest.approx(expected, rel=1e-3)
    assert abs(own[1] - told["truth"][0]) < 4.5 * expected
    assert any(line.startswith(wording.RATIO_OF_THE_STYLI) for line in told["table"])


def test_the_truth_is_drawn_from_the_statement(told: dict[str, Any]) -> None:
    (truth,) = told["truth"]
    assert 0.0 < abs(truth - 1e-4) < 5 * UNCERTAINTY


def test_an_unknown_ratio_is_in_the_rank(told: dict[str, Any], problem: dense.Problem) -> None:
    deficiency = spread(problem, 0.0).deficiency
    assert told["free"][0]["rank_deficiency"] == deficiency
    assert any(wording.RATIO_OF_THE_STYLI in one for one in told["free"][1]) == (deficiency > 0)


def test_replicates_scatter_by_the_uncertainty(told: dict[str, Any]) -> None:
    for found in told["run"]["monte_carlo"]["quantities"].values():
        ratio = found["spread_ratio"]
        assert abs(ratio["value"] - 1.0) < 4.0 * ratio["standard_error"]


def test_what_is_wrong_is_told_at_its_place(told: dict[str, Any]) -> None:
    assert "influences[0].value" in told["refused"] and "is a length" in told["refused"]


def test_reliability_knows_what_is_stated(told: dict[str, Any]) -> None:
    assert wording.PRIOR_OF_RATIO_OF_THE_STYLI in str(told["reliability"])
