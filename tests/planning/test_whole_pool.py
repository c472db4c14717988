"""What even all candidates of a pool leave undetermined, against a dense rank of all of them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from ballplate.cli import main
from ballplate.planning.repair.changes import ChangeKind, apply_all
from ballplate.planning.whole_pool import pool_gap
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.load import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.experiment.pool import with_chosen

from tests.reference import dense

TEXT = """
title: a pool without positions across y
machine: {volume: [600 mm, 600 mm, 600 mm], repeatability: 0.5 um}
error_model: {kind: kinematic, position_coefficients: 3, rotation_coefficients: 3}
probes: {down: [0 mm, 0 mm, -100 mm], right: [100 mm, 0 mm, 0 mm]}
artefacts:
  plate: {kind: grid, balls: [3, 3], size: [300 mm, 300 mm]}
calibration: [{kind: distances, artefact: plate, pairs: corner sides, standard_uncertainty: 20 um}]
evaluation: {points: {random: 6, seed: 1}}
positions: []
pool:
  candidates:
    - {name: flat, artefact: plate, planes: [z], levels: [100 mm, 300 mm, 500 mm], corners: {x: 100 mm, y: [50 mm, 250 mm]}, probes: [PROBES]}
    - {name: x, artefact: plate, planes: [x], levels: [100 mm, 500 mm], corners: {y: 250 mm, z: [50 mm, 250 mm]}, quarter_turns: 1, probes: [PROBES]}
"""


def written(folder: Path, probes: str = "[down, right]", more: str = "") -> Path:
    path = folder / "pool.yaml"
    path.write_text(TEXT.replace("PROBES", probes) + more, "utf-8")
    return path


def dense_deficiency(experiment: Experiment) -> int:
    problem = dense.planned(lay_out(experiment), 3, 3)
    whole = dense.jacobian(lambda step: dense.residuals(problem, step), problem.parameters)
    return int(dense.spread(whole).deficiency)


def test_what_the_whole_pool_leaves_open_is_that_of_a_dense_computation(tmp_path: Path) -> None:
    experiment = load(written(tmp_path), planning=True)[0]
    assert experiment.pool is not None
    found = pool_gap(experiment, experiment.pool.candidates)
    whole = with_chosen(experiment, experiment.pool.candidates)
    assert found.verdict.deficiency == dense_deficiency(whole) > 0
    assert found.cures
    for one in found.cures:
        # A cure may be a poorer error model, which the dense computation would have to be told.
        if not any(change.kind is ChangeKind.MODEL for change in one.changes):
            assert dense_deficiency(apply_all(one.changes, whole)) == 0


def test_plan_says_so_and_of_offsets_that_carry_the_scale(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(written(tmp_path))
    assert main(["plan", path, "--positions", "6", "--workers", "1", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["whole_pool"]["deficiency"] == found["plan"]["rank_deficiency"] == 2
    assert found["plan"]["scale"]["rests_on_exact_offsets"] is True
    # Expected, it is no reason to complain; more than is expected is.
    written(tmp_path, more="expected_rank_deficiency: 2\n")
    assert main(["plan", path, "--positions", "6", "--workers", "1"]) == 0
    out = capsys.readouterr().out
    assert "even all 8 candidates together leave 2 directions undetermined (EAZ, ECZ, EYZ)" in out
    assert "the file expects that" in out and "the scale rests on probe offsets" in out


def test_a_pool_that_determines_nothing_is_refused_with_what_it_lacks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(written(tmp_path, "down"))
    assert main(["plan", path]) == 3
    told = capsys.readouterr().err
    assert "no selection determines any of it" in told and "together leave" in told
    assert "what would determine it" in told and "with a new probe too" in told
    assert main(["check", path]) == 3
    assert (
        "positions: empty; add positions, or choose some from the pool" in capsys.readouterr().err
    )
