"""Replicates of an experiment's true machine: validation of the linearised uncertainties."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import reduce
from operator import add

import numpy as np
from ballplate.simulator.computing.processes import in_processes, single_threaded
from ballplate.simulator.computing.steps import ProgressStep, Report, unreported
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.machines.protocol import ErrorModel, Parameter, Reported
from ballplate.simulator.readings.simulated import NoReadingError, on_stated_machine

from ._reference import DivergedError, Reference, Truth, reference
from ._replicates import BATCH, estimate_batch
from ._targets import MonteCarloQuantity, targets
from .accumulator import Accumulator, accumulate
from .figures import MonteCarloOutcome, outcome, power_of_misfit

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
        # These are squares: to first order the ratio has half their relative standard error.
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
    # Results come in the order of tasks, whichever worker is first, so that sums have the same
    # bits.
    arguments = ((shared, aims, seed, task, trials) for task in tasks)
    return in_processes(sum_of_task, arguments, min(workers, len(tasks)))


@dataclass(frozen=True)
class JoinedModel:
    """e(x, a, p) = e1(x, a1, p) + e2(x, a2, p) - p, with a = (a1, a2).

    Errors common to both models have two sets of parameters: use the sum for ranks and sums of
    squares only.
    """

    first: ErrorModel
    second: ErrorModel

    @property
    def dimension(self) -> int:
        return self.first.dimension

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of the first model, then those of the second, named "second …"."""
        renamed = (replace(p, name=f"second {p.name}") for p in self.second.parameters)
        return (*self.first.parameters, *renamed)

    def error(self, x: Array, a: Array, p: Array) -> Array:
        n = len(self.first.parameters)
        return self.first.error(x, a[:n], p) + self.second.error(x, a[n:], p) - p

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        n = len(self.first.parameters)
        return np.concatenate(
            [self.first.jacobian(x, a[:n], p), self.second.jacobian(x, a[n:], p)], axis=2
        )

    def reported(self) -> Reported:
        second = self.second.reported()
        names = tuple(f"second {name}" for name in second.names)
        return self.first.reported().beside(replace(second, names=names))


@dataclass(frozen=True)
class OwnModel:
    """Result of a second fit that adds the true machine's functions (NPL Report CISE 15/98, section
    5.3).

    The design determines `more` further parameters; they lower S^2 by `gain` more than chance does,
    and the difference of both S^2 shows the lack of fit with probability `power`.
    """

    more: int
    gain: float
    power: float


@dataclass(frozen=True)
class Trials:
    """Replicates of an experiment; without an outcome there is a reason.

    If the fitted model differs from the true machine's, S^2 alone shows the lack of fit with
    probability `power`, and a larger model as `own_model` states.
    """

    seed: int
    outcome: MonteCarloOutcome | None
    reason: str = ""
    power: float | None = None
    own_model: OwnModel | None = None


def true_experiment(experiment: Experiment) -> tuple[Design, Truth]:
    """Return the design, and the nominal artefacts on the true machine."""
    design = lay_out(experiment)
    on_truth, state = on_stated_machine(experiment, design)
    return design, Truth(state, on_truth.model)


def trials(
    experiment: Experiment,
    count: int,
    seed: int | None = None,
    until: float | None = None,
    workers: int = 1,
    report: Report = unreported,
) -> Trials:
    """Estimate replicates of an experiment's true machine; see `run_trials`.

    :raises ExperimentError: a true machine whose errors are too large to be simulated or fitted.
    """
    chosen = experiment.seed if seed is None else seed
    shared = _shared(experiment)
    if isinstance(shared, str):
        return Trials(chosen, None, shared)
    result = run_trials(shared, chosen, count, until, workers, report)
    if shared.truth.model == shared.design.model:
        return Trials(chosen, result)
    power = power_of_misfit(shared.degrees_of_freedom, shared.sum_of_squares)
    return Trials(chosen, result, power=power, own_model=_own_model(experiment, shared))


def block_of_trials(
    experiment: Experiment, count: int, seed: int, block: int, size: int
) -> Accumulator | None:
    """Return sums over at most `size` of `count` replicates from `block` x `size` on; None without
    any.

    `size` is a multiple of `TASK` replicates. Replicates have the same bits, regardless of blocks.

    :raises ExperimentError: as `trials`.
    """
    shared = _shared(experiment)
    if isinstance(shared, str):
        return None
    aims = targets(shared)
    first, last = block * size // TASK, min((block + 1) * size, count)
    parts = [sum_of_task(shared, aims, seed, task, last) for task in range(first, -(-last // TASK))]
    return reduce(add, parts)


def combined(experiment: Experiment, total: Accumulator) -> MonteCarloOutcome:
    """Return the outcome of sums over an experiment's replicates.

    :raises ExperimentError: as `trials`.
    """
    shared = _shared(experiment)
    assert not isinstance(shared, str)
    return outcome(shared, targets(shared), total)


def _shared(experiment: Experiment) -> Reference | str:
    """Return the common parts of replicates, or why there are none."""
    design, truth = true_experiment(experiment)
    try:
        shared = reference(design, truth)
    except (NoReadingError, DivergedError) as error:
        text = f"{error}; state smaller errors"
        raise experiment.refused(("true_machine",), text) from None
    return shared if targets(shared) else "the design determines no quantity that can be compared"


def _own_model(experiment: Experiment, shared: Reference) -> OwnModel | None:
    """Return the result of a second fit; None if it has no further parameters."""
    misfit = shared.sum_of_squares
    if getattr(experiment.true_machine, "error_model", None) is None:
        return None
    design = shared.design
    # Neither model need contain the other: the joint rank gives the parameters that the true one
    # adds.
    joined = replace(design, model=JoinedModel(design.model, shared.truth.model))
    widened = joined.observed(_widened(design, shared.truth))
    determined = design.parameter_count - shared.spectrum.deficiency
    more = widened.parameter_count - linearise(widened).deficiency - determined
    return OwnModel(more, misfit, power_of_misfit(more, misfit)) if more else None


def _widened(design: Design, truth: Truth) -> Priors:
    """Return the design's priors for a model with the true one's parameters added."""
    by_model = design.of(Priors).by_model
    return replace(
        design.of(Priors), by_model=np.pad(by_model, ((0, 0), (0, len(truth.model.parameters))))
    )
