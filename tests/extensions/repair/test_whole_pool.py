"""What even all candidates of a pool leave undetermined, against a dense rank of all of them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.repair import whole_pool
from ballplate.extensions.repair.whole_pool import PoolGap, pool_gap, spanning
from ballplate.planning.information import pool_information
from ballplate.results.checked_designs import planned_uncertainty
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment, Position
from ballplate.simulator.experiment.pool import placed_only, with_chosen
from ballplate.simulator.inputs.messages import refused

from tests.extensions.repair import wording
from tests.planning.random_pools import random_pool
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


def told_of(experiment: Experiment) -> tuple[PoolGap, tuple[int, ...]]:
    assert experiment.pool is not None
    candidates = experiment.pool.candidates
    information = pool_information(experiment, candidates)
    found = pool_gap(experiment, candidates, information)
    assert found is not None
    return found, spanning(information, candidates)


# The candidates across z, and four times as many.
MANY = (
    "levels: {from: 100 mm, to: 500 mm, count: 6},"
    " corners: {x: [100 mm, 200 mm], y: [50 mm, 250 mm]}"
)
FEW = "levels: [100 mm, 300 mm, 500 mm], corners: {x: 100 mm, y: [50 mm, 250 mm]}"


@pytest.mark.parametrize("places", [FEW, MANY])
def test_what_the_whole_pool_leaves_open_is_that_of_a_dense_computation(
    tmp_path: Path, places: str
) -> None:
    path = written(tmp_path)
    path.write_text(path.read_text("utf-8").replace(FEW, places), "utf-8")
    experiment = load(path, planning=True)[0]
    assert experiment.pool is not None
    candidates = experiment.pool.candidates
    found, few = told_of(experiment)
    whole = with_chosen(experiment, candidates)
    some = with_chosen(experiment, [candidates[k] for k in few])
    assert found.verdict.deficiency == dense_deficiency(whole) == dense_deficiency(some) > 0
    assert len(few) < len(candidates) or places == FEW


def test_turns_that_single_positions_leave_open_are_counted(tmp_path: Path) -> None:
    """Two balls leave the turn about the line through them open, however good everything else."""
    path = written(tmp_path)
    path.write_text(path.read_text("utf-8").replace(FEW, MANY), "utf-8")
    experiment = load(path, planning=True)[0]
    assert experiment.pool is not None
    candidates = list(experiment.pool.candidates)
    for k in (3, 8):
        item = candidates[k].item
        assert isinstance(item, Position)
        group = item.readings[0]
        two = replace(group, balls=group.balls[:2], ball_indices=group.ball_indices[:2])
        candidates[k] = replace(candidates[k], item=replace(item, readings=(two,)))
    information = pool_information(experiment, candidates)
    found = pool_gap(experiment, candidates, information)
    assert found is not None
    assert {3, 8} < set(spanning(information, candidates))
    assert found.verdict.deficiency == dense_deficiency(with_chosen(experiment, candidates)) == 4


def test_a_few_candidates_leave_open_what_all_of_them_do(tmp_path: Path) -> None:
    """Against the rank of a design with all, for pools at random and for parts of them."""
    fewer = told = 0
    for seed in range(60):
        experiment = random_pool(tmp_path, seed).experiment
        assert experiment.pool is not None
        generator = np.random.default_rng(seed)
        candidates = [one for one in experiment.pool.candidates if generator.random() < 0.7]
        placed = {one.item.artefact for one in candidates if isinstance(one.item, Position)}
        # No certificate may be about an artefact that nothing places.
        candidates = [one for one in candidates if one.item.artefact in placed]
        if not placed:
            continue
        pool = placed_only(
            replace(
                experiment,
                positions=tuple(one.item for one in candidates if isinstance(one.item, Position)),
            )
        )
        whole = planned_uncertainty(with_chosen(pool, candidates)).deficiency
        information = pool_information(pool, candidates)
        few = spanning(information, candidates)
        some = with_chosen(pool, [candidates[k] for k in few])
        assert planned_uncertainty(some).deficiency == whole
        fewer += len(few) < len(candidates)
        if information.deficiency:
            found = pool_gap(pool, candidates, information)
            assert found is not None and found.verdict.deficiency == whole
            told += 1
    assert fewer > 20 and told > 2


def test_words_that_cannot_be_had_do_not_stop_a_plan(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuses(*_: object, **__: object) -> NoReturn:
        raise refused(None, "cannot stand in one design", "pool")

    path = str(written(tmp_path))
    arguments = ["plan", path, "--positions", "6", "--workers", "1"]
    assert main(arguments) == 1
    told = capsys.readouterr().out
    assert "even all 8 candidates" in told and wording.ADD_CANDIDATES in told
    monkeypatch.setattr(whole_pool, "check", refuses)
    assert main(arguments) == 1
    without = capsys.readouterr().out.splitlines()
    left = [line for line in told.splitlines() if line not in without]
    assert [line.split(" ")[0] for line in left] == ["even", "add"]


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
    assert wording.EVEN_ALL_CANDIDATES_TOGETHER_LEAVE_DIRECTIONS in out
    assert wording.THE_FILE_EXPECTS in out and wording.THE_SCALE_RESTS_ON_PROBE_OFFSETS in out


def test_a_pool_that_determines_nothing_is_refused_with_what_it_lacks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(written(tmp_path, "down"))
    assert main(["plan", path]) == 3
    told = capsys.readouterr().err
    assert wording.NO_SELECTION_DETERMINES_ANY in told and "together leave" in told
    assert wording.ADD_CANDIDATES in told
    assert main(["check", path]) == 3
    assert wording.EMPTY_ADD_POSITIONS in capsys.readouterr().err


@pytest.mark.parametrize(
    ("balls", "pairs", "open_"),
    [
        # Alone, it turns about the line of the two corners from which its distances are known.
        ("[r3c3]", "corner sides", 1),
        ("[r3c3]", "[[r1c1, r1c3]]", 3),
        # A distance is read besides; of a ball in the plane of the others none shows how high it is.
        ("[r3c3, r1c1]", "[[r1c1, r1c3]]", 2),
        ("[r3c3, r1c1]", "corner sides", 1),
        ("[r3c3, r1c1, r1c2]", "[[r1c1, r1c3]]", 1),
        ("[r3c3, r1c1, r2c1, r1c2]", "[[r1c1, r1c3]]", 0),
    ],
)
def test_a_ball_that_nothing_ties_to_its_plate_is_counted(
    tmp_path: Path, balls: str, pairs: str, open_: int
) -> None:
    path = written(tmp_path, "[down, right]")
    text = path.read_text("utf-8").replace("corner sides", pairs)
    others = "probes: [[down, right]], balls: [r1c1, r1c2, r1c3, r2c1, r2c2, r2c3, r3c1, r3c2]"
    text = text.replace("probes: [[down, right]]", others)
    last = "plane: z, level: 200 mm, corner: {x: 100 mm, y: 50 mm}, probes: [down]"
    text += f"    - {{name: last, artefact: plate, {last}, balls: {balls}}}\n"
    path.write_text(text, "utf-8")
    experiment = load(path, planning=True)[0]
    assert experiment.pool is not None
    candidates = experiment.pool.candidates
    information = pool_information(experiment, candidates)
    assert information.balls_open == open_
    found = pool_gap(experiment, candidates, information)
    assert found is not None
    wanted = information.deficiency + open_ + sum(information.pose_open)
    assert (
        found.verdict.deficiency == dense_deficiency(with_chosen(experiment, candidates)) == wanted
    )
