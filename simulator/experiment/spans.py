"""Parts of the volume that plates no longer span, as sizes changed and their places did not."""

from __future__ import annotations

import numpy as np

from ..design.objects import SLIGHTLY
from ..geometry.positions import ball_coordinates
from ..inputs.messages import ExperimentError
from ..inputs.number_arrays import Array
from ..inputs.yamltree import Node
from .bounds import TOLERANCE
from .model import Experiment
from .variants import node_at

SIZES = ("artefacts", "machine.volume", "pool.limits")


def unspanned(tree: Node, changed: Experiment) -> str:
    """Return which part of the volume plates span, where that is less than in the experiment of
    another `tree`, which shares all nodes that do not differ.

    Empty unless artefacts, the volume or the edge differ, and outermost places are lengths.
    """
    if all(node_at(tree, path) is node_at(changed.tree, path) for path in SIZES):
        return ""
    try:
        before = _room(changed.builder(tree))
    except ExperimentError:
        return ""
    volume, room = changed.machine.volume, _room(changed)
    if room.shape != before.shape:
        return ""
    is_lost = room > before + SLIGHTLY * volume.size
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


def _room(experiment: Experiment) -> Array:
    """Return the least room (2, d) outwards of plates that lie along each axis, or of all if none
    does; none where the file states a part of it.
    """
    d, artefacts = experiment.dimension, experiment.artefacts
    places = [at for at in experiment.positions if artefacts[at.artefact].role == "plate"]
    balls = [ball_coordinates(at.pose, experiment.layouts[at.artefact]) for at in places]
    lie = np.array([np.ptp(rows, axis=0) > TOLERANCE for rows in balls], bool).reshape(-1, 1, d)
    rooms = [np.abs(at.room) * [axis not in at.parts for axis in "xyz"[:d]] for at in places]
    where = lie | ~lie.any(axis=0)
    return np.min(np.reshape(rooms, (-1, 2, d)), axis=0, where=where, initial=np.inf)
