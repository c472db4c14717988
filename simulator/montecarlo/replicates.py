"""Estimates of many replicates at once, refined until nothing changes.

A pass computes the exact non-linear residuals of all replicates of a batch and their exact gradient; the step solves
R'R step = -gradient with the triangular factor that all share. What the passes end at is each replicate's own
least-squares estimate, whatever factor the steps were made with. Everything is counted from the reference, so that
differences of a nanometre in a metre keep their digits.

A batch has a seed of its own and a fixed size, so that neither the number of workers nor the size of their tasks
changes a bit of the result.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..design import Integers
from ..estimation.covariance import _solve_balls
from ..estimation.elimination import Factor
from ..machines.protocol import Array
from ..threads import single_threaded
from .reference import Group, Reference

# Replicates of a batch. The size of a matrix product decides the last bits of its result: it must be constant.
BATCH = 64

# Passes after which a replicate counts as not converged.
PASSES = 20

# A replicate has converged when its step is below this fraction of its first, which is as long as its errors are: what
# passes of such a pace leave to the next one is far below anything that statistics of replicates could show.
SMALLEST_STEP = 1e-4


@dataclass(frozen=True)
class Deviations:
    """What b replicates differ by from the reference.

    `balls` (d, n, b), `rotations` (k, pose size - d, b) as vectors about the machine's axes, `origins` (k, d, b) and
    `a` (n, b).
    """

    balls: Array
    rotations: Array
    origins: Array
    a: Array


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
    """Noise of b replicates: of the plates' readings `moved` (d, m, b), of the certificates' distances, co-ordinates
    and lengths (m, b), and of the readings of the lengths' two ends (d, m, b)."""

    moved: Array
    distances: Array
    coordinates: Array
    lengths: Array
    ends: tuple[Array, Array]


def draw(shared: Reference, seed: int, batch: int) -> Draw:
    """Noise of one batch."""
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(batch,)))
    design = shared.design
    moved = generator.standard_normal((*shared.noise.shape, BATCH))
    moved *= shared.noise[:, :, None]

    def certificate(uncertainty: Array) -> Array:
        return uncertainty[:, None] * generator.standard_normal((len(uncertainty), BATCH))

    distances = certificate(design.distances.uncertainty)
    coordinates = certificate(design.coordinates.uncertainty)
    lengths = certificate(design.lengths.uncertainty)
    return Draw(moved, distances, coordinates, lengths, _drawn_ends(shared, generator))


def _drawn_ends(shared: Reference, generator: np.random.Generator) -> tuple[Array, Array]:
    """Noise of the readings that lengths are formed of; a reading that serves several is drawn once."""
    both = np.stack([shared.design.lengths.first, shared.design.lengths.second])
    read, place = np.unique(both, return_inverse=True)
    drawn = generator.standard_normal((shared.end_noise.shape[1], len(read), BATCH))
    place = place.reshape(both.shape)
    noise = shared.end_noise[:, :, :, None]
    return drawn[:, place[0]] * noise[0], drawn[:, place[1]] * noise[1]


@single_threaded
def estimate_batch(shared: Reference, seed: int, batch: int) -> Estimates:
    """Estimates of the `BATCH` replicates of one batch."""
    drawn = draw(shared, seed, batch)
    design, layout = shared.design, shared.factor.layout
    columns = layout.pose_columns
    n, d = design.balls.shape
    k, turns = columns.shape[0], columns.shape[1] - d
    at = Deviations(
        np.zeros((d, n, BATCH)),
        np.zeros((k, turns, BATCH)),
        np.zeros((k, d, BATCH)),
        np.zeros((len(shared.start.a), BATCH)),
    )
    passes, converged = np.zeros(BATCH, np.int64), np.zeros(BATCH, bool)
    squares, first = np.full(BATCH, np.nan), np.zeros(BATCH)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        for number in range(PASSES):
            now, by_ball, by_shared = _gradient(shared, drawn, None if number == 0 else at, at)
            balls, common = _step(shared.factor, by_ball, by_shared)
            # A replicate that has converged is left alone, so that its end does not depend on its neighbours.
            active = ~converged
            balls, common = balls * active, common * active
            poses = np.where(columns[:, :, None] >= 0, common[np.maximum(columns, 0)], 0.0)
            turn = poses[:, d:]
            at = Deviations(
                at.balls + balls,
                at.rotations + turn + 0.5 * _bracket(turn, at.rotations),
                at.origins + poses[:, :d],
                at.a + common[layout.model],
            )
            # S^2 after the step, which the quadratic that the factor stands for foretells to its own accuracy.
            after = now + (by_ball * balls).sum(axis=(0, 1)) + (by_shared * common).sum(axis=0)
            squares = np.where(active, after, squares)
            size = np.maximum(
                np.abs(common / layout.scale[:, None]).max(axis=0, initial=0.0),
                np.abs(balls).max(axis=(0, 1), initial=0.0),
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


def _gradient(shared: Reference, drawn: Draw, at: Deviations | None, shape: Deviations) -> tuple[Array, Array, Array]:
    """S^2 (b,), its half gradient by the balls (d, n, b) and by the shared parameters (s, b).

    `at` is None at the reference, where less is to be computed.
    """
    layout = shared.factor.layout
    squares = np.zeros(BATCH)
    by_ball = np.zeros_like(shape.balls)
    by_pose = np.zeros((len(shape.origins), layout.pose_columns.shape[1], BATCH))
    by_shared = np.zeros((len(layout), BATCH))
    for group in shared.groups:
        moved = drawn.moved[:, group.rows]
        pull, arm = _pull(shared, group, moved, at, squares)
        by_pose[group.position] -= np.concatenate([pull.sum(axis=1), _moment(arm, pull)])
        back = pull if at is None else _turned(-at.rotations[group.position], pull)
        rotation = shared.start.rotations[group.position]
        by_ball[:, group.ball] -= (rotation.T @ back.reshape(len(rotation), -1)).reshape(back.shape)
        by_shared[layout.model] += group.model.gather(moved, None if at is None else at.a, pull)
    position, parameter = np.nonzero(layout.pose_columns >= 0)
    by_shared[layout.pose_columns[position, parameter]] += by_pose[position, parameter]
    _certificates(shared, drawn, shape.balls, squares, by_ball)
    _lengths(shared, drawn, None if at is None else at.a, squares, by_shared)
    return squares, by_ball, by_shared


def _pull(shared: Reference, group: Group, moved: Array, at: Deviations | None, squares: Array) -> tuple[Array, Array]:
    """Doubly weighted residuals (d, m, b) of a group, and its balls about their position's origin, (d, m, 1 or b)."""
    residual = group.residual[:, :, None] + moved
    arm = group.arm[:, :, None]
    if at is None:
        residual += group.model.change(moved, None)
    else:
        residual += group.model.change(moved, at.a)
        balls = at.balls[:, group.ball]
        rotation = shared.start.rotations[group.position]
        straight = arm + (rotation @ balls.reshape(len(rotation), -1)).reshape(balls.shape)
        turned = _turned(at.rotations[group.position], straight)
        residual -= turned - arm
        residual -= at.origins[group.position][:, None]
        arm = turned
    residual *= group.weight[:, :, None]
    squares += np.einsum("imb,imb->b", residual, residual)
    residual *= group.weight[:, :, None]
    return residual, arm


def _turned(turn: Array, vectors: Array) -> Array:
    """Vectors (d, m, b) turned by rotation vectors (r, b), one for each replicate."""
    angle = np.sqrt((turn**2).sum(axis=0))
    # sin(t)/t and (1 - cos t)/t^2, both smooth at 0, where np.sinc is exact.
    first, second = np.sinc(angle / np.pi), 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    once = _cross(turn, vectors)
    twice = _cross(turn, once)
    once *= first
    twice *= second
    once += twice
    once += vectors
    return once


def _cross(turn: Array, vectors: Array) -> Array:
    """turn (r, b) x vectors (d, m, b)."""
    if len(vectors) == 2:
        return np.stack([-turn[0] * vectors[1], turn[0] * vectors[0]])
    found = np.empty_like(vectors)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        np.multiply(turn[j], vectors[k], out=found[i])
        found[i] -= turn[k] * vectors[j]
    return found


def _moment(arm: Array, pull: Array) -> Array:
    """Sum over m of arm x pull: (3, b) in space, (1, b) in the plane; `arm` is (d, m, b) or (d, m, 1)."""

    def product(i: int, j: int) -> Array:
        if arm.shape[2] == 1:
            return np.asarray(arm[i, :, 0] @ pull[j])
        return np.asarray(np.einsum("mb,mb->b", arm[i], pull[j]))

    planes = [(0, 1)] if len(arm) == 2 else [(1, 2), (2, 0), (0, 1)]
    return np.stack([product(i, j) - product(j, i) for i, j in planes])


def _bracket(turn: Array, before: Array) -> Array:
    """turn x before, both (k, r, b): what two small rotations one after the other add to their sum, twice over."""
    if turn.shape[1] == 1:
        return np.zeros_like(turn)
    return np.cross(turn, before, axis=1)


def _certificates(shared: Reference, drawn: Draw, balls: Array, squares: Array, by_ball: Array) -> None:
    """Add the part of calibrated distances and co-ordinates to S^2 and its gradient."""
    design, start = shared.design, shared.start
    true = shared.truth.state.balls
    given = design.distances
    if len(given):
        counts = np.arange(design.dimension)[:, None] < given.dimensions
        base = (start.balls[given.first] - start.balls[given.second]).T * counts
        exact = (true[given.first] - true[given.second]).T * counts
        difference = base[:, :, None] + (balls[:, given.first] - balls[:, given.second]) * counts[:, :, None]
        length = np.sqrt((difference**2).sum(axis=0))
        residual = length - np.sqrt((exact**2).sum(axis=0))[:, None] - drawn.distances
        residual /= given.uncertainty[:, None]
        squares += (residual**2).sum(axis=0)
        force = residual / (given.uncertainty[:, None] * length) * difference
        for axis in range(design.dimension):
            np.add.at(by_ball[axis], given.first, force[axis])
            np.subtract.at(by_ball[axis], given.second, force[axis])
    known = design.coordinates
    if len(known):
        offset = start.balls[known.ball, known.axis] - true[known.ball, known.axis]
        residual = offset[:, None] + balls[known.axis, known.ball] - drawn.coordinates
        residual /= known.uncertainty[:, None]
        squares += (residual**2).sum(axis=0)
        np.add.at(by_ball, (known.axis, known.ball), residual / known.uncertainty[:, None])


def _lengths(shared: Reference, drawn: Draw, step: Array | None, squares: Array, by_shared: Array) -> None:
    """Add the part of length standards read in the volume."""
    given = shared.design.lengths
    if shared.ends is None:
        return
    first, second = shared.ends
    difference = shared.end_difference.T[:, :, None] + (
        drawn.ends[0] + first.change(drawn.ends[0], step) - drawn.ends[1] - second.change(drawn.ends[1], step)
    )
    unit = difference / np.sqrt((difference**2).sum(axis=0))
    unit = np.where(given.projected[:, None], given.direction.T[:, :, None], unit)
    length = (unit * difference).sum(axis=0)
    scatter = ((given.direction.T**2) * (shared.end_noise**2).sum(axis=0)).sum(axis=0) * given.with_repeatability
    weight = 1.0 / np.sqrt(given.uncertainty**2 + scatter)[:, None]
    residual = weight * (length - given.value[:, None] - drawn.lengths)
    squares += (residual**2).sum(axis=0)
    pull = unit * (weight * residual)
    model = shared.factor.layout.model
    by_shared[model] += first.gather(drawn.ends[0], step, pull) - second.gather(drawn.ends[1], step, pull)


def _step(factor: Factor, by_ball: Array, by_shared: Array) -> tuple[Array, Array]:
    """Solve R'R step = -gradient for all replicates: steps of the balls (d, n, b), shared parameters (s, b)."""
    from scipy.linalg import solve_triangular

    d, n, b = by_ball.shape
    e, s = len(factor.eliminated), len(by_shared)
    rows = factor.ball_shared.reshape(e * d, s)
    single = _solve_balls_transposed(factor.ball_root, by_ball[:, factor.eliminated].transpose(1, 0, 2))
    right = by_shared - rows.T @ single.reshape(e * d, b)
    kept = by_ball[:, factor.kept].transpose(1, 0, 2).reshape(-1, b)
    if len(factor.kept):
        kept = solve_triangular(factor.kept_root, kept, trans="T", check_finite=False)
        right = right - factor.kept_shared.T @ kept
    right = solve_triangular(factor.root, right, trans="T", check_finite=False)
    shared = solve_triangular(factor.root, right, check_finite=False)
    steps = np.zeros((d, n, b))
    carried = (rows @ shared).reshape(e, d, b)
    steps[:, factor.eliminated] = _solve_balls(factor.ball_root, single - carried).transpose(1, 0, 2)
    if len(factor.kept):
        kept = solve_triangular(factor.kept_root, kept - factor.kept_shared @ shared, check_finite=False)
        steps[:, factor.kept] = kept.reshape(-1, d, b).transpose(1, 0, 2)
    return -steps, -shared


def _solve_balls_transposed(root: Array, side: Array) -> Array:
    """Solve R' z = side for upper triangular R (n, d, d) and sides (n, d, m), all balls at once."""
    solution = np.array(side, dtype=float)
    for row in range(root.shape[1]):
        for earlier in range(row):
            solution[:, row] -= root[:, earlier, row, None] * solution[:, earlier]
        solution[:, row] /= root[:, row, row, None]
    return solution
