"""Bounds of positions: where an artefact can be, and whether its balls are inside."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.simulator.design.objects import SLIGHTLY, Machine, Volume
from ballplate.simulator.geometry.ball_layouts import BallLayout
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.geometry.poses import AXIS_INDEX, Pose, balls_in_machine, corner_points
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.number_arrays import Array, Indices
from ballplate.simulator.inputs.problems import Problems
from ballplate.simulator.inputs.quantity_types import Place
from ballplate.simulator.inputs.settings import number_of
from ballplate.simulator.inputs.units import format_length
from ballplate.simulator.inputs.yamltree import Mark

from .model import Position, Probe
from .pool_sections import LimitsSettings, Region
from .references import References
from .validation import Sections

TOLERANCE = 1e-9

# Positions whose balls are placed together: of the largest artefacts these are 64 MB.
AT_ONCE = 64

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
    limits = sections.pool.limits if sections.pool else LimitsSettings.model_validate({})
    reach = _reach(limits, references)
    forbidden = _forbidden(limits, references)
    if machine is None or machine.dimension != references.dimension:
        return None
    forbidden = _through_walls(forbidden, machine.volume)
    return Bounds(machine.volume, probes, reach, limits.edge, forbidden)


def limits_of(
    pose: Pose,
    layout: BallLayout,
    balls: Array,
    edge: float | None,
    readings: Iterable[tuple[Indices, tuple[str, ...]]],
    bounds: Bounds,
) -> dict[str, Array]:
    """Return the least and the greatest shifts (2, d) of a pose at which probes reach the balls
    that they read, and an `edge` of material stays inside the volume, by what is wrong beyond them;
    the least is above the greatest where there is no room.

    `balls` (n, d) are those of the pose; `readings` are indices of balls, with the names of probes.
    """
    ends = np.array([bounds.volume.lower, bounds.volume.upper])
    shifts: dict[str, list[Array]] = {OUTSIDE: []}
    if edge is not None:
        shifts[EDGE] = [ends - outline(pose, layout, edge)]
    for indices, names in readings:
        around = extent(balls[indices])
        for name in names:
            # The volume limits scale readings, which are the balls less the offset of the probe.
            # Reach limits the balls themselves.
            offset = bounds.probes[name].offset if name in bounds.probes else 0.0
            shifts[OUTSIDE].append(ends + offset - around)
            if name in bounds.reach:
                beyond = shifts.setdefault(f"out of reach of probe {name}", [])
                beyond.append(bounds.reach[name] - around)
    return {reason: shared(rooms) for reason, rooms in shifts.items()}


def shared(rooms: Iterable[Array]) -> Array:
    """Return what rooms (2, d) have in common."""
    least, greatest = np.swapaxes([*rooms], 0, 1)
    return np.array([least.max(axis=0), greatest.min(axis=0)])


def length_of(place: Place, low: float, high: float) -> float:
    """Return a place in metres; parts of a room between two ends, the middle if there is no room.

    >>> from ballplate.simulator.inputs import RoomPart
    >>> length_of(0.75, 0.0, 0.5), length_of(RoomPart(0.3, "30 %"), -0.05, 0.95)
    (0.75, 0.25)
    """
    if isinstance(place, float):
        return place
    fraction = place.fraction if low <= high else 0.5
    # A millionth of a micrometre: as round as a length that one would write.
    return float(round(low + fraction * (high - low), 12)) + 0.0


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
    return extent(corner_points(pose, layout, edge))


def entered(around: Array, boxes: Array) -> Any:
    """Return which of boxes (n, 2, d) each artefact enters (…, n), by its ends `around` (…, 2, d);
    what touches a box does not enter it.
    """
    # Two boxes overlap unless one is beyond the other along some axis.
    low, high = around[..., None, 0, :], around[..., None, 1, :]
    is_beyond = (low >= boxes[:, 1] - TOLERANCE) | (high <= boxes[:, 0] + TOLERANCE)
    return ~is_beyond.any(axis=-1)


def _reach(limits: LimitsSettings, references: References) -> dict[str, Array]:
    """Lower and upper ends (2, d) of where balls can be read, by probe."""
    reach = {}
    for name, region in limits.reach.items():
        steps = ("pool", "limits", "reach", name)
        if references.is_probe(name, steps, of_key=True):
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
    return np.stack([lower, upper], axis=1)


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
    return ends[:, : references.dimension or 3]


def check_inside(
    positions: Mapping[Steps, Position],
    volume: Volume,
    probes: Mapping[str, Probe],
    references: References,
) -> None:
    """Report positions, by their paths, with scale readings outside the measuring volume.

    Error models are functions of the scale readings, where the ball is less the probe's offset.
    Balls may be outside, and scale readings by a thousandth of the volume.
    """
    layouts = [references.layouts[position.artefact] for position in positions.values()]
    balls = balls_of([position.pose for position in positions.values()], layouts)
    for (steps, position), layout, places in zip(positions.items(), layouts, balls, strict=True):
        if text := _outside(position, layout, places, volume, probes):
            references.problems.add(steps, text)


def balls_of(poses: Sequence[Pose], layouts: Sequence[BallLayout]) -> Iterator[Array]:
    """Yield the balls (n, d) of each pose in the machine, of few at once: there may be hundreds of
    thousands, of which few are read.
    """
    for start in range(0, len(poses), AT_ONCE):
        block = slice(start, start + AT_ONCE)
        yield from balls_in_machine(poses[block], layouts[block])


def _outside(
    position: Position,
    layout: BallLayout,
    places: Array,
    volume: Volume,
    probes: Mapping[str, Probe],
) -> str:
    """Return what is wrong with scale readings of balls at `places` (n, d); possibly empty."""
    rows = [
        (group.ball_indices, probe, probes[probe].offset)
        for group in position.readings
        for probe in group.probes
        if probe in probes and probes[probe].offset.shape == volume.lower.shape
    ]
    if not rows:
        return ""
    balls = np.concatenate([indices for indices, _, _ in rows])
    names_of_rows = [name for indices, name, _ in rows for _ball in indices]
    by_how_much, axes, sides = excess(
        np.concatenate([places[indices] - offset for indices, _, offset in rows]), volume
    )
    outside = np.flatnonzero(by_how_much > SLIGHTLY * (volume.upper - volume.lower)[axes])
    if len(outside) == 0:
        return ""
    # The first of those furthest outside, whatever rounding makes of equal ones.
    worst = int(outside[np.argmax(by_how_much[outside] > by_how_much.max() - TOLERANCE)])
    axis, probe = int(axes[worst]), names_of_rows[worst]
    offset, place = float(probes[probe].offset[axis]), float(places[balls[worst], axis])
    others_text = f", and {number_of(len(outside) - 1, 'more reading')}" if len(outside) > 1 else ""
    less = (
        f" (the ball at {format_length(place)} less the offset of {format_length(offset)})"
        if offset
        else ""
    )
    remedy = "move the artefact"
    if AXIS_NAMES[axis] in position.parts:
        remedy = f"there is no room along {AXIS_NAMES[axis]}: take a smaller artefact"
    return (
        f'reading ball "{layout.names[balls[worst]]}" with probe "{probe}" moves the scales to'
        f" {AXIS_NAMES[axis]} = {format_length(place - offset)}{less},"
        f" {format_length(by_how_much[worst])} {sides[worst]} the measuring volume{others_text};"
        f" {remedy}, or read it otherwise"
    )


def excess(points: Array, volume: Volume) -> tuple[Array, Array, list[str]]:
    """Return how far points (n, d) are outside the volume, along which axis, and on which side."""
    below, above = volume.lower - points, points - volume.upper
    by_axis = np.maximum(below, above)
    axes = np.argmax(by_axis, axis=1)
    rows = np.arange(len(points))
    sides = ["below" if is_below else "above" for is_below in below[rows, axes] > above[rows, axes]]
    return by_axis[rows, axes], axes, sides


def check_points(
    points: Array,
    steps: Steps,
    volume: Volume,
    problems: Problems,
    marks: Sequence[Mark] | None = None,
    of_one: bool = False,
) -> None:
    """Report points outside the volume: listed ones one by one, of a table (with ``marks``) the
    first.

    ``of_one``: the path is that of a single point, not of a list.
    """
    by_how_much, axes, sides = excess(points, volume)
    outside = np.flatnonzero(by_how_much > TOLERANCE)
    for i in outside if marks is None else outside[:1]:
        axis = int(axes[i])
        others_text = (
            f", as {len(outside) - 1} further points are"
            if marks is not None and len(outside) > 1
            else ""
        )
        text = (
            f"{AXIS_NAMES[axis]} = {format_length(points[i, axis])} is"
            f" {format_length(by_how_much[i])} {sides[i]} the measuring volume{others_text};"
            " move the point inside"
        )
        if marks is None:
            problems.add(steps if of_one else (*steps, int(i)), text)
        else:
            problems.add_at(marks[int(i)], steps, text)
