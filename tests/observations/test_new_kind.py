"""A kind of observation added as one file and one line, heights of balls above a plane as the
documentation has them: every command then knows it.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate import experiment
from ballplate.simulator.experiment.layout import lay_out
from scipy.optimize import least_squares
from scipy.stats import norm

from tests.reference import dense

TOP = Path(__file__).parents[2]

SIDES = {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.2 um"}
HEIGHTS = {
    "kind": "flatness",
    "balls": ["r3c3", "r5c5", "r2c4"],
    "plane": ["r1c1", "r1c5", "r5c1"],
    "values": ["1.5 um", "0 mm", "-0.5 um"],
    "standard_uncertainty": "0.05 um",
}
# Indices of the balls of each height: itself, then those of its plane.
ENDS = np.array([[12, 0, 4, 20], [24, 0, 4, 20], [8, 0, 4, 20]])
VALUE, UNCERTAINTY = np.array([1.5e-6, 0.0, -0.5e-6]), 5e-8
SWEEP = """\
title: heights
base: base.yaml
axes:
  u: {path: "calibration[1].standard_uncertainty", values: [0.05 um, 0.5 um]}
"""

SCRIPT = """
import contextlib, io, json, sys
from pathlib import Path

import ballplate as bp
from ballplate.cli import main
from ballplate.simulator.inputs.messages import ExperimentError

def said(*arguments):
    stream = io.StringIO()
    with contextlib.redirect_stdout(stream), contextlib.redirect_stderr(stream):
        try:
            main(list(arguments))
        except SystemExit:
            pass
    return stream.getvalue()

folder = Path(sys.argv[1])
base, readings, certificate = (str(folder / name) for name in ("base.yaml", "r.csv", "c.csv"))
store, start = str(folder / "store"), bp.load(base)
said("sweep", str(folder / "sweep.yaml"), "--store", store, "--workers", "1")
said("simulate", base, "-o", readings, "--certificate", certificate, "--seed", "2")
fitted = bp.fit(start, bp.simulate(start, seed=5))
given = fitted.design.readings
try:
    bp.load(folder / "wrong.yaml")
    refused = ""
except ExperimentError as error:
    refused = str(error)
biases = bp.reliability(start, sigma="given")
print(json.dumps({
    "run": bp.run(start, trials=2048).to_dict(),
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
    "fit": said("fit", base, readings, "--certificate", certificate, "--json"),
    "schema": json.loads(said("schema")),
    "refused": refused,
    "export": said("export", store, "-o", "-"),
}))
"""


def sections(*calibration: dict[str, Any], **changes: Any) -> str:
    """An experiment file, the quickstart with few coefficients and points."""
    found = yaml.safe_load((TOP / "designs" / "quickstart.yaml").read_text(encoding="utf-8"))
    found["error_model"] |= {"position_coefficients": 3, "rotation_coefficients": 3}
    found["evaluation"]["points"] = {"random": 20, "seed": 1}
    return str(yaml.safe_dump(found | {"calibration": list(calibration)} | changes))


def only_low() -> list[dict[str, Any]]:
    return [one for one in yaml.safe_load(sections())["positions"] if one["name"] == "z low"]


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What a copy of the package says that has the file and the line of the documentation."""
    folder = tmp_path_factory.mktemp("package")
    package, ignored = folder / "ballplate", shutil.ignore_patterns("__pycache__")
    shutil.copytree(TOP / "analysis", package, ignore=ignored)
    for part in ("simulator", "designs"):
        shutil.copytree(TOP / part, package / part, ignore=ignored)
    page = (TOP / "docs" / "how-to" / "extend.md").read_text(encoding="utf-8")
    page = page.partition("**A kind of observation**")[2]
    file, entry = (part.split("```\n")[0] for part in page.split("```python\n")[1:3])
    rooms = package / "simulator" / "design" / "observations"
    (rooms / "flatness.py").write_text(file, encoding="utf-8")
    kinds = (rooms / "kinds.py").read_text(encoding="utf-8")
    line, registered = entry.strip().split("\n\n")
    for mark, new in (
        ("from .radius import", line + "\n"),
        ("    RadiusSettings: read", registered),
    ):
        assert kinds.count(mark) == 1
        kinds = kinds.replace(mark, new.rstrip() + "\n" + mark)
    (rooms / "kinds.py").write_text(kinds, encoding="utf-8")
    work = folder / "work"
    work.mkdir()
    priced = {"name": "heights", "price": "1 h", **HEIGHTS}
    wrong = HEIGHTS | {"balls": ["r3c3", "r9c9", "r2c4"]}
    for name, text in {
        "base": sections(SIDES, HEIGHTS),
        "few": sections(SIDES, HEIGHTS, positions=only_low()),
        "pool": sections(SIDES, pool={"calibration": [priced]}),
        "wrong": sections(SIDES, wrong),
        "sweep": SWEEP,
    }.items():
        (work / f"{name}.yaml").write_text(text, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(work)],
        env={**os.environ, "PYTHONPATH": str(folder)},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


def problem(**changes: Any) -> dense.Problem:
    """The same without heights, for the dense computation."""
    made = experiment(yaml.safe_load(sections(SIDES, **changes)))
    return dense.planned(lay_out(made), 3, 3)


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
    of = problem()
    expected = dense.standard_uncertainties(of, spread(of))
    found = told["run"]["quantities"]
    for symbol in ("U1", "U4", "U5", "U6"):
        assert found[symbol]["maximum"] == pytest.approx(expected[symbol].max(), rel=1e-8)
        assert found[symbol]["average"] == pytest.approx(expected[symbol].mean(), rel=1e-8)
    without = dense.standard_uncertainties(of)
    assert without["U1"].mean() > 1.01 * expected["U1"].mean()
    assert told["run"]["rank_deficiency"] == 0


def test_the_rank_is_that_of_a_dense_computation(told: dict[str, Any]) -> None:
    of = problem(positions=only_low())
    assert told["few"]["rank_deficiency"] == spread(of).deficiency
    assert spread(of).deficiency < dense.linearised(of).deficiency


def test_a_fit_minimises_the_sum_of_squares(told: dict[str, Any]) -> None:
    nominal = problem()
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
    of = problem()
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
    of, plan = problem(), told["plan"]
    assert "heights" in json.dumps(plan["chosen"])
    expected = dense.standard_uncertainties(of, spread(of))["U6"].mean()
    assert plan["value"] == pytest.approx(expected, rel=1e-6)


def test_sweeps_vary_it(told: dict[str, Any]) -> None:
    of = problem()
    head, *rows = [line.split(",") for line in told["export"].splitlines()]
    for row, uncertainty in zip(rows, (5e-8, 5e-7), strict=True):
        expected = dense.standard_uncertainties(of, spread(of, uncertainty))["U1"].mean()
        assert float(row[head.index("U1_average_m")]) == pytest.approx(expected, rel=1e-8)


def test_files_hold_its_values(told: dict[str, Any]) -> None:
    lines = [line for line in told["certificate"].splitlines() if "calibration[1]" in line]
    assert [line.split(",")[1:3] for line in lines] == [[b, "height"] for b in HEIGHTS["balls"]]
    assert json.loads(told["fit"])["status"] == "converged"


def test_messages_and_the_schema_know_it(told: dict[str, Any]) -> None:
    assert 'unknown ball "r9c9"' in told["refused"] and "calibration[1].balls[1]" in told["refused"]
    settings = told["schema"]["$defs"]
    assert {"FlatnessSettings", "PricedFlatnessSettings"} <= set(settings)
    assert "standard_uncertainty" in settings["FlatnessSettings"]["required"]
