"""What is deficient and what is not where a budget allows little more than determines everything,
by a dense rank.
"""

from __future__ import annotations

from functools import cache
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from ballplate.extensions.planning.campaign_choice import TINY_POOL, Request, campaign
from ballplate.extensions.planning.constraints import Budget, constraints, with_chosen
from ballplate.extensions.planning.criteria import CriterionName, criterion, is_about_balls
from ballplate.extensions.planning.information import pool_information
from ballplate.extensions.planning.search import LARGE, Losses, SelectionProblem, full_root, value
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Candidate, Experiment, Position
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.planning import wording
from tests.extensions.planning.small_pool import TEXT as SMALL
from tests.reference import dense

# Of the pairs of its candidates that have both plates some determine everything, and most leave
# open a direction in which what a plan computes with has small last components.
TEXT = """
title: two plates
machine: {volume: [500 mm, 400 mm, 300 mm], repeatability: 1 um}
error_model: {kind: kinematic, arrangement: MB2, position_coefficients: 2, rotation_coefficients: 2}
probes: {right: [50 mm, 0 mm, 0 mm], front: [0 mm, -50 mm, 10 mm], left: [-50 mm, 0 mm, 0 mm]}
artefacts:
  wide: {kind: grid, balls: [3, 3], size: [200 mm, 200 mm]}
  narrow: {kind: grid, balls: [3, 2], size: [200 mm, 100 mm]}
calibration:
  - {kind: distances, artefact: wide, pairs: corners, standard_uncertainty: 0.5 um}
  - {kind: distances, artefact: narrow, pairs: corners, standard_uncertainty: 30 um}
evaluation: {points: {random: 8, seed: 1}, probe: right}
pool:
  candidates:
    - name: narrow
      artefact: narrow
      planes: [x, y]
      levels: [100 mm, 250 mm]
      corners: {x: 50 mm, y: 50 mm, z: 60 mm}
      probes: [[right, left], [front, right]]
    - name: wide
      artefact: wide
      planes: [x, y]
      levels: [100 mm, 250 mm]
      corners: {x: 50 mm, y: 50 mm, z: 60 mm}
      probes: [[right, front], [front, left]]
"""
COEFFICIENTS = 2

NAMES: tuple[CriterionName, ...] = ("U5", "U6", "E")


def loaded(text: str) -> Experiment:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "two.yaml"
        path.write_text(text)
        return load(path, planning=True)[0]


@cache
def two_plates() -> Experiment:
    return loaded(TEXT)


def candidates() -> tuple[Candidate, ...]:
    pool = two_plates().pool
    assert pool is not None and len(pool.candidates) > TINY_POOL
    return pool.candidates


def artefacts(chosen: tuple[int, ...]) -> set[str]:
    items = [candidates()[k].item for k in chosen]
    return {item.artefact for item in items if isinstance(item, Position)}


@cache
def averages() -> dict[tuple[int, ...], dict[str, float]]:
    """Average U5 and U6 of the pairs of candidates that determine everything; of the others
    none.
    """
    found = {}
    for chosen in combinations(range(len(candidates())), 2):
        design = lay_out(with_chosen(two_plates(), [candidates()[k] for k in chosen]))
        problem = dense.planned(design, COEFFICIENTS, COEFFICIENTS)
        spread = dense.linearised(problem)
        found[chosen] = {}
        if not spread.deficiency:
            every = dense.standard_uncertainties(problem, spread, ("U5", "U6"))
            found[chosen] = {name: float(values.mean()) for name, values in every.items()}
    return found


def is_determined(name: CriterionName, chosen: tuple[int, ...]) -> bool:
    return bool(averages()[chosen]) and (name != "U5" or len(artefacts(chosen)) == 2)


def test_some_pairs_determine_everything_and_most_do_not() -> None:
    pairs = [chosen for chosen in averages() if len(artefacts(chosen)) == 2]
    assert 10 < sum(is_determined("U5", chosen) for chosen in pairs) < len(pairs) / 2


@pytest.mark.parametrize("name", NAMES)
def test_finite_where_the_dense_rank_is_full_and_nowhere_else(name: CriterionName) -> None:
    experiment = two_plates()
    pool = experiment.pool
    assert pool is not None
    information = pool_information(experiment, pool.candidates, is_about_balls(name))
    limits = constraints(pool.candidates, pool.changes, Budget(positions=2))
    problem = SelectionProblem(information, criterion(information, experiment, name), limits)
    losses = Losses(problem)
    for chosen, expected in averages().items():
        determined = is_determined(name, chosen)
        assert np.isfinite(value(problem, chosen)) == determined, chosen
        assert (losses.of(frozenset(chosen)) < LARGE) == determined, chosen
        if determined and name in expected:
            assert value(problem, chosen) == pytest.approx(expected[name], rel=1e-9)


@pytest.mark.parametrize("name", ["U5", "U6"])
def test_the_choice_is_the_best_of_those_that_determine_everything(name: CriterionName) -> None:
    best = min(found[name] for chosen, found in averages().items() if is_determined(name, chosen))
    chosen = campaign(two_plates(), Request(name, Budget(positions=2)))
    assert chosen.is_determined
    assert chosen.value == pytest.approx(best, rel=1e-9)


@pytest.mark.parametrize("last", [1e-1, 1e-2, 1e-3, 1e-4, 1e-6])
def test_a_null_vector_is_found_however_small_its_last_components(last: float) -> None:
    size = 12
    null = np.ones(size)
    null[-3:] = last, last**1.5, last**2
    null /= np.linalg.norm(null)
    along = np.outer(null, null)
    assert full_root(np.eye(size) - along) is None
    root = full_root(np.eye(size) - (1 - 1e-6) * along)
    assert root is not None
    np.testing.assert_allclose(
        root @ root.T, np.eye(size) + (1e6 - 1) * along, rtol=1e-8, atol=1e-8
    )


POSITIONS_ALONE = SMALL[: SMALL.index("  calibration:\n    - {name: sides")].replace(
    "[50 mm, 350 mm]", "[50 mm, 200 mm, 350 mm]"
)
LIMITED = """\
  limits:
    at_most: [{of: {plane: x}, count: COUNT}, {of: {plane: y}, count: 0}, {of: {name: bar}, count: 0}]
"""


@pytest.mark.parametrize("count", [0, 1])
def test_the_choice_that_limits_leave_deficient_is_the_nearest_to_a_determined_one(
    count: int,
) -> None:
    """Of all choices that limits allow none determines everything: told is one that leaves the
    fewest directions open, by the rank of each.
    """
    experiment = loaded(POSITIONS_ALONE + LIMITED.replace("COUNT", str(count)))
    assert experiment.pool is not None and len(experiment.pool.candidates) > TINY_POOL
    found = campaign(experiment, Request("U6", Budget(positions=2)))
    assert not found.is_determined and found.chosen
    allowed = [
        one
        for one in experiment.pool.candidates
        if isinstance(one.item, Position) and one.plane in ("z", "x") and one.name != "bar"
    ]
    deficiencies = [
        linearise(lay_out(with_chosen(experiment, pair))).deficiency
        for pair in combinations(allowed, 2)
        if sum(one.plane == "x" for one in pair) <= count
    ]
    assert found.prediction.verdict.deficiency == min(deficiencies)


def test_limits_that_leave_no_position_are_named() -> None:
    experiment = loaded(SMALL + "  limits: {at_most: [{of: {name: '*'}, count: 0}]}\n")
    with pytest.raises(ExperimentError, match=wording.NO_POSITION_CAN_BE_READ_AS_LIMITS):
        campaign(experiment, Request("U6", Budget(positions=6)))
    experiment = loaded(SMALL)
    with pytest.raises(ExperimentError, match=wording.NO_POSITION_CAN_BE_READ_WITH_ALLOW):
        campaign(experiment, Request("U6", Budget(seconds=36.0)))
