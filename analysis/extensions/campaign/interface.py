"""Run sheets from Python."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.arguments import PathLike, experiment_of
from ballplate.simulator.experiment import Experiment

if TYPE_CHECKING:
    from .sheet import Sheet


def sheet(experiment: Experiment | PathLike) -> Sheet:
    """Return a run sheet of an experiment, a table to fill in, and points for a program.

    `page()` is the run sheet to print, `template()` the CSV file of readings with empty cells, and
    `points()` the nominal centres of the balls; that of a plan is its `to_print`.

    >>> import ballplate as bp
    >>> bp.sheet(bp.quickstart())
    <Sheet of quickstart: 6 positions, 250 readings>
    >>> bp.sheet(bp.quickstart()).template().splitlines()[:2]
    ['position,ball,probe,x_mm,y_mm,z_mm', 'z low,r1c1,down,,,']
    """
    from ballplate.simulator.experiment import with_pool

    from .sheet import sheet_of

    resolved = experiment_of(experiment)
    return sheet_of(resolved if resolved is experiment else with_pool(resolved))
