"""Machines and drafts as shapes in space, drawn on paper in one projection."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from ballplate.presentation import as_data
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.geometry import AXIS_NAMES, corner_points
from ballplate.simulator.machines import ARRANGEMENTS, Array

from .machine_tables import table

# Directions on the paper of the machine's x, y and z, for one metre; downwards is positive.
VIEW = np.array([[0.86, 0.17], [0.48, -0.30], [0.0, -0.92]])
# Ends of a box, along x, y and z, whose sides are seen.
SEEN = np.array([1, 0, 1])
# Most of the way from an edge of a part to its letter, in metres.
LETTER = 0.12


@dataclass(frozen=True)
class Shape:
    """A polygon through ``points`` (n, 3) in metres, a stylus between two, or a letter at one.

    ``role`` is that of a part (probe, workpiece, still), stylus, letter, volume or plate.
    """

    role: str
    points: Array
    text: str = ""


def machine_shapes(kind: str) -> Iterator[Shape]:
    """Yield a kind of machine from back to front, and the letters of the axes of its parts."""
    chain = ARRANGEMENTS[table("kinds")[kind][0]]
    letters = []
    for axis, *box in table("boxes")[kind]:
        ends = np.array(box, float)
        if axis == "stylus":
            yield Shape(axis, ends)
            continue
        role = "workpiece" if axis in chain.workpiece_side else "probe" if axis else "still"
        yield from _box(role, ends, SEEN)
        place = ends[:1] + np.minimum(np.diff(ends, axis=0) / 2, LETTER) * (1, 0, 1)
        letters.append(Shape("letter", place, axis))
    yield from letters


def draft_shapes(experiment: Experiment) -> Iterator[Shape]:
    """Yield the volume with its axes and the plates of a grid, as they are placed."""
    volume = experiment.machine.volume
    ends = np.array([volume.lower, volume.upper])
    yield from _box("volume", ends, 1 - SEEN)
    for place in experiment.positions:
        yield Shape(
            "plate", corner_points(place.pose, experiment.layouts[place.artefact]), place.name
        )
    yield from _box("volume", ends, SEEN)
    for name, end in zip(AXIS_NAMES, 1.08 * np.diag(volume.upper), strict=True):
        yield Shape("letter", end[None], name)


def on_paper(shapes: Iterable[Shape]) -> list[dict[str, Any]]:
    """Return shapes as plain data with points on the paper, in metres."""
    return [as_data(replace(shape, points=np.round(shape.points @ VIEW, 4))) for shape in shapes]


def _box(role: str, ends: Array, sides: Array) -> Iterator[Shape]:
    """Yield the sides of a box between two corners (2, 3), at one end along each axis."""
    for axis, end in enumerate(sides):
        side = np.insert([[0, 0], [1, 0], [1, 1], [0, 1]], axis, end, axis=1)
        yield Shape(role, np.take_along_axis(ends, side, axis=0))
