"""Kinds of observation that an extension provides, heights of balls above a plane and angles at
balls: every command knows them.
"""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate import experiment
from ballplate.simulator.experiment.layout import lay_out
from scipy.optimize import least_squares
from scipy.stats import norm

from tests.reference import dense
from tests.reference.installed_extension import install, said_with
from tests.reference.small_quickstart import small_sections

SIDES = {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.2 um"}
HEIGHTS = {
    "kind": "flatness",
    "balls": ["r2c2", "r3c3", "r2c3"],
    "plane": ["r1c1", "r1c3", "r3c1"],
    "values": ["1.5 um", "0 mm", "-0.5 um"],
    "standard_uncertainty": "0.05 um",
}
# Indices of the balls of each height: itself, then those of its plane.
ENDS = np.array([[4, 0, 2, 6], [8, 0, 2, 6], [5, 0, 2, 6]])
VALUE, UNCERTAINTY = np.array([1.5e-6, 0.0, -0.5e-6]), 5e-8
CORNER = {
    "kind": "corner",
    "balls": ["r1c3", "r1c1", "r3c1"],
    "standard_uncertainty": "0.05 arcsec",
}
ANGLE_UNCERTAINTY = 0.05 * np.pi / 180 / 3600
ONE_HEIGHT = HEIGHTS | {"values": ["0 mm"], "balls": ["r2c3"]}
REFUSED = {
    "collinear plane": ONE_HEIGHT | {"plane": ["r1c1", "r1c2", "r1c3"]},
    "nearly collinear plane": ONE_HEIGHT | {"plane": ["r1c1", "r2c2", "r3c3"]},
    "ball of its plane": ONE_HEIGHT | {"balls": ["r1c1"]},
    "no balls": CORNER | {"balls": []},
    "same angle twice": CORNER | {"balls": [*CORNER["balls"], *CORNER["balls"]]},
}

SCRIPT = """
base, readings, certificate = (str(folder / name) for name in ("base.yaml", "r.csv", "c.csv"))
start = bp.load(base)
said("simulate", base, "-o", readings, "--certificate", certificate, "--seed", "2")
fitted = bp.fit(start, bp.simulate(start, seed=5))
given = fitted.design.readings
def refusal(name):
    try:
        bp.load(folder / f"{name}.yaml")
    except bp.ExperimentError as error:
        return str(error)
    return ""

biases = bp.reliability(start, sigma="given")
corner, angle_certificate = str(folder / "corner.yaml"), str(folder / "angle.csv")
said("simulate", corner, "-o", readings + "2", "--certificate", angle_certificate, "--seed", "2")
angular = bp.reliability(bp.load(corner), sigma="given")
print(json.dumps({
    "run": bp.run(start, trials=256).to_dict(),
    "few": bp.check(folder / "few.yaml").to_dict(),
    "plan": bp.plan(folder / "pool.yaml", "U6", hours=100.0).to_dict(),
    "reliability": biases.to_dict(),
    "reliability table": biases.lines(),
    "read": [given.ball.tolist(), given.position.tolist(), given.probe.tolist()],
    "x": fitted.observed.x.tolist(),
    "balls": fitted.solution.state.balls.tolist(),
    "S^2": fitted.solution.factor.sum_of_squares,
    "status": fitted.solution.status,
    "certificate": Path(certificate).read_text(),
    "fit": said("fit", base, readings, "--certificate", certificate, "--json")[1],
    "schema": json.loads(said("schema")[1]),
    "refused": refusal("wrong"),
    "refusals": {name: refusal(name) for name in sys.argv[2:]},
    "angle certificate": Path(angle_certificate).read_text(),
    "angle reliability": angular.to_dict(),
    "angle reliability table": angular.lines(),
}))
"""


def sections(*calibration: dict[str, Any], **changes: Any) -> str:
    """An experiment file, the quickstart with few balls, coefficients and points."""
    found = small_sections(20, 1, calibration=list(calibration))
    return str(yaml.safe_dump(found | changes))


def only_low() -> list[dict[str, Any]]:
    return [one for one in yaml.safe_load(sections())["positions"] if one["name"] == "z low"]


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What is said where the extension is installed."""
    folder = install(tmp_path_factory.mktemp("package"))
    work = folder / "work"
    work.mkdir()
    priced = {"name": "heights", "price": "1 h", **HEIGHTS}
    wrong = HEIGHTS | {"balls": ["r2c2", "r9c9", "r2c3"]}
    for name, text in {
        "base": sections(SIDES, HEIGHTS),
        "few": sections(SIDES, HEIGHTS, positions=only_low()),
        "pool": sections(SIDES, pool={"calibration": [priced]}),
        "wrong": sections(SIDES, wrong),
        "corner": sections(SIDES, CORNER),
        **{name: sections(SIDES, one) for name, one in REFUSED.items()},
    }.items():
        (work / f"{name}.yaml").write_text(text, encoding="utf-8")
    return said_with(folder, SCRIPT, work, *REFUSED)


def problem(**changes: Any) -> dense.Problem:
    """The same without heights, for the dense computation."""
    made = experiment(yaml.safe_load(sections(SIDES, **changes)))
    return dense.planned(lay_out(made), 3, 3)


@cache
def drawn() -> dense.Problem:
    return problem()


def heights(balls: dense.Values) -> dense.Values:
    """Volumes over areas."""
    found = []
    for ball, origin, one, other in ENDS:
        edges = np.array([balls[k] - balls[origin] for k in (one, other, ball)])
        volume = (
            edges[0, 0] * (edges[1, 1] * edges[2, 2] - edges[1, 2] * edges[2, 1])
            - edges[0, 1] * (edges[1, 0] * edges[2, 2] - edges[1, 2] * edges[2, 0])
            + edges[0, 2] * (edges[1, 0] * edges[2, 1] - edges[1, 1] * edges[2, 0])
        )
        gram = [[(edges[i] * edges[j]).sum() for j in range(2)] for i in range(2)]
        found.append(volume / np.sqrt(gram[0][0] * gram[1][1] - gram[0][1] * gram[1][0]))
    return np.array(found)


def residuals(
    of: dense.Problem, step: dense.Values, uncertainty: float = UNCERTAINTY
) -> dense.Values:
    """All rows, those of the heights last."""
    balls = dense.unpack(of, step)[0]
    return np.concatenate([dense.residuals(of, step), (heights(balls) - VALUE) / uncertainty])


def spread(of: dense.Problem, uncertainty: float = UNCERTAINTY) -> dense.Spread:
    return dense.spread(
        dense.jacobian(lambda step: residuals(of, step, uncertainty), of.parameters)
    )


def test_uncertainties_are_those_of_a_dense_computation(told: dict[str, Any]) -> None:
    of, symbols = drawn(), ("U1", "U4", "U5", "U6")
    expected = dense.standard_uncertainties(of, spread(of), symbols)
    found = told["run"]["quantities"]
    for symbol in symbols:
        assert found[symbol]["maximum"] == pytest.approx(expected[symbol].max(), rel=1e-8)
        assert found[symbol]["average"] == pytest.approx(expected[symbol].mean(), rel=1e-8)
    without = dense.standard_uncertainties(of, symbols=["U1"])
    assert without["U1"].mean() > 1.01 * expected["U1"].mean()
    assert told["run"]["rank_deficiency"] == 0


def test_the_rank_is_that_of_a_dense_computation(told: dict[str, Any]) -> None:
    of = problem(positions=only_low())
    assert told["few"]["rank_deficiency"] == spread(of).deficiency
    assert spread(of).deficiency < dense.linearised(of).deficiency


def test_a_fit_minimises_the_sum_of_squares(told: dict[str, Any]) -> None:
    nominal = drawn()
    given = nominal.design.readings
    assert told["read"] == [given.ball.tolist(), given.position.tolist(), given.probe.tolist()]
    of = replace(nominal, scales=np.array(told["x"]))

    def derivative(at: np.ndarray) -> np.ndarray:
        return dense.jacobian(lambda step: residuals(of, at + step), of.parameters)

    start = np.zeros(of.parameters)
    solution = least_squares(
        lambda at: residuals(of, at), start, derivative, x_scale="jac", xtol=1e-15, ftol=1e-15
    )
    assert told["status"] == "converged"
    assert told["S^2"] == pytest.approx(2.0 * solution.cost, rel=1e-9)
    balls = dense.unpack(of, solution.x)[0]
    np.testing.assert_allclose(told["balls"], balls, rtol=0, atol=1e-12)
    # The heights are far from what the drawing has, and are met.
    assert np.abs(heights(balls) - VALUE).max() < 5 * UNCERTAINTY < np.abs(VALUE).max()


def test_replicates_scatter_by_the_uncertainty(told: dict[str, Any]) -> None:
    for found in told["run"]["monte_carlo"]["quantities"].values():
        ratio = found["spread_ratio"]
        assert abs(ratio["value"] - 1.0) < 4.0 * ratio["standard_error"]


def test_the_smallest_detectable_bias_is_that_of_the_hat_matrix(told: dict[str, Any]) -> None:
    of = drawn()
    whole = dense.jacobian(lambda step: residuals(of, step), of.parameters)
    hat = (np.linalg.qr(whole / np.linalg.norm(whole, axis=0))[0][-3:] ** 2).sum(axis=1)
    limit = norm.isf(0.0005) + norm.isf(0.2)
    found = [one for one in told["reliability"]["observations_by_name"] if one["kind"] == "height"]
    assert [one["name"] for one in found] == [f"height of ball {b}" for b in HEIGHTS["balls"]]
    for one, taken in zip(found, hat, strict=True):
        assert one["redundancy"] == pytest.approx(1.0 - taken, rel=1e-6)
        assert one["minimal_detectable"] == pytest.approx(
            limit * UNCERTAINTY / np.sqrt(1.0 - taken), rel=1e-4
        )
    assert "height of ball" in " ".join(told["reliability table"])


def test_a_plan_buys_it(told: dict[str, Any]) -> None:
    of, plan = drawn(), told["plan"]
    assert "heights" in json.dumps(plan["chosen"])
    expected = dense.standard_uncertainties(of, spread(of), ["U6"])["U6"].mean()
    assert plan["value"] == pytest.approx(expected, rel=1e-6)


def test_files_hold_its_values(told: dict[str, Any]) -> None:
    lines = [line for line in told["certificate"].splitlines() if "calibration[1]" in line]
    assert [line.split(",")[1:3] for line in lines] == [[b, "height"] for b in HEIGHTS["balls"]]
    assert json.loads(told["fit"])["status"] == "converged"


def test_certificates_have_the_unit_of_the_kind(told: dict[str, Any]) -> None:
    (line,) = [one for one in told["angle certificate"].splitlines() if "calibration[1]" in one]
    item, ball, what, value = line.split(",")
    assert (ball, what) == ("r1c1", "angle")
    number, unit = value.split()
    assert unit == "rad"
    assert 0.0 < abs(float(number) - np.pi / 2) < 6.0 * ANGLE_UNCERTAINTY


def test_reliability_has_the_unit_of_the_kind(told: dict[str, Any]) -> None:
    found = told["angle reliability"]["observations_by_name"]
    assert [one["unit"] for one in found if one["kind"] == "angle"] == ["rad"]
    table = told["angle reliability table"]
    (line,) = [one for one in table if one.startswith("angle at ball r1c1")]
    assert "µrad" in line


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("collinear plane", "cannot be determined at the nominal locations of the balls"),
        ("nearly collinear plane", "cannot be determined at the nominal locations of the balls"),
        ("ball of its plane", "is the same wherever balls are"),
        ("no balls", "states no value"),
        ("same angle twice", "states r1c1, angle more than once"),
    ],
)
def test_what_cannot_be_observed_is_refused(told: dict[str, Any], name: str, words: str) -> None:
    (line,) = told["refusals"][name].splitlines()
    assert "calibration[1]: " in line and words in line


def test_messages_and_the_schema_know_it(told: dict[str, Any]) -> None:
    assert 'unknown ball "r9c9"' in told["refused"] and "calibration[1].balls[1]" in told["refused"]
    settings = told["schema"]["$defs"]
    assert {"FlatnessSettings", "PricedFlatnessSettings"} <= set(settings)
    assert "standard_uncertainty" in settings["FlatnessSettings"]["required"]
