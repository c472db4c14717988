"""Hours of the shortest plan from a pool that meets a goal."""

from __future__ import annotations

from bisect import bisect_left
from functools import cache

from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import ExperimentError

from ..planning import HOUR, Budget, Campaign, Request, campaign
from .answers import Answer, Status
from .goals import Goal, judge
from .unknowns import NotVariableError

QUARTER = HOUR / 4


def hours_answer(experiment: Experiment, goal: Goal) -> Answer:
    """Return the fewest hours, to a quarter, of a plan from the experiment's pool that meets a
    goal, found by doubling and bisection up to twice the time of all candidates.

    :raises NotVariableError: there is no pool.
    """
    if experiment.pool is None:
        raise NotVariableError("the file has no pool of positions to plan from; add one")

    wanted = "dimensions" if goal.kind == "dimensions" else "U6"

    @cache
    def planned(quarters: int) -> Campaign | None:
        try:
            return campaign(experiment, Request(wanted, Budget(QUARTER * quarters)))
        except ExperimentError:
            return None

    def is_met(quarters: int) -> bool:
        plan = planned(quarters)
        return plan is not None and judge(goal, plan.prediction).is_met

    most = int(sum(candidate.seconds for candidate in experiment.pool.candidates) / QUARTER)
    doubled = [2**k for k in range(most.bit_length() + 1)]
    met = next(filter(is_met, doubled), 0)
    found = bisect_left(range(met), True, met // 2 + 1, key=is_met) if met else doubled[-1]
    plan, title = planned(found), "hours of a plan from the pool"
    if plan is None:
        return Answer("hours", title, "undetermined", grows=True)
    words, outcome = f"{found / 4:g} h", judge(goal, plan.prediction).words
    status: Status = "found" if met else "none"
    needed = words, QUARTER * found, outcome
    return Answer("hours", title, status, "", True, *needed, qualifications=plan.qualifications)
