"""Conversion of an experiment into its design: names become indices, and every artefact gets a
frame.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.computing.numerics import comparable, svd
from ballplate.simulator.design.arrays import Design, Observations, Readings
from ballplate.simulator.design.objects import (
    Artefacts,
    Balls,
    EvaluationPoints,
    Positions,
    Probes,
    Tasks,
    Volume,
)
from ballplate.simulator.design.observations.balls import BallObservations
from ballplate.simulator.design.observations.coordinates import (
    CalibratedCoordinates,
    flat,
    no_coordinates,
)
from ballplate.simulator.design.observations.distances import (
    CalibratedDistances,
    RadiusCalibration,
    no_distances,
)
from ballplate.simulator.design.observations.joint_values import JointValues
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.geometry.artefacts import BryanGaugeSettings
from ballplate.simulator.geometry.motions import pose_size
from ballplate.simulator.inputs.extensions import UnusableError
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.number_arrays import Array, Flags, Integers
from ballplate.simulator.inputs.yamltree import Mark
from ballplate.simulator.machines.settings import build_error_model

from ._influences import with_influences
from ._length_standards import standard_lengths
from .model import Experiment, Prior

if TYPE_CHECKING:
    from ballplate.simulator.design.observations.star import Stars

# Evaluation points of an experiment that names none.
DEFAULT_POINTS = 200
DEFAULT_SEED = 1

# Directions below this fraction of the largest do not count when a frame is fixed or a line
# recognised, nor motions of unit length whose square is below it in what is not held yet.
FLAT = 1e-9


# In one piece: every array of a design is laid out beside those whose order it shares.
def lay_out(experiment: Experiment, is_pool: bool = False) -> Design:
    """Design of an experiment, or of a pool of positions that are never solved for together.

    >>> from pathlib import Path
    >>> from ballplate.simulator.experiment.loading import load
    >>> lay_out(load(Path("designs/quickstart.yaml"))[0]).dimension
    3

    :raises ExperimentError: the experiment was loaded with its faults, and has some, or a prior is
        of a pose parameter that is held.
    :raises UnusableError: values of the machine are correlated.
    """
    if experiment.faults:
        raise ExperimentError(experiment.faults)
    machine, d = experiment.machine, experiment.dimension
    model = build_error_model(experiment.error_model, *machine.volume.corners)
    artefacts = list(experiment.artefacts)
    layouts = [experiment.layouts[name] for name in artefacts]
    sizes = [len(layout.names) for layout in layouts]
    first_ball = dict(zip(artefacts, np.cumsum([0, *sizes[:-1]]), strict=True))
    balls = np.concatenate([layout.coordinates[:, :d] for layout in layouts])
    for item in experiment.calibration:
        # The ball of a gauge moves on a sphere about the pivot. A certified radius takes the place
        # of the nominal one.
        if isinstance(item, RadiusCalibration):
            first = first_ball[item.artefact]
            balls_of_artefact = slice(first, first + len(experiment.layouts[item.artefact].names))
            balls[balls_of_artefact] *= (
                item.value / np.sqrt((balls[balls_of_artefact] ** 2).sum(axis=1))[:, None]
            )
    is_plate = np.array([artefact.role == "plate" for artefact in experiment.artefacts.values()])
    is_gauge = np.array(
        [isinstance(artefact, BryanGaugeSettings) for artefact in experiment.artefacts.values()]
    )
    probe_index = {name: k for k, name in enumerate(experiment.probes)}
    places = experiment.positions
    readings = _readings(experiment, first_ball, probe_index)
    position_artefact = np.array([artefacts.index(place.artefact) for place in places], np.int64)
    rotations = np.array([place.pose.rotation for place in places])
    origins = np.array([place.pose.origin for place in places])
    observations = _stated(experiment, first_ball)
    # These two kinds are always there, empty if nothing is stated, and have a fixed place.
    distances, coordinates, *other_observations = observations
    lengths, unknown = standard_lengths(
        experiment, readings, first_ball, rotations, position_artefact, balls
    )
    points, tasks = experiment.evaluation.points, experiment.evaluation.tasks
    if not len(points):
        points = random_points(machine.volume, DEFAULT_POINTS, DEFAULT_SEED)
    laid = Balls(
        tuple(name for layout in layouts for name in layout.names),
        np.repeat(np.arange(len(artefacts)), sizes),
        balls,
    )
    across = _across(experiment, rotations, position_artefact)
    held_flags = _held(laid, position_artefact, rotations, observations)
    if across is not None:
        plane_positions = np.flatnonzero(across >= 0)
        # Nothing is read of a shift across the plane and, of what is in it, of tilts.
        held_flags[plane_positions, across[plane_positions]] = True
        held_flags[plane_positions, d:] |= np.arange(d) != across[plane_positions][:, None]
    # A pivot has a place; how the bar turns about it is what the readings say.
    held_flags[is_gauge[position_artefact]] = np.arange(pose_size(d)) >= d
    priors = _priors(experiment, held_flags, len(model.parameters))
    design = Design(
        model,
        machine,
        Probes(
            tuple(experiment.probes),
            np.array([probe.offset for probe in experiment.probes.values()]),
            _free(experiment),
        ),
        Artefacts(tuple(artefacts), is_plate, is_gauge),
        laid,
        Positions(
            tuple(place.name for place in places),
            position_artefact,
            rotations,
            origins,
            held_flags,
            across,
            experiment.switched_off,
        ),
        readings,
        (distances, coordinates, lengths, priors, *other_observations, *_stars(experiment)),
        unknown,
        EvaluationPoints(points, probe_index[experiment.evaluation.probe]),
        Tasks(
            tuple(task.name for task in tasks),
            np.array([task.points for task in tasks], float).reshape(len(tasks), 2, d),
            np.array(
                [[probe_index[name] for name in task.probes] for task in tasks], np.int64
            ).reshape(-1, 2),
            tuple(task.target for task in tasks),
        ),
        noise=experiment.noise,
        sections=experiment.sections,
    )
    return with_influences(design, experiment, is_pool)


def _free(experiment: Experiment) -> Flags:
    """Return a mask (l, d) of probe offsets that are parameters."""
    free = [probe.is_estimated for probe in experiment.probes.values()]
    return np.repeat(np.array(free)[:, None], experiment.dimension, axis=1)


def _priors(experiment: Experiment, held_flags: Flags, parameters: int) -> Priors:
    """Return prior knowledge: the priors stated, and the probe offsets that have an uncertainty.

    :raises ExperimentError: a prior is about a pose parameter that is held.
    """
    all_priors = list(experiment.priors)
    places = [place.name for place in experiment.positions]
    messages = []
    for prior in all_priors:
        if prior.position is not None and held_flags[places.index(prior.position), prior.component]:
            text = (
                f'"{prior.name}" is held, to fix the frame of the artefact; state priors of other'
                " positions"
            )
            messages.append(prior.mark.message(prior.path, text))
    if messages:
        raise ExperimentError(messages)
    nowhere = Mark(str(experiment.source), 0, 0)
    for probe, axis, value, u in experiment.certified_offsets:
        label = f"probe {probe.name}: offset {'xyz'[axis]}"
        all_priors.append(
            Prior(label, None, probe.name, axis, np.zeros(parameters), value, u, nowhere)
        )
    probes, by_offset = list(experiment.probes), None
    if any(prior.by_offset for prior in all_priors):
        by_offset = np.zeros((len(all_priors), len(probes), experiment.dimension))
        for k, prior in enumerate(all_priors):
            for name, coefficients in (prior.by_offset or {}).items():
                by_offset[k, probes.index(name)] = coefficients
    return Priors(
        tuple(prior.name for prior in all_priors),
        np.array(
            [-1 if p.position is None else places.index(p.position) for p in all_priors], np.int64
        ),
        np.array([-1 if p.probe is None else probes.index(p.probe) for p in all_priors], np.int64),
        np.array([p.component for p in all_priors], np.int64),
        np.array([p.by_model for p in all_priors], float).reshape(len(all_priors), parameters),
        np.array([p.value for p in all_priors], float),
        np.array([p.standard_uncertainty for p in all_priors], float),
        by_offset=by_offset,
        units=tuple(p.unit for p in all_priors),
    )


def _across(
    experiment: Experiment, rotations: Array, position_artefact: Integers
) -> Integers | None:
    """Return the machine's axis (k,) across artefacts that are read in their plane, -1 for others,
    if there are such artefacts.
    """
    in_plane = [artefact.reads == "in plane" for artefact in experiment.artefacts.values()]
    if not any(in_plane):
        return None
    # The normal of the plane in the machine. It is along an axis: oblique artefacts that are read
    # in their plane are refused when positions are resolved.
    axis = np.abs(rotations[:, :, -1]).argmax(axis=1)
    return np.where(np.array(in_plane)[position_artefact], axis, -1)


def _stars(experiment: Experiment) -> list[Stars]:
    if not experiment.stars:
        return []
    from ballplate.simulator.design.observations.star import observed_stars

    return [observed_stars(experiment.stars, list(experiment.probes))]


def random_points(volume: Volume, count: int, seed: int) -> Array:
    """Points (count, d) drawn evenly from the volume."""
    generator = np.random.default_rng(np.random.SeedSequence(seed))
    return volume.lower + volume.size * generator.random((count, len(volume.lower)))


def _readings(
    experiment: Experiment, first_ball: dict[str, int], probe_index: dict[str, int]
) -> Readings:
    """All readings in the order of the file, the same one named twice merged into one with more
    repeats.
    """
    rows = []
    uncertainties = [experiment.machine.repeatability]
    is_in_order = any(influence.in_order for influence in experiment.influences)
    for k, place in enumerate(experiment.positions):
        for group in place.readings:
            balls = first_ball[place.artefact] + group.ball_indices
            # Readings of the same ball with different uncertainties stay apart, and where order
            # counts those at different times.
            kind, own = 0, group.standard_uncertainty
            if own is not None or is_in_order:
                kind = len(uncertainties)
                uncertainties.append(experiment.machine.repeatability if own is None else own)
            for name in group.probes:
                columns = np.full(
                    (len(balls), 5), (0, k, probe_index[name], kind, group.repeats), np.int64
                )
                columns[:, 0] = balls
                rows.append(columns)
    table = np.concatenate(rows)
    unique, first, inverse = np.unique(table[:, :4], axis=0, return_index=True, return_inverse=True)
    repeats = np.bincount(inverse.ravel(), weights=table[:, 4], minlength=len(unique)).astype(
        np.int64
    )
    order = np.argsort(first, kind="stable")
    ball, position, probe, kind_of = unique[order].T
    uncertainty = np.array(uncertainties)[kind_of] if len(uncertainties) > 1 else None
    return Readings(ball, position, probe, repeats[order], uncertainty)


def _stated(experiment: Experiment, first_ball: dict[str, int]) -> list[Observations]:
    """Observations of the balls of plates, and of the machine, by kind: what all items of a kind
    state.
    """
    parts: dict[type[Observations], list[Observations]] = {
        CalibratedDistances: [no_distances()],
        CalibratedCoordinates: [no_coordinates()],
    }
    joint = []
    for item in experiment.calibration:
        if experiment.is_observed(item):
            observed = item.observed(int(first_ball.get(item.artefact, 0)))
            root = item.root
            if root is None:
                parts.setdefault(type(observed), []).append(observed)
            elif isinstance(observed, BallObservations):
                joint.append((observed, root))
            else:
                text = "values of the machine cannot be correlated; leave their covariance out"
                raise UnusableError(f"calibration of {item.subject}: {text}")
    for name, artefact in experiment.artefacts.items():
        if artefact.flatness is not None:
            parts[CalibratedCoordinates].append(
                flat(experiment.layouts[name], int(first_ball[name]), artefact.flatness)
            )
    joined = [kind.joined(parts_of_kind) for kind, parts_of_kind in parts.items()]
    return [*joined, JointValues.of(joint)] if joint else joined


# Readings do not distinguish a motion of the artefact's frame from the opposite motion of all its
# poses, and would leave six null directions that say nothing about the machine. What certified
# co-ordinates do not fix of the frame is therefore fixed by the first pose. Turns that leave all
# balls where they are, of balls in a line or of a single ball, are open in every pose, and each is
# held by itself.
def _held(
    balls: Balls,
    position_artefact: Integers,
    rotations: Array,
    observations: Collection[Observations],
) -> Flags:
    """Return a mask (k, pose size) of held pose parameters.

    An artefact's frame is free up to a rigid motion, except the part that calibrated co-ordinates
    fix. As many parameters of the artefact's first pose are held as remain free: all of them if
    only distances are known, none with co-ordinates of three balls. Balls on one line leave the
    turn about it undetermined in every pose, a single ball every turn.
    """
    d = balls.places.shape[1]
    held_flags = np.zeros((len(position_artefact), pose_size(d)), bool)
    ball, axis, _ = (
        np.concatenate(part)
        for part in zip(*(observation.fixing() for observation in observations), strict=True)
    )
    for artefact in np.unique(position_artefact):
        positions = np.flatnonzero(position_artefact == artefact)
        members = balls.of(artefact)
        places = balls.places[members]
        idle = _idle_turns(places)
        for k in positions:
            held_flags[k] |= _parameters_to_hold(_in_machine_axes(idle, rotations[k]))
        chosen = np.isin(ball, members)
        # About the centre of the balls, as the idle turns are.
        fixed = _motion_of_coordinates(
            balls.places[ball[chosen]] - places.mean(axis=0), axis[chosen], d
        )
        # Turns that no reading shows are dealt with already, in every position.
        free = _null_space(np.concatenate([fixed, idle.T]))
        first = rotations[positions[0]]
        motions = _in_machine_axes(np.concatenate([idle, free], axis=1), first)
        # What is held of idle turns counts among the pivots, so that in all no parameter too many
        # is held.
        held_flags[positions[0]] |= _parameters_to_hold(motions, held_flags[positions[0]])
    return held_flags


def _idle_turns(balls: Array) -> Array:
    """Return the motions (pose size, k) of an artefact about its centre that leave all its balls
    (n, d) unchanged.
    """
    d = balls.shape[1]
    centred = balls - balls.mean(axis=0)
    moves = _motion_of_coordinates(
        np.repeat(centred, d, axis=0), np.tile(np.arange(d), len(balls)), d
    )
    size = np.abs(centred).max(initial=0.0)
    if size == 0.0:
        return np.eye(pose_size(d))[:, d:]
    turns = _null_space(moves[:, d:] / size)
    return np.concatenate([np.zeros((d, turns.shape[1])), turns])


def _in_machine_axes(motions: Array, rotation: Array) -> Array:
    """Motions (pose size, k) of an artefact's frame as changes of the pose that undo them: a shift
    and a turn.
    """
    d = len(rotation)
    turned = rotation @ motions[d:] if d == 3 else motions[d:]
    return np.concatenate([rotation @ motions[:d], turned])


def _motion_of_coordinates(places: Array, axis: Integers, d: int) -> Array:
    """Return the change of co-ordinates (m, pose size) by a small motion of the artefact's
    frame.
    """
    m = len(axis)
    rows = np.zeros((m, pose_size(d)))
    rows[np.arange(m), axis] = 1.0
    padded = np.zeros((m, 3))
    padded[:, :d] = places
    turns = np.cross(np.eye(3), padded[:, None])[np.arange(m), :, axis]
    rows[:, d:] = turns if d == 3 else turns[:, 2:]
    return rows


def _null_space(rows: Array) -> Array:
    """Return orthonormal columns of the null space of the rows."""
    if not len(rows):
        return np.eye(rows.shape[1])
    # What the triangular factor leaves free, the rows do; their own decomposition grows with their
    # number squared.
    triangle = np.linalg.qr(rows, mode="r") if len(rows) > rows.shape[1] else rows
    _, values, directions = svd(triangle)
    rank = int((values > FLAT * values[0]).sum())
    return directions[rank:].T


# Pivoted elimination of rows: to hold a parameter removes the motions that would change it. The
# parameter that they change most is taken first, and the remaining motions are made orthogonal to
# it, so that those held determine all motions, and well.
def _parameters_to_hold(motions: Array, already: Flags | None = None) -> Flags:
    """Parameters (rows of `motions`) to hold so that no motion remains, those `already` held first,
    then largest.
    """
    chosen = np.zeros(len(motions), bool)
    waiting = [] if already is None else np.flatnonzero(already).tolist()
    remainder = motions.copy()
    for k in range(motions.shape[1]):
        size = np.where(chosen, -1.0, (remainder**2).sum(axis=1))
        row = waiting[k] if k < len(waiting) else int(comparable(size).argmax())
        if size[row] <= FLAT:
            break
        chosen[row] = True
        direction = remainder[row] / np.sqrt(remainder[row] @ remainder[row])
        remainder = remainder - np.outer(remainder @ direction, direction)
    return chosen
