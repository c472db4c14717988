"""Verdicts of a design on the goals that it is checked for."""

from __future__ import annotations

from collections.abc import Sequence

from ballplate.results import planned_uncertainty
from ballplate.simulator.experiment import Experiment

from .goals import Goal, GoalError, check_goal, judge


def judged_goals(
    experiment: Experiment, goals: Sequence[Goal]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return a line per goal, and those that are not met."""
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
        lines.append(f"goal {'met' if judged.is_met else 'not met'}: {goal}; {judged.words}")
        missed += [] if judged.is_met else [lines[-1]]
    return tuple(lines), tuple(missed)
