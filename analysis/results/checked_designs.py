"""The work of the commands without a terminal: check, prediction and fit of a design."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ballplate.rank.verdicts import verdict
from ballplate.results.influences import influence_uncertainties
from ballplate.results.prediction import Prediction
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.uncertainty.scale import scale_of
from ballplate.uncertainty.summaries import Quantity, tasks_of, uncertainties
from ballplate.uncertainty.tasks import TaskUncertainty

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class PlannedUncertainty:
    """Uncertainties alone, for searches that judge many designs: rank deficiency and quantities,
    the measuring tasks among them.
    """

    deficiency: int
    quantities: dict[str, Quantity]

    @property
    def tasks(self) -> tuple[TaskUncertainty, ...]:
        return tasks_of(self.quantities)


def check(
    experiment: Experiment, design: Design | None = None, with_scale: bool = False
) -> Prediction:
    """Judge the rank of an experiment's design, or of what came of it, at zero machine error."""
    return _predict(experiment, design or lay_out(experiment), False, with_scale)


def predict(experiment: Experiment, with_scale: bool = False) -> Prediction:
    """Rank verdict and U1 to U6 of an experiment's design at zero machine error."""
    return _predict(experiment, lay_out(experiment), True, with_scale)


@single_threaded
def planned_uncertainty(experiment: Experiment) -> PlannedUncertainty:
    """What `predict` finds, less the explanation of the rank, which takes most of its time."""
    at = linearise(lay_out(experiment))
    found = uncertainties(at, target=experiment.target_uncertainty)
    return PlannedUncertainty(at.deficiency, found)


@single_threaded
def _predict(
    experiment: Experiment, design: Design, with_quantities: bool, with_scale: bool
) -> Prediction:
    at, target = linearise(design), experiment.target_uncertainty
    judged = verdict(at, experiment.expected_rank_deficiency, target)
    quantities: dict[str, Quantity] = {}
    if with_quantities:
        quantities = uncertainties(at, target=target)
        lengths = quantities.get("U6")
    else:
        lengths = uncertainties(at, target=target, symbols=("U6",)).get("U6")
    scale = scale_of(experiment, at) if with_scale else None
    return Prediction(
        experiment.label,
        experiment.title,
        design,
        judged,
        quantities,
        lengths,
        scale,
        influences=influence_uncertainties(at) if with_quantities else (),
        experiment=experiment,
    )
