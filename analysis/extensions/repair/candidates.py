"""The generated pool of changes: positions moved, turned and read more, new ones, and those that
the file's own pool has.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from ballplate.simulator.computing import svd
from ballplate.simulator.experiment import Experiment, Position, Probe, ReadingGroup, placed_only
from ballplate.simulator.geometry import (
    AXIS_INDEX,
    QUARTER_TURNS,
    Axis,
    BallLayout,
    Pose,
    TwoSpheresSettings,
    plane_rotation,
)
from ballplate.simulator.inputs import format_length
from ballplate.simulator.machines import Array

from ..planning import seconds_of
from .certificates import certificates
from .changes import Change, ChangeKind, free_name, is_possible, middle_of, scale_readings
from .written import cleaned, plane_of

PLANES: tuple[Axis, ...] = ("x", "y", "z")
AXES = "xyz"
TURNS = {1: "one quarter-turn", 2: "half a turn", 3: "three quarter-turns"}
# New positions: along the normal of their plane, in fractions of the volume; across it, in pitches;
# quarter-turns.
LEVELS, SHIFTS, NEW_TURNS = (0.25, 0.75, 0.5), (0.0, 0.5), (0, 1)
# Candidates of each kind: as many as plan's matrices have room for.
MOST_OF_A_KIND = 250
# Shifts below this, in metres, change nothing; others are to a tenth of a millimetre.
LEAST_SHIFT, STEP = 1e-3, 1e-4
# Offset, in metres, of a probe that is to be added if the experiment's own have none.
TIP = 0.05


def candidates(experiment: Experiment) -> list[Change]:
    """Return changes within the volume; additions are those of the pool, if there is one."""
    pool, placed = experiment.pool, placed_only(experiment)
    # What the pool forbids is forbidden to positions that are moved, too.
    bounded = replace(placed, pool=pool)
    makers = [moves(bounded), further_readings(bounded)]
    if pool is not None:
        makers.append(pool_additions(experiment))
    else:
        makers += [new_positions(placed), certificates(placed)]
    return [change for maker in makers for change in _thinned(list(maker))]


def _thinned(changes: list[Change]) -> list[Change]:
    """Return at most `MOST_OF_A_KIND` changes, evenly spread."""
    if len(changes) <= MOST_OF_A_KIND:
        return changes
    return [changes[k] for k in np.linspace(0, len(changes) - 1, MOST_OF_A_KIND).astype(int)]


def moves(experiment: Experiment) -> Iterator[Change]:
    """Plates turned in their plane, shifted along an axis by half a pitch, or turned and shifted as
    far as there is room.
    """
    for place in experiment.positions:
        if not _is_plate(experiment, place.artefact):
            continue
        step = pitch(experiment.layouts[place.artefact])
        plane = plane_of(place.pose.rotation)
        normal = -1 if plane is None or experiment.dimension == 2 else AXIS_INDEX[plane[0]]
        across = [axis for axis in range(experiment.dimension) if axis != normal]
        axes = across if normal < 0 else (*across, normal)
        plain = [(0, {axis: by * step}) for axis in axes for by in (0.5, -0.5)]
        found: dict[tuple[float, ...], Change] = {}
        for turns, by_axis in (*plain, *_at_ends(experiment, place, across, normal)):
            shift = {axis: by for axis, by in by_axis.items() if abs(by) >= LEAST_SHIFT}
            if not turns and not shift:
                continue
            new = replace(place, pose=_moved(experiment, place, turns, shift))
            if is_possible(experiment, new):
                pose = new.pose
                key = (*pose.rotation.ravel().round(9), *pose.origin.round(9))
                words = _move_in_words(place, turns, shift, normal)
                change = Change(ChangeKind.MOVE, words, f"position {place.name}", new)
                found.setdefault(key, change)
        yield from found.values()


def _at_ends(
    experiment: Experiment, place: Position, across: Sequence[int], normal: int
) -> Iterator[tuple[int, Mapping[int, float]]]:
    """Yield quarter-turns and shifts by axis, in metres, that lead to the ends of the room of a
    plate: across it in each pair of directions, or along its normal.
    """
    layout, volume = experiment.layouts[place.artefact], experiment.machine.volume
    for turns in range(4):
        turned = replace(place, pose=_moved(experiment, place, turns, {}))
        readings = scale_readings(turned, layout, experiment.probes)
        room = np.stack([volume.lower - readings.min(axis=0), volume.upper - readings.max(axis=0)])
        # A part of a step is rounding.
        room = np.trunc(np.round(room / STEP, 3)) * STEP
        yield turns, {}
        # Turned ones in the corners alone, which keeps their number down.
        for ends in product((0, 1) if turns else (None, 0, 1), repeat=len(across)):
            by_axis = zip(across, ends, strict=True)
            yield turns, {axis: room[end, axis] for axis, end in by_axis if end is not None}
        if not turns and normal >= 0:
            yield from ((0, {normal: by}) for by in room[:, normal])


def _moved(experiment: Experiment, place: Position, turns: int, shift: Mapping[int, float]) -> Pose:
    """Return the pose of a position after quarter-turns about the middle of its balls, in their
    own plane, and a shift.
    """
    pose, d = place.pose, experiment.dimension
    middle = middle_of(experiment.layouts[place.artefact])[:d]
    turn = np.eye(d)
    turn[:2, :2] = QUARTER_TURNS[turns]
    rotation = pose.rotation @ turn + 0.0
    origin = pose.origin + (pose.rotation - rotation) @ middle
    for axis, by in shift.items():
        origin[axis] += by
    return Pose(rotation, np.round(origin, 9) + 0.0 if shift or turns else pose.origin)


def _move_in_words(place: Position, turns: int, shift: Mapping[int, float], normal: int) -> str:
    words, by_axis = [], dict(shift)
    if turns:
        words.append(f"turn {{}} by {TURNS[turns]}")
    if normal in by_axis:
        level = format_length(np.round(place.pose.origin[normal] + by_axis.pop(normal), 9))
        words.append(f"move {{}} to the level {AXES[normal]} = {level}")
    if by_axis:
        along = " and ".join(
            f"{format_length(abs(by))} along {'-' * bool(by < 0)}{AXES[axis]}"
            for axis, by in by_axis.items()
        )
        words.append(f"shift {{}} by {along}")
    name = f'position "{place.name}"'
    return " and ".join([words[0].format(name), *(each.format("it") for each in words[1:])])


def further_readings(experiment: Experiment) -> Iterator[Change]:
    """Positions read twice, or with further probes: existing ones and, if these are on one line,
    new ones.
    """
    tips = _new_tips(experiment)
    for place in experiment.positions:
        subject, before = f"position {place.name}", seconds_of(place)
        groups = tuple(replace(group, repeats=2 * group.repeats) for group in place.readings)
        twice = replace(place, readings=groups)
        words = f'read position "{place.name}" twice as often'
        seconds = seconds_of(twice) - before
        yield Change(ChangeKind.READ, words, subject, twice, seconds)
        if not _is_plate(experiment, place.artefact) or experiment.dimension == 2:
            continue
        for name, probe in {**experiment.probes, **tips}.items():
            probes, more = {**experiment.probes, name: probe}, _read_with(place, name)
            if name in place.probes or not is_possible(experiment, more, probes):
                continue
            seconds = seconds_of(more) - before
            if name not in tips:
                words = f'read position "{place.name}" with probe {name} too'
                yield Change(ChangeKind.READ, words, subject, more, seconds)
                continue
            offset = ", ".join(format_length(v).removesuffix(" mm") for v in probe.offset)
            words = (
                f'read position "{place.name}" with a new probe too, {name}, its offset'
                f" ({offset}) mm"
            )
            # A stylus has to be made, and its offset to be known.
            yield Change(ChangeKind.CERTIFICATE, words, subject, more, seconds, 1, probe)


def _read_with(place: Position, probe: str) -> Position:
    """Return a position with all its balls read with a further probe."""
    if len(place.readings) == 1:
        (group,) = place.readings
        return replace(place, readings=(replace(group, probes=(*group.probes, probe)),))
    names = {
        int(i): name
        for group in place.readings
        for i, name in zip(group.ball_indices, group.balls, strict=True)
    }
    indices = np.array(sorted(names), np.intp)
    repeats = min(group.repeats for group in place.readings)
    balls = tuple(names[int(i)] for i in indices)
    further = ReadingGroup((probe,), balls, indices, repeats)
    return replace(place, readings=(*place.readings, further))


def _new_tips(experiment: Experiment) -> Mapping[str, Probe]:
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


def new_positions(experiment: Experiment) -> Iterator[Change]:
    """A plate in one position more, in each plane, turned and shifted, or a bar in one direction
    more.
    """
    for artefact in dict.fromkeys(place.artefact for place in experiment.positions):
        layout = experiment.layouts[artefact]
        every = np.arange(len(layout.names))
        makers = _plate_poses if _is_plate(experiment, artefact) else _bar_poses
        for words, plane, pose in makers(experiment, artefact):
            across = probes_across(experiment, artefact, plane)
            for probes in dict.fromkeys((across, tuple(experiment.probes))):
                group = ReadingGroup(probes, layout.names, every, 1)
                name = free_name(experiment, f"more {plane or ''}".strip())
                new = Position(name, artefact, pose, (group,))
                if not is_possible(experiment, new):
                    continue
                text = f"read {artefact} again {words}"
                if experiment.dimension == 3 and len(experiment.probes) > 1:
                    text += f", with {'probe' if len(probes) == 1 else 'probes'}"
                    text += f" {' and '.join(probes)}"
                yield Change(ChangeKind.READ, text, f"more {words}", new, seconds_of(new))


def _plate_poses(experiment: Experiment, artefact: str) -> Iterator[tuple[str, Axis | None, Pose]]:
    layout, d = experiment.layouts[artefact], experiment.dimension
    volume, step = experiment.machine.volume, pitch(layout)
    middle = middle_of(layout)[:d]
    for shift, turns in product(SHIFTS, NEW_TURNS):
        for level, plane in product(LEVELS if d == 3 else (0.5,), PLANES if d == 3 else PLANES[2:]):
            rotation = plane_rotation(plane, turns, d)
            origin = 0.5 * (volume.lower + volume.upper) + np.round(shift * step, 4)
            words = "in the middle of the volume"
            if shift:
                by = format_length(np.round(shift * step, 4))
                words = f"in the middle, shifted by {by} along both axes"
            if turns:
                words += f", turned by {90 * turns} deg"
            if d == 3:
                normal = AXIS_INDEX[plane]
                origin[normal] = volume.lower[normal] + level * volume.size[normal]
                words = f"in plane {plane} at {format_length(origin[normal])}, {words}"
            pose = Pose(rotation, cleaned(origin - rotation @ middle))
            yield words, plane if d == 3 else None, pose


def _bar_poses(experiment: Experiment, artefact: str) -> Iterator[tuple[str, Axis | None, Pose]]:
    """A bar in the middle of the volume, along axes and diagonals of planes and space."""
    if not isinstance(experiment.artefacts[artefact], TwoSpheresSettings):
        return
    volume, d = experiment.machine.volume, experiment.dimension
    middle = middle_of(experiment.layouts[artefact])[:d]
    for signs in product((1, 0, -1), repeat=d):
        # One of each pair of opposite directions.
        if next((sign for sign in signs if sign), -1) < 0:
            continue
        rotation = along_rotation(np.array(signs) / np.linalg.norm(signs))
        origin = np.round(0.5 * (volume.lower + volume.upper) - rotation @ middle, 5) + 0.0
        yield f"along {signs}, in the middle of the volume", None, Pose(rotation, origin)


def along_rotation(direction: Array) -> Array:
    """Return a rotation that lays the artefact's x axis in a direction (d,)."""
    if len(direction) == 2:
        return np.array([[direction[0], -direction[1]], [direction[1], direction[0]]])
    level = np.hypot(direction[0], direction[1])
    side = np.array([0.0, 1.0, 0.0])
    if level > 1e-9:
        side = np.array([-direction[1], direction[0], 0.0]) / level
    return np.column_stack([direction, side, np.cross(direction, side)])


def probes_across(experiment: Experiment, artefact: str, plane: Axis | None) -> tuple[str, ...]:
    """Return the probes that read the artefact in that plane, or those that reach across it, or the
    first.
    """
    for place in experiment.positions:
        across = plane_of(place.pose.rotation)
        if place.artefact == artefact and (plane is None or (across and across[0] == plane)):
            return place.probes
    normal = AXIS_INDEX[plane or "z"]
    reaching = [
        name
        for name, probe in experiment.probes.items()
        if abs(probe.offset[normal]) > 0.7 * float(np.linalg.norm(probe.offset))
    ]
    return tuple(reaching) or (next(iter(experiment.probes)),)


def pool_additions(experiment: Experiment) -> Iterator[Change]:
    """Candidates of the pool that the experiment does not have yet, within its limits."""
    pool = experiment.pool
    assert pool is not None
    drawn = {k for k, candidate in enumerate(pool.candidates) if candidate.drawn}
    for k, candidate in enumerate(pool.candidates):
        full = any(
            k in limit.members and len(drawn.intersection(limit.members)) >= limit.count
            for limit in pool.at_most
        )
        if candidate.drawn or full:
            continue
        words = f'add "{candidate.name}" of the pool ({duration(candidate.seconds)})'
        yield Change(
            ChangeKind.READ,
            words,
            f"candidate {k}",
            candidate.item,
            candidate.seconds,
            candidate=k,
        )


def duration(seconds: float) -> str:
    """Return a time in hours, or in minutes below one hour.

    >>> duration(5400), duration(90)
    ('1.5 h', '1.5 min')
    """
    return f"{seconds / 3600:.3g} h" if seconds >= 3600 else f"{seconds / 60:.3g} min"


def pitch(layout: BallLayout) -> float:
    """Return the usual distance of neighbouring balls along the artefact's x or y, in metres."""
    gaps: list[float] = []
    for axis in (0, 1):
        gap = np.diff(np.unique(np.round(layout.coordinates[:, axis], 9)))
        gaps += gap[gap > 1e-6].tolist()
    return float(np.round(np.median(gaps), 4)) if gaps else 0.1


def _is_plate(experiment: Experiment, artefact: str) -> bool:
    return experiment.artefacts[artefact].role == "plate"
