"""What the positions of an experiment's file cost, by the durations of its pool."""

from __future__ import annotations

from typing import Any

from ballplate.simulator.experiment import Candidate, Experiment, TimesSettings, node_at
from ballplate.simulator.inputs import to_python

from .constraints import Budget, Spent, constraints
from .pools import change_times, durations, seconds_of


def settings_as_drawn(experiment: Experiment) -> dict[str, Any]:
    """Return the settings of the positions of an experiment's file, by their names."""
    node = node_at(experiment.tree, "positions")
    listed: Any = () if node is None else to_python(node)
    return {str(settings["name"]): settings for settings in listed}


def spent_as_drawn(experiment: Experiment) -> Spent:
    """Return the cost of the positions of an experiment, as a plan of them all would state it, by
    the durations of its file or, without any, the usual ones.
    """
    node = node_at(experiment.tree, "pool.times")
    times = TimesSettings.model_validate({} if node is None else to_python(node))
    settings, changes = settings_as_drawn(experiment), change_times(times)
    candidates = []
    for position in experiment.positions:
        set_up, reading = durations(times, (times.positions or {}).get(position.name))
        seconds = seconds_of(position, set_up, reading, changes.probe)
        plane = settings.get(position.name, {}).get("plane") if experiment.dimension == 3 else None
        candidates.append(Candidate(position.name, position, seconds, plane or "", "", True, {}))
    return constraints(candidates, changes, Budget()).spent(range(len(candidates)))
