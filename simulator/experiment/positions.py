"""Conversion of the settings of a position into its pose and its readings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from ballplate.simulator.geometry.ball_layouts import BallLayout
from ballplate.simulator.geometry.poses import (
    AXIS_INDEX,
    IN_PLANE_AXES,
    Axis,
    FreePlacement,
    PlanePlacement,
    Pose,
    nominal_poses,
    room_parts,
    shifted,
)
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.quantity_types import Place

from .bounds import Bounds, balls_of, edge_of, length_of, limits_of, shared
from .model import Position, ReadingGroup
from .position_sections import PositionSettings, ReadingSettings
from .references import References, lengths_per_axis

# A plane of holes is across an axis if its normal has that axis' direction to within this.
OBLIQUE = 1e-12

PLANE_KEYS = ("plane", "level", "corner", "centre", "quarter_turns")
READING_KEYS = ("probes", "balls", "repeats", "standard_uncertainty")


@dataclass(frozen=True)
class _Draft:
    """A position whose keys are right, before its pose is known."""

    settings: PositionSettings
    steps: Steps
    artefact: str
    layout: BallLayout
    readings: tuple[ReadingGroup, ...]
    placement: PlanePlacement | FreePlacement


def resolve_positions(
    entries: Mapping[Steps, PositionSettings], bounds: Bounds | None, references: References
) -> dict[Steps, Position]:
    """Return the positions that are right, by their paths, with poses and readings; faults go to
    the problems.

    A place that is a part of the free room is known once the artefact is placed at 0 along that
    axis: the shifts at which its probes still reach all balls are the room.
    """
    d = references.dimension
    drafts = [_draft(settings, steps, references) for steps, settings in entries.items()]
    placed = [draft for draft in drafts if draft is not None]
    if d is None or not placed:
        return {}
    poses = nominal_poses([(draft.placement, draft.layout) for draft in placed], d)
    rooms, lengths = [np.zeros((2, d))] * len(placed), [dict[str, float]()] * len(placed)
    if bounds is not None:
        balls = balls_of(poses, [draft.layout for draft in placed])
        rooms = [
            _room(draft, pose, places, bounds, references)
            for draft, pose, places in zip(placed, poses, balls, strict=True)
        ]
        parts_of = room_parts([draft.placement for draft in placed])
        lengths = [
            {axis: length_of(part, *room[:, AXIS_INDEX[axis]]) for axis, part in parts.items()}
            for parts, room in zip(parts_of, rooms, strict=True)
        ]
        shifts = [[parts.get(axis, 0.0) for axis in AXIS_INDEX][:d] for parts in lengths]
        poses = shifted(poses, shifts)
        # From the place taken, as far as the artefact can still be moved either way.
        rooms = [room - shift for room, shift in zip(rooms, shifts, strict=True)]
    return {
        draft.steps: Position(
            draft.settings.name,
            draft.artefact,
            pose,
            draft.readings,
            draft.settings.description or "",
            draft.settings.enabled,
            room,
            parts,
        )
        for draft, pose, room, parts in zip(placed, poses, rooms, lengths, strict=True)
        if _is_read_as_it_lies(draft, pose, references)
    }


def _draft(settings: PositionSettings, steps: Steps, references: References) -> _Draft | None:
    # Everything is looked at before anything that is wrong ends it, so that all faults of a
    # position are reported at once.
    artefact = references.artefact(settings.artefact, steps)
    layout = references.layouts.get(artefact) if artefact is not None else None
    readings = _readings(settings, steps, layout, references)
    placement = _placement(settings, steps, references)
    if artefact is None or layout is None or readings is None or placement is None:
        return None
    return _Draft(settings, steps, artefact, layout, readings, placement)


def _room(draft: _Draft, pose: Pose, balls: Array, bounds: Bounds, references: References) -> Array:
    """Return the least and the greatest shifts (2, d) of a pose within its free room."""
    read = [(group.ball_indices, group.probes) for group in draft.readings]
    edge = edge_of(draft.artefact, bounds, references)
    return shared(limits_of(pose, draft.layout, balls, edge, read, bounds).values())


def _is_read_as_it_lies(draft: _Draft, pose: Pose, references: References) -> bool:
    """True unless an artefact that is read in its plane is oblique, after saying so."""
    in_plane = references.artefacts[draft.artefact].reads == "in plane"
    text = (
        f'"{draft.artefact}" is read in its plane, which has to be across an axis of the machine;'
        " correct the pose, or write reads: in space for the artefact"
    )
    is_across = float(np.abs(pose.rotation[:, -1]).max()) > 1.0 - OBLIQUE
    return references.require(is_across or not in_plane, (*draft.steps, "pose"), text)


def _readings(
    settings: PositionSettings, steps: Steps, layout: BallLayout | None, references: References
) -> tuple[ReadingGroup, ...] | None:
    if settings.readings is None:
        # What was validated with the position is not validated again.
        only = ReadingSettings.model_construct(
            probes=settings.probes,
            balls=settings.balls or "all",
            repeats=settings.repeats or 1,
            standard_uncertainty=settings.standard_uncertainty,
        )
        group = _group(only, steps, layout, references)
        return (group,) if group else None
    complete = True
    for key in READING_KEYS:
        if getattr(settings, key) is not None:
            references.problems.add(
                (*steps, key),
                'cannot be combined with "readings"; move it there, or remove "readings"',
                of_key=True,
            )
            complete = False
    groups = [
        _group(group, (*steps, "readings", i), layout, references)
        for i, group in enumerate(settings.readings)
    ]
    resolved = tuple(group for group in groups if group is not None)
    return resolved if complete and len(resolved) == len(groups) else None


def _group(
    settings: ReadingSettings, steps: Steps, layout: BallLayout | None, references: References
) -> ReadingGroup | None:
    balls = settings.balls
    probe_names = references.probe_names(settings.probes, steps)
    uncertainty, is_right = lengths_per_axis(
        settings.standard_uncertainty, (*steps, "standard_uncertainty"), references
    )
    if layout is None:
        return None
    names = layout.names if balls == "all" else balls
    if not references.count_readings(len(probe_names or ()) * len(names) * settings.repeats, steps):
        return None
    indices = references.balls(balls, layout, (*steps, "balls"))
    if probe_names is None or indices is None or not is_right:
        return None
    return ReadingGroup(probe_names, tuple(names), indices, settings.repeats, uncertainty)


def _placement(
    settings: PositionSettings, steps: Steps, references: References
) -> PlanePlacement | FreePlacement | None:
    dimension, problems = references.dimension, references.problems
    plane_keys = [key for key in PLANE_KEYS if getattr(settings, key) is not None]
    if settings.pose is not None:
        for key in plane_keys:
            problems.add(
                (*steps, key),
                'cannot be combined with "pose"; give only one of the two',
                of_key=True,
            )
        pose = _free_placement(settings.pose, (*steps, "pose"), references)
        return None if plane_keys else pose
    if dimension is None:
        return None
    if not {"plane", "level", "corner", "centre"} & set(plane_keys):
        needed = "corner or centre" if dimension == 2 else "plane, level and corner or centre"
        problems.add(steps, f"does not state the artefact's location; add {needed}, or pose")
        return None
    is_right = True
    if dimension == 2:
        for key in {"plane", "level"} & set(plane_keys):
            references.refuse_in_plane(*steps, key)
            is_right = False
    else:
        is_right &= references.require(
            settings.plane is not None, (*steps, "plane"), 'missing; add "plane", x, y or z'
        )
        text = 'missing; add "level", the co-ordinate of the plane'
        is_right &= references.require(settings.level is not None, (*steps, "level"), text)
    if settings.corner is None and settings.centre is None:
        problems.add((*steps, "corner"), 'missing; add "corner" or "centre"')
        return None
    if settings.corner is not None and settings.centre is not None:
        problems.add(
            (*steps, "centre"),
            'cannot be combined with "corner"; give only one of the two',
            of_key=True,
        )
        return None
    plane: Axis | None = "z" if dimension == 2 else settings.plane
    if plane is None:
        return None
    anchor: Literal["corner", "centre"] = "centre" if settings.corner is None else "corner"
    point = _in_plane(getattr(settings, anchor), plane, (*steps, anchor), references)
    turns = settings.quarter_turns or 0
    is_right &= check_turns(turns, (*steps, "quarter_turns"), references)
    if point is None or not is_right:
        return None
    return PlanePlacement(plane, settings.level or 0.0, anchor, point, turns)


def check_turns(turns: int, steps: Steps, references: References) -> bool:
    """Report a number of quarter-turns that may be meant as an angle."""
    if turns % 90:
        meant = f"write 0 to 3, such as {turns % 4}, which turns as far"
    else:
        meant = f"write {turns // 90 % 4} for {turns} deg"
    return references.require(
        0 <= turns <= 3, steps, f"{turns} is not a number of turns by 90 deg from 0 to 3; {meant}"
    )


def _in_plane(
    point: Any, plane: Axis, steps: Steps, references: References
) -> tuple[Place, Place] | None:
    axes = IN_PLANE_AXES[plane]
    first, second = sorted(axes)
    is_right = True
    for axis in ("x", "y", "z"):
        is_written = axis in point
        if axis in axes:
            is_right &= references.require(is_written, (*steps, axis), f'missing; add "{axis}"')
        elif is_written:
            text = f"is not an axis of the plane; give {first} and {second}"
            references.problems.add((*steps, axis), text, of_key=True)
            is_right = False
    return (point[axes[0]], point[axes[1]]) if is_right else None


def _free_placement(pose: Any, steps: Steps, references: References) -> FreePlacement | None:
    dimension = references.dimension
    if dimension is None:
        return None
    is_right = references.has_dimension(pose.origin, (*steps, "origin"))
    is_right &= references.require(
        pose.rotation is None or isinstance(pose.rotation, float) == (dimension == 2),
        (*steps, "rotation"),
        (
            "a two-dimensional experiment has one angle; write for example 90 deg"
            if dimension == 2
            else (
                "a three-dimensional experiment has three angles; write for example [0 deg, 0 deg,"
                " 90 deg]"
            )
        ),
    )
    if not is_right:
        return None
    if pose.rotation is None:
        return FreePlacement(pose.origin, (0.0,) if dimension == 2 else (0.0, 0.0, 0.0))
    return FreePlacement(
        pose.origin, pose.rotation if isinstance(pose.rotation, tuple) else (pose.rotation,)
    )
