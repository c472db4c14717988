"""Hours of the shortest plan from a pool that meets a goal."""

from __future__ import annotations

from functools import cache

from ballplate.planning import HOUR, Budget, Campaign, Request, campaign
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import ExperimentError

from .answers import Answer
from .goals import Goal, Judgement, judge
from .unknowns import NotVariableError

# Shortest and longest plans that are looked at, in quarters of an hour.
LEAST, MOST = 1, 4 * 128


def hours_answer(experiment: Experiment, goal: Goal) -> Answer:
    """Return the fewest hours, to a quarter, of a plan from the experiment's pool that meets a
    goal, found by doubling and bisection.

    :raises NotVariableError: there is no pool.
    """
    if experiment.pool is None:
        raise NotVariableError("the file has no pool of positions to plan from; add one")

    @cache
    def planned(quarters: int) -> Campaign | str:
        try:
            return campaign(experiment, Request(budget=Budget(seconds=HOUR * quarters / 4)))
        except ExperimentError as error:
            return error.messages[0].text

    def judged(quarters: int) -> Judgement | None:
        plan = planned(quarters)
        return None if isinstance(plan, str) else judge(goal, plan.prediction)

    def is_met(quarters: int) -> bool:
        found = judged(quarters)
        return found is not None and found.is_met

    failed, met, before = LEAST - 1, LEAST, None
    while not is_met(met):
        plan = planned(met)
        chosen = None if isinstance(plan, str) else len(plan.chosen)
        assert experiment.pool is not None
        if (
            met >= MOST
            or chosen == len(experiment.pool.candidates)
            or (chosen and chosen == before)
        ):
            return _answer(planned(met), met, goal, "none")
        failed, met, before = met, 2 * met, chosen
    while met - failed > 1:
        middle = (met + failed) // 2
        failed, met = (failed, middle) if is_met(middle) else (middle, met)
    answer = _answer(planned(met), met, goal, "found")
    return answer


def _answer(plan: Campaign | str, quarters: int, goal: Goal, status: str) -> Answer:
    words, title = f"{quarters / 4:g} h", "hours of a plan from the pool"
    if isinstance(plan, str):
        return Answer("hours", title, "undetermined", grows=True, remarks=(plan,))
    outcome = judge(goal, plan.prediction).words
    value, qualified = HOUR * quarters / 4, plan.qualifications
    first = "", True, words, value, outcome
    return Answer("hours", title, status, *first, qualifications=qualified)  # type: ignore[arg-type]
