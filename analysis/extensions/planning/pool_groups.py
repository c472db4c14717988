"""Groups of a pool: candidates for every combination of planes, levels, locations, turns
and probes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Literal, get_args

import numpy as np
from ballplate.simulator.design import SLIGHTLY
from ballplate.simulator.experiment import (
    OUTSIDE,
    TOLERANCE,
    Bounds,
    GroupSettings,
    PlacesByAxis,
    Position,
    RangeSettings,
    ReadingGroup,
    References,
    check_turns,
    edge_of,
    entered,
    extent,
    length_of,
    lengths_per_axis,
    limits_of,
    outline,
    shared,
)
from ballplate.simulator.geometry import (
    AXIS_INDEX,
    IN_PLANE_AXES,
    Axis,
    BallLayout,
    PlanePlacement,
    Pose,
    ball_coordinates,
    nominal_pose,
)
from ballplate.simulator.inputs import (
    Array,
    Place,
    RoomPart,
    Steps,
    length_text,
    place_text,
    to_python,
    written,
)

# Candidates of a pool, those dropped included.
MOST_CANDIDATES = 20_000

# Why a candidate is dropped that enters a forbidden box.
FORBIDDEN = "in a forbidden box"


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
class _Group:
    """A group with everything in it resolved; in two dimensions the only plane is z."""

    name: str | None
    artefact: str
    layout: BallLayout
    planes: tuple[Axis, ...]
    levels: tuple[Place, ...]
    anchor: Literal["corner", "centre"]
    places: Mapping[str, tuple[tuple[Place, Place], ...]]
    turns: tuple[int, ...]
    readings: tuple[ReadingGroup, ...]
    # What a file says of the artefact, of the probes if there are some, and of the readings.
    artefact_written: Mapping[str, Any]
    names_probes: bool
    readings_written: Mapping[str, Any]

    @property
    def count(self) -> int:
        places = sum(len(self.places[p]) for p in self.planes) * len(self.levels)
        return places * len(self.turns) * len(self.readings)


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
    generated = [
        candidate
        for plane in group.planes
        for candidate in _candidates(group, plane, bounds, references)
    ]
    readings = sum(one.position.count for one in generated if one.position is not None)
    return generated if references.count_readings(readings, steps) else None


def _rows(
    group: _Group,
    plane: Axis,
    turn: int,
    readings: ReadingGroup,
    bounds: Bounds,
    references: References,
) -> tuple[Pose, Array, list[str]]:
    """Return the pose at level and location 0, the origins (n, d) of all levels and locations, and
    why each candidate cannot be read; empty if it can.
    """
    d = references.dimension or 3
    at_zero = nominal_pose(
        PlanePlacement(plane, 0.0, group.anchor, (0.0, 0.0), turn), group.layout, d
    )
    edge = edge_of(group.artefact, bounds, references)
    read = [(readings.ball_indices, readings.probes)]
    balls = ball_coordinates(at_zero, group.layout)
    limits = limits_of(at_zero, group.layout, balls, edge, read, bounds)
    room = shared(limits.values())
    points = np.array(
        [
            [length_of(places[axis], *room[:, k]) for axis, k in [*AXIS_INDEX.items()][:d]]
            for level, at in product(group.levels, group.places[plane])
            for places in [PlanePlacement(plane, level, group.anchor, at).places]
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
    return at_zero, points, reasons.tolist()


def _candidates(
    group: _Group, plane: Axis, bounds: Bounds, references: References
) -> Iterator[Generated]:
    axes, is_flat = IN_PLANE_AXES[plane], references.dimension == 2
    choices = [*product(group.turns, group.readings)]
    rows = [_rows(group, plane, *choice, bounds, references) for choice in choices]
    for row, (level, place) in enumerate(product(group.levels, group.places[plane])):
        at_axis = [at for _, at in sorted(zip(axes, place, strict=True))]
        where = f"{'at' if group.anchor == 'corner' else 'about'} {_both(*at_axis)}"
        words = [group.name, *([] if is_flat else [plane, place_text(level)]), where]
        for (turn, readings), (at_zero, points, reasons) in zip(choices, rows, strict=True):
            turned = [f"turn {turn}"] if len(set(group.turns)) > 1 else []
            read = ["+".join(readings.probes)] if len(group.readings) > 1 else []
            name = " ".join(filter(None, [*words, *turned, *read]))
            if reasons[row]:
                yield Generated(name, None, plane, {}, reasons[row])
                continue
            pose = Pose(at_zero.rotation, at_zero.origin + points[row])
            lengths = dict(zip(AXIS_INDEX, map(length_text, points[row]), strict=False))
            settings = {
                "name": name,
                **group.artefact_written,
                **({} if is_flat else {"plane": plane, "level": lengths[plane]}),
                group.anchor: {axis: lengths[axis] for axis in sorted(axes)},
                **({"quarter_turns": turn} if turn else {}),
                **({"probes": list(readings.probes)} if group.names_probes else {}),
                **group.readings_written,
            }
            position = Position(name, group.artefact, pose, (readings,))
            yield Generated(name, position, "" if is_flat else plane, settings, "")


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
    levels = _levels(settings, steps, references)
    anchor: Literal["corner", "centre"] = "centre" if settings.corners is None else "corner"
    lengths = settings.centres if settings.corners is None else settings.corners
    assert lengths is not None
    places = _places(lengths, planes, (*steps, f"{anchor}s"), references)
    probes = _probes(settings.probes, steps, references)
    uncertainty, _ = lengths_per_axis(
        settings.standard_uncertainty, (*steps, "standard_uncertainty"), references
    )
    if artefact is None or layout is None:
        return None
    balls = references.balls(settings.balls, layout, (*steps, "balls"))
    turns = settings.quarter_turns
    is_list = isinstance(turns, tuple)
    turns = turns if isinstance(turns, tuple) else (turns,)
    for k, turn in enumerate(turns):
        check_turns(turn, (*steps, "quarter_turns", *((k,) if is_list else ())), references)
    if balls is None or not probes or len(references.problems.messages) > before:
        return None
    names = tuple(layout.names[i] for i in balls)
    root = references.problems.root
    said: dict[str, Any] = {}
    if settings.balls != "all":
        said["balls"] = list(names)
    if settings.repeats != 1:
        said["repeats"] = settings.repeats
    if uncertainty is not None:
        said["standard_uncertainty"] = to_python(written(root, *steps, "standard_uncertainty"))  # type: ignore[arg-type]
    return _Group(
        settings.name,
        artefact,
        layout,
        planes,
        levels,
        anchor,
        places,
        turns,
        tuple(ReadingGroup(each, names, balls, settings.repeats, uncertainty) for each in probes),
        {"artefact": artefact} if len(references.artefact_names) > 1 else {},
        written(root, "probes") is not None,
        said,
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


def _levels(settings: GroupSettings, steps: Steps, references: References) -> tuple[Place, ...]:
    if references.dimension == 2:
        return (0.0,)
    text = 'missing; add "levels", the co-ordinates of the planes'
    if not references.require(settings.levels is not None, (*steps, "levels"), text):
        return ()
    return _values(settings.levels)


def _places(
    lengths: PlacesByAxis, planes: Sequence[Axis], steps: Steps, references: References
) -> dict[str, tuple[tuple[Place, Place], ...]]:
    axes = sorted({axis for plane in planes for axis in IN_PLANE_AXES[plane]})
    places_by_axis = _by_axis(lengths, axes, steps, references)
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
    lengths: PlacesByAxis,
    axes: Sequence[str],
    steps: Steps,
    references: References,
) -> dict[str, tuple[Place, ...]]:
    by_axis = {}
    for axis in get_args(Axis):
        value = lengths.get(axis)
        if value is not None and axis not in axes:
            references.problems.add(
                (*steps, axis),
                "is not an axis of the planes; remove it, or add to planes",
                of_key=True,
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


def _probes(stated: Any, steps: Steps, references: References) -> tuple[tuple[str, ...], ...]:
    """Return the sets of probes to choose from, or report faults."""
    if stated is None or isinstance(stated[0], str):
        names = references.probe_names(stated, steps)
        return () if names is None else (names,)
    for k, names in enumerate(stated):
        references.are_probes(names, (*steps, "probes", k))
    return tuple(stated)


def occupied(pose: Pose, layout: BallLayout, edge: float | None) -> Array:
    """Return the lowest and the highest co-ordinates (2, d) of an artefact's balls, and with an
    `edge` of the plate.
    """
    balls = extent(ball_coordinates(pose, layout))
    return balls if edge is None else extent(np.vstack([balls, outline(pose, layout, edge)]))
