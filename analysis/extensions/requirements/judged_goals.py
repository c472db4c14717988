"""Verdicts of a design on the goals that it is checked for."""

from __future__ import annotations

from collections.abc import Sequence

from ballplate.results import planned_uncertainty
from ballplate.simulator.experiment import Experiment

from .goals import Goal, GoalError, check_goal, judge


def judged_goals(
    experiment: Experiment, goals: Sequence[Goal]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """How goals are met, in words, and those of them that are not."""
    found = planned_uncertainty(experiment)
    told, missed = [], []
    for goal in goals:
        try:
            check_goal(goal, found)
        except GoalError as error:
            told.append(f"goal not met: {goal}; {error}")
            missed.append(told[-1])
            continue
        judged = judge(goal, found)
        told.append(f"goal {'met' if judged.is_met else 'not met'}: {goal}; {judged.words}")
        missed += [] if judged.is_met else [told[-1]]
    return tuple(told), tuple(missed)
