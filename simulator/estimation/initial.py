"""Starting values for balls and poses from the readings alone.

Two positions that share enough balls determine their relative pose. The positions of an artefact
are joined one after the other to the known ones, so that no position has to read all balls (NPL
Report CISE 15/98, section 4.1). The machine is assumed to be without errors.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from ballplate.simulator.computing.numerics import comparable, lstsq, svd
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.readings import seen_places
from ballplate.simulator.design.state import State
from ballplate.simulator.geometry.motions import (
    fit_motion,
    fit_sphere,
    rigid_motions,
    rotation_from_vector,
    vector_from_rotation,
)
from ballplate.simulator.inputs.number_arrays import Array, Flags, Integers

# Points whose spread across their main line is below this fraction of their length do not fix a
# pose.
FLAT = 1e-3

# Steps of a motion to the frame of an artefact: its second-order part vanishes with the first ones.
STEPS = 6


def initial_state(design: Design, x: Array) -> State:
    """Balls, poses and zero machine errors, from scale readings x (readings, d).

    Where too few balls join a position to the others, the nominal geometry closes the gap.
    """
    # A star may have been turned against its nominal orientation, which would shift every location
    # that follows by the error of the offsets.
    for observation in design.observations:
        design = observation.as_read(design, x)
    d = design.dimension
    balls = design.balls.places.copy()
    rotations, origins = design.positions.rotations.copy(), design.positions.origins.copy()
    means = _mean_locations(design, x)
    for artefact in design.artefacts.plates:
        members = design.balls.of(artefact)
        places = [int(k) for k in np.flatnonzero(design.positions.artefact == artefact)]
        if len(members) == 1:
            # A single ball has a place in each position and no turn.
            arm = np.einsum("kij,j->ki", rotations[places], balls[members[0]])
            there = means[places, members[0]]
            origins[places] = np.where(np.isnan(there), origins[places], there - arm)
            fixed = [k for k in places if design.positions.held[k, :d].all()]
            if fixed:
                origins[fixed] = design.positions.origins[fixed]
                first = rotations[fixed[0]].T @ (means[fixed[0], members[0]] - origins[fixed[0]])
                balls[members[0]] = np.where(np.isnan(first), balls[members[0]], first)
            continue
        shape, poses = _assemble(means[places][:, members], design.balls.places[members], d)
        # The shape is in the frame of one of the positions. The motion into the artefact's frame is
        # applied to the balls, and taken out of every pose, so that R y + o stays as it is.
        turn, shift = _into_frame(design, shape, poses, places, members)
        if (
            _strength(
                means[places[0], members][~np.isnan(means[places[0], members, 0])],
                d,
            )
            > 0.0
        ):
            turn, shift = _with_held(design, shape, poses[0], places[0], members, turn, shift)
        balls[members] = np.where(
            np.isnan(shape), design.balls.places[members], shape @ turn.T + shift
        )
        # With y' = T y + s: R y + o = R T' y' + (o - R T' s).
        for place, (rotation, origin) in zip(places, poses, strict=True):
            rotations[place] = rotation @ turn.T
            origins[place] = origin - rotations[place] @ shift
    if design.positions.across is not None:
        for k, across in enumerate(design.positions.across.tolist()):
            if across >= 0:
                rotations[k], there = _in_plane(design, k, across, means[k], balls, origins[k])
                is_held = design.positions.held[k, :d]
                origins[k] = np.where(is_held, design.positions.origins[k], there)
    readings = design.readings
    for k in design.gauge_positions:
        rows = readings.position == k
        if rows.any():
            origins[k] = fit_sphere(
                x[rows] + design.probes.offsets[readings.probe[rows]], origins[k]
            )[0]
    state = replace(nominal_state(design), balls=balls, rotations=rotations, origins=origins)
    for observation in design.observations:
        state = observation.started(design, x, state)
    return state


def _in_plane(
    design: Design, k: int, across: int, locations: Array, balls: Array, origin: Array
) -> tuple[Array, Array]:
    """Return the pose of a position that is read in its plane, from the locations (n, 3) of its
    balls; out of the plane the pose stays nominal, since no reading determines it.
    """
    drawn = design.positions.rotations[k]
    is_seen, inside = ~np.isnan(locations).all(axis=1), np.arange(3) != across
    turn, places = np.eye(3), balls[is_seen] @ drawn.T
    if is_seen.sum() > 1 and not design.positions.held[k, 3 + across]:
        turn[np.ix_(inside, inside)] = fit_motion(places[:, inside], locations[is_seen][:, inside])[
            0
        ]
    if is_seen.any():
        origin = np.where(inside, (locations[is_seen] - places @ turn.T).mean(axis=0), origin)
    return turn @ drawn, origin


def _mean_locations(design: Design, x: Array) -> Array:
    """Return the mean location of each ball in each position (k, n, d), NaN without a reading."""
    readings = design.readings
    total = np.zeros((len(design.positions.names), len(design.balls.names), design.dimension))
    count = np.zeros(total.shape[:2])
    np.add.at(total, (readings.position, readings.ball), seen_places(design, readings, x))
    np.add.at(count, (readings.position, readings.ball), 1.0)
    with np.errstate(invalid="ignore"):
        return total / count[:, :, None]


def _assemble(locations: Array, nominal: Array, d: int) -> tuple[Array, list[tuple[Array, Array]]]:
    """Shape (n, d) of an artefact in the frame of its best-read position, and the poses from
    there.
    """
    # The shape grows from the position with most balls. At each step the position joins whose balls
    # in common with the shape have the largest extent across their main line, since a pose from
    # balls nearly in a line, or from two close to each other, would hand its error on to all later
    # ones. Every ball is the mean of the positions that have joined so far. The result is no
    # estimate, only near enough for Gauss-Newton steps to converge.
    present = ~np.isnan(locations[:, :, 0])
    first = int(present.sum(axis=1).argmax())
    shape = np.where(present[first][:, None], locations[first], np.nan)
    weight = present[first].astype(float)
    poses = [(np.eye(d), np.zeros(d))] * len(locations)
    waiting = [k for k in range(len(locations)) if k != first]
    while waiting:
        shared = [present[k] & ~np.isnan(shape[:, 0]) for k in waiting]
        # Rounded, so that positions equally good by symmetry are taken in one order on every
        # computer.
        choice = int(np.argmax(comparable([_strength(shape[s], d) for s in shared])))
        k, common = waiting.pop(choice), shared[choice]
        if _strength(shape[common], d) > 0:
            rotation, origin = fit_motion(shape[common], locations[k, common])
        else:
            rotation, origin = _by_nominal(locations[k], shape, nominal)
        poses[k] = (rotation, origin)
        here = np.where(present[k][:, None], (locations[k] - origin) @ rotation, 0.0)
        old = np.where(np.isnan(shape), 0.0, shape)
        total = weight + present[k]
        with np.errstate(invalid="ignore"):
            shape = (old * weight[:, None] + here) / total[:, None]
        weight = total
    return shape, poses


def _strength(points: Array, d: int) -> float:
    """Return the extent of points (n, d) across their main line, 0 if they do not fix a pose."""
    if len(points) < 2:
        return 0.0
    extent = svd(points - points.mean(axis=0), compute_uv=False)
    # In space a line of balls leaves the turn about it open, and the second extent decides. In the
    # plane two balls are enough, and the first does.
    needed = extent[d - 2]
    return float(needed) if needed > FLAT * extent[0] else 0.0


def _by_nominal(locations: Array, shape: Array, nominal: Array) -> tuple[Array, Array]:
    here, is_known = ~np.isnan(locations[:, 0]), ~np.isnan(shape[:, 0])
    if not here.any() or not is_known.any():
        return np.eye(locations.shape[1]), np.zeros(locations.shape[1])
    # No balls in common fix the relative pose. Both sides are compared with the nominal artefact,
    # each with the balls that it has.
    to_position, to_position_origin = fit_motion(nominal[here], locations[here])
    to_shape, to_shape_origin = fit_motion(nominal[is_known], shape[is_known])
    rotation = to_position @ to_shape.T
    return rotation, to_position_origin - rotation @ to_shape_origin


def _into_frame(
    design: Design,
    shape: Array,
    poses: list[tuple[Array, Array]],
    places: list[int],
    members: Integers,
) -> tuple[Array, Array]:
    """Motion that takes the assembled shape into the artefact's own frame."""
    # A held pose defines the frame: readings cannot distinguish a motion of the frame from the
    # opposite motion of all poses. Otherwise certified co-ordinates do, and without enough of these
    # the nominal ones.
    fixed = [k for k in places if design.positions.held[k].all()]
    if fixed:
        rotation, origin = poses[places.index(fixed[0])]
        turn = design.positions.rotations[fixed[0]].T @ rotation
        return turn, design.positions.rotations[fixed[0]].T @ (
            origin - design.positions.origins[fixed[0]]
        )
    target, certified, _ = _certified(design, members)
    is_known = ~np.isnan(shape[:, 0])
    chosen = certified & is_known
    if _strength(target[members[chosen]], design.dimension) == 0.0:
        chosen = is_known
    return fit_motion(shape[chosen], target[members[chosen]])


def _certified(design: Design, members: Integers) -> tuple[Array, Flags, Flags]:
    """Return the locations of all balls with their calibrated co-ordinates, the artefact's balls
    that have any, and a mask (n, d) of these co-ordinates.
    """
    target = design.balls.places.copy()
    is_certified = np.zeros(target.shape, bool)
    for observation in design.observations:
        ball, axis, value = observation.fixing()
        if len(ball):
            target[ball, axis] = value
            is_certified[ball, axis] = True
    return target, np.asarray(is_certified[members].any(axis=1)), is_certified[members]


def _with_held(
    design: Design,
    shape: Array,
    pose: tuple[Array, Array],
    position: int,
    members: Integers,
    turn: Array,
    shift: Array,
) -> tuple[Array, Array]:
    """Return the motion into an artefact's frame that keeps the held parameters of its first pose
    nominal, if calibrated co-ordinates fix the rest of the frame.

    Held parameters never move later: the readings do not determine them.
    """
    d, is_held = design.dimension, design.positions.held[position]
    target, _, is_certified = _certified(design, members)
    is_certified &= ~np.isnan(shape)
    if not is_held.any() or is_held.all() or not is_certified.any():
        return turn, shift
    drawn = design.positions.rotations[position], design.positions.origins[position]
    # Gauss-Newton for the six parameters of a motion (three in the plane). Certified co-ordinates
    # and the held parameters of the first pose together are conditions on it.
    for _ in range(STEPS):
        places = shape @ turn.T + shift
        rotation = pose[0] @ turn.T
        # A motion of the frame moves the pose the other way.
        by_pose = np.zeros((len(is_held), len(is_held)))
        by_pose[:d, :d] = -rotation
        by_pose[d:, d:] = -rotation if d == 3 else -1.0
        turned = vector_from_rotation((rotation @ drawn[0].T)[None])[0]
        off = np.concatenate([pose[1] - rotation @ shift - drawn[1], turned])
        moves = rigid_motions(places)[is_certified]
        # There the turn about z stands first.
        moves = moves[:, [0, 1, 2, 4, 5, 3]] if d == 3 else moves
        rows = np.concatenate([moves, by_pose[is_held]])
        residuals = np.concatenate([(target[members] - places)[is_certified], -off[is_held]])
        motion = lstsq(rows, residuals, rcond=1e-9)[0]
        step = rotation_from_vector(motion[None, d:])[0]
        turn, shift = step @ turn, step @ shift + motion[:d]
    return turn, shift
