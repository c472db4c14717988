"""Plans from Python."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.arguments import PathLike, experiment_of, table_of
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.experiment import Experiment, load as load_experiments, with_pool
from ballplate.simulator.inputs import (
    ensure_one_of,
    ensure_positive,
    ensure_report,
    ensure_type,
    ensure_whole,
    service,
)

if TYPE_CHECKING:
    import pandas

    from .criteria import CriterionName
    from .selection import Campaign


def plan(
    experiment: Experiment | PathLike,
    criterion: CriterionName = "U6",
    hours: float | None = None,
    positions: int | None = None,
    readings: int | None = None,
    curve: bool = False,
    seed: int = 1,
    workers: int = 1,
    done: PathLike | pandas.DataFrame | None = None,
    moved: bool = False,
    earlier: PathLike | None = None,
    report: Report = unreported,
) -> Campaign:
    """Choose positions and certificates from the experiment's pool within a limit, with the bound
    of any choice.

    Without a limit the choice may cost as much as the positions of the experiment. Readings that
    are `done` already are kept; if the artefact has `moved` since, a position interrupted there
    can only be set up again. `earlier` is the file of an earlier choice from this pool, to compare
    with and continue.

    >>> import ballplate as bp
    >>> corners = {"x": ["50 mm"], "y": ["50 mm"]}
    >>> places = {"planes": ["z"], "levels": ["100 mm", "400 mm"], "corners": corners}
    >>> pool = {"candidates": [places | {"probes": ["down"]}]}
    >>> bp.plan(bp.quickstart().with_(pool=pool), positions=7).headline()
    '7 of 8 candidates, U6 0.137 µm, given chain of axes MB2, temperatures exactly known'
    """
    from .campaign_choice import Request, campaign
    from .constraints import HOUR, Budget
    from .criteria import NAMES

    ensure_one_of(NAMES, criterion=str(criterion))
    ensure_positive("hours above 0", 1e5, hours=hours)
    ensure_whole(1, positions=positions, readings=readings, workers=workers)
    ensure_whole(0, seed=seed)
    ensure_type(bool, "True or False", curve=curve, moved=moved)
    ensure_report(report)
    budget = None
    if (hours, positions, readings) != (None, None, None):
        budget = Budget(None if hours is None else HOUR * hours, readings, positions)
    request = Request(criterion, budget, curve, seed)
    loaded = load_experiments(experiment, True) if isinstance(experiment, str | os.PathLike) else ()
    chosen = loaded[0] if len(loaded) == 1 else with_pool(experiment_of(experiment))
    done_table = None if done is None else table_of("done", done)
    before = None if earlier is None else Path(earlier)
    offered, choice = None, None
    if done_table is not None or before is not None:
        offered, choice = service("begun")(chosen, done_table, moved, before)
    return campaign(chosen, request, offered, choice, workers, report)
