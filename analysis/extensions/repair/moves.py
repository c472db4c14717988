"""Changes of positions that are read anyway: moved, turned or read more."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import product

import numpy as np
from ballplate.simulator.computing import svd
from ballplate.simulator.experiment import Experiment, Position, Probe
from ballplate.simulator.geometry import AXIS_INDEX, QUARTER_TURNS
from ballplate.simulator.inputs import format_length
from ballplate.simulator.machines import Array

from .changes import (
    Change,
    ChangeKind,
    further,
    is_inside,
    moved,
    with_further,
    with_pose,
)
from .placing import clean, is_plate, middle_of, pitch
from .written import plane_of

AXES = "xyz"
TURNS = {1: "one quarter-turn", 2: "half a turn", 3: "three quarter-turns"}
# Offset of a probe that is to be added where the experiment's own have none.
TIP = 0.05
# What readings with it count for, as it has to be made.
NEW_TIP = 1.5


def moves(experiment: Experiment) -> Iterator[Change]:
    """Positions that are read anyway, turned or shifted."""
    volume = experiment.machine.volume
    for place in experiment.positions:
        layout = experiment.layouts[place.artefact]
        for words, pose in (*_turned(experiment, place), *_shifted(experiment, place)):
            new = moved(place, *pose)
            if is_inside(new, layout, volume, experiment.probes):
                description = words.format(f'position "{place.name}"')
                apply = partial(with_pose, name=place.name, pose=new.pose)
                yield Change(
                    ChangeKind.MOVE, description, 0.0, frozenset({f"position {place.name}"}), apply
                )


def _turned(experiment: Experiment, place: Position) -> Iterator[tuple[str, tuple[Array, Array]]]:
    """Turned about the middle of the balls, in their own plane."""
    layout, pose, d = experiment.layouts[place.artefact], place.pose, experiment.dimension
    if not is_plate(experiment, place.artefact) or len(layout.names) < 2:
        return
    middle = middle_of(layout)[:d]
    for turns, words in TURNS.items():
        turn = np.eye(d)
        turn[:2, :2] = QUARTER_TURNS[turns]
        rotation = pose.rotation @ turn + 0.0
        centre = pose.rotation @ middle + pose.origin
        yield f"turn {{}} by {words}", (rotation, clean(centre - rotation @ middle))


def _shifted(experiment: Experiment, place: Position) -> Iterator[tuple[str, tuple[Array, Array]]]:
    if not is_plate(experiment, place.artefact):
        return
    step = pitch(experiment.layouts[place.artefact])
    plane = plane_of(place.pose.rotation)
    for axis in range(experiment.dimension):
        for steps in (0.5, -0.5, 1.0, -1.0):
            by = np.zeros(experiment.dimension)
            by[axis] = np.round(steps * step, 4)
            amount = f"{format_length(abs(by[axis]))} along {'' if steps > 0 else '-'}{AXES[axis]}"
            words = f"shift {{}} by {amount}"
            if plane is not None and experiment.dimension == 3 and axis == AXIS_INDEX[plane[0]]:
                level = format_length(place.pose.origin[axis] + by[axis])
                words = f"move {{}} to the level {AXES[axis]} = {level}"
            yield words, (place.pose.rotation.copy(), clean(place.pose.origin + by))


def more_readings(experiment: Experiment) -> Iterator[Change]:
    """Return positions read with further probes: existing ones and, if these are on one line, new
    ones.
    """
    tips = new_tips(experiment)
    for name, probe in {**experiment.probes, **tips}.items():
        for place in experiment.positions:
            if (
                name in place.probes
                or not is_plate(experiment, place.artefact)
                or experiment.dimension == 2
            ):
                continue
            more, layout = further(place, name), experiment.layouts[place.artefact]
            if not is_inside(more, layout, experiment.machine.volume, {name: probe}):
                continue
            cost = float(more.count)
            words = f'read position "{place.name}" with probe {name} too'
            if name in tips:
                # A stylus has to be made.
                cost *= NEW_TIP
                words = f'read position "{place.name}" with a new probe too, {_tip_words(probe)}'
            new = {name: probe} if name in tips else {}
            apply = partial(with_further, name=place.name, more=more, probes=new)
            touched = frozenset({f"position {place.name} with {name}"})
            yield Change(ChangeKind.READ_MORE, words, cost, touched, apply, more, place.name)


def new_tips(experiment: Experiment) -> dict[str, Probe]:
    """Return probes opposite and perpendicular to the existing ones, if these are on one line."""
    probes = experiment.probes.values()
    if experiment.dimension == 2 or any(probe.is_estimated for probe in probes):
        return {}
    offsets = np.array([probe.offset for probe in probes])
    values = svd(offsets - offsets.mean(axis=0), compute_uv=False)
    if len(values) > 1 and values[1] > 1e-6:
        return {}
    size = float(np.linalg.norm(offsets, axis=1).max(initial=0.0)) or TIP
    tips = {}
    for sign, axis in product((1.0, -1.0), range(3)):
        offset = np.zeros(3)
        offset[axis] = sign * size
        if np.linalg.norm(offsets - offset, axis=1).min() > 0.1 * size:
            name = f"{'minus ' if sign < 0 else ''}{AXES[axis]}"
            while name in experiment.probes:
                name += " new"
            tips[name] = Probe(name, offset)
    return tips


def _tip_words(probe: Probe) -> str:
    lengths = (format_length(v).removesuffix(" mm") for v in probe.offset)
    return f"{probe.name}, its offset ({', '.join(lengths)}) mm"
