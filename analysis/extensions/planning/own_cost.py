"""What the positions of an experiment's file cost, by the durations of its pool."""

from __future__ import annotations

from ballplate.simulator.experiment import (
    Candidate,
    ChangeTimes,
    Experiment,
    TimesSettings,
    node_at,
)
from ballplate.simulator.inputs import Mapping, Sequence, child, to_python

from .constraints import Budget, Spent, constraints
from .pools import PLANE_CHANGE, PROBE_CHANGE, READING, SET_UP, seconds_of


def spent_as_drawn(experiment: Experiment) -> Spent:
    """Return the cost of the positions of an experiment, as a plan of them all would state it, by
    the durations of its file or, without any, the usual ones.
    """
    node = node_at(experiment.tree, "pool.times")
    times = TimesSettings.model_validate({} if node is None else to_python(node))
    probe = PROBE_CHANGE if times.probe_change is None else times.probe_change
    plane = PLANE_CHANGE if times.plane_change is None else times.plane_change
    listed = node_at(experiment.tree, "positions")
    planes = {
        str(to_python(entry.items["name"])): to_python(entry.items["plane"])
        for entry in (listed.items if isinstance(listed, Sequence) else ())
        if isinstance(entry, Mapping) and child(entry, "name") and child(entry, "plane")
    }
    candidates = []
    for position in experiment.positions:
        own = (times.positions or {}).get(position.name, times)
        set_up, reading = (
            next((value for value in stated if value is not None), usual)
            for stated, usual in (
                ((own.set_up, times.set_up), SET_UP),
                ((own.reading, times.reading), READING),
            )
        )
        across = str(planes.get(position.name, "")) if experiment.dimension == 3 else ""
        seconds = seconds_of(position, set_up, reading, probe)
        candidates.append(Candidate(position.name, position, seconds, across, "", True, {}))
    every = constraints(candidates, ChangeTimes(probe, plane), Budget())
    return every.spent(range(len(candidates)))
