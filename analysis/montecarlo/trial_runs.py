"""Computation of replicates in processes, summed in a fixed order."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from ballplate.simulator.computing.processes import in_processes, single_threaded
from ballplate.simulator.computing.steps import ProgressStep, Report, unreported

from .accumulator import Accumulator, accumulate
from .figures import MonteCarloOutcome, outcome
from .reference import Reference
from .replicates import BATCH, estimate_batch
from .targets import MonteCarloQuantity, targets

# Batches of a task: constant, so that the order of sums is independent of the workers.
BATCHES = 4
TASK = BATCH * BATCHES

# Limit of the replicates of a run, also with `until`.
MOST_TRIALS = 1_000_000


def run_trials(
    shared: Reference,
    seed: int,
    trials: int,
    until: float | None = None,
    workers: int = 1,
    report: Report = unreported,
) -> MonteCarloOutcome:
    """Estimate up to `trials` replicates and compare them with the linearised uncertainties.

    With `until` the run ends when the relative standard error of every ratio of spread to
    linearised uncertainty is at most this. The result of a number of replicates is independent of
    `workers` and interruptions: after a KeyboardInterrupt the outcome is that of the finished
    tasks, in order.

    :raises KeyboardInterrupt: before the first task was finished.
    """
    # Loaded first, since there is little time after an interruption.
    import scipy.special  # noqa: F401

    aims = targets(shared)
    total = None
    interrupted = False
    try:
        for part in _parts(shared, aims, seed, trials, workers):
            total = part if total is None else total + part
            accuracy, count = accuracy_of(total), total.count + len(total.failed)
            # Accuracy improves as the root of the number.
            enough = (
                trials
                if until is None
                else min(trials, int(count * max(accuracy / until, 1.0) ** 2))
            )
            remark = f"accurate to {100 * accuracy:.2g} %" if accuracy < 1.0 else ""
            report(ProgressStep("data sets", count, enough, remark))
            if until is not None and accuracy <= until:
                break
    except KeyboardInterrupt:
        if total is None:
            raise
        interrupted = True
    assert total is not None
    return replace(outcome(shared, aims, total), interrupted=interrupted)


def accuracy_of(total: Accumulator) -> float:
    """Return the largest relative standard error of the ratios of spread to linearised uncertainty;
    infinite for one replicate.
    """
    if total.count < 2:
        return float("inf")
    n = total.count
    worst = 0.0
    for sums in total.quantities:
        mean = sums.numbers[0] / n
        variance = max(sums.numbers_squared[0] / n - mean**2, 0.0) * n / (n - 1)
        worst = max(worst, float(np.sqrt(variance / n) / (2.0 * mean)))
    return worst


@single_threaded
def sum_of_task(
    shared: Reference, aims: tuple[MonteCarloQuantity, ...], seed: int, task: int, trials: int
) -> Accumulator:
    """Return sums over the replicates of one task."""
    total = None
    for batch in range(task * BATCHES, (task + 1) * BATCHES):
        count = min(BATCH, trials - batch * BATCH)
        if count <= 0:
            break
        part = accumulate(shared, aims, estimate_batch(shared, seed, batch, count), count)
        total = part if total is None else total + part
    assert total is not None
    return total


def _parts(
    shared: Reference, aims: tuple[MonteCarloQuantity, ...], seed: int, trials: int, workers: int
) -> Iterator[Accumulator]:
    tasks = range(-(-trials // TASK))
    arguments = ((shared, aims, seed, task, trials) for task in tasks)
    return in_processes(sum_of_task, arguments, min(workers, len(tasks)))
