"""Groups of a pool: candidates for every combination of planes, levels, locations, turns, probes
and balls.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Literal

import numpy as np

from ..design.lookup import Indices, References, lengths_per_axis
from ..design.objects import Volume
from ..geometry.ball_layouts import BallLayout
from ..geometry.positions import (
    AXIS_INDEX,
    IN_PLANE_AXES,
    Axis,
    PlanePlacement,
    Pose,
    ball_coordinates,
    corners,
    nominal_pose,
)
from ..inputs.messages import Steps
from ..inputs.number_arrays import Array
from ..inputs.quantities import length_text, typed_length
from ..inputs.yamltree import to_python, written
from .model import Position, Probe, ReadingGroup
from .placements import check_turns
from .pool_sections import (
    GroupSettings,
    LengthsByAxisSettings,
    ProbesByPlaneSettings,
    RangeSettings,
    form_of_balls,
)

# Candidates of a pool, those dropped included.
MOST_CANDIDATES = 20_000

TOLERANCE = 1e-9

# Why a candidate is dropped that enters a forbidden box.
FORBIDDEN = "in a forbidden box"


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


@dataclass(frozen=True, eq=False)
class Generated:
    """A candidate of a group that can be read, or with a reason instead of a position why it
    cannot.
    """

    name: str
    position: Position | None
    plane: str
    settings: Mapping[str, Any]
    reason: str


@dataclass(frozen=True, eq=False)
class _Balls:
    word: str
    names: tuple[str, ...]
    indices: Indices
    written: Any


@dataclass(frozen=True, eq=False)
class _Group:
    """A group with everything in it resolved, by plane; in two dimensions the only plane is z."""

    artefact: str
    layout: BallLayout
    prefix: str
    planes: tuple[Axis, ...]
    levels: Mapping[str, tuple[float, ...]]
    anchor: Literal["corner", "centre"]
    places: Mapping[str, tuple[tuple[float, float], ...]]
    turns: tuple[int, ...]
    probes: Mapping[str, tuple[tuple[str, ...], ...]]
    balls: tuple[_Balls, ...]
    repeats: int
    uncertainty: Array | None
    names_artefact: bool
    names_probes: bool
    # What a file says of the readings besides probes and balls.
    written: Mapping[str, Any]

    @property
    def count(self) -> int:
        of_planes = (
            len(self.levels[p]) * len(self.places[p]) * len(self.probes[p]) for p in self.planes
        )
        return sum(of_planes) * len(self.turns) * len(self.balls)


def generate(
    settings: GroupSettings, steps: Steps, bounds: Bounds | None, count: int, references: References
) -> list[Generated] | None:
    """Return the candidates of a group, after `count` earlier ones, or report faults."""
    group = _resolve(settings, steps, references)
    if group is None:
        return None
    text = (
        f"there are {count + group.count} candidates up to here; at most {MOST_CANDIDATES} are"
        " possible"
    )
    if (
        not references.require(count + group.count <= MOST_CANDIDATES, steps, text)
        or bounds is None
    ):
        return None
    reasons = {
        (plane, turn, k): _reasons(group, plane, turn, balls, bounds, references)
        for plane in dict.fromkeys(group.planes)
        for turn in dict.fromkeys(group.turns)
        for k, balls in enumerate(group.balls)
    }
    candidate_count = sum(
        sum(reason == "" for reason in reasons[plane, turn, k][probes])
        * len(probes)
        * len(balls.indices)
        for plane, turn, (k, balls) in product(group.planes, group.turns, enumerate(group.balls))
        for probes in group.probes[plane]
    )
    if not references.count_readings(candidate_count * group.repeats, steps):
        return None
    return list(_candidates(group, reasons, references.dimension or 3))


def extent(points: Array) -> Array:
    """Return the lowest and the highest co-ordinates (2, d) of points (n, d)."""
    return np.array([points.min(axis=0), points.max(axis=0)])


def outline(pose: Pose, layout: BallLayout, edge: float) -> Array:
    """Return the lowest and the highest co-ordinates (2, d) of a plate with `edge` of material
    beyond its balls.
    """
    return extent(corners(pose, layout, edge))


def is_within(indices: Array, lower: Array, upper: Array) -> Any:
    """True if extents (…, 2, d) are within limits (d,)."""
    return np.all(
        (indices[..., 0, :] >= lower - TOLERANCE) & (indices[..., 1, :] <= upper + TOLERANCE),
        axis=-1,
    )


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


def _reasons(
    group: _Group, plane: Axis, turn: int, balls: _Balls, bounds: Bounds, references: References
) -> dict[tuple[str, ...], list[str]]:
    """Return by set of probes, for each level and location, why a candidate cannot be read; empty
    if it can.
    """
    d = references.dimension or 3
    at_zero = nominal_pose(
        PlanePlacement(plane, 0.0, group.anchor, (0.0, 0.0), turn), group.layout, d
    )
    shifts = np.zeros((len(group.levels[plane]) * len(group.places[plane]), d))
    pairs = list(product(group.levels[plane], group.places[plane]))
    first, second = (AXIS_INDEX[axis] for axis in IN_PLANE_AXES[plane])
    shifts[:, [first, second]] = [place for _, place in pairs]
    if d == 3:
        shifts[:, AXIS_INDEX[plane]] = [level for level, _ in pairs]
    extents = extent(ball_coordinates(at_zero, group.layout)[balls.indices]) + shifts[:, None, :]
    reasons = np.full(len(shifts), "", dtype=object)
    edge = bounds.edge if references.artefacts[group.artefact].role == "plate" else None
    if edge is not None:
        around = outline(at_zero, group.layout, edge) + shifts[:, None, :]
        beyond = ~is_within(around, bounds.volume.lower, bounds.volume.upper)
        reasons[beyond] = "edge outside the volume"
    around = occupied(at_zero, group.layout, edge) + shifts[:, None, :]
    reasons[entered(around, bounds.forbidden).any(axis=-1)] = FORBIDDEN
    by_probes = {}
    for probes in group.probes[plane]:
        of_probe = reasons.copy()
        for offset in (
            bounds.probes[of_probe].offset for of_probe in probes if of_probe in bounds.probes
        ):
            of_probe[~is_within(extents - offset, *bounds.volume.of_readings)] = (
                "outside the volume"
            )
        for probe in probes:
            if probe in bounds.reach:
                of_probe[(of_probe == "") & ~is_within(extents, *bounds.reach[probe])] = (
                    f"out of reach of probe {probe}"
                )
        by_probes[probes] = of_probe.tolist()
    return by_probes


def _candidates(
    group: _Group,
    reasons: Mapping[tuple[Axis, int, int], Mapping[tuple[str, ...], list[str]]],
    d: int,
) -> Iterator[Generated]:
    readings = {
        (probes, k): (
            ReadingGroup(probes, balls.names, balls.indices, group.repeats, group.uncertainty),
        )
        for plane in group.planes
        for probes in group.probes[plane]
        for k, balls in enumerate(group.balls)
    }
    for plane in group.planes:
        axes = IN_PLANE_AXES[plane]
        for row, (level, place) in enumerate(product(group.levels[plane], group.places[plane])):
            at_axis = {axis: length for axis, length in sorted(zip(axes, place, strict=True))}
            where = f"{'at' if group.anchor == 'corner' else 'about'} {_both(*at_axis.values())}"
            name = (
                f"{group.prefix}{where}"
                if d == 2
                else f"{group.prefix}{plane} {typed_length(level)} {where}"
            )
            placed: dict[str, Any] = {} if d == 2 else {"plane": plane, "level": length_text(level)}
            placed[group.anchor] = {axis: length_text(length) for axis, length in at_axis.items()}
            for turn in group.turns:
                pose = None
                turned = f"{name} turn {turn}" if len(set(group.turns)) > 1 else name
                for probes, (k, balls) in product(group.probes[plane], enumerate(group.balls)):
                    reason = reasons[plane, turn, k][probes][row]
                    full = (
                        f"{turned} {'+'.join(probes)}" if len(group.probes[plane]) > 1 else turned
                    )
                    full = f"{full} {balls.word}" if len(group.balls) > 1 else full
                    if reason:
                        yield Generated(full, None, plane, {}, reason)
                        continue
                    pose = pose or nominal_pose(
                        PlanePlacement(plane, level, group.anchor, place, turn), group.layout, d
                    )
                    position = Position(full, group.artefact, pose, readings[probes, k])
                    settings: dict[str, Any] = {"name": full}
                    settings |= {"artefact": group.artefact} if group.names_artefact else {}
                    settings |= placed
                    settings |= {"quarter_turns": turn} if turn else {}
                    settings |= {"probes": list(probes)} if group.names_probes else {}
                    settings |= {"balls": balls.written} if balls.written != "all" else {}
                    settings |= group.written
                    yield Generated(full, position, "" if d == 2 else plane, settings, "")


def _both(first: float, second: float) -> str:
    first_length, second_length = typed_length(first), typed_length(second)
    number, _, unit = first_length.partition(" ")
    return f"{number if second_length.endswith(f' {unit}') else first_length}, {second_length}"


def _resolve(settings: GroupSettings, steps: Steps, references: References) -> _Group | None:
    before = len(references.problems.messages)
    artefact = references.artefact(settings.artefact, steps)
    layout = references.layouts.get(artefact) if artefact is not None else None
    planes = _planes(settings, steps, references)
    if planes is None:
        return None
    levels = _levels(settings, planes, steps, references)
    anchor: Literal["corner", "centre"] = "centre" if settings.corners is None else "corner"
    lengths = settings.centres if settings.corners is None else settings.corners
    assert lengths is not None
    places = _places(lengths, planes, (*steps, f"{anchor}s"), references)
    probes = _probes(settings, planes, steps, references)
    uncertainty, _ = lengths_per_axis(
        settings.standard_uncertainty, (*steps, "standard_uncertainty"), references
    )
    balls = _balls(settings, layout, (*steps, "balls"), references) if layout is not None else ()
    if artefact is None or layout is None or len(references.problems.messages) > before:
        return None
    if set(planes) - probes.keys():
        # Whoever names no probes is told where these are missing.
        return None
    is_list = isinstance(settings.quarter_turns, tuple)
    turns = (
        settings.quarter_turns
        if isinstance(settings.quarter_turns, tuple)
        else (settings.quarter_turns,)
    )
    for k, turn in enumerate(turns):
        check_turns(turn, (*steps, "quarter_turns", *((k,) if is_list else ())), references)
    if len(references.problems.messages) > before:
        return None
    repeats: dict[str, Any] = {"repeats": settings.repeats} if settings.repeats != 1 else {}
    if uncertainty is not None:
        node = written(references.problems.root, *steps, "standard_uncertainty")
        assert node is not None
        repeats["standard_uncertainty"] = to_python(node)
    prefix = "" if settings.name is None else f"{settings.name} "
    return _Group(
        artefact,
        layout,
        prefix,
        planes,
        levels,
        anchor,
        places,
        turns,
        probes,
        balls,
        settings.repeats,
        uncertainty,
        len(references.artefact_names) > 1,
        written(references.problems.root, "probes") is not None,
        repeats,
    )


def _planes(
    settings: GroupSettings, steps: Steps, references: References
) -> tuple[Axis, ...] | None:
    if references.dimension is None:
        return None
    if references.dimension == 2:
        for key in ("planes", "levels"):
            if getattr(settings, key) is not None:
                references.refuse_in_plane(*steps, key)
        return ("z",)
    text = 'missing; add "planes", such as [x, y, z]'
    if not references.require(settings.planes is not None, (*steps, "planes"), text):
        return None
    return settings.planes


def _levels(
    settings: GroupSettings, planes: Sequence[Axis], steps: Steps, references: References
) -> dict[str, tuple[float, ...]]:
    if references.dimension == 2:
        return {"z": (0.0,)}
    text = 'missing; add "levels", the co-ordinates of the planes'
    if not references.require(settings.levels is not None, (*steps, "levels"), text):
        return {}
    if not isinstance(settings.levels, LengthsByAxisSettings):
        return dict.fromkeys(planes, _values(settings.levels))
    return _by_axis(settings.levels, planes, "a plane", (*steps, "levels"), references)


def _places(
    lengths: LengthsByAxisSettings, planes: Sequence[Axis], steps: Steps, references: References
) -> dict[str, tuple[tuple[float, float], ...]]:
    axes = sorted({axis for plane in planes for axis in IN_PLANE_AXES[plane]})
    places_by_axis = _by_axis(lengths, axes, "an axis of the planes", steps, references)
    if set(places_by_axis) != set(axes):
        return {}
    result: dict[str, tuple[tuple[float, float], ...]] = {}
    for plane in planes:
        first, second = IN_PLANE_AXES[plane]
        # A grid so fine that it is refused need not be made.
        count = len(places_by_axis[first]) * len(places_by_axis[second])
        if count > MOST_CANDIDATES:
            text = f"{count} locations are too many; at most {MOST_CANDIDATES} are possible"
            references.problems.add(steps, text)
            return {}
        result[plane] = tuple(product(places_by_axis[first], places_by_axis[second]))
        if first > second:
            result[plane] = tuple(
                (a, b) for b, a in product(places_by_axis[second], places_by_axis[first])
            )
    return result


def _by_axis(
    lengths: LengthsByAxisSettings,
    axes: Sequence[str],
    noun: str,
    steps: Steps,
    references: References,
) -> dict[str, tuple[float, ...]]:
    by_axis = {}
    for axis in AXIS_INDEX:
        value = getattr(lengths, axis)
        if value is not None and axis not in axes:
            references.problems.add(
                (*steps, axis), f"is not {noun}; remove it, or add to planes", of_key=True
            )
        elif value is not None:
            by_axis[axis] = _values(value)
        elif axis in axes:
            references.problems.add((*steps, axis), f'missing; add "{axis}"')
    return by_axis


def _values(lengths: Any) -> tuple[float, ...]:
    if isinstance(lengths, RangeSettings):
        last, spread = lengths.count - 1, lengths.to - lengths.from_
        # The ends are exactly as stated, and values between them those that one would write.
        inner = [float(np.round(lengths.from_ + spread * k / last, 12)) for k in range(1, last)]
        return (lengths.from_, *inner, lengths.to)
    return lengths if isinstance(lengths, tuple) else (lengths,)


def _probes(
    settings: GroupSettings, planes: Sequence[Axis], steps: Steps, references: References
) -> dict[str, tuple[tuple[str, ...], ...]]:
    stated, where = settings.probes, (*steps, "probes")
    if stated is None:
        names = references.probe_names(None, steps)
        return {} if names is None else dict.fromkeys(planes, (names,))
    if not isinstance(stated, ProbesByPlaneSettings):
        return dict.fromkeys(planes, _sets(stated, where, references))
    if references.dimension == 2:
        references.problems.add(where, "has no planes in two dimensions; list the probes")
        return {}
    sets = {}
    for plane in AXIS_INDEX:
        value = getattr(stated, plane)
        if value is not None and plane not in planes:
            text = "is not among the planes; remove it, or add it to planes"
            references.problems.add((*where, plane), text, of_key=True)
        elif value is not None:
            sets[plane] = _sets(value, (*where, plane), references)
        elif plane in planes:
            references.problems.add((*where, plane), f'missing; add "{plane}"')
    return sets


def _sets(value: Any, steps: Steps, references: References) -> tuple[tuple[str, ...], ...]:
    if isinstance(value[0], str):
        references.are_probes(value, steps)
        return (value,)
    for k, names in enumerate(value):
        references.are_probes(names, (*steps, k))
    return tuple(value)


def _balls(
    settings: GroupSettings, layout: BallLayout, steps: Steps, references: References
) -> tuple[_Balls, ...]:
    entries: Any = settings.balls
    is_several = form_of_balls(entries) == "<sets>"
    ball_sets = []
    for k, entry in enumerate(entries if is_several else (entries,)):
        where = (*steps, k) if is_several else steps
        indices = references.balls(entry, layout, where)
        if indices is None:
            continue
        names = tuple(layout.names[i] for i in indices)
        word = (
            "all balls" if entry == "all" else "corners" if entry == "corners" else f"set {k + 1}"
        )
        ball_sets.append(_Balls(word, names, indices, "all" if entry == "all" else list(names)))
    return tuple(ball_sets)
