"""A change of an experiment: one position, or one calibration item, as it would then be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from ballplate.simulator.design import Calibration
from ballplate.simulator.experiment import Experiment, Position, Probe
from ballplate.simulator.geometry import BallLayout, ball_coordinates, corner_points
from ballplate.simulator.machines import Array


class ChangeKind(IntEnum):
    """Classes of changes in the order of their proposal: other poses, further readings, and
    certificates or probes that have to be obtained.
    """

    MOVE = 0
    READ = 1
    CERTIFICATE = 2


@dataclass(frozen=True, eq=False)
class Change:
    """Possible change of an experiment, with an imperative sentence as `words`.

    `item` replaces the position of its name, or is added. Two changes of one `subject` exclude
    each other. `seconds` are the additional laboratory time, and `values` the number of calibrated
    values. `probe` is a new one that the item is read with, and `candidate` the index in the pool,
    or -1.
    """

    kind: ChangeKind
    words: str
    subject: str
    item: Position | Calibration
    seconds: float = 0.0
    values: int = 0
    probe: Probe | None = None
    candidate: int = -1


def changed(experiment: Experiment, changes: Sequence[Change]) -> Experiment:
    """Return the experiment with all changes; added positions get names that are not in use."""
    names = {place.name for place in experiment.positions}
    after = experiment
    for change in changes:
        if change.probe is not None:
            after = replace(after, probes={**after.probes, change.probe.name: change.probe})
        if not isinstance(change.item, Position):
            after = replace(after, calibration=(*after.calibration, change.item))
        elif change.item.name in names:
            after = with_position(after, change.item)
        else:
            after = with_added(after, change.item)
    return after


def with_position(experiment: Experiment, position: Position) -> Experiment:
    """Return the experiment with the position of that name replaced, or with it as the last one."""
    places = {place.name: place for place in experiment.positions} | {position.name: position}
    return replace(experiment, positions=tuple(places.values()))


def with_added(experiment: Experiment, position: Position) -> Experiment:
    """Return the experiment with an additional position, under another name if this one is
    in use.
    """
    return with_position(experiment, replace(position, name=free_name(experiment, position.name)))


def free_name(experiment: Experiment, name: str) -> str:
    """Return a name, or the first with a number after it, that no position has."""
    names = {place.name for place in experiment.positions} | {*experiment.switched_off}
    return next(
        candidate_name
        for k in range(len(names) + 1)
        if (candidate_name := name if not k else f"{name} {k + 1}") not in names
    )


def is_possible(
    experiment: Experiment, position: Position, probes: Mapping[str, Probe] | None = None
) -> bool:
    """True if all scale readings of a position are in the volume, as in a file, and its artefact
    is in no box that the pool forbids.
    """
    layout, pool = experiment.layouts[position.artefact], experiment.pool
    lower, upper = experiment.machine.volume.of_readings
    readings = scale_readings(position, layout, probes or experiment.probes)
    if not ((readings >= lower) & (readings <= upper)).all():
        return False
    if pool is None or not len(pool.forbidden):
        return True
    around = corner_points(position.pose, layout, pool.edge or 0.0)
    low, high = around.min(axis=0), around.max(axis=0)
    enters = (low < pool.forbidden[:, 1]) & (high > pool.forbidden[:, 0])
    return not enters.all(axis=1).any()


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


def middle_of(layout: BallLayout) -> Array:
    """Return the middle (3,) of an artefact's balls in its own frame."""
    return 0.5 * (layout.coordinates.min(axis=0) + layout.coordinates.max(axis=0))
