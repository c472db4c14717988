"""Check and prediction of a design."""

from __future__ import annotations

from dataclasses import dataclass

from ballplate.rank.verdicts import verdict
from ballplate.simulator.computing.processes import single_threaded
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.uncertainty.summaries import Quantity, tasks_of, uncertainties
from ballplate.uncertainty.tasks import TaskUncertainty

from .influences import influence_uncertainties
from .prediction import Prediction


@dataclass(frozen=True)
class PlannedUncertainty:
    """Rank deficiency and quantities, with measuring tasks, for searches that judge many
    designs.
    """

    deficiency: int
    quantities: dict[str, Quantity]

    @property
    def tasks(self) -> tuple[TaskUncertainty, ...]:
        return tasks_of(self.quantities)


def check(experiment: Experiment, design: Design | None = None) -> Prediction:
    """Judge the rank of an experiment's design, or of another, at zero machine error."""
    return _predict(experiment, design or lay_out(experiment), False)


def predict(experiment: Experiment) -> Prediction:
    """Return rank verdict and U1 to U6 of an experiment's design at zero machine error."""
    return _predict(experiment, lay_out(experiment), True)


@single_threaded
def planned_uncertainty(experiment: Experiment) -> PlannedUncertainty:
    """Return the uncertainties of `predict` without explaining the rank, which takes longest."""
    at = linearise(lay_out(experiment))
    quantities = uncertainties(at, target=experiment.target_uncertainty)
    return PlannedUncertainty(at.deficiency, quantities)


@single_threaded
def _predict(experiment: Experiment, design: Design, with_quantities: bool) -> Prediction:
    at, target = linearise(design), experiment.target_uncertainty
    judged = verdict(at, experiment.expected_rank_deficiency, target)
    quantities = {}
    if with_quantities:
        quantities = uncertainties(at, target=target)
        lengths = quantities.get("U6")
    else:
        lengths = uncertainties(at, target=target, symbols=("U6",)).get("U6")
    return Prediction(
        experiment.label,
        experiment.title,
        design,
        judged,
        quantities,
        lengths,
        influences=influence_uncertainties(at) if with_quantities else (),
        experiment=experiment,
    )
