"""Verdicts of a design on the goals that it is checked for."""

from __future__ import annotations

from collections.abc import Sequence

from ballplate.results import planned_uncertainty
from ballplate.simulator.experiment import Experiment

from .goals import Goal, GoalError, check_goal, judge


def judged_goals(
    experiment: Experiment, goals: Sequence[Goal], given: str = ""
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return a line per goal, and those that are not met; a goal is met as `given`."""
    planned = planned_uncertainty(experiment)
    lines, missed = [], []
    for goal in goals:
        try:
            check_goal(goal, planned)
        except GoalError as error:
            lines.append(f"goal not met: {goal}; {error}")
            missed.append(lines[-1])
            continue
        judged = judge(goal, planned)
        verdict = f"met{given}" if judged.is_met else "not met"
        lines.append(f"goal {verdict}: {goal}; {judged.words}")
        missed += [] if judged.is_met else [lines[-1]]
    return tuple(lines), tuple(missed)
