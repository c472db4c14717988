"""Possible poses of artefacts, and the distances between their balls."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.geometry import BallLayout
from ballplate.simulator.machines import Array


def bars(d: int) -> Iterator[tuple[str, Array]]:
    """Words and directions (d,): along axes, diagonals of planes, diagonals of space."""
    axes = np.eye(d)
    for k in range(d):
        yield f"along {'xyz'[k]}", axes[k]
    for sign, angle in ((1, "45"), (-1, "-45")):
        for i, j in combinations(range(d), 2):
            plane = f"in the {'xyz'[i]}{'xyz'[j]} plane at {angle} deg"
            yield plane, (axes[i] + sign * axes[j]) / np.sqrt(2.0)
    for signs in ((1, 1), (-1, 1), (1, -1), (-1, -1)) if d == 3 else ():
        words = f"along the diagonal ({signs[0]}, {signs[1]}, 1)"
        yield words, np.array([*signs, 1.0]) / np.sqrt(3.0)


def along_rotation(direction: Array) -> Array:
    """A rotation that lays the artefact's x axis in a direction."""
    d = len(direction)
    if d == 2:
        return np.array([[direction[0], -direction[1]], [direction[1], direction[0]]])
    level = np.hypot(direction[0], direction[1])
    side = (
        np.array([0.0, 1.0, 0.0])
        if level < 1e-9
        else np.array([-direction[1], direction[0], 0.0]) / level
    )
    return np.column_stack([direction, side, np.cross(direction, side)])


def pitch(layout: BallLayout) -> float:
    """Usual distance of neighbouring balls along the artefact's x or y, in metres."""
    gaps = []
    for axis in (0, 1):
        gap = np.diff(np.unique(np.round(layout.coordinates[:, axis], 9)))
        gaps += gap[gap > 1e-6].tolist()
    # To what anyone would set up.
    return float(np.round(np.median(gaps), 4)) if gaps else 0.1


def middle_of(layout: BallLayout) -> Array:
    return 0.5 * (layout.coordinates.min(axis=0) + layout.coordinates.max(axis=0))


def clean(origin: Array) -> Array:
    """Without what rounding leaves."""
    return np.round(origin, 13) + 0.0


def is_plate(experiment: Experiment, artefact: str) -> bool:
    return experiment.artefacts[artefact].role == "plate"
