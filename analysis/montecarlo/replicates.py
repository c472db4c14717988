"""Estimates of many replicates at once, refined until nothing changes.

A pass computes the exact non-linear residuals of all replicates of a batch and their exact
gradient; the step solves R'R step = -gradient with the triangular factor that all share. What the
passes end at is each replicate's own least-squares estimate, whatever factor the steps were made
with. Everything is counted from the reference, so that differences of a nanometre in a metre keep
their digits.

A batch has a seed of its own and a fixed size, so that neither the number of workers nor the size
of their tasks changes a bit of the result.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.design.observations import Lengths
from ballplate.simulator.estimation.elimination import Factor
from ballplate.simulator.estimation.observations import length_values
from ballplate.simulator.estimation.parameters import SharedLayout
from ballplate.simulator.estimation.substitution import solve_balls, solve_kept, solve_shared
from ballplate.simulator.machines.protocol import Array, Integers

from .expansion import Single
from .reference import PositionReadings, Reference

# Replicates of a batch. The size of a matrix product decides the last bits of its result: it must
# be constant.
BATCH = 128

# Passes after which a replicate counts as not converged.
PASSES = 20

# A replicate has converged when its step is below this fraction of its first, which is as long as
# its errors are. Each pass shortens it a hundredfold at least, so that a few millionths of the
# errors are left at the most.
SMALLEST_STEP = 1e-4


@dataclass(frozen=True)
class Deviations:
    """What b replicates differ by from the reference.

    `balls` (b, d, n), `rotations` (b, k, pose size - d) as vectors about the machine's axes,
    `origins` (b, k, d), `a` (b, n) and `offsets` of probes (b, l, d). `shared` (b, s) are the sums
    of all steps of the shared parameters.
    """

    balls: Array
    rotations: Array
    origins: Array
    a: Array
    offsets: Array
    shared: Array


@dataclass(frozen=True)
class Estimates:
    """Estimates of b replicates with their S^2, passes and whether they converged, each (b,)."""

    index: Integers
    found: Deviations
    sum_of_squares: Array
    passes: Integers
    converged: np.ndarray


@dataclass(frozen=True)
class Draw:
    """Noise of b replicates: of the plates' readings `moved` (b, d, m), of the certificates'
    distances, co-ordinates and lengths (b, m), of priors (b, m), and of the readings of the
    lengths' two ends (b, d, m)."""

    moved: Single
    distances: Array
    coordinates: Array
    lengths: Array
    priors: Array
    ends: tuple[Array, Array]


def draw(shared: Reference, seed: int, batch: int) -> Draw:
    """Noise of one batch."""
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(batch,)))
    design = shared.design
    # Single precision: drawn in half the time, and noise is noise.
    moved = generator.standard_normal((BATCH, *shared.noise.shape), np.float32)
    moved *= shared.noise.astype(np.float32)

    def certificate(uncertainty: Array) -> Array:
        return uncertainty * generator.standard_normal((BATCH, len(uncertainty)))

    distances = certificate(design.distances.uncertainty)
    coordinates = certificate(design.coordinates.uncertainty)
    lengths = _drawn_lengths(design.lengths, generator)
    priors = certificate(design.priors.uncertainty)
    return Draw(moved, distances, coordinates, lengths, priors, _drawn_ends(shared, generator))


def _drawn_lengths(given: Lengths, generator: np.random.Generator) -> Array:
    """Errors (b, m) of the certificates of lengths, one for each certificate."""
    drawn = generator.standard_normal((BATCH, int(given.certificate.max(initial=-1)) + 1))
    return np.asarray(given.uncertainty * drawn[:, given.certificate])


def _drawn_ends(shared: Reference, generator: np.random.Generator) -> tuple[Array, Array]:
    """Noise of the readings that lengths are formed of; a reading that serves several is drawn
    once.
    """
    given = shared.design.lengths
    read, place = np.unique(
        np.concatenate([given.first, given.second[~given.to_pivot]]), return_inverse=True
    )
    drawn = generator.standard_normal((BATCH, shared.design.dimension, len(read)))
    first, second = np.split(place.ravel(), [len(given)])
    return drawn[:, :, first] * shared.end_noise[0], drawn[:, :, second] * shared.end_noise[1]


@single_threaded
def estimate_batch(shared: Reference, seed: int, batch: int) -> Estimates:
    """Estimates of the `BATCH` replicates of one batch."""
    drawn = draw(shared, seed, batch)
    design, layout = shared.design, shared.factor.layout
    columns, offset = layout.pose_columns, layout.offset_columns
    n, d = design.balls.places.shape
    k, turns = columns.shape[0], columns.shape[1] - d
    at = Deviations(
        np.zeros((BATCH, d, n)),
        np.zeros((BATCH, k, turns)),
        np.zeros((BATCH, k, d)),
        np.zeros((BATCH, len(shared.start.a))),
        np.zeros((BATCH, *design.probes.offsets.shape)),
        np.zeros((BATCH, len(layout))),
    )
    passes, converged = np.zeros(BATCH, np.int64), np.zeros(BATCH, bool)
    squares, first = np.full(BATCH, np.nan), np.zeros(BATCH)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        for number in range(PASSES):
            now, by_ball, by_shared = _gradient(shared, drawn, at, is_start=number == 0)
            balls, common = _step(shared.factor, by_ball, by_shared)
            # A replicate that has converged is left alone, so that its end does not depend on its
            # neighbours.
            active = ~converged
            balls, common = balls * active[:, None, None], common * active[:, None]
            poses = np.where(columns >= 0, common[:, np.maximum(columns, 0)], 0.0)
            turn = poses[:, :, d:]
            at = Deviations(
                at.balls + balls,
                at.rotations + turn + 0.5 * _bracket(turn, at.rotations),
                at.origins + poses[:, :, :d],
                at.a + common[:, layout.model],
                at.offsets + np.where(offset >= 0, common[:, np.maximum(offset, 0)], 0.0),
                at.shared + common,
            )
            # S^2 after the step, which the quadratic that the factor stands for foretells to its
            # own accuracy.
            after = now + (by_ball * balls).sum(axis=(1, 2)) + (by_shared * common).sum(axis=1)
            squares = np.where(active, after, squares)
            size = np.maximum(
                np.abs(common / layout.scale).max(axis=1, initial=0.0),
                np.abs(balls).max(axis=(1, 2), initial=0.0),
            )
            passes += active
            if number == 0:
                first = size
            else:
                converged |= size <= SMALLEST_STEP * first
            if converged.all():
                break
    converged &= np.isfinite(squares)
    return Estimates(batch * BATCH + np.arange(BATCH), at, squares, passes, converged)


def _gradient(
    shared: Reference, drawn: Draw, at: Deviations, is_start: bool
) -> tuple[Array, Array, Array]:
    """S^2 (b,), its half gradient by the balls (b, d, n) and by the shared parameters (b, s).

    At the start all deviations are zero, and less is to be computed.
    """
    layout, d = shared.factor.layout, shared.design.dimension
    squares = np.zeros(BATCH)
    by_ball = np.zeros_like(at.balls)
    by_pose = np.zeros((BATCH, *layout.pose_columns.shape))
    by_shared = np.zeros((BATCH, len(layout)))
    step = None if is_start else at.a
    for group in shared.groups:
        k = group.position
        moved = drawn.moved[:, :, group.rows]
        rotation = (
            shared.start.rotations[k]
            if is_start
            else _turn(at.rotations[:, k]) @ shared.start.rotations[k]
        )
        pull, arm = _pull(shared, group, moved, at, is_start)
        squares += np.einsum("bim,bim->b", pull, pull)
        pull *= group.weight
        by_pose[:, k, :d] -= pull.sum(axis=2)
        by_pose[:, k, d:] -= _moment(arm, pull)
        by_ball[:, :, group.ball] -= np.swapaxes(rotation, -1, -2) @ pull
        by_shared[:, layout.model] += group.model.gather(
            moved, step, pull, _offsets(at, group.probe)
        )
        if group.probe is not None:
            _add_by_offset(by_shared, layout, group.probe, group.model.gather_offsets(step, pull))
    position, parameter = np.nonzero(layout.pose_columns >= 0)
    by_shared[:, layout.pose_columns[position, parameter]] += by_pose[:, position, parameter]
    _certificates(shared, drawn, at.balls, squares, by_ball)
    _lengths(shared, drawn, at, is_start, squares, by_shared)
    if drawn.priors.shape[1]:
        weight = 1.0 / shared.design.priors.uncertainty
        residual = (
            shared.prior_residual + at.shared @ shared.prior_derivative.T - weight * drawn.priors
        )
        squares += (residual**2).sum(axis=1)
        by_shared += residual @ shared.prior_derivative
    return squares, by_ball, by_shared


def _pull(
    shared: Reference, group: PositionReadings, moved: Single, at: Deviations, is_start: bool
) -> tuple[Array, Array]:
    """Weighted residuals (b, d, m) of a group, and its balls about their position's origin, (d, m)
    or (b, d, m).
    """
    residual = group.residual + moved
    arm = group.arm
    if is_start:
        residual += group.model.change(moved, None)
    else:
        residual += group.model.change(moved, at.a, _offsets(at, group.probe))
        # Turned less straight, so that the small difference of two large vectors is never formed.
        less = _turn_less_one(at.rotations[:, group.position])
        rotation = shared.start.rotations[group.position]
        displaced = (less.reshape(-1, less.shape[2]) @ group.arm).reshape(moved.shape)
        displaced += (rotation + less @ rotation) @ at.balls[:, :, group.ball]
        residual -= displaced
        residual -= at.origins[:, group.position, :, None]
        arm = group.arm + displaced
    residual *= group.weight
    return residual, arm


def _turn_less_one(turn: Array) -> Array:
    """Rotation matrices (b, d, d) of rotation vectors (b, r), less the unit matrix, to full
    relative accuracy.
    """
    b = len(turn)
    if turn.shape[1] == 1:
        s, half = np.sin(turn[:, 0]), np.sin(0.5 * turn[:, 0])
        less = -2.0 * half**2
        return np.stack([np.stack([less, -s], axis=1), np.stack([s, less], axis=1)], axis=1)
    angle = np.sqrt((turn**2).sum(axis=1))
    # sin(t)/t and (1 - cos t)/t^2, both smooth at 0, where np.sinc is exact.
    first, second = (
        np.sinc(angle / np.pi)[:, None, None],
        (0.5 * np.sinc(angle / (2 * np.pi)) ** 2)[:, None, None],
    )
    cross = np.zeros((b, 3, 3))
    cross[:, 0, 1], cross[:, 0, 2] = -turn[:, 2], turn[:, 1]
    cross[:, 1, 0], cross[:, 1, 2] = turn[:, 2], -turn[:, 0]
    cross[:, 2, 0], cross[:, 2, 1] = -turn[:, 1], turn[:, 0]
    return np.asarray(first * cross + second * (cross @ cross))


def _turn(turn: Array) -> Array:
    """Rotation matrices (b, d, d) of rotation vectors (b, r)."""
    less = _turn_less_one(turn)
    return np.asarray(less + np.eye(less.shape[1]))


def _moment(arm: Array, pull: Array) -> Array:
    """Sum over m of arm x pull, with arm (d, m) or (b, d, m) and pull (b, d, m): (b, 3), in the
    plane (b, 1).
    """
    planes = [(0, 1)] if pull.shape[1] == 2 else [(1, 2), (2, 0), (0, 1)]
    if arm.ndim == 2:
        products = (pull.reshape(-1, arm.shape[1]) @ arm.T).reshape(len(pull), *arm.shape[:1], -1)
        return np.stack([products[:, j, i] - products[:, i, j] for i, j in planes], axis=1)

    # One by one: as a product of matrices for each replicate it takes twice as long.
    def product(i: int, j: int) -> Array:
        return np.asarray(np.einsum("bm,bm->b", arm[:, i], pull[:, j]))

    return np.stack([product(i, j) - product(j, i) for i, j in planes], axis=1)


def _bracket(turn: Array, before: Array) -> Array:
    """turn x before, both (b, k, r): what two small rotations one after the other add to their sum,
    twice over.
    """
    if turn.shape[2] == 1:
        return np.zeros_like(turn)
    return np.cross(turn, before)


def _certificates(
    shared: Reference, drawn: Draw, balls: Array, squares: Array, by_ball: Array
) -> None:
    """Add the part of calibrated distances and co-ordinates to S^2 and its gradient."""
    design, start = shared.design, shared.start
    true = shared.truth.state.balls
    given = design.distances
    if len(given):
        counts = np.arange(design.dimension)[:, None] < given.dimensions
        base = (start.balls[given.first] - start.balls[given.second]).T * counts
        exact = (true[given.first] - true[given.second]).T * counts
        difference = base + (balls[:, :, given.first] - balls[:, :, given.second]) * counts
        length = np.sqrt((difference**2).sum(axis=1))
        residual = (length - np.sqrt((exact**2).sum(axis=0)) - drawn.distances) / given.uncertainty
        squares += (residual**2).sum(axis=1)
        force = (residual / (given.uncertainty * length))[:, None] * difference
        # A ball may stand in several pairs.
        of_pair = force.transpose(2, 0, 1)
        pulled = np.zeros((len(start.balls), *of_pair.shape[1:]))
        np.add.at(pulled, given.first, of_pair)
        np.subtract.at(pulled, given.second, of_pair)
        by_ball += pulled.transpose(1, 2, 0)
    known = design.coordinates
    if len(known):
        offset = start.balls[known.ball, known.axis] - true[known.ball, known.axis]
        residual = (
            offset + balls[:, known.axis, known.ball] - drawn.coordinates
        ) / known.uncertainty
        squares += (residual**2).sum(axis=1)
        # A co-ordinate may be certified twice.
        certified = np.zeros((start.balls.size, BATCH))
        np.add.at(
            certified, design.dimension * known.ball + known.axis, (residual / known.uncertainty).T
        )
        by_ball += certified.reshape(*start.balls.shape, BATCH).transpose(2, 1, 0)


def _add_by_offset(
    by_shared: Array, layout: SharedLayout, probe: Integers, gradient: Array
) -> None:
    """Add a gradient (b, d, m) by the offsets of the probes (m,) that readings were made with."""
    for k in np.unique(probe):
        columns = layout.offset_columns[k]
        free = columns >= 0
        by_shared[:, columns[free]] += gradient[:, :, probe == k].sum(axis=2)[:, free]


def _offsets(at: Deviations, probe: Integers | None) -> Array | None:
    """What the offsets of the probes (m,) differ by, (b, d, m), where they are parameters."""
    return None if probe is None else at.offsets[:, probe].swapaxes(1, 2)


def _lengths(
    shared: Reference, drawn: Draw, at: Deviations, is_start: bool, squares: Array, by_shared: Array
) -> None:
    """Add the part of length standards read in the volume."""
    step = None if is_start else at.a
    given = shared.design.lengths
    if shared.ends is None:
        return
    first, second = shared.ends
    design, ends = shared.design, drawn.ends
    layout, pivoted = shared.factor.layout, given.to_pivot
    read = slice(None) if not pivoted.any() else np.flatnonzero(~pivoted)
    pivot = design.readings.position[given.first[pivoted]]
    at_ends = given.first, given.second[read]
    probes = [design.readings.probe[k] if design.probes.free.any() else None for k in at_ends]
    offsets = [_offsets(at, probe) for probe in probes]
    difference = shared.end_difference.T + (ends[0] + first.change(ends[0], step, offsets[0]))
    difference[:, :, read] -= ends[1] + second.change(ends[1], step, offsets[1])
    difference[:, :, pivoted] -= at.origins[:, pivot].swapaxes(1, 2)
    unit = difference / np.sqrt((difference**2).sum(axis=1))[:, None]
    unit = np.where(given.projected, given.direction.T, unit)
    length = (unit * difference).sum(axis=1)
    white = design.length_whitening
    expected = length_values(design, shared.start) + drawn.lengths
    is_free = given.free is not None and len(design.unknown_lengths.names) > 0
    if given.free is not None and is_free:
        changed = at.shared[:, layout.lengths][:, given.free]
        expected = expected + np.where(given.free >= 0, changed, 0.0)
    residual = white.whitened((length - expected).T)
    squares += (residual**2).sum(axis=0)
    pull = unit * white.pulled(residual).T[:, None]
    pulls = pull, pull[:, :, read]
    for sign, end, moved, probe, moved_probe, own in zip(
        (1.0, -1.0), shared.ends, ends, probes, offsets, pulls, strict=True
    ):
        by_shared[:, layout.model] += sign * end.gather(moved, step, own, moved_probe)
        if probe is not None:
            _add_by_offset(by_shared, layout, probe, sign * end.gather_offsets(step, own))
    for k in np.unique(pivot):
        columns = layout.pose_columns[k, : design.dimension]
        by_shared[:, columns] -= pull[:, :, np.flatnonzero(pivoted)[pivot == k]].sum(axis=2)
    if given.free is not None and is_free:
        tight = white.pulled(residual).T
        for number in range(len(design.unknown_lengths.names)):
            by_shared[:, layout.lengths.start + number] -= tight[:, given.free == number].sum(
                axis=1
            )


def _step(factor: Factor, by_ball: Array, by_shared: Array) -> tuple[Array, Array]:
    """Solve R'R step = -gradient for all replicates: steps of the balls (b, d, n), shared
    parameters (b, s).
    """
    b, d, n = by_ball.shape
    e, s = len(factor.eliminated), by_shared.shape[1]
    rows = factor.ball_shared.reshape(e * d, s)
    # The columns of the systems are replicates.
    of_ball = np.ascontiguousarray(by_ball.transpose(2, 1, 0))
    single = solve_balls(factor, of_ball[factor.eliminated], transposed=True)
    right = by_shared.T - rows.T @ single.reshape(e * d, b)
    kept = of_ball[factor.kept].reshape(-1, b)
    if len(factor.kept):
        kept = solve_kept(factor, kept, transposed=True)
        right = right - factor.kept_shared.T @ kept
    shared = solve_shared(factor, solve_shared(factor, right, transposed=True))
    steps = np.zeros((n, d, b))
    carried = (rows @ shared).reshape(e, d, b)
    steps[factor.eliminated] = solve_balls(factor, single - carried)
    if len(factor.kept):
        kept = solve_kept(factor, kept - factor.kept_shared @ shared)
        steps[factor.kept] = kept.reshape(-1, d, b)
    return -np.ascontiguousarray(steps.transpose(2, 1, 0)), -shared.T
