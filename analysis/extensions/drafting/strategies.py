"""Simple strategies in a design that exists: the positions that a draft would begin with."""

from __future__ import annotations

from collections.abc import Iterator

from ballplate.simulator.experiment import Experiment, node_at
from ballplate.simulator.inputs import ExperimentError, Sequence, child, to_python

from .machine_tables import table
from .places import Settings


def as_drafted(experiment: Experiment) -> Iterator[tuple[list[Settings], Experiment]]:
    """Yield the positions of simple strategies, with an experiment that has these instead of its
    own, of no more positions and readings; the longest first.

    None of a design of several artefacts, or whose positions are not all across an axis, and across
    each of the three.
    """
    listed = node_at(experiment.tree, "positions")
    entries = listed.items if isinstance(listed, Sequence) else ()
    planes = [to_python(plane) for entry in entries if (plane := child(entry, "plane"))]
    in_turn = zip(planes, experiment.positions, strict=False)
    probes = {plane: list(position.probes) for plane, position in reversed(list(in_turn))}
    if len(experiment.artefacts) > 1 or set(probes) != {*"xyz"} or len(planes) < len(entries):
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
