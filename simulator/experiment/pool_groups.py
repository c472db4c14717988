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
from ..design.objects import SLIGHTLY
from ..geometry.ball_layouts import BallLayout
from ..geometry.positions import (
    AXIS_INDEX,
    IN_PLANE_AXES,
    Axis,
    PlanePlacement,
    Pose,
    nominal_pose,
)
from ..inputs.messages import Steps
from ..inputs.number_arrays import Array
from ..inputs.quantities import length_text
from ..inputs.room_parts import Place, RoomPart, length_of, place_text
from ..inputs.yamltree import to_python, written
from .bounds import OUTSIDE, TOLERANCE, Bounds, edge_of, entered, limits_of, occupied, shared
from .model import Position, ReadingGroup
from .placements import check_turns
from .pool_sections import (
    GroupSettings,
    PlacesByAxisSettings,
    ProbesByPlaneSettings,
    RangeSettings,
    form_of_balls,
)

# Candidates of a pool, those dropped included.
MOST_CANDIDATES = 20_000

# Why a candidate is dropped that enters a forbidden box.
FORBIDDEN = "in a forbidden box"


# The pose at level and location 0, both (n, d) in metres, and why each candidate cannot be read;
# empty if it can.
_Rows = tuple[Pose, Array, list[str]]


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
    levels: Mapping[str, tuple[Place, ...]]
    anchor: Literal["corner", "centre"]
    places: Mapping[str, tuple[tuple[Place, Place], ...]]
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
    rows = {
        (plane, turn, k): _rows(group, plane, turn, balls, bounds, references)
        for plane in dict.fromkeys(group.planes)
        for turn in dict.fromkeys(group.turns)
        for k, balls in enumerate(group.balls)
    }
    candidate_count = sum(
        sum(reason == "" for reason in rows[plane, turn, k][probes][2])
        * len(probes)
        * len(balls.indices)
        for plane, turn, (k, balls) in product(group.planes, group.turns, enumerate(group.balls))
        for probes in group.probes[plane]
    )
    if not references.count_readings(candidate_count * group.repeats, steps):
        return None
    return list(_candidates(group, rows, references.dimension or 3))


def _rows(
    group: _Group, plane: Axis, turn: int, balls: _Balls, bounds: Bounds, references: References
) -> dict[tuple[str, ...], _Rows]:
    """Return by set of probes where the candidates of each level and location are."""
    d = references.dimension or 3
    at_zero = nominal_pose(
        PlanePlacement(plane, 0.0, group.anchor, (0.0, 0.0), turn), group.layout, d
    )
    all_places = [
        PlanePlacement(plane, level, group.anchor, at).places
        for level, at in product(group.levels[plane], group.places[plane])
    ]
    edge = edge_of(group.artefact, bounds, references)
    by_probes = {}
    for probes in group.probes[plane]:
        limits = limits_of(at_zero, group.layout, edge, [(balls.indices, probes)], bounds)
        room = shared(limits.values())
        points = np.array(
            [
                [length_of(places[axis], *room[:, k]) for axis, k in [*AXIS_INDEX.items()][:d]]
                for places in all_places
            ]
        )
        around = occupied(at_zero, group.layout, edge) + points[:, None, :]
        beyond = {FORBIDDEN: entered(around, bounds.forbidden).any(axis=-1)}
        for reason, (least, greatest) in limits.items():
            play = TOLERANCE + (reason == OUTSIDE) * SLIGHTLY * bounds.volume.size
            beyond[reason] = ((points < least - play) | (points > greatest + play)).any(axis=-1)
        reasons = np.full(len(points), "", dtype=object)
        for reason in dict.fromkeys((OUTSIDE, FORBIDDEN, *limits)):
            reasons[(reasons == "") & beyond[reason]] = reason
        by_probes[probes] = at_zero, points, reasons.tolist()
    return by_probes


def _candidates(
    group: _Group,
    rows: Mapping[tuple[Axis, int, int], Mapping[tuple[str, ...], _Rows]],
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
            at_axis = [at for _, at in sorted(zip(axes, place, strict=True))]
            where = f"{'at' if group.anchor == 'corner' else 'about'} {_both(*at_axis)}"
            name = (
                f"{group.prefix}{where}"
                if d == 2
                else f"{group.prefix}{plane} {place_text(level)} {where}"
            )
            for turn in group.turns:
                turned = f"{name} turn {turn}" if len(set(group.turns)) > 1 else name
                for probes, (k, balls) in product(group.probes[plane], enumerate(group.balls)):
                    at_zero, points, reasons = rows[plane, turn, k][probes]
                    full = (
                        f"{turned} {'+'.join(probes)}" if len(group.probes[plane]) > 1 else turned
                    )
                    full = f"{full} {balls.word}" if len(group.balls) > 1 else full
                    if reasons[row]:
                        yield Generated(full, None, plane, {}, reasons[row])
                        continue
                    pose = Pose(at_zero.rotation, at_zero.origin + points[row])
                    position = Position(full, group.artefact, pose, readings[probes, k])
                    lengths = dict(zip(AXIS_INDEX, map(length_text, points[row]), strict=False))
                    settings: dict[str, Any] = {"name": full}
                    settings |= {"artefact": group.artefact} if group.names_artefact else {}
                    settings |= {} if d == 2 else {"plane": plane, "level": lengths[plane]}
                    settings |= {group.anchor: {axis: lengths[axis] for axis in sorted(axes)}}
                    settings |= {"quarter_turns": turn} if turn else {}
                    settings |= {"probes": list(probes)} if group.names_probes else {}
                    settings |= {"balls": balls.written} if balls.written != "all" else {}
                    settings |= group.written
                    yield Generated(full, position, "" if d == 2 else plane, settings, "")


def _both(first: Place, second: Place) -> str:
    first_text, second_text = place_text(first), place_text(second)
    number, _, unit = first_text.partition(" ")
    return f"{number if second_text.endswith(f' {unit}') else first_text}, {second_text}"


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
) -> dict[str, tuple[Place, ...]]:
    if references.dimension == 2:
        return {"z": (0.0,)}
    text = 'missing; add "levels", the co-ordinates of the planes'
    if not references.require(settings.levels is not None, (*steps, "levels"), text):
        return {}
    if not isinstance(settings.levels, PlacesByAxisSettings):
        return dict.fromkeys(planes, _values(settings.levels))
    return _by_axis(settings.levels, planes, "a plane", (*steps, "levels"), references)


def _places(
    lengths: PlacesByAxisSettings, planes: Sequence[Axis], steps: Steps, references: References
) -> dict[str, tuple[tuple[Place, Place], ...]]:
    axes = sorted({axis for plane in planes for axis in IN_PLANE_AXES[plane]})
    places_by_axis = _by_axis(lengths, axes, "an axis of the planes", steps, references)
    if set(places_by_axis) != set(axes):
        return {}
    result: dict[str, tuple[tuple[Place, Place], ...]] = {}
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
    lengths: PlacesByAxisSettings,
    axes: Sequence[str],
    noun: str,
    steps: Steps,
    references: References,
) -> dict[str, tuple[Place, ...]]:
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


def _values(places: Any) -> tuple[Place, ...]:
    if not isinstance(places, RangeSettings):
        return places if isinstance(places, tuple) else (places,)
    first, last = (
        end.fraction if isinstance(end, RoomPart) else end for end in (places.from_, places.to)
    )
    steps = places.count - 1
    # The ends are exactly as stated, and values between them those that one would write.
    inner = [float(np.round(first + (last - first) * k / steps, 12)) for k in range(1, steps)]
    if isinstance(places.from_, RoomPart):
        return (places.from_, *(RoomPart(k, f"{100 * k:.9g} %") for k in inner), places.to)
    return (places.from_, *inner, places.to)


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
