"""Estimators beside the full one that `ballplate fit --estimator` offers.

A further one is a function from the options, the experiment and its readings to an
`EstimatorOutcome`, and one line in `ESTIMATORS`.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ballplate.simulator.experiment.model import Experiment
    from ballplate.simulator.readings.reading_files import ObservedReadings


@dataclass(frozen=True)
class EstimatorOutcome:
    """What an estimator has found, as lines of text and as plain data in metres and radians.

    `complaint` says why the exit status is 1 and is empty where all is well; `warnings` do not
    change the status. `draw` writes the picture of its residuals, None where it has none.
    """

    lines: list[str]
    data: dict[str, Any]
    complaint: str = ""
    warnings: tuple[str, ...] = ()
    draw: Callable[[Path], None] | None = None


Estimator = Callable[[Namespace, "Experiment", "ObservedReadings"], EstimatorOutcome]


def _of_distances(
    options: Namespace, experiment: Experiment, observed: ObservedReadings
) -> EstimatorOutcome:
    from ..estimators.distances import alternative_fit_data, alternative_fit_lines, fit_alternative

    found = fit_alternative(
        experiment,
        observed,
        options.estimator,
        options.pairs,
        options.across_probes,
        options.monomials,
    )
    complaint = ""
    if found.solution.status != "converged":
        complaint = f"the estimate has {found.solution.status}; see the record of iterations"
    elif found.solution.deficiency:
        complaint = f"rank deficiency {found.solution.deficiency}: what is undetermined is left out"
    return EstimatorOutcome(alternative_fit_lines(found), alternative_fit_data(found), complaint)


def _reversal(
    options: Namespace, experiment: Experiment, observed: ObservedReadings
) -> EstimatorOutcome:
    from ..estimators.reversal_fits import fit_reversal
    from ..estimators.reversal_tables import reversal_data, reversal_lines

    found = fit_reversal(experiment, observed, options.scale, not options.no_offsets, options.sigma)
    complaint = found.complaint
    if not found.full.converged:
        complaint = f"the estimate by multiple redundancy has {found.full.solution.status}"
    elif not found.full.verdict.as_expected:
        complaint = found.full.verdict.complaint

    def draw(path: Path) -> None:
        from ..presentation.vectors import draw_vectors

        draw_vectors(found.residual_vectors(), found.title, path)

    return EstimatorOutcome(
        reversal_lines(found), reversal_data(found), complaint, found.warnings, draw
    )


def _of_length_equations(
    options: Namespace, experiment: Experiment, observed: ObservedReadings
) -> EstimatorOutcome:
    from ..estimators.length_fits import (
        fit_lengths,
        has_all_errors,
        length_fit_data,
        length_fit_lines,
    )
    from ..rank.verdict import rank_complaint

    found = fit_lengths(experiment, observed, options.estimator)
    complaint, deficiency = "", found.solution.deficiency
    if not found.solution.converged:
        complaint = (
            "the estimate has not converged; look for wrong units, balls or positions among the"
            " readings"
        )
    elif has_all_errors(observed.design) and deficiency != (
        experiment.expected_rank_deficiency or 0
    ):
        complaint = rank_complaint(deficiency, experiment.expected_rank_deficiency)
    remarks = found.remarks
    if options.sigma is not None:
        remarks += (
            "--sigma has no effect: uncertainties come from the scatter about the equations",
        )
    return EstimatorOutcome(length_fit_lines(found), length_fit_data(found), complaint, remarks)


ESTIMATORS: dict[str, Estimator] = {
    "distances": _of_distances,
    "cresto": _of_distances,
    "kruth": _of_distances,
    "reversal": _reversal,
    "length-equations": _of_length_equations,
    "sphere-then-metric": _of_length_equations,
}
"""By name; `full` is not among them."""
