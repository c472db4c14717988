"""Comparison of estimators from Python."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.arguments import PathLike, experiment_of
from ballplate.results import COMPARED, EstimatorName
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import ensure_one_of, ensure_report, ensure_type, ensure_whole

if TYPE_CHECKING:
    from .distances import EstimatorComparison


def compare(
    experiment: Experiment | PathLike,
    estimator: EstimatorName = "distances",
    trials: int = 100,
    pairs: str | None = None,
    across_probes: bool = False,
    seed: int | None = None,
    points: int = 200,
    report: Report = unreported,
) -> EstimatorComparison:
    """Return the differences between distances corrected by another estimator and by the full one,
    and of both from the true machine's, on synthetic data sets.

    >>> import ballplate as bp
    >>> bp.compare(bp.quickstart(), trials=2, points=10).failed
    ()
    """
    from ballplate.montecarlo import MOST_TRIALS

    from .distances import MOST_POINTS, compare_estimators

    ensure_one_of(COMPARED, estimator=str(estimator))
    ensure_type(str, 'a set of pairs of balls, such as "corners"', pairs=pairs)
    ensure_type(bool, "True or False", across_probes=across_probes)
    ensure_whole(1, MOST_TRIALS, trials=trials)
    ensure_whole(0, seed=seed)
    ensure_whole(1, MOST_POINTS, points=points)
    ensure_report(report)
    return compare_estimators(
        experiment_of(experiment),
        trials,
        estimator,  # type: ignore[arg-type]
        pairs,
        across_probes,
        seed,
        points,
        report,
    )
