"""Required equipment from Python."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, get_args

from ballplate.arguments import PathLike, experiment_of
from ballplate.simulator.computing import Report, unreported
from ballplate.simulator.experiment import Experiment, with_pool
from ballplate.simulator.inputs import (
    ensure_one_of,
    ensure_positive,
    ensure_report,
    ensure_type,
    ensure_whole,
)

if TYPE_CHECKING:
    from .answers import Reach
    from .unknowns import UnknownName


def reach(
    experiment: Experiment | PathLike,
    goal: str = "lengths",
    unknowns: UnknownName | Sequence[UnknownName] | None = None,
    target: str | None = None,
    share: float | None = None,
    artefact: str | None = None,
    calibration: int | None = None,
    report: Report = unreported,
) -> Reach:
    """Return the value of each of some unknowns that meets a goal, the others unchanged.

    `goal` is as for `ballplate reach --goal`, with the `share` of lengths to be within, `unknowns`
    one or several of repeatability, certificate, tips, thermometers, repeats, balls, size and
    hours (of a plan from the experiment's pool); by default all but hours.
    `target` replaces the experiment's target, as a text with a unit. The `artefact` by its name
    and the entry of the `calibration` select the varied ones among several.

    >>> import ballplate as bp
    >>> bp.reach(bp.quickstart(), "U6 average 0.2 um", ["repeatability"]).answers[0].is_met
    True
    """
    from .goals import parse_goal
    from .root_search import reach as search
    from .unknowns import NAMES, UnknownName

    ensure_type(str, 'a text such as "U6 average 0.3 um"', goal=goal)
    ensure_type(str, 'a text with a unit, such as "0.5 um"', target=target)
    ensure_type(str, "the name of an artefact", artefact=artefact)
    ensure_positive("a ratio above 0 and at most 1", 1.0, share=share)
    ensure_whole(0, calibration=calibration)
    ensure_report(report)
    names = (unknowns,) if isinstance(unknowns, str) else tuple(unknowns or NAMES)
    for name in names:
        ensure_one_of(get_args(UnknownName), unknowns=name)
    chosen = experiment_of(experiment)
    return search(
        with_pool(chosen) if "hours" in names else chosen,
        parse_goal(goal, share),
        names,
        artefact,
        calibration,
        target,
        report,
    )
