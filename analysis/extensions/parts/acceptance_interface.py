"""The acceptance test from Python."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ballplate.arguments import PathLike, experiment_of, table_of
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import parse_length_function, parse_positive_length

from ..machine_files import fitted_map_of

if TYPE_CHECKING:
    import pandas
    from ballplate.results import Fit

    from ..machine_files import FittedMap
    from .acceptance_result import Acceptance


def acceptance(
    *,
    design: Experiment | PathLike | None = None,
    fitted: Fit | FittedMap | PathLike | None = None,
    readings: PathLike | pandas.DataFrame | None = None,
    mpe: str,
    mpl: str | None = None,
    probe: str | None = None,
    point_repeatability: str | None = None,
    gauge: str = "0 um",
    draws: int = 20_000,
    seed: int = 1,
) -> Acceptance:
    """Return what an acceptance test of ISO 10360-2 with the errors E0, E150 and R0 will show of a
    machine corrected by the map of an experiment `design` or a `fitted` one, or what it shows by
    `readings`, as `ballplate acceptance` prints it.

    Limits `mpe` and `mpl`, and the standard uncertainty of calibrated lengths (`gauge`, common to
    all), are texts such as "1.5 um + L/333000". `probe` names that of E150. A prediction needs
    `point_repeatability`, that of a touched point along the length: it is greater than that of
    centres of balls.

    :raises ValueError: not one source, a wrong text, no such probe, or undetermined lengths.

    >>> import ballplate as bp
    >>> test = {"mpe": "0.5 um + L/1000000", "point_repeatability": "0.1 um"}
    >>> bp.acceptance(design=bp.quickstart(), **test).headline()[:37]
    'simple acceptance: chance to pass 0.9'
    """
    from .acceptance_prediction import acceptance_prediction, by_design, by_map
    from .acceptance_readings import acceptance_evaluation
    from .acceptance_rules import Agreed

    if sum(source is not None for source in (design, fitted, readings)) != 1:
        raise ValueError("give one of a design, a map and readings")
    agreed = Agreed(
        parse_length_function(mpe),
        parse_positive_length(mpl) if mpl else math.inf,
        parse_length_function(gauge, or_zero=True),
        parse_positive_length(point_repeatability) if point_repeatability else 0.0,
    )
    if readings is not None:
        return acceptance_evaluation(table_of("readings", readings), agreed, probe)
    if not agreed.point:
        raise ValueError('no point repeatability; give that of a touched point, such as "0.4 um"')
    by_fit = None if fitted is None else by_map(fitted_map_of("fitted", fitted))
    machine = by_fit or by_design(experiment_of(design))
    return acceptance_prediction(machine, agreed, probe, draws, seed)
