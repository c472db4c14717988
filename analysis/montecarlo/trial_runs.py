"""Computation of replicates, on one processor or several, until there are enough, summed in
order.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from ballplate.montecarlo.accumulator import Accumulator, accumulate
from ballplate.montecarlo.figures import MonteCarloOutcome, outcome
from ballplate.montecarlo.reference import Reference
from ballplate.montecarlo.replicates import BATCH, estimate_batch
from ballplate.montecarlo.targets import MonteCarloQuantity, targets
from ballplate.simulator.computing.processes import in_processes
from ballplate.simulator.computing.steps import ProgressStep, Report, unreported
from ballplate.simulator.computing.threads import single_threaded

# Batches of a task. A fixed number, so that sums are formed in the same order whoever forms them.
BATCHES = 4
TASK = BATCH * BATCHES

# Replicates of a run, those of one included that is to go on until its figures are accurate.
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

    With `until` the run ends as soon as the relative standard error of every ratio of spread to
    linearised uncertainty is no larger. Neither `workers` nor an interruption changes what a given
    number of replicates comes to: after a KeyboardInterrupt the outcome is that of the tasks done
    so far, in order.

    :raises KeyboardInterrupt: before the first task was done.
    """
    # What figures are made with is loaded first: after an interruption there is little time.
    import scipy.special  # noqa: F401

    aims = targets(shared)
    total: Accumulator | None = None
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
    """Largest relative standard error of the ratios of spread to linearised uncertainty; infinite
    for 1 replicate.
    """
    if total.count < 2:
        return float("inf")
    n = total.count
    worst = 0.0
    for one in total.quantities:
        mean = one.numbers[0] / n
        variance = max(one.numbers_squared[0] / n - mean**2, 0.0) * n / (n - 1)
        worst = max(worst, float(np.sqrt(variance / n) / (2.0 * mean)))
    return worst


@single_threaded
def sum_of_task(
    shared: Reference, aims: tuple[MonteCarloQuantity, ...], seed: int, task: int, trials: int
) -> Accumulator:
    """Sums over the replicates of one task."""
    total: Accumulator | None = None
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
