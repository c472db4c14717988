"""Positions of an artefact in the machine: a rotation and an origin from their keys."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.quantity_types import Place, RoomPart

from .ball_layouts import BallLayout
from .motions import rotation_matrix

Axis = Literal["x", "y", "z"]

# The artefact's two axes go to these, cyclic so that its third goes to the plane's normal.
IN_PLANE_AXES: Mapping[str, tuple[Axis, Axis]] = {"x": ("y", "z"), "y": ("z", "x"), "z": ("x", "y")}
AXIS_INDEX: Mapping[str, int] = {"x": 0, "y": 1, "z": 2}
QUARTER_TURNS = tuple(
    np.array(turn, dtype=float)
    for turn in (
        ((1, 0), (0, 1)),
        ((0, -1), (1, 0)),
        ((-1, 0), (0, -1)),
        ((0, 1), (-1, 0)),
    )
)


@dataclass(frozen=True, eq=False)
class Pose:
    """A rigid motion x = ``rotation`` y + ``origin`` from the artefact's frame into the machine's.

    ``rotation``: (d, d), proper. ``origin``: (d,) in metres.
    """

    rotation: Array
    origin: Array

    def __post_init__(self) -> None:
        for array in (self.rotation, self.origin):
            array.setflags(write=False)


@dataclass(frozen=True)
class PlanePlacement:
    """An artefact parallel to a machine plane.

    ``plane``: axis the plane is normal to; in two dimensions z. ``level``: co-ordinate of the
    artefact's plane along it. ``anchor``: which point of the turned bounding rectangle is ``at``,
    in the order of ``IN_PLANE_AXES[plane]``. Both are in metres, or parts of the free room.
    ``quarter_turns``: counter-clockwise as seen against the plane's normal.
    """

    plane: Axis
    level: Place
    anchor: Literal["corner", "centre"]
    at: tuple[Place, Place]
    quarter_turns: int = 0

    @property
    def places(self) -> dict[str, Place]:
        """Level and anchor by axis."""
        return dict(
            zip((*IN_PLANE_AXES[self.plane], self.plane), (*self.at, self.level), strict=True)
        )


@dataclass(frozen=True)
class FreePlacement:
    """An artefact anywhere: x = R y + ``origin`` (d metres or parts of the free room), R from
    ``rotation`` (3 radians, or 1 in 2-D).
    """

    origin: tuple[Place, ...]
    rotation: tuple[float, ...]

    @property
    def places(self) -> dict[str, Place]:
        """The origin by axis."""
        return dict(zip(AXIS_INDEX, self.origin, strict=False))


def nominal_pose(
    placement: PlanePlacement | FreePlacement, layout: BallLayout, dimension: int
) -> Pose:
    """Return the pose of a placement in a machine of 2 or 3 dimensions, at 0 along axes with a part
    of the free room.

    :raises ValueError: in two dimensions a plane other than z, or a free placement of another
        dimension.
    """
    anchor = np.zeros(dimension)
    if isinstance(placement, FreePlacement):
        if len(placement.origin) != dimension:
            raise ValueError(
                f"a pose with {len(placement.origin)} co-ordinates in {dimension} dimensions"
            )
        rotation = rotation_matrix(placement.rotation)
    else:
        if dimension == 2 and placement.plane != "z":
            raise ValueError("a plane experiment has no plane but z")
        rotation = plane_rotation(placement.plane, placement.quarter_turns, dimension)
        rectangle = bounding_rectangle(layout) @ rotation[:, :2].T
        lower, upper = rectangle.min(axis=0), rectangle.max(axis=0)
        anchor = lower if placement.anchor == "corner" else (lower + upper) / 2
    places = [placement.places[axis] for axis in list(AXIS_INDEX)[:dimension]]
    lengths = [0.0 if isinstance(place, RoomPart) else place for place in places]
    return Pose(rotation, lengths - anchor)


def nominal_poses(
    placed: Iterable[tuple[PlanePlacement | FreePlacement, BallLayout]], dimension: int
) -> list[Pose]:
    """Return the `nominal_pose` of each placement.

    :raises ValueError: as `nominal_pose`.
    """
    return [nominal_pose(placement, layout, dimension) for placement, layout in placed]


def room_parts(
    placements: Iterable[PlanePlacement | FreePlacement],
) -> list[dict[str, RoomPart]]:
    """Return the places of each placement that are parts of the free room, by axis."""
    return [
        {axis: place for axis, place in placement.places.items() if isinstance(place, RoomPart)}
        for placement in placements
    ]


def shifted(poses: Iterable[Pose], shifts: Iterable[Sequence[float]]) -> list[Pose]:
    """Return poses shifted by (d,) metres each."""
    return [
        Pose(pose.rotation, pose.origin + shift) for pose, shift in zip(poses, shifts, strict=True)
    ]


def plane_rotation(plane: str, turns: int, dimension: int = 3) -> Array:
    """Return the rotation (d, d) of an artefact in a plane after quarter-turns."""
    turn = QUARTER_TURNS[turns % 4]
    if dimension == 2:
        return turn.copy()
    rotation = np.zeros((3, 3))
    rotation[np.ix_([AXIS_INDEX[axis] for axis in IN_PLANE_AXES[plane]], [0, 1])] = turn
    rotation[AXIS_INDEX[plane], 2] = 1.0
    return rotation


def bounding_rectangle(layout: BallLayout) -> Array:
    """Return the lower and upper corner, (2, 2) metres, of the balls in the artefact's x and y."""
    plane = layout.coordinates[:, :2]
    return np.array([plane.min(axis=0), plane.max(axis=0)])


def corner_points(pose: Pose, layout: BallLayout, edge: float = 0.0) -> Array:
    """Return the corners (4, d), in order round it, of the rectangle around an artefact's balls and
    an `edge` of material beyond them.
    """
    (left, low), (right, high) = bounding_rectangle(layout) + [[-edge], [edge]]
    plane = [(left, low, 0.0), (right, low, 0.0), (right, high, 0.0), (left, high, 0.0)]
    return np.array(plane)[:, : len(pose.origin)] @ pose.rotation.T + pose.origin


def ball_coordinates(pose: Pose, layout: BallLayout) -> Array:
    """Return the nominal co-ordinates (n, d) of an artefact's balls in the machine, in metres."""
    return layout.coordinates[:, : len(pose.origin)] @ pose.rotation.T + pose.origin


def balls_in_machine(poses: Iterable[Pose], layouts: Iterable[BallLayout]) -> list[Array]:
    """Return the `ball_coordinates` of each pose and its layout."""
    return [ball_coordinates(pose, layout) for pose, layout in zip(poses, layouts, strict=True)]
