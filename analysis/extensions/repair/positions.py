"""Positions that an experiment does not have yet."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
from ballplate.simulator.experiment import Experiment, Position, ReadingGroup
from ballplate.simulator.geometry import AXIS_INDEX, Axis, Pose, TwoSpheresSettings, plane_rotation
from ballplate.simulator.inputs import format_length
from ballplate.simulator.machines import Array

from .changes import Change, ChangeKind, is_inside, with_position
from .placing import along_rotation, bars, clean, is_plate, middle_of, pitch
from .written import plane_of

PLANES: tuple[Axis, ...] = ("x", "y", "z")
# Where they may be along the normal of their plane, in fractions of the volume.
LEVELS = (0.25, 0.75, 0.5)


def positions(experiment: Experiment) -> Iterator[Change]:
    """A plate in one position more, in each plane, turned and shifted, or a bar in one direction
    more.
    """
    volume, d = experiment.machine.volume, experiment.dimension
    for artefact in dict.fromkeys(place.artefact for place in experiment.positions):
        layout = experiment.layouts[artefact]
        makers = _plate_poses if is_plate(experiment, artefact) else _bar_poses
        for words, plane, pose in makers(experiment, artefact):
            across = probes_across(experiment, artefact, plane)
            every = np.arange(len(layout.names))
            name = free_name(experiment, f"more {plane or ''}".strip())
            for names in dict.fromkeys((across, tuple(experiment.probes))):
                new = Position(
                    name, artefact, Pose(*pose), (ReadingGroup(names, layout.names, every, 1),)
                )
                if d == len(pose[1]) and is_inside(new, layout, volume, experiment.probes):
                    description = f"read {artefact} again {words}"
                    if d == 3 and len(experiment.probes) > 1:
                        probes = "probe" if len(names) == 1 else "probes"
                        description += f", with {probes} {' and '.join(names)}"
                    add = partial(with_added, position=new)
                    yield Change(
                        ChangeKind.ADD_POSITION,
                        description,
                        float(new.count),
                        frozenset({f"more {words}"}),
                        add,
                        new,
                    )


def with_added(experiment: Experiment, position: Position) -> Experiment:
    """Return the experiment with an additional position, under another name if this one is
    in use.
    """
    name = free_name(experiment, position.name)
    return with_position(experiment, replace(position, name=name))


def free_name(experiment: Experiment, name: str) -> str:
    """Return a name, or the first with a number after it, that no position has."""
    names = {place.name for place in experiment.positions} | {*experiment.switched_off}
    return next(
        candidate_name
        for k in range(len(names) + 1)
        if (candidate_name := name if not k else f"{name} {k + 1}") not in names
    )


def _plate_poses(
    experiment: Experiment, artefact: str
) -> Iterator[tuple[str, Axis | None, tuple[Array, Array]]]:
    layout, d, volume = (
        experiment.layouts[artefact],
        experiment.dimension,
        experiment.machine.volume,
    )
    centre, step = 0.5 * (volume.lower + volume.upper), pitch(layout)
    middle = middle_of(layout)[:d]
    for shift, turns in product((0.0, 0.5), range(4)):
        for level, plane in product(LEVELS if d == 3 else (0.5,), PLANES if d == 3 else PLANES[2:]):
            rotation = plane_rotation(plane, turns, d)
            origin = centre + np.round(shift * step, 4)
            words = (
                f"in the middle of the volume, turned by {90 * turns} deg"
                if turns
                else "in the middle of the volume"
            )
            if shift:
                words = words.replace(
                    " of the volume",
                    f", shifted by {format_length(np.round(0.5 * step, 4))} along both axes",
                )
            if d == 3:
                normal = AXIS_INDEX[plane]
                origin[normal] = volume.lower[normal] + level * (
                    volume.upper[normal] - volume.lower[normal]
                )
                words = f"in plane {plane} at {format_length(origin[normal])}, {words}"
            yield words, plane if d == 3 else None, (rotation, clean(origin - rotation @ middle))


def _bar_poses(
    experiment: Experiment, artefact: str
) -> Iterator[tuple[str, Axis | None, tuple[Array, Array]]]:
    if not isinstance(experiment.artefacts[artefact], TwoSpheresSettings):
        return
    volume, d = experiment.machine.volume, experiment.dimension
    centre, middle = (
        0.5 * (volume.lower + volume.upper),
        middle_of(experiment.layouts[artefact])[:d],
    )
    for words, along in bars(d):
        rotation = along_rotation(along)
        yield (
            f"{words}, in the middle of the volume",
            None,
            (rotation, np.round(centre - rotation @ middle, 5) + 0.0),
        )


def probes_across(experiment: Experiment, artefact: str, plane: Axis | None) -> tuple[str, ...]:
    """Return the probes that read the artefact in that plane, or those that reach across it, or the
    first.
    """
    places = [place for place in experiment.positions if place.artefact == artefact]
    for place in places:
        plane_axes = plane_of(place.pose.rotation)
        if plane is None or (plane_axes is not None and plane_axes[0] == plane):
            return place.probes
    normal = AXIS_INDEX[plane or "z"]
    across = [
        name
        for name, probe in experiment.probes.items()
        if abs(probe.offset[normal]) > 0.7 * float(np.linalg.norm(probe.offset))
    ]
    return tuple(across) or (next(iter(experiment.probes)),)
