"""Judgement of a fit from Python: models, data left out, uncertainty budget."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from ballplate.arguments import SIGMAS, PathLike, experiment_of, observed_of
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import ensure_one_of, ensure_report, ensure_whole

from .observation_groups import GROUPINGS, Grouping

if TYPE_CHECKING:
    import pandas
    from ballplate.arguments import Tables
    from ballplate.results import Fit

    from .budget import UncertaintyBudget
    from .compared_models_result import ComparedModels
    from .left_out_result import Validation


def compare_models(
    experiment: Experiment | PathLike,
    readings: Tables = None,
    sigma: Literal["estimated", "given"] | None = None,
    coefficients: int = 8,
    certificate: PathLike | pandas.DataFrame | None = None,
    report: Report = unreported,
) -> ComparedModels:
    """Compare error models on readings: kinematic ones with up to `coefficients`, and empirical
    ones, by the sum of squares that larger ones explain, with their effect on lengths.

    >>> import ballplate as bp
    >>> readings = bp.simulate(bp.quickstart())
    >>> bp.compare_models(bp.quickstart(), readings, coefficients=6).recommended
    'kinematic, 5 and 5 coefficients'
    """
    from .compared_models import compared_models

    ensure_one_of(SIGMAS, sigma=sigma)
    ensure_whole(3, 12, coefficients=coefficients)
    ensure_report(report)
    chosen, observed = observed_of(experiment, readings, certificate)
    return compared_models(chosen, observed, sigma, coefficients, report)


def validate(
    experiment: Experiment | PathLike,
    readings: Tables = None,
    sigma: Literal["estimated", "given"] | None = None,
    certificate: PathLike | pandas.DataFrame | None = None,
    report: Report = unreported,
) -> Validation:
    """Return the predictions of each position from the others.

    >>> import ballplate as bp
    >>> bp.validate(bp.quickstart(), bp.simulate(bp.quickstart()))
    <Validation of quickstart: 6 left out in turn, 0 predicted wrongly>
    """
    from .left_out import validate as predicted

    ensure_one_of(SIGMAS, sigma=sigma)
    ensure_report(report)
    chosen, observed = observed_of(experiment, readings, certificate)
    return predicted(chosen, observed, sigma, report)


def budget(subject: Experiment | PathLike | Fit, by: Grouping = "calibration") -> UncertaintyBudget:
    """Return the contributions of each source to U4, U6, the body diagonals and the measuring
    tasks of the design of an experiment, or of a fit.

    `by` splits the readings by axis, probe, position or artefact; by default they are one source.
    Contributions add in squares; the largest comes first.

    >>> import ballplate as bp
    >>> bp.budget(bp.quickstart())
    <UncertaintyBudget of quickstart: readings 75 % of the variance of U6>
    >>> bp.budget(bp.fit(bp.quickstart(), bp.simulate(bp.quickstart())), by="probe").sources[0]
    'calibration[0]: distances of plate'
    """
    from ballplate.results import Fit

    from .budget import budget as budget_of

    ensure_one_of(GROUPINGS, by=str(by))
    if isinstance(subject, Fit):
        if subject.experiment is None:
            raise ValueError(
                f"the estimate has {subject.solution.status}; there is no budget of it"
            )
        return budget_of(subject.experiment, subject, by)
    return budget_of(experiment_of(subject), None, by)
