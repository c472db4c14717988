"""The dimensions of a part as a quantity of an experiment: uncertainties, plans, goals, budget,
Monte Carlo.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.simulator.estimation import (
    Combinations,
    MeasuredPoints,
    displacements,
    linear_functions,
    linearise,
)
from ballplate.simulator.experiment import Experiment, lay_out
from ballplate.uncertainty import combined_uncertainties, functions_of, member_root
from scipy.sparse import csr_array

BLOCK = Path("designs/parts/block.yaml").resolve()
CORNERS = {"x": ["50 mm"], "y": ["50 mm"]}
PLACES = {"planes": ["z"], "levels": ["100 mm", "400 mm"], "corners": CORNERS, "probes": ["down"]}


def with_part(tmp_path: Path, share: str = "40 %", **changes: object) -> Experiment:
    text = BLOCK.read_text(encoding="utf-8").replace(
        "unit: mm", f"unit: mm\nshare_of_tolerance: {share}", 1
    )
    path = tmp_path / "block.yaml"
    path.write_text(text, encoding="utf-8")
    return bp.quickstart().with_(part={"file": str(path)}, **changes)


def combination(places: MeasuredPoints, weights: np.ndarray, **changes: object) -> Combinations:
    """One value for each row of weights (k, n d), or one of all."""
    count = len(weights)
    found = Combinations(
        places,
        csr_array(weights),
        csr_array(np.zeros((count, 1))),
        np.arange(count + 1),
        (None,) * count,
        tuple(f"value {k}" for k in range(count)),
        ("m",) * count,
        np.ones(count),
        (None,) * count,
        np.full(count, np.nan),
    )
    return replace(found, **changes)


def test_a_distance_is_a_combination_of_its_ends() -> None:
    ends = [{"name": "a", "from": ["0.1 m", "0.2 m", "0.3 m"], "to": ["0.9 m", "0.4 m", "0.5 m"]}]
    experiment = bp.quickstart().with_({"evaluation.tasks": ends})
    at = linearise(lay_out(experiment))
    (task,) = functions_of("tasks", at.design, at.layout)
    where = task.places.at(at.design, at.state)
    unit = (where[0] - where[1]) / np.linalg.norm(where[0] - where[1])
    found = combination(task.places, np.concatenate([unit, -unit])[None])
    root = member_root(found, displacements(at, found.places))
    (value,) = combined_uncertainties(found, root)
    assert value.standard_uncertainty == pytest.approx(
        bp.run(experiment).tasks[0].standard_uncertainty, rel=1e-9
    )
    both = [linear_functions(at, functions).shared for functions in (task, found)]
    assert np.allclose(*both, rtol=0.0, atol=1e-12)
    # Twice the readings' uncertainty: not of what comes from outside the estimate.
    outside = replace(found, outside=csr_array([[3e-6]]))
    u = [combined_uncertainties(outside, sigma * root)[0].standard_uncertainty for sigma in (1, 2)]
    assert u[1] ** 2 - u[0] ** 2 == pytest.approx(3 * value.standard_uncertainty**2, rel=1e-9)


def test_what_no_reading_determines_is_undetermined_and_differences_are_not() -> None:
    # Without certificates and known offsets the scale is unknown: lengths are, straightness is not.
    probes = {
        name: {
            "offset": [f"{value} m" for value in probe.offset.tolist()],
            "unknown": name != "down",
        }
        for name, probe in bp.quickstart().probes.items()
    }
    experiment = bp.quickstart().with_(calibration=None, probes=probes)
    at = linearise(lay_out(experiment))
    assert at.deficiency > 0
    points = np.array([[0.2, 0.5, 0.5], [0.5, 0.5, 0.5], [0.8, 0.5, 0.5]])
    places = MeasuredPoints(points, np.zeros(3, int))
    length = np.zeros((3, 3))
    length[0, 0], length[2, 0] = -1.0, 1.0
    bent = np.zeros((3, 3))
    bent[:, 2] = 1.0, -2.0, 1.0
    found = combination(places, np.stack([length.ravel(), bent.ravel()]))
    values = combined_uncertainties(found, member_root(found, displacements(at, places)))
    assert np.isnan(values[0].standard_uncertainty) and values[1].standard_uncertainty > 0.0


def test_a_value_of_a_group_is_drawn_from_the_covariance_of_the_group() -> None:
    at = linearise(lay_out(bp.quickstart()))
    places = MeasuredPoints(np.full((1, 3), 0.5), np.zeros(1, int))
    found = combination(
        places,
        np.zeros((2, 3)),
        starts=np.array([0, 2]),
        of_members=(lambda members: np.linalg.norm(members, axis=1)[:, None],),
        outside=csr_array(1e-6 * np.eye(2)),
        names=("radius",),
    )
    (value,) = combined_uncertainties(found, member_root(found, displacements(at, places)))
    # Rayleigh's distribution, within five standard errors of ten thousand draws.
    assert value.shift == pytest.approx(1e-6 * np.sqrt(np.pi / 2), abs=5 * 0.0066e-6)
    assert value.standard_uncertainty == pytest.approx(1e-6 * np.sqrt(2 - np.pi / 2), rel=0.05)
    assert value.quantiles[0][-1] == pytest.approx(1e-6 * np.sqrt(-2 * np.log(0.025)), rel=0.03)
    assert value.share == 0.0 and value.outside == value.standard_uncertainty


def test_run_has_the_dimensions_of_the_part(tmp_path: Path) -> None:
    experiment = with_part(tmp_path)
    prediction = bp.run(experiment)
    alone = bp.part(tmp_path / "block.yaml", bp.quickstart())
    named = prediction["dimensions"].named
    assert [value.standard_uncertainty for value in named] == [
        pytest.approx(one.value.standard_uncertainty, rel=1e-12)
        for one in alone.dimensions
        if one.value is not None
    ]
    assert prediction["dimensions"].within_target == 1.0
    lines = "\n".join(prediction.lines())
    assert "bearing block: 15 dimensions in 2 places; 30 of 30 within 40 %" in lines
    assert len(prediction.to_dict()["part"]["dimensions"]) == 30
    assert "U/T" in bp.page(prediction)


def test_a_plan_keeps_the_dimensions_within_their_limits(tmp_path: Path) -> None:
    experiment = with_part(tmp_path, pool={"candidates": [PLACES]})
    campaign = bp.plan(experiment, "dimensions", positions=7)
    at = linearise(lay_out(campaign.chosen_experiment))
    (found,) = functions_of("dimensions", at.design, at.layout)
    by_map = np.linalg.norm(member_root(found, displacements(at, found.places)), axis=1)
    limited = ~np.isnan(found.allowed)
    worst = (by_map[limited] / found.allowed[limited]).max()
    assert campaign.value == pytest.approx(worst, rel=1e-6)
    assert campaign.bound <= campaign.value * (1 + 1e-9) and campaign.value < 1.0
    # Linear dimensions are at the limit where the map has its share.
    for value, start in zip(campaign.prediction["dimensions"].named, found.starts, strict=False):
        if not value.quantiles:
            there = np.hypot(value.outside, found.allowed[start])
            assert 2.0 * there == pytest.approx(value.target, rel=1e-9)


def test_a_limit_that_probing_exceeds_is_refused(tmp_path: Path) -> None:
    experiment = with_part(tmp_path, share="1 %", pool={"candidates": [PLACES]})
    with pytest.raises(bp.ExperimentError, match="no plan holds the limit of .*widen it"):
        bp.plan(experiment, "dimensions", positions=7)


def test_a_goal_is_that_every_dimension_is_within_its_limit(tmp_path: Path) -> None:
    from ballplate.extensions.requirements.goals import judge, parse_goal

    goal = parse_goal("dimensions")
    met, missed = (judge(goal, bp.run(with_part(tmp_path, share))) for share in ("40 %", "10 %"))
    assert met.is_met and not missed.is_met
    assert missed.words.startswith("12 of 30 dimensions within their targets")


def test_a_budget_has_what_is_outside_the_estimate(tmp_path: Path) -> None:
    experiment = with_part(tmp_path)
    figures = {figure.name: figure for figure in bp.budget(experiment).figures}
    named = {value.name: value for value in bp.run(experiment)["dimensions"].named}
    for name in ("diameter bore 1 (low)", "distance C, right (turned)"):
        assert figures[name].standard_uncertainty == pytest.approx(
            named[name].standard_uncertainty, rel=1e-9
        )
        assert np.hypot.reduce(figures[name].contributions) == pytest.approx(
            named[name].standard_uncertainty, rel=1e-9
        )


def test_replicates_scatter_as_the_members_are_uncertain(tmp_path: Path) -> None:
    trials = bp.run(with_part(tmp_path), trials=400).monte_carlo
    ratio = trials.outcome.comparisons["dimensions"].actual
    assert abs(ratio.value - 1.0) <= 4.0 * ratio.error


MACHINE = """\
title: random positioning
arrangement: MB2
volume: {x: [0 mm, 1000 mm], y: [0 mm, 1000 mm], z: [0 mm, 1000 mm]}
reference_point: [0 mm, 0 mm, 0 mm]
probe: [0 mm, 0 mm, 0 mm]
errors: {EXX: {bandwidth: 2 um, sigmas: 2}}
"""


def test_random_errors_of_the_machine_act_at_each_approach(tmp_path: Path) -> None:
    """A micrometre along x moves only points of faces across x, each on its own."""
    (tmp_path / "machine.yaml").write_text(MACHINE, encoding="utf-8")
    path, values = tmp_path / "block.yaml", []
    text = BLOCK.read_text(encoding="utf-8")
    for added in ("", "random_part: machine.yaml\n"):
        path.write_text(text.replace("unit: mm\n", f"unit: mm\n{added}", 1), encoding="utf-8")
        found = bp.part(path, bp.quickstart()).dimensions
        values.append({one.name: one.value.standard_uncertainty for one in found})
    before, after = values
    gained = after["distance C, right (low)"] ** 2 - before["distance C, right (low)"] ** 2
    assert gained == pytest.approx(1e-12 * (1 / 6 + 1 / 6), rel=1e-6)
    turned = "distance C, right (turned)", "flatness A (low)"
    assert [after[name] for name in turned] == [pytest.approx(before[name]) for name in turned]
