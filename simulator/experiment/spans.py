"""Parts of the volume that plates no longer span, as sizes changed and their places did not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from ballplate.simulator.design.objects import SLIGHTLY
from ballplate.simulator.geometry.poses import ball_coordinates
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.yamltree import Node

from .bounds import TOLERANCE
from .changes import node_at
from .model import Experiment, Position

SIZES = ("artefacts", "machine.volume", "pool.limits")


def unspanned(tree: Node, changed: Experiment) -> str:
    """Return which part of the volume plates span, where that is less than in the experiment of
    another `tree`, which shares all nodes that do not differ.

    Empty unless artefacts, the volume or the edge differ, and the outermost plates of a side would
    reach further if the places that are lengths followed.
    """
    if all(node_at(tree, path) is node_at(changed.tree, path) for path in SIZES):
        return ""
    try:
        before = changed.builder(tree)
    except ExperimentError:
        return ""
    if before.dimension != changed.dimension:
        return ""
    volume, plates = changed.machine.volume, _plates(changed)
    places = {place.name: place for place in before.positions}
    # Rooms are what is left between the outermost plates of each side and the ends that a plate can
    # reach. The second has them as if all places had grown with the free room, as stated parts of
    # it do. A variant with a smaller plate or a larger volume has lost the difference.
    room = _least(changed, [np.abs(place.room) for place in plates])
    followed = _least(changed, [_followed(place, places.get(place.name)) for place in plates])
    is_lost = room > followed + SLIGHTLY * volume.size
    ends = 1e3 * np.array([volume.lower + room[0], volume.upper - room[1], volume.size])
    spans = [
        f"{'xyz'[k]} {first:.6g} to {last:.6g} of {size:.6g} mm"
        for k, (first, last, size) in enumerate(ends.T)
        if is_lost[:, k].any()
    ]
    if not spans:
        return ""
    end, k = np.argwhere(is_lost[::-1])[0]
    return (
        f"plates span {', '.join(spans)}; the places are lengths: state `corner: {{{'xyz'[k]}:"
        f" {('high', 'low')[end]}}}` to follow"
    )


def _plates(experiment: Experiment) -> list[Position]:
    artefacts = experiment.artefacts
    return [place for place in experiment.positions if artefacts[place.artefact].role == "plate"]


def _least(experiment: Experiment, rooms: Sequence[Array]) -> Array:
    """Return the least of the rooms (2, d) of plates that lie along each axis, or of all if none
    does.
    """
    d = experiment.dimension
    balls = [
        ball_coordinates(at.pose, experiment.layouts[at.artefact]) for at in _plates(experiment)
    ]
    # A plate across an axis is at one place of it, chosen for reasons of its own, and says nothing
    # about what plates span along it.
    lie = np.array([np.ptp(rows, axis=0) > TOLERANCE for rows in balls], bool).reshape(-1, 1, d)
    where = lie | ~lie.any(axis=0)
    return np.min(np.reshape(rooms, (-1, 2, d)), axis=0, where=where, initial=np.inf)


def _followed(now: Position, before: Position | None) -> Array:
    """Return the room (2, d) that a position would have, if those of its co-ordinates that are
    lengths had followed its free room.
    """
    room = np.abs(now.room)
    if before is None:
        return room
    earlier = np.abs(before.room)
    free, earlier_free = room.sum(axis=0), earlier.sum(axis=0)
    growth = np.maximum(1.0, free / np.where(earlier_free > 0.0, earlier_free, np.inf))
    is_part = [axis in now.parts for axis in "xyz"[: room.shape[1]]]
    return np.where(is_part, room, earlier * growth)
