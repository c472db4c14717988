"""Replicates of an experiment's true machine: are the linearised uncertainties right, or too
optimistic?
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce
from operator import add

import numpy as np
from ballplate.montecarlo.reference import (
    DivergedError,
    Reference,
    Truth,
    reference,
)
from ballplate.simulator.computing.steps import Report, unreported
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.joined import JoinedModel
from ballplate.simulator.readings.generate import NoReadingError
from ballplate.simulator.readings.simulated import on_stated_machine

from .accumulator import Accumulator
from .figures import MonteCarloOutcome, outcome, power_of_difference, power_of_misfit
from .targets import targets
from .trial_runs import TASK, run_trials, sum_of_task


@dataclass(frozen=True)
class OwnModel:
    """What a second fit, with the true machine's own functions added, would tell (NPL Report CISE
    15/98, section 5.3).

    The design determines `more` parameters more of it; it brings S^2 down by `gain` more than by
    chance, and the difference of the two S^2 shows the misfit with probability `power`.
    """

    more: int
    gain: float
    power: float


@dataclass(frozen=True)
class Optimism:
    """How a misfit would be noticed: by S^2 alone with probability `power`, or by a richer
    model.
    """

    power: float
    own_model: OwnModel | None


@dataclass(frozen=True)
class Trials:
    """Replicates of an experiment; without an outcome there is a reason. `optimism` where the
    models differ.
    """

    seed: int
    outcome: MonteCarloOutcome | None
    reason: str = ""
    optimism: Optimism | None = None


def true_experiment(experiment: Experiment) -> tuple[Design, Truth]:
    """The design, and the artefacts as drawn on the true machine."""
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
    found = run_trials(shared, chosen, count, until, workers, report)
    differs = shared.truth.model != shared.design.model
    return Trials(chosen, found, optimism=_optimism(experiment, shared) if differs else None)


def block_of_trials(
    experiment: Experiment, count: int, seed: int, block: int, size: int
) -> Accumulator | None:
    """Sums over the replicates from `block` x `size` on, `size` of `count` in all at most; None
    where there are none.

    `size` is a multiple of `TASK` replicates. The same replicates have the same bits, whatever the
    blocks.

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
    """What sums over replicates of an experiment come to.

    :raises ExperimentError: as `trials`.
    """
    shared = _shared(experiment)
    assert not isinstance(shared, str)
    return outcome(shared, targets(shared), total)


def _shared(experiment: Experiment) -> Reference | str:
    """What all replicates share, or why there are none."""
    design, truth = true_experiment(experiment)
    try:
        shared = reference(design, truth)
    except (NoReadingError, DivergedError) as error:
        text = f"{error}; state smaller errors"
        raise experiment.refused(("true_machine",), text) from None
    return shared if targets(shared) else "the design determines nothing that could be compared"


def _optimism(experiment: Experiment, shared: Reference) -> Optimism:
    misfit = shared.sum_of_squares
    power = power_of_misfit(shared.degrees_of_freedom, misfit)
    if getattr(experiment.true_machine, "error_model", None) is None:
        return Optimism(power, None)
    design = shared.design
    # Neither model need contain the other: what the true one's functions add is the rank of both
    # together.
    joined = replace(design, model=JoinedModel(design.model, shared.truth.model))
    both = joined.observed(_widened(design, shared.truth))
    known = design.parameter_count - shared.spectrum.deficiency
    more = both.parameter_count - linearise(both).deficiency - known
    if more == 0:
        return Optimism(power, None)
    return Optimism(power, OwnModel(more, misfit, power_of_difference(more, misfit)))


def _widened(design: Design, truth: Truth) -> Priors:
    """The design's priors for a model that has the true one's parameters besides."""
    by_model = design.of(Priors).by_model
    return replace(
        design.of(Priors), by_model=np.pad(by_model, ((0, 0), (0, len(truth.model.parameters))))
    )
