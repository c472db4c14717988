"""Replicates of an experiment's true machine: validation of the linearised uncertainties."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce
from operator import add

import numpy as np
from ballplate.simulator.computing.steps import Report, unreported
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.truth import JoinedModel
from ballplate.simulator.readings.generate import NoReadingError, on_stated_machine

from .accumulator import Accumulator
from .figures import MonteCarloOutcome, outcome, power_of_misfit
from .reference import (
    DivergedError,
    Reference,
    Truth,
    reference,
)
from .targets import targets
from .trial_runs import TASK, run_trials, sum_of_task


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
