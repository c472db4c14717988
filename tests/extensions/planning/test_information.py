"""What a plan computes step by step is what a full computation of the chosen design gives."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate.extensions.planning.campaign_choice import Request, campaign
from ballplate.extensions.planning.constraints import Budget, constraints, with_chosen
from ballplate.extensions.planning.criteria import CriterionName, criterion, is_about_balls
from ballplate.extensions.planning.information import pool_information
from ballplate.extensions.planning.search import Losses, SelectionProblem, value
from ballplate.results.prediction import Prediction, predict
from ballplate.simulator.estimation.functions import displacements
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment, Position
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.uncertainty.pairs import pairs_of
from ballplate.uncertainty.quantities import functions_of

from tests.extensions.planning import wording

from .small_pool import TEXT

# A plate in two dimensions whose probes have offsets that are estimated, some balls of it read, and
# more often.
FLAT = """
title: a plate on a table
machine: {volume: [600 mm, 500 mm], repeatability: [1 um, 2 um]}
error_model: {kind: metric}
probes: {one: [0 mm, 0 mm], two: {offset: [30 mm, 0 mm], standard_uncertainty: 5 um}}
artefacts: {plate: {kind: grid, balls: [3, 3], size: [200 mm, 300 mm]}}
evaluation: {points: {random: 15, seed: 2}, probe: two}
pool:
  candidates:
    - {name: straight, corner: {x: 50 mm, y: 50 mm}, probes: [one]}
    - {name: turned, corner: {x: 150 mm, y: 100 mm}, quarter_turns: 1, probes: [one, two]}
    - {name: slanting, pose: {origin: [300 mm, 50 mm], rotation: 30 deg}, probes: [two], repeats: 3}
    - {name: some, corner: {x: 250 mm, y: 150 mm}, balls: [r1c1, r1c3, r3c1, r2c2], probes: [one]}
    - {name: precise, corner: {x: 50 mm, y: 100 mm}, standard_uncertainty: 0.3 um, probes: [one]}
  calibration:
    - {name: sides, kind: distances, pairs: corner sides, standard_uncertainty: 0.4 um, price: 1 h}
    - {name: corners, kind: coordinates, balls: corners, standard_uncertainty: 0.5 um, price: 1 h}
"""


def problem_of(experiment: Experiment, name: CriterionName) -> SelectionProblem:
    assert experiment.pool is not None
    candidates = experiment.pool.candidates
    information = pool_information(experiment, candidates, is_about_balls(name))
    limits = constraints(candidates, experiment.pool.changes, Budget())
    return SelectionProblem(information, criterion(information, experiment, name), limits)


def in_full(found: Prediction, name: CriterionName) -> float:
    kind, _, largest = name.partition("-")
    return getattr(found.quantities[kind], "maximum" if largest else "average")


def written(folder: Path, text: str) -> Path:
    path = folder / "pool.yaml"
    path.write_text(text)
    return path


def selections(experiment: Experiment, count: int, size: int, seed: int) -> list[list[int]]:
    assert experiment.pool is not None
    generator = np.random.default_rng(seed)
    n = len(experiment.pool.candidates)
    return [sorted(generator.choice(n, min(size, n), replace=False).tolist()) for _ in range(count)]


BASE: dict[str, Any] = yaml.safe_load(TEXT)
SIDES = {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.8 um"}
CANDIDATES = BASE["pool"]["candidates"]
# Influence quantities are of plates only.
WITHOUT_BAR: dict[str, Any] = {
    "artefacts": {"plate": BASE["artefacts"]["plate"]},
    "calibration": [SIDES],
    "pool": {**BASE["pool"], "candidates": [one for one in CANDIDATES if one["name"] != "bar"]},
}
IN_PLANE = {"reads": "in plane", "flatness": "3 um"}
# Bars of four balls and a plate, all of whose distances are certified, in several places each.
PLACES: list[dict[str, Any]] = [
    {"pose": {"origin": ["100 mm", "250 mm", "200 mm"]}, "probes": ["down"], "repeats": 2},
    {
        "pose": {
            "origin": ["100 mm", "100 mm", "200 mm"],
            "rotation": ["0 deg", "0 deg", "80 deg"],
        },
        "probes": ["down", "right"],
    },
    {"plane": "z", "level": "100 mm", "corner": {"x": "100 mm", "y": "100 mm"}, "probes": ["down"]},
    {
        "plane": "x",
        "level": "300 mm",
        "corner": {"y": "100 mm", "z": "100 mm"},
        "probes": ["right"],
    },
]
STANDARDS: dict[str, Any] = {
    "artefacts": {
        "plate": BASE["artefacts"]["plate"],
        "bar": {
            "kind": "balls",
            "role": "length_standard",
            "coordinates": {
                name: [f"{x} mm", "0 mm", "0 mm"]
                for name, x in zip("abcd", (0, 80, 210, 350), strict=True)
            },
        },
        "tile": {
            "kind": "grid",
            "balls": [2, 3],
            "size": ["150 mm", "200 mm"],
            "role": "length_standard",
        },
    },
    "calibration": [
        {"kind": "distances", "artefact": name, "pairs": "all", "standard_uncertainty": u}
        for name, u in (("bar", "0.2 um + L/500000"), ("tile", "0.4 um + L/1000000"))
    ],
    "pool": {
        **BASE["pool"],
        "candidates": [
            *WITHOUT_BAR["pool"]["candidates"],
            *(
                {"name": f"{name} {k}", "artefact": name, **PLACES[k]}
                for k, name in enumerate(("bar", "bar", "tile", "tile"))
            ),
        ],
    },
}
ITEMS = BASE["pool"]["calibration"]
TIGHT_ITEM = [{**ITEMS[0], "standard_uncertainty": "1e-9 um"}, ITEMS[1]]
STAR = {"standard_uncertainty": "0.2 um"}
CASES: dict[str, dict[str, Any]] = {
    "as it is": {},
    "estimated offsets and parts of a plate": yaml.safe_load(FLAT) | {"calibration": []},
    "star": {"stars": [STAR]},
    "star elsewhere": {"stars": [STAR | {"place": "unknown"}]},
    "re-indexing": {
        **WITHOUT_BAR,
        "influences": [{"kind": "re-indexing", "standard_uncertainty": "0.7 um"}],
    },
    "holes": {"artefacts": BASE["artefacts"] | {"plate": BASE["artefacts"]["plate"] | IN_PLANE}},
    "lengths that share readings": STANDARDS,
    # What is known all but exactly: of a machine's parameter, of a certificate, and beside readings
    # that are coarse.
    "tight prior": {"priors": [{"parameter": "EXX t^1", "standard_uncertainty": "1e-9 um"}]},
    "coarse readings": {"machine": BASE["machine"] | {"repeatability": "10 mm"}},
    "tight item on offer": {"pool": {**BASE["pool"], "calibration": TIGHT_ITEM}},
}


@pytest.mark.parametrize("case", CASES)
def test_equal_to_the_full_computation(tmp_path: Path, case: str) -> None:
    text = yaml.safe_dump({**BASE, **CASES[case]}, sort_keys=False)
    (experiment,) = load(written(tmp_path, text), planning=True)
    assert experiment.pool is not None
    names: tuple[CriterionName, ...] = ("U6", "U5-maximum", "tasks")
    problems = {
        name: problem_of(experiment, name) for name in names if name in text or name != "tasks"
    }
    size = (len(experiment.pool.candidates) + 1) // 2
    compared = 0
    for chosen in selections(experiment, 12, size, 3):
        items = [experiment.pool.candidates[k] for k in chosen]
        if not any(isinstance(one.item, Position) for one in items):
            continue
        full = predict(with_chosen(experiment, items))
        for name, problem in problems.items():
            found = value(problem, chosen)
            assert np.isfinite(found) == (full.verdict.deficiency == 0)
            if np.isfinite(found):
                compared += 1
                assert found == pytest.approx(in_full(full, name), rel=1e-8)
                # So are the figures that exchanges compare.
                assert Losses(problem).of(frozenset(chosen)) == pytest.approx(found, rel=1e-8)
    assert compared > 5


def test_positions_that_read_different_balls_are_not_overrated(tmp_path: Path) -> None:
    """What certificates tell of one another from position to position is left out: a plan is on the
    safe side.
    """
    pool = STANDARDS["pool"]
    some = [{**one, "balls": ["a", "b", "d"]} if one["name"] == "bar 0" else one
            for one in pool["candidates"]]  # fmt: skip
    text = yaml.safe_dump({**BASE, **STANDARDS, "pool": {**pool, "candidates": some}})
    (experiment,) = load(written(tmp_path, text), planning=True)
    assert experiment.pool is not None
    problem, compared = problem_of(experiment, "U6"), 0
    for chosen in selections(experiment, 20, 10, 6):
        full = predict(with_chosen(experiment, [experiment.pool.candidates[k] for k in chosen]))
        if not full.verdict.deficiency:
            compared += 1
            expected = full.quantities["U6"].average
            assert expected * (1.0 - 1e-9) <= value(problem, chosen) < 1.02 * expected
    assert compared > 4


def test_what_no_candidate_determines_is_left_out(tmp_path: Path) -> None:
    # With one probe, rotations cannot be told from straightness.
    text = (
        TEXT.replace("[[right, down]]", "[down]")
        .replace("[[back, down]]", "[down]")
        .replace(", probe: right", "")
    )
    (experiment,) = load(written(tmp_path, text), planning=True)
    assert experiment.pool is not None
    candidates = experiment.pool.candidates
    full = predict(with_chosen(experiment, candidates))
    information = pool_information(experiment, candidates)
    assert information.deficiency == full.verdict.deficiency > 0
    assert full.quantities["U6"].undetermined == full.quantities["U6"].count
    with pytest.raises(ExperimentError, match=wording.NO_SELECTION_DETERMINES_ANY):
        criterion(information, experiment, "U6")
    with pytest.raises(ExperimentError, match="undetermined"):
        criterion(information, experiment, "A")
    problem = problem_of(experiment, "U5")
    assert problem.criterion.excluded == full.quantities["U5"].undetermined
    at = linearise(lay_out(with_chosen(experiment, candidates)))
    (balls,) = functions_of("U5", at.design, at.layout)
    every = np.stack(np.triu_indices(len(balls.places.index), 1), axis=1)
    tile = pairs_of(displacements(at, balls.places), every)
    assert tile.is_open.sum() == full.quantities["U5"].undetermined > 0
    assert value(problem, range(len(candidates))) == pytest.approx(
        tile.uncertainties[~tile.is_open].mean(), rel=1e-9
    )


def test_priors_about_poses_are_refused(tmp_path: Path) -> None:
    drawn = (
        "positions: [{name: low, artefact: plate, plane: z, level: 100 mm, corner: {x: 0 mm, y: 0"
        " mm}, probes: [down]}]"
    )
    prior = 'priors: [{parameter: "low: origin x", standard_uncertainty: 1 um}]'
    (experiment,) = load(written(tmp_path, f"{TEXT}{drawn}\n{prior}\n"), planning=True)
    assert experiment.pool is not None
    with pytest.raises(ExperimentError, match=wording.WHICH_A_PLAN_CANNOT):
        pool_information(experiment, experiment.pool.candidates)


TWO_PLATES = """
title: one of two plates
machine: {volume: [500 mm, 400 mm], repeatability: 1 um}
error_model: {kind: metric}
probes: {tip: [0 mm, 0 mm]}
artefacts:
  small: {kind: grid, balls: [2, 2], size: [200 mm, 150 mm]}
  large: {kind: grid, balls: [3, 2], size: [300 mm, 250 mm]}
evaluation: {points: {random: 12, seed: 1}}
pool:
  candidates:
    - {name: a, artefact: small, corner: {x: 50 mm, y: 50 mm}}
    - {name: b, artefact: small, corner: {x: 250 mm, y: 100 mm}, quarter_turns: 1}
    - {name: c, artefact: large, corner: {x: 50 mm, y: 50 mm}}
    - {name: d, artefact: large, corner: {x: 150 mm, y: 50 mm}, quarter_turns: 1}
  calibration:
    - {name: of small, artefact: small, kind: distances, pairs: corner sides, standard_uncertainty: 0.5 um, price: 1 h}
    - {name: of large, artefact: large, kind: distances, pairs: corner sides, standard_uncertainty: 0.5 um, price: 1 h}
"""


# What is known of both in any case.
CERTIFIED = """calibration:
  - {artefact: small, kind: coordinates, balls: all, standard_uncertainty: 0.5 um}
  - {artefact: large, kind: distances, pairs: corners, standard_uncertainty: 30 um}
"""


@pytest.mark.parametrize("positions", [2, 4])
def test_two_plates_of_unlike_certificates(tmp_path: Path, positions: int) -> None:
    (experiment,) = load(
        written(tmp_path, TWO_PLATES.replace("pool:\n", CERTIFIED + "pool:\n")), planning=True
    )
    assert experiment.pool is not None
    found = campaign(experiment, Request("U5", Budget(positions=positions)))
    candidates = experiment.pool.candidates
    best = np.inf
    for size in range(2, len(candidates) + 1):
        for chosen in combinations(candidates, size):
            places = [one.item for one in chosen if isinstance(one.item, Position)]
            if len({one.artefact for one in places}) == 2 and len(places) <= positions:
                full = predict(with_chosen(experiment, chosen))
                best = min(
                    best, np.inf if full.verdict.deficiency else full.quantities["U5"].average
                )
    assert found.bound <= found.value == pytest.approx(best, rel=1e-9)
    with pytest.raises(ExperimentError, match=wording.INCLUDES_THE_DISTANCES):
        campaign(experiment, Request("U5", Budget(positions=1)))
