"""Simple strategies in a design that exists: the positions that a draft would begin with."""

from __future__ import annotations

from collections.abc import Iterator

from ballplate.simulator.experiment import Experiment, node_at
from ballplate.simulator.inputs import ExperimentError, Sequence, child, to_python
from ballplate.simulator.machines import ARRANGEMENTS

from .machine_tables import table
from .places import Settings


def as_drafted(experiment: Experiment) -> Iterator[tuple[list[Settings], Experiment]]:
    """Yield the positions of simple strategies, with an experiment that has these instead of its
    own, of no more positions and readings; the longest first.

    None of a design of several artefacts, whose positions are not all across an axis, and across
    each of the three, or whose last carriage does not move along z.
    """
    listed = node_at(experiment.tree, "positions")
    entries = listed.items if isinstance(listed, Sequence) else ()
    planes = {
        str(to_python(name)): to_python(plane)
        for entry in entries
        if (name := child(entry, "name")) and (plane := child(entry, "plane"))
    }
    in_turn = reversed(experiment.positions)
    probes = {planes.get(position.name): list(position.probes) for position in in_turn}
    arrangement = ARRANGEMENTS.get(getattr(experiment.error_model, "arrangement", ""))
    is_upright = arrangement is None or arrangement.probe_side[-1] == "z"
    if len(experiment.artefacts) > 1 or set(probes) != {*"xyz"} or not is_upright:
        return
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
            yield positions, drafted
