"""Reports of measuring programs from Python."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ballplate.arguments import PathLike, experiment_of
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import ensure_one_of, ensure_path, ensure_type

if TYPE_CHECKING:
    from .imported import ReadReport


def read_report(
    reports: PathLike | Sequence[PathLike],
    experiment: Experiment | PathLike | None = None,
    name: str | None = None,
    form: str | None = None,
    unit: Literal["mm", "cm", "m", "in"] | None = None,
    circles: bool = False,
) -> ReadReport:
    """Return readings from reports of measuring programs; their `to_frame()` is a table that `fit`
    accepts.

    Positions, balls and probes are in the names of features, by a rule such as
    {position}_{ball}_{probe}: that of `name`, or the one by which the names are those of the
    `experiment`, whose `readings` may state it, as well as unit and encoding. `form` is dmis,
    pcdmis, calypso or qif, by default recognised; `unit` applies to reports without one;
    `circles` includes centres of circles.

    >>> import ballplate as bp
    >>> bp.read_report("designs/reports/z-low.dmo", "designs/quickstart.yaml").told
    ('designs/reports/z-low.dmo: DMIS output; taken: 3 sphere centres; left: 1 plane',)
    """
    from ballplate.simulator.experiment import ReadingsSettings, check_rule, lay_out
    from ballplate.simulator.inputs import LENGTH_UNITS, plain_unit

    from .formats.registered import FORMATS
    from .imported import ImportSettings, report_readings

    paths = [reports] if isinstance(reports, str | os.PathLike) else list(reports)
    for path in paths:
        ensure_path("reports", path)
    if not paths:
        raise ValueError("reports=[]; name at least one file")
    ensure_type(str, "a rule such as {position}_{ball}", name=name)
    ensure_one_of([known_format.name for known_format in FORMATS], form=form)
    ensure_one_of(("mm", "cm", "m", "in"), unit=unit)
    ensure_type(bool, "True or False", circles=circles)
    loaded = None if experiment is None else experiment_of(experiment)
    stated = ReadingsSettings.model_construct() if loaded is None else loaded.readings
    design = None if loaded is None else lay_out(loaded)
    rule = stated.names if name is None else check_rule(name)
    unit_name = unit or stated.unit
    factor = None if unit_name is None else LENGTH_UNITS[plain_unit(unit_name)]
    settings = ImportSettings(
        *(design, rule, form, factor, circles, stated.encoding), stated.probes or {}
    )
    return report_readings([Path(path) for path in paths], settings)
