"""A change of an experiment: its description, its price, and a function from experiment to
experiment.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from ballplate.simulator.design import (
    Calibration,
    DistanceCalibration,
    Indices,
    Volume,
)
from ballplate.simulator.experiment import Experiment, Position, Probe, ReadingGroup
from ballplate.simulator.geometry import BallLayout, Pose, ball_coordinates, pairs
from ballplate.simulator.machines import Array


class ChangeKind(IntEnum):
    """Classes of changes, the cheapest first."""

    POOL = 0
    MOVE = 1
    READ_MORE = 2
    CERTIFICATE = 3
    ADD_POSITION = 4


# What a calibrated distance, and setting up a position, take as many readings for.
EFFORT = {
    ChangeKind.CERTIFICATE: 25.0,
    ChangeKind.READ_MORE: 1.0,
    ChangeKind.ADD_POSITION: 1.5,
    ChangeKind.POOL: 1.0,
}

KINDS = {
    ChangeKind.POOL: "candidates of the pool",
    ChangeKind.MOVE: "positions moved",
    ChangeKind.READ_MORE: "more readings in a position",
    ChangeKind.CERTIFICATE: "calibration",
    ChangeKind.ADD_POSITION: "more positions",
}


@dataclass(frozen=True, eq=False)
class Change:
    """Possible change of an experiment.

    `words` is an imperative sentence. `cost` compares changes of one class: seconds for candidates
    of a pool, otherwise additional readings or distances. Two changes of the same subject exclude
    each other. `adds` is the additional observation of a change that only adds: a calibration
    item, a position, or the further readings in the position that `of` names. `candidate` is the
    index of the pool's candidate, or -1.
    """

    kind: ChangeKind
    words: str
    cost: float
    touches: frozenset[str]
    apply: Callable[[Experiment], Experiment]
    adds: Position | Calibration | None = None
    of: str | None = None
    candidate: int = -1


def apply_all(changes: Sequence[Change], experiment: Experiment) -> Experiment:
    """The experiment with all changes made."""
    for change in changes:
        experiment = change.apply(experiment)
    return experiment


def go_together(changes: Sequence[Change]) -> bool:
    """True if no two changes concern the same subject."""
    touched = [name for change in changes for name in change.touches]
    return len(touched) == len(set(touched))


def is_inside(
    position: Position, layout: BallLayout, volume: Volume, probes: Mapping[str, Probe]
) -> bool:
    """True if all scale readings of a position are in the volume, as in a file."""
    lower, upper = volume.of_readings
    readings = scale_readings(position, layout, probes)
    return bool(((readings >= lower) & (readings <= upper)).all())


def scale_readings(position: Position, layout: BallLayout, probes: Mapping[str, Probe]) -> Array:
    """Return all scale readings (n, d) of a position: the balls less the offsets of probes."""
    balls = ball_coordinates(position.pose, layout)
    return np.concatenate(
        [
            balls[group.ball_indices] - probes[name].offset
            for group in position.readings
            for name in group.probes
        ]
    )


def with_position(experiment: Experiment, position: Position) -> Experiment:
    """The experiment with the position of that name replaced, or with it as the last one."""
    places = tuple(
        position if place.name == position.name else place for place in experiment.positions
    )
    if all(place.name != position.name for place in experiment.positions):
        places = (*experiment.positions, position)
    return replace(experiment, positions=places)


def with_calibration(experiment: Experiment, item: Calibration) -> Experiment:
    """The experiment with one calibration item more."""
    return replace(experiment, calibration=(*experiment.calibration, item))


def moved(position: Position, rotation: Array, origin: Array) -> Position:
    """The position in another pose."""
    return replace(position, pose=Pose(rotation, origin))


def further(position: Position, probe: str) -> Position:
    """Return all readings of a position, taken once with another probe."""
    every = {
        int(i): name
        for group in position.readings
        for i, name in zip(group.ball_indices, group.balls, strict=True)
    }
    indices = np.array(sorted(every), np.intp)
    repeats = min(group.repeats for group in position.readings)
    group = ReadingGroup((probe,), tuple(every[int(i)] for i in indices), indices, repeats)
    if len(position.readings) == 1:
        group = replace(position.readings[0], probes=(probe,))
    return replace(position, readings=(group,))


def with_further(
    experiment: Experiment, name: str, more: Position, probes: Mapping[str, Probe]
) -> Experiment:
    """Return the experiment with the readings of `more` added to position `name`, and with any new
    probes.
    """
    (group,) = more.readings
    position = _named(experiment, name)
    same = [
        k
        for k, reading in enumerate(position.readings)
        if np.array_equal(reading.ball_indices, group.ball_indices)
        and reading.repeats == group.repeats
    ]
    groups = [*position.readings]
    if same and len(groups) == 1:
        groups[0] = replace(groups[0], probes=(*groups[0].probes, *group.probes))
    else:
        groups.append(group)
    changed = with_position(experiment, replace(position, readings=tuple(groups)))
    return replace(changed, probes={**experiment.probes, **probes})


def with_pose(experiment: Experiment, name: str, pose: Pose) -> Experiment:
    """The experiment with a position in another pose."""
    return with_position(experiment, replace(_named(experiment, name), pose=pose))


def _named(experiment: Experiment, name: str) -> Position:
    return next(position for position in experiment.positions if position.name == name)


def pair_set(layout: BallLayout, chosen: Indices) -> str | None:
    """Return the name of the set of pairs that indices (m, 2) form, if it has one."""
    wanted = {frozenset(pair) for pair in chosen.tolist()}
    for name in (*layout.pair_sets, "all"):
        if name == "all" and len(wanted) != len(layout.names) * (len(layout.names) - 1) // 2:
            continue
        pairs_found = pairs(layout, name)
        if (
            len(pairs_found) == len(wanted)
            and {frozenset(pair) for pair in pairs_found.tolist()} == wanted
        ):
            return name
    return None


def ball_set(layout: BallLayout, chosen: Indices) -> str | None:
    """Return `all` or `corners` if the indices are those."""
    wanted = set(chosen.tolist())
    if len(wanted) == len(layout.names):
        return "all"
    return "corners" if layout.corner_set and wanted == set(layout.corner_set) else None


def distances(
    like: DistanceCalibration, layout: BallLayout, chosen: Indices
) -> DistanceCalibration:
    """Calibrated distances between pairs (m, 2) of balls, otherwise like others that state one
    standard uncertainty.
    """
    assert like.standard_uncertainty is not None
    ends = layout.coordinates[chosen][:, :, : like.dimensions]
    values = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return replace(
        like,
        pairs=chosen,
        values=values,
        certified=False,
        standard_uncertainties=like.standard_uncertainty.at(values),
        root=None,
    )
