"""Estimators beside the full one that `ballplate fit --estimator` offers.

A further one is a function from the options, the experiment and its readings to an `Outcome`, and one line in
`ESTIMATORS`.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simulator.experiment.model import Experiment
    from simulator.readings import ObservedReadings


@dataclass(frozen=True)
class Outcome:
    """What an estimator has found, as lines of text and as plain data in metres and radians.

    `complaint` says why the exit status is 1 and is empty where all is well; `warnings` do not change the status.
    """

    lines: list[str]
    data: dict[str, Any]
    complaint: str = ""
    warnings: tuple[str, ...] = ()


Estimator = Callable[[Namespace, "Experiment", "ObservedReadings"], Outcome]


def _of_distances(options: Namespace, experiment: Experiment, observed: ObservedReadings) -> Outcome:
    from ..estimators import fit_rival, rival_fit_data, rival_fit_lines

    found = fit_rival(experiment, observed, options.estimator, options.pairs, options.across_probes, options.monomials)
    complaint = ""
    if found.solution.status != "converged":
        complaint = f"the estimate has {found.solution.status}; see the record of iterations"
    elif found.solution.deficiency:
        complaint = f"rank deficiency {found.solution.deficiency}: what is undetermined is left out"
    return Outcome(rival_fit_lines(found), rival_fit_data(found), complaint)


ESTIMATORS: dict[str, Estimator] = {
    "distances": _of_distances,
    "cresto": _of_distances,
    "kruth": _of_distances,
}
"""By name; `full` is not among them."""
