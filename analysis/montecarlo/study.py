"""Replicates of an experiment's true machine: are the linearised uncertainties right, or too optimistic?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from simulator.design import Design, nominal_state
from simulator.estimation.covariance import spectrum
from simulator.estimation.elimination import eliminate
from simulator.estimation.parameters import shared_layout
from simulator.experiment.load import message_at
from simulator.experiment.messages import ExperimentError
from simulator.experiment.model import Experiment
from simulator.generate import NoReadingError, on_true_machine
from simulator.layout import lay_out
from simulator.machines.truth import true_machine
from simulator.montecarlo.reference import NoReferenceError, Reference, TooWildError, Truth, reference

from .figures import Outcome, power_of_difference, power_of_misfit
from .trials import Progress, run_trials


@dataclass(frozen=True)
class OwnModel:
    """What fitting the true machine's own model as well would tell (NPL Report CISE 15/98, section 5.3).

    It determines `more` parameters more, brings S^2 down by `gain` more than by chance, and the difference of the two
    S^2 shows the misfit with probability `power`.
    """

    more: int
    gain: float
    power: float


@dataclass(frozen=True)
class Optimism:
    """How a misfit would be noticed: by S^2 alone with probability `power`, or by a richer model."""

    power: float
    own_model: OwnModel | None


@dataclass(frozen=True)
class Trials:
    """Replicates of an experiment; without an outcome there is a reason. `optimism` where the models differ."""

    seed: int
    outcome: Outcome | None
    reason: str = ""
    optimism: Optimism | None = None


def true_experiment(experiment: Experiment) -> tuple[Design, Truth]:
    """The design, and the artefacts as drawn on the true machine."""
    design = lay_out(experiment)
    lower, upper = tuple(design.lower.tolist()), tuple(design.upper.tolist())
    on_truth, state = on_true_machine(design, true_machine(experiment.true_machine, design.model, lower, upper))
    return design, Truth(state, on_truth.model)


def trials(
    experiment: Experiment,
    count: int,
    seed: int | None = None,
    until: float | None = None,
    workers: int = 1,
    report: Callable[[Progress], None] = lambda progress: None,
) -> Trials:
    """Estimate replicates of an experiment's true machine; see `run_trials`.

    :raises ExperimentError: a true machine whose errors are too large to be simulated or fitted.
    """
    chosen = experiment.seed if seed is None else seed
    design, truth = true_experiment(experiment)
    try:
        shared = reference(design, truth)
    except NoReferenceError as error:
        return Trials(chosen, None, str(error))
    except (NoReadingError, TooWildError) as error:
        text = f"{error}; state smaller errors"
        raise ExperimentError([message_at(experiment.source, ("true_machine",), text)]) from None
    outcome = run_trials(shared, chosen, count, until, workers, report)
    return Trials(chosen, outcome, optimism=_optimism(experiment, shared) if truth.model != design.model else None)


def _optimism(experiment: Experiment, shared: Reference) -> Optimism:
    misfit = shared.sum_of_squares
    power = power_of_misfit(shared.degrees_of_freedom, misfit)
    if getattr(experiment.true_machine, "error_model", None) is None:
        return Optimism(power, None)
    own = replace(shared.design, model=shared.truth.model)
    found = spectrum(eliminate(own, shared_layout(own), nominal_state(own)))
    more = own.parameter_count - found.deficiency - shared.design.parameter_count
    if more <= 0:
        return Optimism(power, None)
    return Optimism(power, OwnModel(more, misfit, power_of_difference(more, misfit)))
