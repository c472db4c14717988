"""Limits of the poses of artefacts, and the room that they leave."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.simulator.design.lookup import Indices, References
from ballplate.simulator.design.objects import Machine, Volume
from ballplate.simulator.geometry.ball_layouts import BallLayout, frozen
from ballplate.simulator.geometry.positions import AXIS_INDEX, Pose, ball_coordinates, corners
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.settings import hint

from .model import Probe
from .pool_sections import LimitsSettings, Region
from .structure import Sections

TOLERANCE = 1e-9

# Why a place cannot be taken.
OUTSIDE, EDGE = "outside the volume", "edge outside the volume"


@dataclass(frozen=True, eq=False)
class Bounds:
    """Limits of the poses of artefacts.

    The scale readings of balls (ball less probe offset) must be in `volume`, the balls themselves
    in the lower and upper ends (2, d) of `reach`, by probe. `edge` is the margin of a plate around
    its balls. No artefact may enter one of the `forbidden` boxes, lower and upper ends (n, 2, d).
    """

    volume: Volume
    probes: Mapping[str, Probe]
    reach: Mapping[str, Array]
    edge: float | None
    forbidden: Array


def resolve_bounds(
    sections: Sections,
    machine: Machine | None,
    probes: Mapping[str, Probe],
    references: References,
) -> Bounds | None:
    """Return the limits that the volume, the probes and the limits of a pool state; None if one of
    them is invalid, which is reported.
    """
    limits = sections.get("pool", "limits") or LimitsSettings.model_validate({})
    reach = _reach(limits, references)
    forbidden = _forbidden(limits, references)
    if machine is None or machine.dimension != references.dimension:
        return None
    forbidden = _through_walls(forbidden, machine.volume)
    return Bounds(machine.volume, probes, reach, limits.edge, forbidden)


def limits_of(
    pose: Pose,
    layout: BallLayout,
    edge: float | None,
    readings: Iterable[tuple[Indices, tuple[str, ...]]],
    bounds: Bounds,
) -> dict[str, Array]:
    """Return the least and the greatest shifts (2, d) of a pose at which probes reach the balls
    that they read, and an `edge` of material stays inside the volume, by what is wrong beyond them;
    the least is above the greatest where there is no room.

    `readings` are indices of balls, with the names of probes.
    """
    ends = np.array([bounds.volume.lower, bounds.volume.upper])
    balls = ball_coordinates(pose, layout)
    shifts: dict[str, list[Array]] = {OUTSIDE: []}
    if edge is not None:
        shifts[EDGE] = [ends - outline(pose, layout, edge)]
    for indices, names in readings:
        around = extent(balls[indices])
        for name in names:
            offset = bounds.probes[name].offset if name in bounds.probes else 0.0
            shifts[OUTSIDE].append(ends + offset - around)
            if name in bounds.reach:
                beyond = shifts.setdefault(f"out of reach of probe {name}", [])
                beyond.append(bounds.reach[name] - around)
    return {reason: shared(rooms) for reason, rooms in shifts.items()}


def shared(rooms: Iterable[Array]) -> Array:
    """Return what rooms (2, d) have in common."""
    least, greatest = np.swapaxes([*rooms], 0, 1)
    return frozen([least.max(axis=0), greatest.min(axis=0)])


def edge_of(artefact: str, bounds: Bounds, references: References) -> float | None:
    """Return the stated margin of an artefact around its balls; only plates have one."""
    return bounds.edge if references.artefacts[artefact].role == "plate" else None


def extent(points: Array) -> Array:
    """Return the lowest and the highest co-ordinates (2, d) of points (n, d)."""
    return np.array([points.min(axis=0), points.max(axis=0)])


def outline(pose: Pose, layout: BallLayout, edge: float) -> Array:
    """Return the lowest and the highest co-ordinates (2, d) of a plate with `edge` of material
    beyond its balls.
    """
    return extent(corners(pose, layout, edge))


def entered(around: Array, boxes: Array) -> Any:
    """Return which of boxes (n, 2, d) each artefact enters (…, n), by its ends `around` (…, 2, d);
    what touches a box does not enter it.
    """
    low, high = around[..., None, 0, :], around[..., None, 1, :]
    is_beyond = (low >= boxes[:, 1] - TOLERANCE) | (high <= boxes[:, 0] + TOLERANCE)
    return ~is_beyond.any(axis=-1)


def occupied(pose: Pose, layout: BallLayout, edge: float | None) -> Array:
    """Return the lowest and the highest co-ordinates (2, d) of an artefact's balls, and with an
    `edge` of the plate.
    """
    balls = extent(ball_coordinates(pose, layout))
    return balls if edge is None else extent(np.vstack([balls, outline(pose, layout, edge)]))


def _reach(limits: LimitsSettings, references: References) -> dict[str, Array]:
    """Lower and upper ends (2, d) of where balls can be read, by probe."""
    problems, reach = references.problems, {}
    for name, region in limits.reach.items():
        steps = ("pool", "limits", "reach", name)
        if name not in references.probes:
            problems.add(
                steps, f'unknown probe "{name}"; {hint(name, references.probes)}', of_key=True
            )
            continue
        reach[name] = _ends(region, steps, references)
    return reach


def _forbidden(limits: LimitsSettings, references: References) -> Array:
    """Lower and upper ends (n, 2, d) of the boxes that no artefact may enter."""
    d, boxes = references.dimension or 3, []
    for k, region in enumerate(limits.forbidden):
        steps, before = ("pool", "limits", "forbidden", k), len(references.problems.messages)
        ends = _ends(region, steps, references)
        text = "has no limits; give the ends of the box along at least one axis"
        references.require(bool(region), steps, text)
        is_faulty = len(references.problems.messages) > before
        # Nothing enters a box that begins at infinity.
        boxes.append(np.full((2, d), np.inf) if is_faulty else ends)
    return np.reshape(boxes, (len(boxes), 2, d))


def _through_walls(boxes: Array, volume: Volume) -> Array:
    """Return boxes (n, 2, d), those that reach a wall of the volume without an end there: what lies
    on the wall is within them, and does not touch them alone.
    """
    lower = np.where(boxes[:, 0] <= volume.lower + TOLERANCE, -np.inf, boxes[:, 0])
    upper = np.where(boxes[:, 1] >= volume.upper - TOLERANCE, np.inf, boxes[:, 1])
    return frozen(np.stack([lower, upper], axis=1))


def _ends(region: Region, steps: Steps, references: References) -> Array:
    """Lower and upper ends (2, d) of a region, infinite where it is not limited."""
    ends = np.array([[-np.inf] * 3, [np.inf] * 3])
    for axis, axis_lengths in region.items():
        k = AXIS_INDEX[axis]
        if axis_lengths[0] >= axis_lengths[1]:
            text = "the lower end must be below the upper; correct them"
            references.problems.add((*steps, axis), text)
        if k >= (references.dimension or 3):
            references.refuse_in_plane(*steps, axis)
        ends[:, k] = axis_lengths
    return frozen(ends[:, : references.dimension or 3])
