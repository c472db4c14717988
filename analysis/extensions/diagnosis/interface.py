"""Reliability from Python."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from ballplate.arguments import SIGMAS, PathLike, experiment_of
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import ensure_one_of, ensure_positive, ensure_report

if TYPE_CHECKING:
    from .reliability_result import Reliability


def reliability(
    experiment: Experiment | PathLike,
    false_alarm: float = 0.001,
    power: float = 0.8,
    sigma: Literal["estimated", "given"] | None = None,
    report: Report = unreported,
) -> Reliability:
    """Return redundancies, minimal detectable biases and effects of undetected errors.

    >>> import ballplate as bp
    >>> bp.reliability(bp.quickstart()).degrees_of_freedom
    580
    """
    from . import redundancy
    from .power import LEAST_CHANCE, MOST_CHANCE

    ensure_one_of(SIGMAS, sigma=sigma)
    limits = f"between {LEAST_CHANCE:g} and {MOST_CHANCE:g}"
    ensure_positive(f"a ratio {limits}", MOST_CHANCE, false_alarm=false_alarm, power=power)
    ensure_report(report)
    if not LEAST_CHANCE <= false_alarm < power:
        raise ValueError(
            f"false_alarm={false_alarm}, power={power}; give ratios {limits}, the power the larger"
        )
    return redundancy.reliability(experiment_of(experiment), false_alarm, power, sigma, report)
