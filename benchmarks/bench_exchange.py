"""The cost of one step of an exchange: one position is taken out of six, and the best of a pool
takes its place.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.planning.constraints import Budget, constraints
from ballplate.extensions.planning.criteria import criterion
from ballplate.extensions.planning.information import Information, pool_information
from ballplate.extensions.planning.search import Losses, SelectionProblem, best_addition, full_root
from ballplate.results.prediction import predict
from ballplate.simulator.computing.processes import single_threaded
from ballplate.simulator.experiment.construction import with_chosen
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.machines.protocol import Array

POOL = Path("designs/planning/plate-pool.yaml")
ROUNDS = 5

# Candidates that the slow ways are timed with.
FEW = 12


def seconds(function: Callable[[], object]) -> float:
    before = time.perf_counter()
    function()
    return time.perf_counter() - before


def pool_of(folder: Path, balls: int) -> SelectionProblem:
    text = POOL.read_text().replace("balls: [7, 7]", f"balls: [{balls}, {balls}]")
    path = folder / "pool.yaml"
    path.write_text(text)
    (experiment,) = load(path, planning=True)
    assert experiment.pool is not None
    # Every third of the candidates, and the six drawn.
    candidates = experiment.pool.candidates[:6] + experiment.pool.candidates[6::3]
    information = pool_information(experiment, candidates)
    limits = constraints(candidates, experiment.pool.changes, Budget(positions=6))
    return SelectionProblem(information, criterion(information, experiment, "U6"), limits)


def by_update(problem: SelectionProblem, left: Array, rows: Array) -> float:
    """The criterion by an update of the covariance with the candidate's own rows (Woodbury), of
    full rank or not.
    """
    carried = rows @ left
    small = np.linalg.solve(np.eye(len(rows)) + carried @ rows.T, carried)
    root = np.linalg.cholesky(left - carried.T @ small)
    own = problem.information.shared
    return problem.criterion.value(root[own])


def rank_rows(information: Information, k: int) -> Array:
    values, directions = np.linalg.eigh(information.matrices[k])
    kept = values > 1e-12 * values[-1]
    return (directions[:, kept] * np.sqrt(values[kept])).T


@pytest.mark.parametrize("balls", [5, 7, 9])
@single_threaded
def test_one_exchange(tmp_path: Path, balls: int) -> None:
    problem = pool_of(tmp_path, balls)
    information, n = problem.information, problem.constraints.count
    left = frozenset(range(5))
    some = np.linspace(6, n - 1, FEW).astype(int)

    (experiment,) = load(tmp_path / "pool.yaml", planning=True)

    def step() -> None:
        assert best_addition(problem, left, Losses(problem)) is not None

    def in_full() -> list[float]:
        found = []
        for k in some:
            members = [information.candidates[m] for m in (*left, int(k))]
            found.append(predict(with_chosen(experiment, members)).quantities["U6"].average)
        return found

    def anew() -> list[float]:
        found = []
        for k in some:
            root = full_root(information.of({*left, int(k)}))
            found.append(np.inf if root is None else problem.value(root))
        return found

    rows = {int(k): rank_rows(information, int(k)) for k in some}
    covariance = np.linalg.inv(information.of(left))

    def updated() -> list[float]:
        return [by_update(problem, covariance, rows[int(k)]) for k in some]

    full, new, update = in_full(), anew(), updated()
    np.testing.assert_allclose(new, full, rtol=1e-9)
    np.testing.assert_allclose(update, full, rtol=1e-6)
    ranks = [len(r) for r in rows.values()]
    steps, fulls, anews, updates = ([] for _ in range(4))
    for _ in range(ROUNDS):
        steps.append(seconds(step))
        fulls.append(seconds(in_full) * n / FEW)
        anews.append(seconds(anew) * n / FEW)
        updates.append(seconds(updated) * n / FEW)
    ratios = [np.median(np.array(slow) / np.array(steps)) for slow in (anews, updates, fulls)]
    print(
        f"\n| {balls} | {n} | {information.basis.size} | {min(ranks)} to {max(ranks)} |"
        f" {1e3 * np.median(steps):.0f} | {1e6 * np.median(steps) / n:.0f} | {ratios[0]:.1f} |"
        f" {ratios[1]:.1f} | {ratios[2]:.0f} |"
    )
