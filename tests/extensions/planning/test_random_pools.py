"""Choices from pools at random: never better than their bound, worth what the written file is
worth, best of all.
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Sequence
from itertools import chain, combinations, product
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.planning.campaign_choice import TINY_POOL
from ballplate.extensions.planning.constraints import Spent, with_chosen
from ballplate.extensions.planning.criteria import CriterionName
from ballplate.extensions.planning.experiment_file import experiment_text
from ballplate.extensions.planning.schedule import run_sheet
from ballplate.extensions.planning.selection import Campaign
from ballplate.results.prediction import planned_uncertainty, predict
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Candidate, Experiment, Position
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.readings.reading_files import read_readings

from .random_pools import RandomPool, random_pool, write_some

# Candidates of which every selection is tried by full computations.
FEW = 6


def by_run(experiment: Experiment, name: CriterionName) -> float:
    """The criterion by what `run` computes, infinite where something that it is about is
    undetermined.
    """
    kind, _, largest = name.partition("-")
    if kind in ("U6", "U5", "tasks"):
        found = predict(experiment).quantities[kind]
        return np.inf if found.undetermined else getattr(found, "maximum" if largest else "average")
    design = lay_out(experiment)
    at = linearise(design)
    layout = at.layout
    scaled = np.eye(len(layout))[layout.model] / layout.scale[layout.model, None]
    if np.isnan(at.of_shared(scaled)).any():
        return np.inf
    variances = np.linalg.eigvalsh(scaled @ at.shared @ at.shared.T @ scaled.T)
    return {
        "A": np.sqrt(variances.mean()),
        "D": np.exp(0.5 * np.log(variances).mean()),
        "E": np.sqrt(variances[-1]),
        "condition": np.sqrt(variances[-1] / variances[0]),
    }[kind]


def written(found: Campaign, folder: Path) -> Experiment:
    """The choice as `plan -o` writes it, read again."""
    path = folder / "chosen.yaml"
    path.write_text(
        experiment_text(found.experiment, found.sheet.chosen, "", folder, found.left_open or None)
    )
    return load(path)[0]


def spent_on(chosen: Sequence[Candidate], experiment: Experiment) -> Spent:
    """What a choice costs, from its run sheet."""
    assert experiment.pool is not None
    positions = sum(isinstance(one.item, Position) for one in chosen)
    seconds = run_sheet(chosen, experiment.pool.changes).seconds
    return Spent(seconds, sum(one.readings for one in chosen), positions)


def best_of_all(pool: RandomPool) -> float:
    """The least criterion of all selections that keep to the limits and determine everything."""
    experiment = pool.experiment
    assert experiment.pool is not None
    candidates, limits = experiment.pool.candidates, experiment.pool
    every = chain.from_iterable(
        combinations(range(len(candidates)), k) for k in range(1, len(candidates) + 1)
    )
    plates = {name for name, one in experiment.artefacts.items() if one.role == "plate"}
    offered = {one.item.artefact for one in candidates if isinstance(one.item, Position)}
    best = np.inf
    for indices in every:
        chosen = [candidates[k] for k in indices]
        placed = {one.item.artefact for one in chosen if isinstance(one.item, Position)}
        if (
            not placed
            or not set(limits.must) <= set(indices)
            or any(len(set(indices) & set(limit.members)) > limit.count for limit in limits.at_most)
            or not spent_on(chosen, experiment).is_within(pool.budget)
            or (pool.criterion.startswith("U5") and plates & offered > placed & plates)
        ):
            continue
        whole = with_chosen(experiment, chosen)
        if not planned_uncertainty(whole).deficiency:
            best = min(best, by_run(whole, pool.criterion))
    return best


def check_choice(pool: RandomPool, folder: Path) -> bool:
    """Whether there is a choice that determines everything; it has to be what it is said to be in
    any case.
    """
    try:
        taken = pool.taken
        found = pool.planned(taken)
    except ExperimentError:
        return False
    if not np.isnan(found.bound):
        assert found.bound <= found.value * (1 + 1e-9)
    assert found.spent.is_within(pool.budget)
    assert found.sheet.seconds == pytest.approx(found.spent.seconds, abs=1e-6)
    experiment = written(found, folder)
    if found.is_determined:
        assert by_run(experiment, pool.criterion) == pytest.approx(found.value, rel=1e-9)
    if not taken and len(found.pool.candidates) <= FEW and not found.excluded:
        assert best_of_all(pool) == pytest.approx(found.value, rel=1e-9)
    if pool.readings is not None and not found.ignored:
        # What has been read is part of what the file plans, and with the rest of it nothing is
        # missing.
        design = lay_out(experiment)
        with pool.readings.open(newline="", encoding="utf-8") as stream:
            read = Counter(
                (row["position"], row["ball"], row["probe"]) for row in csv.DictReader(stream)
            )
        planned = Counter[tuple[str, str, str]]()
        for position in experiment.positions:
            for group in position.readings:
                for ball, probe in product(group.balls, group.probes):
                    planned[position.name, ball, probe] += group.repeats
        assert read <= planned
        complete = read_readings(
            write_some(experiment, experiment.positions, folder / "all.csv", 1.0), design
        )
        assert complete.missing == complete.unplanned == ()
    return found.is_determined


def check_more_data(pool: RandomPool) -> bool:
    """Whether there is an interrupted position, with whose readings the plan has to be no worse
    than without.

    A better direction makes the condition worse, and larger pools are searched, not tried out.
    """
    if pool.criterion == "condition":
        return False
    try:
        taken = pool.taken
        less = pool.planned(tuple(one for one in taken if one.rest is None))
    except ExperimentError:
        return False
    if all(one.rest is None for one in taken) or len(less.pool.candidates) > TINY_POOL:
        return False
    more = pool.planned(taken)
    assert more.value <= less.value * (1 + 1e-9)
    return True


def test_pools_at_random(tmp_path: Path) -> None:
    fine = [check_choice(random_pool(tmp_path, seed), tmp_path) for seed in range(8)]
    assert sum(fine) >= 6


def test_readings_of_an_interrupted_position_never_make_a_plan_worse(tmp_path: Path) -> None:
    assert sum(check_more_data(random_pool(tmp_path, seed)) for seed in range(2, 20, 3)) >= 2


@pytest.mark.long
def test_two_hundred_pools_at_random(tmp_path: Path) -> None:
    fine = [check_choice(random_pool(tmp_path, seed), tmp_path) for seed in range(8, 212)]
    assert sum(fine) >= 160
