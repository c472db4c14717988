"""Changes of an experiment as edits of its file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any

import numpy as np
from ballplate.simulator.design import (
    Calibration,
    CoordinateCalibration,
    DistanceCalibration,
    RadiusCalibration,
)
from ballplate.simulator.experiment import Experiment, Position, ReadingGroup
from ballplate.simulator.geometry import (
    AXIS_INDEX,
    IN_PLANE_AXES,
    BallLayout,
    ball_coordinates,
    pairs,
    plane_rotation,
)
from ballplate.simulator.inputs import (
    Indices,
    LengthFunction,
    Step,
    format_path,
    parse_length,
    to_list,
    to_python,
    typed_length,
)
from ballplate.simulator.machines import Array

from .yamltext import flow

AXES = "xyz"


@dataclass(frozen=True)
class Edit:
    """A value that a file is to have at a path, where positions go by their names; `is_new` says
    that it goes to the end of the list there.
    """

    steps: tuple[Step, ...]
    value: Any
    is_new: bool = False

    @property
    def path(self) -> str:
        """The path as in messages and in overrides of variants."""
        if self.steps[0] == "positions" and len(self.steps) == 2:
            return f"positions[{self.steps[1]}]"
        return format_path(self.steps)

    def __str__(self) -> str:
        return f"{'add to ' if self.is_new else ''}{self.path}: {flow(self.value)}"


def edits(before: Experiment, after: Experiment) -> tuple[Edit, ...]:
    """Return the changes that turn the file of `before` into that of `after`.

    Positions, added probes and added calibration are compared.
    """
    changes = []
    for name, probe in after.probes.items():
        if name not in before.probes:
            changes.append(Edit(("probes", name), [written_length(v) for v in probe.offset]))
    places_before = {place.name: place for place in before.positions}
    # With one probe, a file need not name it.
    named = to_python(before.tree).get("positions", ()) if len(after.probes) > 1 else ()
    unnamed = {
        str(candidate["name"])
        for candidate in named
        if len(before.probes) == 1 and lacks_probes(candidate)
    }
    for place in after.positions:
        place_before = places_before.get(place.name)
        if place_before is place and place.name not in unnamed:
            continue
        settings = position_settings(after, place)
        if place_before is None:
            changes.append(Edit(("positions",), settings, True))
        elif place.name in unnamed or settings != position_settings(before, place_before):
            changes.append(Edit(("positions", place.name), settings))
    candidates = () if after.pool is None else after.pool.candidates
    for item in after.calibration[len(before.calibration) :]:
        # Only a candidate of the pool is added as the file states it.
        settings = (
            calibration_settings(after, item)
            if can_be_written(item)
            else to_list(next(each.settings for each in candidates if each.item is item))
        )
        changes.append(Edit(("calibration",), settings, True))
    return tuple(changes)


def lacks_probes(settings: Mapping[str, Any]) -> bool:
    """True if a position in a file omits the probes that read it."""
    return any("probes" not in group for group in settings.get("readings", [settings]))


def position_settings(experiment: Experiment, position: Position) -> dict[str, Any]:
    """Return a position in the form of a file."""
    settings = {"name": position.name}
    if len(experiment.artefacts) > 1:
        settings["artefact"] = position.artefact
    settings |= _placement(experiment, position)
    groups = [_group(experiment, position, group) for group in position.readings]
    return settings | (groups[0] if len(groups) == 1 else {"readings": groups})


def _placement(experiment: Experiment, position: Position) -> dict[str, Any]:
    layout, pose, d = experiment.layouts[position.artefact], position.pose, experiment.dimension
    plane_axis = plane_of(pose.rotation)
    if plane_axis is None:
        return {
            "pose": {
                "origin": [written_length(v) for v in pose.origin],
                "rotation": _angles(pose.rotation),
            }
        }
    plane, turns = plane_axis
    normal = AXIS_INDEX[plane]
    lower = cleaned(ball_coordinates(pose, layout).min(axis=0))
    settings: dict[str, Any] = (
        {} if d == 2 else {"plane": plane, "level": written_length(pose.origin[normal])}
    )
    settings["corner"] = {
        axis: written_length(lower[AXIS_INDEX[axis]]) for axis in IN_PLANE_AXES[plane]
    }
    return settings | ({"quarter_turns": turns} if turns else {})


def cleaned(place: Array) -> Array:
    """Return a place (d,) in metres without what rounding leaves."""
    return np.round(place, 13) + 0.0


def plane_of(rotation: Array) -> tuple[Any, int] | None:
    """Return the plane and quarter-turns of a rotation (d, d), unless it is a general one.

    >>> plane_of(np.eye(3)), plane_of(-np.eye(2)), plane_of(np.diag([1.0, -1.0, -1.0]))
    (('z', 0), ('z', 2), None)
    """
    for plane_axis, in_plane in _plane_rotations(len(rotation)):
        if np.abs(rotation - in_plane).max() < 1e-12:
            return plane_axis
    return None


@cache
def _plane_rotations(dimension: int) -> list[tuple[tuple[str, int], Array]]:
    """Return all planes with their quarter-turns, and their rotations (d, d)."""
    every = product("xyz" if dimension == 3 else "z", range(4))
    return [((plane, turns), plane_rotation(plane, turns, dimension)) for plane, turns in every]


def _angles(rotation: Array) -> Any:
    """The angles about x, then y, then z, that a rotation is; one angle in two dimensions."""
    if len(rotation) == 2:
        return _angle(np.arctan2(rotation[1, 0], rotation[0, 0]))
    upright = np.hypot(rotation[0, 0], rotation[1, 0])
    about_y = np.arctan2(-rotation[2, 0], upright)
    if upright > 1e-9:
        about_x, about_z = (
            np.arctan2(rotation[2, 1], rotation[2, 2]),
            np.arctan2(rotation[1, 0], rotation[0, 0]),
        )
    else:
        about_x, about_z = 0.0, np.arctan2(-rotation[0, 1], rotation[1, 1])
    return [_angle(value) for value in (about_x, about_y, about_z)]


def _angle(value: float) -> str:
    degrees = float(np.degrees(value)) + 0.0
    return f"{degrees:.12g} deg"


def _group(experiment: Experiment, position: Position, group: ReadingGroup) -> dict[str, Any]:
    settings: dict[str, Any] = {}
    if len(experiment.probes) > 1 or experiment.dimension == 3:
        settings["probes"] = list(group.probes)
    if ball_set(experiment.layouts[position.artefact], group.ball_indices) != "all":
        settings["balls"] = list(group.balls)
    if group.repeats > 1:
        settings["repeats"] = group.repeats
    if group.standard_uncertainty is not None:
        values = map(written_length, group.standard_uncertainty)
        settings["standard_uncertainty"] = dict(zip(AXES, values, strict=False))
    return settings


def can_be_written(item: Calibration) -> bool:
    """True if `calibration_settings` contain all of an item except its certified values."""
    if isinstance(item, DistanceCalibration):
        return item.standard_uncertainty is not None
    if isinstance(item, CoordinateCalibration):
        # A file states those of each ball.
        return item.standard_uncertainties.ndim == 1
    return isinstance(item, RadiusCalibration)


def calibration_settings(experiment: Experiment, item: Calibration) -> dict[str, Any]:
    """Return a calibration item in the form of a file, without its certified values."""
    layout = experiment.layouts[item.artefact]
    settings: dict[str, Any] = {"kind": item.kind}
    if len(experiment.artefacts) > 1:
        settings["artefact"] = item.artefact
    if isinstance(item, DistanceCalibration):
        named = [[layout.names[i] for i in pair] for pair in item.pairs.tolist()]
        settings["pairs"] = pair_set(layout, item.pairs) or named
        if item.dimensions == 2 and experiment.dimension == 3:
            settings["dimensions"] = 2
        assert item.standard_uncertainty is not None
        settings["standard_uncertainty"] = length_function(item.standard_uncertainty)
    elif isinstance(item, CoordinateCalibration):
        balls = ball_set(layout, item.balls)
        settings["balls"] = balls or [layout.names[i] for i in item.balls.tolist()]
        by_axis = zip(item.axes, item.standard_uncertainties, strict=True)
        settings["standard_uncertainty"] = {AXES[axis]: written_length(u) for axis, u in by_axis}
    elif isinstance(item, RadiusCalibration):
        settings["standard_uncertainty"] = written_length(item.standard_uncertainty)
    return settings


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


def length_function(value: LengthFunction) -> str:
    """An uncertainty as written in a file.

    >>> length_function(LengthFunction(5e-7, 1e-6))
    '0.5 um + L/1000000'
    """
    constant = written_length(value.constant)
    return f"{constant} + L/{1.0 / value.slope:.12g}" if value.slope else constant


def written_length(value: float) -> str:
    """Return a length as written in a file: the shortest readable form, with all digits if needed.

    >>> written_length(0.125), written_length(0.1 / 3)
    ('125 mm', '0.03333333333333333 m')
    """
    value = float(value)
    text = typed_length(value)
    if abs(parse_length(text) - value) <= 1e-15:
        return text
    return f"{value!r} m"
