"""A quantity that an extension provides, U7, the body diagonals of the volume: every command has it."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate import experiment
from ballplate.simulator.experiment.layout import lay_out

from tests.analysis import wording
from tests.reference import dense
from tests.reference.installed_extension import install, said_with
from tests.reference.small_quickstart import small_sections

TOP = Path(__file__).parents[2]

SWEEP = """\
title: repeatability
base: base.yaml
axes:
  u: {path: machine.repeatability, values: [0.4 um, 0.8 um]}
trials: 16
"""

# What a person sees with the entry, and of it without.
SCRIPT = """
from ballplate.extensions.requirements.goals import SYMBOLS
from ballplate.extensions.planning.criteria import NAMES

start = bp.load(folder / "base.yaml")
found = bp.run(start, trials=64)
shown = {"run": found.to_dict(), "lines": found.lines(), "help": said("plan", "--help")[1]}
shown |= {"goals": list(SYMBOLS), "schema": json.loads(said("schema", "sweep")[1])}
if "U7" in SYMBOLS:
    places = {"planes": ["z"], "levels": ["100 mm", "400 mm"], "corners": {"x": ["50 mm"], "y": ["50 mm"]}}
    pool = start.with_(pool={"candidates": [places | {"probes": ["down"]}]})
    shown["plans"] = {name: bp.plan(pool, name, positions=7).to_dict() for name in NAMES if name.startswith("U7")}
    biases = bp.reliability(start)
    shown |= {"reliability": biases.to_dict()["events"], "table": " ".join(biases.lines())}
    goal = ("--goal", "U7 average 0.2 um", "--by", "repeatability")
    shown["reach"] = said("reach", folder / "base.yaml", *goal)[1]
    store = folder / "store"
    said("sweep", folder / "sweep.yaml", "--store", store, "--workers", "1")
    shown["export"] = said("sweep", "--export", store, "-o", "-")[1]
    shown["report"] = said("sweep", "--report", store, "--format", "markdown")[1]
print(json.dumps(shown))
"""


def told(installed: Path | None, work: Path) -> dict[str, Any]:
    """What is said with the extensions that are installed in a folder."""
    work.mkdir()
    (work / "base.yaml").write_text(yaml.safe_dump(small_sections(20, 1)), encoding="utf-8")
    (work / "sweep.yaml").write_text(SWEEP)
    return said_with(installed, SCRIPT, work)


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], dict[str, Any]]:
    """What is told with the extension, and without it."""
    folder = tmp_path_factory.mktemp("package")
    added = told(install(folder), folder / "with")
    return added, told(None, folder / "without")


@cache
def diagonals() -> np.ndarray:
    """Standard uncertainties of the four lengths between opposite corrected corners, by the dense
    reference.
    """
    design = lay_out(experiment(small_sections(20, 1)))
    problem = dense.planned(design, 3, 3)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * (
        design.machine.volume.size
    )
    offsets = np.tile(design.probes.offsets[design.evaluation.probe], (8, 1))

    def lengths(step: dense.Values) -> dense.Values:
        places = dense.corrected(
            problem, design.machine.volume.lower + corners, dense.unpack(problem, step)[3], offsets
        )
        return dense.length(places[:4] - places[:3:-1])

    return dense.linearised(problem).of(dense.jacobian(lengths, problem.parameters))


def test_run_has_it_as_a_dense_computation(both: tuple[dict[str, Any], dict[str, Any]]) -> None:
    found, expected = both[0]["run"]["quantities"]["U7"], diagonals()
    assert found["count"] == 4 and found["undetermined"] == 0
    assert found["maximum"] == pytest.approx(expected.max(), rel=1e-9)
    assert found["average"] == pytest.approx(expected.mean(), rel=1e-9)
    row, of_trials = [line for line in both[0]["lines"] if line.startswith("U7")]
    assert wording.LENGTHS_OF_THE_BODY_DIAGONALS in row and f"{1e6 * expected.max():.4g}" in row
    found = both[0]["run"]["monte_carlo"]["quantities"]["U7"]
    assert found["linear"]["maximum"] == pytest.approx(diagonals().max(), rel=1e-4)
    assert abs(found["spread_ratio"]["value"] - 1.0) < 4.0 * found["spread_ratio"]["standard_error"]
    assert wording.LENGTHS_OF_THE_BODY_DIAGONALS not in of_trials


def test_a_plan_makes_it_small(both: tuple[dict[str, Any], dict[str, Any]]) -> None:
    for name, statistic in (("U7", "average"), ("U7-maximum", "maximum")):
        plan = both[0]["plans"][name]
        # What a selection is worth is what `run` makes of the design.
        assert plan["value"] == pytest.approx(plan["plan"]["quantities"]["U7"][statistic], rel=1e-6)
        assert plan["bound"] <= plan["value"] <= plan["drawn"]
        # The file's target is none of its own.
        assert plan["target"] is None
    assert "U7, U7-maximum" in " ".join(both[0]["help"].split())


def test_reliability_goals_and_reach_know_it(both: tuple[dict[str, Any], dict[str, Any]]) -> None:
    added = both[0]
    effects = [event["effects"]["U7"] for event in added["reliability"]]
    uncertain = [effect["standard_uncertainty"] for effect in effects if effect["at"]]
    assert {effect["at"] for effect in effects} - {""} <= {f"diagonal {i}" for i in range(1, 5)}
    assert uncertain
    expected = diagonals()
    for value in uncertain:
        assert np.abs(value / expected - 1.0).min() < 1e-6
    assert "U7 (body diagonals)" in added["table"]
    assert "U7" in added["goals"] and "average U7" in added["reach"]


def test_sweeps_reports_and_the_schema_have_it(both: tuple[dict[str, Any], dict[str, Any]]) -> None:
    added = both[0]
    record = added["schema"]["properties"]["record"]
    assert "U7" in record["items"]["enum"] and "U7" in record["default"]
    head, *rows = [line.split(",") for line in added["export"].splitlines()]
    assert len(rows) == 2 and {"U7_maximum_m", "U7_average_m", "U7_spread_ratio"} <= set(head)
    smaller, larger = (float(row[head.index("U7_average_m")]) for row in rows)
    assert 0.0 < smaller < larger
    assert "U7 maximum" in added["report"]


def test_nothing_of_it_is_left_without_the_extension(
    both: tuple[dict[str, Any], dict[str, Any]],
) -> None:
    added, removed = both
    assert all("U7" in json.dumps(added[name]) for name in removed)
    assert "U7" not in json.dumps(removed)
    # All else is as it was.
    for symbol, quantity in removed["run"]["quantities"].items():
        assert added["run"]["quantities"][symbol] == quantity
    for symbol, figures in removed["run"]["monte_carlo"]["quantities"].items():
        assert added["run"]["monte_carlo"]["quantities"][symbol] == figures
