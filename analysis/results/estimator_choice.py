"""Estimators by name, and the options of each.

Computing modules are imported late, so that names load fast.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any, Literal, get_args

from ballplate.simulator.inputs.extensions import service
from ballplate.simulator.inputs.messages import refused

if TYPE_CHECKING:
    from ballplate.presentation.result import FitResult
    from ballplate.simulator.experiment.model import Experiment
    from ballplate.simulator.readings.observed_readings import ObservedReadings

EstimatorName = Literal[
    "full", "distances", "cresto", "kruth", "reversal", "length-equations", "sphere-then-metric"
]

ESTIMATORS: tuple[EstimatorName, ...] = get_args(EstimatorName)
OF_DISTANCES = ("distances", "cresto", "kruth")
OF_LENGTHS = ("length-equations", "sphere-then-metric")
COMPARED = (*OF_DISTANCES, *OF_LENGTHS, "reversal")
"""Estimators that are compared with the full one."""
DRAWN = ("full", "reversal")
"""Estimators that draw their residuals."""

# Options that only some estimators take.
TAKE: dict[str, tuple[str, ...]] = {
    "scale": ("reversal",),
    "offsets": ("reversal",),
    "pairs": OF_DISTANCES,
    "across_probes": OF_DISTANCES,
    "monomials": ("full", *OF_DISTANCES),
}


def takers(estimator: str, options: Collection[str]) -> tuple[str, str] | None:
    """Return the first option that the estimator does not take, with the names of those that do.

    >>> takers("full", ["monomials", "pairs"])
    ('pairs', 'distances, cresto or kruth')
    """
    for name, estimators in TAKE.items():
        if name in options and estimator not in estimators:
            return name, " or ".join(filter(None, (", ".join(estimators[:-1]), estimators[-1])))
    return None


def fit_readings(
    experiment: Experiment,
    observed: ObservedReadings,
    estimator: EstimatorName = "full",
    sigma: Literal["estimated", "given"] | None = None,
    monomials: bool = False,
    pairs: str | None = None,
    across_probes: bool = False,
    scale: Any = None,
    offsets: bool = True,
) -> FitResult:
    """Return the fit of an experiment's readings by an estimator.

    :raises ExperimentError: it cannot estimate this experiment.
    """
    if experiment.influences and estimator != "full":
        text = f"{estimator} does not know influence quantities; use the full estimator, or"
        text += " remove them"
        raise refused(experiment.source, text, "influences")
    if estimator == "reversal":
        return service("fit_reversal")(experiment, observed, scale, offsets, sigma)
    if estimator in OF_LENGTHS:
        return service("fit_lengths")(experiment, observed, estimator, sigma)
    if estimator in OF_DISTANCES:
        return service("fit_alternative")(
            experiment, observed, estimator, pairs, across_probes, monomials
        )
    from .fitting import fit

    return fit(experiment, observed, sigma, monomials)
