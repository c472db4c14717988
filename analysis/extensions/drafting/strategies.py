"""Simple strategies in a design that exists: the positions that a draft would begin with."""

from __future__ import annotations

from ballplate.extensions.planning import settings_as_drawn
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import ExperimentError
from ballplate.simulator.machines import ARRANGEMENTS

from .machine_tables import table
from .places import Settings


def as_drafted(experiment: Experiment) -> tuple[list[Settings], Experiment] | None:
    """Return the positions of the longest simple strategy of no more positions and readings than an
    experiment has, with an experiment that has these instead of its own.

    None of a design of several artefacts, whose positions are not all across an axis, and across
    each of the three, or whose last carriage does not move along z.
    """
    settings = settings_as_drawn(experiment)
    in_turn = reversed(experiment.positions)
    probes = {settings.get(one.name, {}).get("plane"): list(one.probes) for one in in_turn}
    arrangement = ARRANGEMENTS.get(getattr(experiment.error_model, "arrangement", ""))
    is_upright = arrangement is None or arrangement.probe_side[-1] == "z"
    if len(experiment.artefacts) > 1 or set(probes) != {*"xyz"} or not is_upright:
        return None
    readings = sum(position.count for position in experiment.positions)
    for strategy in reversed(table("starts")["star"]["z"]):
        positions = [start | {"probes": probes[start["plane"]]} for start in strategy]
        if len(positions) > len(experiment.positions):
            continue
        try:
            drafted = experiment.with_(positions=positions)
        except ExperimentError:
            continue
        if sum(position.count for position in drafted.positions) <= readings:
            return positions, drafted
    return None
