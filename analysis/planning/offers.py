"""What can be changed of any experiment: its positions, probes, calibration, artefacts and model, and its pool."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from simulator.experiment.model import (
    CoordinateCalibration,
    DistanceCalibration,
    Experiment,
    Indices,
    Position,
    RadiusCalibration,
    ReadingGroup,
)
from simulator.experiment.pool import Pool
from simulator.geometry.artefacts import (
    BallLayout,
    BryanGaugeSettings,
    GridSettings,
    SquareSettings,
    TwoSpheresSettings,
    pairs,
)
from simulator.geometry.positions import AXIS_INDEX, QUARTER_TURNS, Axis, Pose
from simulator.machines.protocol import Array
from simulator.machines.settings import EmpiricalSettings, KinematicSettings, MachineFileSettings, SplineSettings
from simulator.quantities import LengthFunction, format_length

from ..bar_cures import bar_directions
from .changes import (
    Change,
    Kind,
    count_readings,
    distances,
    further,
    is_inside,
    moved,
    pair_set,
    probes_of,
    with_artefact,
    with_calibration,
    with_further,
    with_pose,
    with_position,
    with_repeats,
)
from .written import plane_of, plane_rotation

AXES = "xyz"
PLANES: tuple[Axis, ...] = ("x", "y", "z")
TURNS = {1: "one quarter-turn", 2: "half a turn", 3: "three quarter-turns"}
# Where a further position may be along the normal of its plane, in fractions of the volume.
LEVELS = (0.25, 0.75, 0.5)
# Offset of a probe that is to be added where the experiment's own have none.
TIP = 0.05
# What readings with it count for, as it has to be made.
NEW_TIP = 1.5
# More balls a side, and fewer coefficients, than this are not tried.
MOST_BALLS_MORE, MOST_COEFFICIENTS_LESS = 6, 6
TIMES = (2, 4, 9)
# Distances between two balls of a line.
MOST_DISTANCES = 200

Generator = Callable[[Experiment], Iterator[Change]]


def offers(experiment: Experiment, is_deficient: bool = True) -> dict[Kind, list[Change]]:
    """Changes that stay within the volume, by kind; additions are those of the pool where the experiment has one.

    What only makes observations more certain is offered where none is missing.
    """
    makers: list[tuple[Kind, Generator]] = [(Kind.MOVE, moves), (Kind.READ_MORE, more_readings)]
    if not is_deficient:
        makers += [(Kind.READ_MORE, repeats), (Kind.CERTIFICATE, better_certificates)]
    if experiment.pool is not None:
        makers.append((Kind.POOL, pool_additions))
    else:
        makers += [(Kind.CERTIFICATE, certificates), (Kind.ADD_POSITION, positions)]
    makers += [(Kind.ARTEFACT, more_balls), (Kind.MODEL, fewer_coefficients)]
    found: dict[Kind, list[Change]] = {kind: [] for kind, _ in sorted(makers, key=lambda one: one[0])}
    for kind, maker in makers:
        found[kind] += maker(experiment)
    return {kind: sorted(changes, key=lambda one: one.cost) for kind, changes in found.items()}


def pool_additions(experiment: Experiment) -> Iterator[Change]:
    """Candidates of the pool that the experiment does not have yet, the cheapest first."""
    pool = experiment.pool
    assert pool is not None
    order = sorted(range(len(pool.candidates)), key=lambda k: pool.candidates[k].seconds)
    for k in order:
        one = pool.candidates[k]
        if one.drawn or not allowed(pool, (k,)):
            continue
        add = (
            partial(with_position, position=one.item)
            if isinstance(one.item, Position)
            else partial(with_calibration, item=one.item)
        )
        words = f'add "{one.name}" of the pool ({duration(one.seconds)})'
        yield Change(Kind.POOL, words, one.seconds, frozenset({f"candidate {k}"}), add, one.item, candidate=k)


def allowed(pool: Pool, chosen: tuple[int, ...]) -> bool:
    """Whether the pool's limits allow candidates beside those that are drawn."""
    own = {k for k, one in enumerate(pool.candidates) if one.drawn} | set(chosen)
    return all(len(own & set(limit.members)) <= limit.count for limit in pool.at_most)


def duration(seconds: float) -> str:
    """A time in hours, or in minutes where it is less than one.

    >>> duration(5400), duration(90)
    ('1.5 h', '1.5 min')
    """
    return f"{seconds / 3600:.3g} h" if seconds >= 3600 else f"{seconds / 60:.3g} min"


def moves(experiment: Experiment) -> Iterator[Change]:
    """Positions that are read anyway, turned, shifted or laid otherwise."""
    volume = experiment.machine.volume
    for place in experiment.positions:
        layout = experiment.layouts[place.artefact]
        for words, pose in (*_turned(experiment, place), *_shifted(experiment, place), *_laid(experiment, place)):
            new = moved(place, *pose)
            if is_inside(new, layout, volume):
                told = words.format(f'position "{place.name}"')
                apply = partial(with_pose, name=place.name, pose=new.pose)
                yield Change(Kind.MOVE, told, 0.0, frozenset({f"position {place.name}"}), apply)


def _turned(experiment: Experiment, place: Position) -> Iterator[tuple[str, tuple[Array, Array]]]:
    """Turned about the middle of the balls, in their own plane."""
    layout, pose, d = experiment.layouts[place.artefact], place.pose, experiment.dimension
    if not _is_plate(experiment, place.artefact) or len(layout.names) < 2:
        return
    middle = _middle(layout)[:d]
    for turns, words in TURNS.items():
        turn = np.eye(d)
        turn[:2, :2] = QUARTER_TURNS[turns]
        rotation = pose.rotation @ turn + 0.0
        centre = pose.rotation @ middle + pose.origin
        yield f"turn {{}} by {words}", (rotation, _clean(centre - rotation @ middle))


def _shifted(experiment: Experiment, place: Position) -> Iterator[tuple[str, tuple[Array, Array]]]:
    if not _is_plate(experiment, place.artefact):
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
            yield words, (place.pose.rotation.copy(), _clean(place.pose.origin + by))


def _laid(experiment: Experiment, place: Position) -> Iterator[tuple[str, tuple[Array, Array]]]:
    """A bar in other directions, about its middle."""
    if not isinstance(experiment.artefacts[place.artefact], TwoSpheresSettings):
        return
    middle = _middle(experiment.layouts[place.artefact])[: experiment.dimension]
    centre = place.pose.rotation @ middle + place.pose.origin
    for words, along in _bars(experiment.dimension):
        rotation = _along(along)
        if np.abs(rotation[:, 0] - place.pose.rotation[:, 0]).max() > 1e-9:
            yield f"lay the bar of {{}} {words}", (rotation, np.round(centre - rotation @ middle, 5) + 0.0)


def more_readings(experiment: Experiment) -> Iterator[Change]:
    """Positions read with further probes, those there are and, where they lie on one line, new ones."""
    tips = new_tips(experiment)
    for name, offset in {**experiment.probes, **tips}.items():
        for place in experiment.positions:
            if name in probes_of(place) or not _is_plate(experiment, place.artefact) or experiment.dimension == 2:
                continue
            more = further(place, name)
            cost = float(count_readings([more]))
            words = f'read position "{place.name}" with probe {name} too'
            if name in tips:
                # A stylus has to be made.
                cost *= NEW_TIP
                words = f'read position "{place.name}" with a new probe too, {_tip_words(name, offset)}'
            new = {name: offset} if name in tips else {}
            apply = partial(with_further, name=place.name, more=more, probes=new)
            touched = frozenset({f"position {place.name} with {name}"})
            yield Change(Kind.READ_MORE, words, cost, touched, apply, more, place.name)


def repeats(experiment: Experiment) -> Iterator[Change]:
    """Positions read several times."""
    for times in TIMES:
        for place in experiment.positions:
            words = f'read position "{place.name}" {times} times'
            cost = float((times - 1) * count_readings([place]))
            touched = frozenset(f"position {place.name} with {name}" for name in experiment.probes)
            apply = partial(with_repeats, name=place.name, times=times)
            yield Change(Kind.READ_MORE, words, cost, touched, apply)


def new_tips(experiment: Experiment) -> dict[str, Array]:
    """Offsets opposite and perpendicular to those there are, where all of them lie on one line."""
    if experiment.dimension == 2 or experiment.offset_uncertainties:
        return {}
    offsets = np.array(list(experiment.probes.values()))
    values = np.linalg.svd(offsets - offsets.mean(axis=0), compute_uv=False)
    if len(values) > 1 and values[1] > 1e-6:
        return {}
    size = float(np.linalg.norm(offsets, axis=1).max(initial=0.0)) or TIP
    tips: dict[str, Array] = {}
    for sign, axis in product((1.0, -1.0), range(3)):
        offset = np.zeros(3)
        offset[axis] = sign * size
        if np.linalg.norm(offsets - offset, axis=1).min() > 0.1 * size:
            name = f"{'minus ' if sign < 0 else ''}{AXES[axis]}"
            while name in experiment.probes:
                name += " new"
            tips[name] = offset
    return tips


def _tip_words(name: str, offset: Array) -> str:
    return f"{name}, its offset ({', '.join(format_length(v).removesuffix(' mm') for v in offset)}) mm"


def certificates(experiment: Experiment) -> Iterator[Change]:
    """Distances of plates and lengths of bars and gauges that are not calibrated yet."""
    for name, settings in experiment.artefacts.items():
        layout = experiment.layouts[name]
        if isinstance(settings, BryanGaugeSettings):
            if not any(item.artefact == name for item in experiment.calibration):
                u = float(experiment.machine.repeatability.min())
                radius = RadiusCalibration(name, settings.radius, u)
                add = partial(with_calibration, item=radius)
                words = f"calibrate the radius of {name} to {format_length(u)}"
                yield Change(Kind.CERTIFICATE, words, 1.0, frozenset({f"length of {name}"}), add)
            continue
        if settings.role != "plate" and not isinstance(settings, TwoSpheresSettings):
            continue
        known = [item for item in experiment.calibration if item.artefact == name]
        if settings.role != "plate" and known:
            continue
        like = like_distances(experiment, name)
        calibrated = {
            frozenset(pair) for item in known if isinstance(item, DistanceCalibration) for pair in item.pairs.tolist()
        }
        for words, chosen in natural_distances(layout):
            if any(frozenset(pair) not in calibrated for pair in chosen.tolist()):
                new = distances(like, layout, chosen)
                yield calibrated_distances(name, words, new)


def better_certificates(experiment: Experiment) -> Iterator[Change]:
    """Calibration with smaller uncertainties."""
    for k, item in enumerate(experiment.calibration):
        for factor in (0.5, 0.1):
            better, words = _better(item, factor)
            layout = experiment.layouts[item.artefact]
            what = "radius" if isinstance(item, RadiusCalibration) else "co-ordinates"
            if isinstance(item, DistanceCalibration):
                what = f"distances ({pair_set(layout, item.pairs) or len(item.pairs)})"
            told = f"calibrate the {what} of {item.artefact} to {words} ({factor:g} times the standard uncertainty)"
            apply = partial(_with_better, k=k, item=better)
            yield Change(Kind.CERTIFICATE, told, 1.0 / factor, frozenset({f"calibration {k}"}), apply)


def calibrated_distances(artefact: str, words: str, item: DistanceCalibration) -> Change:
    """The change of calibrating distances."""
    u = length_words(item.standard_uncertainty)
    told = f"calibrate the {words.replace('{}', artefact)} to {u}"
    touched = frozenset(f"distance {artefact} {min(pair)} {max(pair)}" for pair in item.pairs.tolist())
    return Change(Kind.CERTIFICATE, told, float(len(item.pairs)), touched, partial(with_calibration, item=item), item)


def like_distances(experiment: Experiment, artefact: str) -> DistanceCalibration:
    """Distances of an artefact, none yet, as certain as others of it, or else as readings."""
    own = [c for c in experiment.calibration if isinstance(c, DistanceCalibration) and c.artefact == artefact]
    uncertainty = own[0].standard_uncertainty if own else LengthFunction(float(experiment.machine.repeatability.min()))
    none, no_pairs = np.zeros(0), np.zeros((0, 2), np.intp)
    dimensions: Any = 2 if experiment.dimension == 2 else 3
    return DistanceCalibration(artefact, no_pairs, dimensions, none, False, uncertainty, none, "distance", "included")


def natural_distances(layout: BallLayout) -> Iterator[tuple[str, Indices]]:
    """Words and pairs (m, 2) of single distances along the edges, diagonals and rows, and of sets of them."""
    n = len(layout.names)
    if n < 2:
        return
    if n == 2:
        yield "distance of its balls on {}", np.array([[0, 1]], np.intp)
        return
    singles = [pair for name in ("corner sides", "corner diagonals") for pair in layout.pair_sets.get(name, ())]
    if not layout.pair_sets:
        far = np.linalg.norm(layout.coordinates[:, None] - layout.coordinates[None], axis=2)
        order = np.argsort(-far[np.triu_indices(n, 1)], kind="stable")[:10]
        singles = [(int(i), int(j)) for i, j in np.column_stack(np.triu_indices(n, 1))[order]]
    singles += row_pairs(layout)
    for pair in dict.fromkeys(singles):
        yield f"distance {distance_words(layout, pair)} of {{}}", np.array([pair], np.intp)
    for name, words in (
        ("corner sides", "four sides of {}"),
        ("corner diagonals", "two diagonals of {}"),
        ("neighbours", "distances between neighbours on {}"),
        ("braced", "braced net of distances on {}"),
    ):
        if name in layout.pair_sets:
            yield f"{words} ({len(layout.pair_sets[name])})", pairs(layout, name)


def row_pairs(layout: BallLayout) -> list[tuple[int, int]]:
    """Balls on the same line along x or y as an outer ball of it, no more than `MOST_DISTANCES`, evenly from all."""
    found = []
    xy = np.round(layout.coordinates[:, :2], 9)
    for across, along in ((1, 0), (0, 1)):
        for line in np.unique(xy[:, across]):
            members = np.flatnonzero(xy[:, across] == line)
            members = members[np.argsort(xy[members, along], kind="stable")]
            found += [(int(members[0]), int(one)) for one in members[:0:-1]]
    if len(found) <= MOST_DISTANCES:
        return found
    return [found[k] for k in np.linspace(0, len(found) - 1, MOST_DISTANCES).astype(int)]


def distance_words(layout: BallLayout, pair: tuple[int, int]) -> str:
    """Names of two balls as those of their distance."""
    return f"{layout.names[pair[0]]}-{layout.names[pair[1]]}"


def length_words(value: LengthFunction) -> str:
    """An uncertainty that may grow with length, in words."""
    constant = format_length(value.constant)
    return f"{constant} + L/{1.0 / value.slope:.6g}" if value.slope else constant


def _better(item: Any, factor: float) -> tuple[Any, str]:
    if isinstance(item, DistanceCalibration):
        old = item.standard_uncertainty
        new = LengthFunction(factor * old.constant, factor * old.slope)
        return (
            replace(item, standard_uncertainty=new, standard_uncertainties=factor * item.standard_uncertainties),
            length_words(new),
        )
    if isinstance(item, CoordinateCalibration):
        u = factor * item.standard_uncertainties
        return replace(item, standard_uncertainties=u), format_length(float(u.min()))
    u = factor * item.standard_uncertainty
    return replace(item, standard_uncertainty=u), format_length(u)


def _with_better(experiment: Experiment, k: int, item: Any) -> Experiment:
    items = (*experiment.calibration[:k], item, *experiment.calibration[k + 1 :])
    return replace(experiment, calibration=items)


def positions(experiment: Experiment) -> Iterator[Change]:
    """A plate in one position more, in each plane, turned and shifted, or a bar in one direction more."""
    volume, d = experiment.machine.volume, experiment.dimension
    for artefact in dict.fromkeys(place.artefact for place in experiment.positions):
        layout = experiment.layouts[artefact]
        makers = _plate_poses if _is_plate(experiment, artefact) else _bar_poses
        for words, plane, pose in makers(experiment, artefact):
            names = _probes_across(experiment, artefact, plane)
            every = np.arange(len(layout.names))
            name = _free_name(experiment, f"more {plane or ''}".strip())
            new = Position(name, artefact, Pose(*pose), (ReadingGroup(names, layout.names, every, 1),))
            if d == len(pose[1]) and is_inside(new, layout, volume):
                told = f"read {artefact} once more {words}"
                if d == 3 and len(experiment.probes) > 1:
                    told += f", with {'probe' if len(names) == 1 else 'probes'} {' and '.join(names)}"
                add = partial(with_added, position=new)
                yield Change(
                    Kind.ADD_POSITION, told, float(count_readings([new])), frozenset({f"more {words}"}), add, new
                )


def with_added(experiment: Experiment, position: Position) -> Experiment:
    """The experiment with one position more, by another name where it has one of that name."""
    name = _free_name(experiment, position.name)
    return with_position(experiment, replace(position, name=name))


def _free_name(experiment: Experiment, name: str) -> str:
    taken = {place.name for place in experiment.positions}
    return next(one for k in range(len(taken) + 1) if (one := name if not k else f"{name} {k + 1}") not in taken)


def _plate_poses(experiment: Experiment, artefact: str) -> Iterator[tuple[str, Axis | None, tuple[Array, Array]]]:
    layout, d, volume = experiment.layouts[artefact], experiment.dimension, experiment.machine.volume
    centre, step = 0.5 * (volume.lower + volume.upper), pitch(layout)
    middle = _middle(layout)[:d]
    for shift, turns in product((0.0, 0.5), range(4)):
        for level, plane in product(LEVELS if d == 3 else (0.5,), PLANES if d == 3 else PLANES[2:]):
            rotation = plane_rotation(plane, turns, d)
            at = centre + np.round(shift * step, 4)
            words = (
                f"in the middle of the volume, turned by {90 * turns} deg" if turns else "in the middle of the volume"
            )
            if shift:
                words = words.replace(
                    " of the volume", f", shifted by {format_length(np.round(0.5 * step, 4))} along both axes"
                )
            if d == 3:
                normal = AXIS_INDEX[plane]
                at[normal] = volume.lower[normal] + level * (volume.upper[normal] - volume.lower[normal])
                words = f"in plane {plane} at {format_length(at[normal])}, {words}"
            yield words, plane if d == 3 else None, (rotation, _clean(at - rotation @ middle))


def _bar_poses(experiment: Experiment, artefact: str) -> Iterator[tuple[str, Axis | None, tuple[Array, Array]]]:
    if not isinstance(experiment.artefacts[artefact], TwoSpheresSettings):
        return
    volume, d = experiment.machine.volume, experiment.dimension
    centre, middle = 0.5 * (volume.lower + volume.upper), _middle(experiment.layouts[artefact])[:d]
    for words, along in _bars(d):
        rotation = _along(along)
        yield f"{words}, in the middle of the volume", None, (rotation, np.round(centre - rotation @ middle, 5) + 0.0)


def _bars(d: int) -> Iterator[tuple[str, Array]]:
    for kind, what, along in bar_directions(d):
        yield f"{kind} {what}".strip(), along[0]


def _along(direction: Array) -> Array:
    """A rotation that lays the artefact's x axis in a direction."""
    d = len(direction)
    if d == 2:
        return np.array([[direction[0], -direction[1]], [direction[1], direction[0]]])
    level = np.hypot(direction[0], direction[1])
    side = np.array([0.0, 1.0, 0.0]) if level < 1e-9 else np.array([-direction[1], direction[0], 0.0]) / level
    return np.column_stack([direction, side, np.cross(direction, side)])


def _probes_across(experiment: Experiment, artefact: str, plane: Axis | None) -> tuple[str, ...]:
    """Probes that read the artefact in that plane, or those that reach across it, or the first."""
    own = [place for place in experiment.positions if place.artefact == artefact]
    for place in own:
        found = plane_of(place.pose.rotation)
        if plane is None or (found is not None and found[0] == plane):
            return probes_of(place)
    normal = AXIS_INDEX[plane or "z"]
    across = [name for name, p in experiment.probes.items() if abs(p[normal]) > 0.7 * float(np.linalg.norm(p))]
    return tuple(across) or (next(iter(experiment.probes)),)


def more_balls(experiment: Experiment) -> Iterator[Change]:
    """Plates with more balls on the same size."""
    for name, settings in experiment.artefacts.items():
        for more in range(1, MOST_BALLS_MORE + 1):
            if isinstance(settings, GridSettings):
                n = settings.balls
                balls: Any = (n[0] + more, n[1] + more)
                words = f"{balls[0]} x {balls[1]} balls on {name} instead of {n[0]} x {n[1]}"
            elif isinstance(settings, SquareSettings):
                balls = settings.balls + more
                words = f"{balls} balls a side on {name} instead of {settings.balls}"
            else:
                break
            try:
                new = type(settings).model_validate({**settings.model_dump(exclude_unset=True), "balls": balls})
            except ValueError:
                new = settings.model_copy(update={"balls": balls})
            changed = with_artefact(experiment, name, new)
            if changed is not None:
                cost = float(count_readings(changed.positions) - count_readings(experiment.positions))
                apply = partial(_with_artefact, name=name, settings=new)
                yield Change(Kind.ARTEFACT, f"use {words}", cost, frozenset({f"artefact {name}"}), apply)


def _with_artefact(experiment: Experiment, name: str, settings: Any) -> Experiment:
    changed = with_artefact(experiment, name, settings)
    assert changed is not None
    return changed


def fewer_coefficients(experiment: Experiment) -> Iterator[Change]:
    """An error model that asks for less."""
    model = experiment.error_model
    if any(prior.by_model.any() for prior in experiment.priors):
        # They are about coefficients that there would be no more.
        return
    keys: tuple[tuple[str, int, str], ...] = ()
    if isinstance(model, KinematicSettings) and not isinstance(model.basis, SplineSettings):
        keys = (
            ("position_coefficients", 2, "coefficients of positional errors"),
            ("rotation_coefficients", 1, "coefficients of rotational errors"),
        )
    elif isinstance(model, EmpiricalSettings) and model.terms in ("sums", "tensor"):
        keys = () if isinstance(model.basis, SplineSettings) else (("coefficients", 2, "coefficients"),)
    elif isinstance(model, MachineFileSettings):
        keys = (("knots", 0, "interior knots"),)
    for key, least, words in keys:
        now = getattr(model, key)
        for value in range(now - 1, max(now - MOST_COEFFICIENTS_LESS, least) - 1, -1):
            new = model.model_copy(update={key: value})
            apply = partial(_with_model, settings=new)
            told = f"ask for {value} {words} instead of {now}"
            yield Change(Kind.MODEL, told, float(now - value), frozenset({"model"}), apply)


def _with_model(experiment: Experiment, settings: Any) -> Experiment:
    return replace(experiment, error_model=settings)


def pitch(layout: BallLayout) -> float:
    """Usual distance of neighbouring balls along the artefact's x or y, in metres."""
    gaps = []
    for axis in (0, 1):
        gap = np.diff(np.unique(np.round(layout.coordinates[:, axis], 9)))
        gaps += gap[gap > 1e-6].tolist()
    # To what anyone would set up.
    return float(np.round(np.median(gaps), 4)) if gaps else 0.1


def _middle(layout: BallLayout) -> Array:
    return 0.5 * (layout.coordinates.min(axis=0) + layout.coordinates.max(axis=0))


def _clean(origin: Array) -> Array:
    """Without what rounding leaves."""
    return np.asarray(np.round(origin, 13) + 0.0)


def _is_plate(experiment: Experiment, artefact: str) -> bool:
    return experiment.artefacts[artefact].role == "plate"
