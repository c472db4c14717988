"""Estimates of many replicates at once, refined to convergence.

A pass computes the exact non-linear residuals of all replicates of a batch and their exact
gradient; the step solves R'R step = -gradient with the shared triangular factor. Passes converge to
each replicate's least-squares estimate, regardless of the factor. A replicate whose own factor
differs too much is estimated separately with `complete_fit`, since omitting it would bias the
selection. All deviations are from the reference, so that differences of a nanometre in a metre keep
their digits.

A batch has its own seed and a fixed size: neither the number of workers nor the size of their tasks
changes a bit of the result.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing.processes import single_threaded
from ballplate.simulator.design.observations.lengths import Lengths, length_values, length_whitening
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.design.state import Replicates, State
from ballplate.simulator.estimation.covariance import solve_balls, solve_kept, solve_shared
from ballplate.simulator.estimation.gauss_newton import Solution
from ballplate.simulator.geometry.motions import cross_matrices, vector_from_rotation
from ballplate.simulator.inputs.number_arrays import Array, Flags, Integers
from ballplate.simulator.readings.simulated import HasRandomPart

from ._reference import PositionReadings, Reference, complete_fit, random_of_machine

# Replicates of a batch: constant, since the size of a matrix product affects its last bits.
BATCH = 128

# Passes after which a replicate is estimated separately.
PASSES = 20

# Ratio of successive steps above which a replicate converges too slowly for `PASSES`, and is
# estimated separately at once.
SLOWEST = 0.5

# Step of a converged replicate as a fraction of its first, which is as long as its errors. Each
# pass shortens it at least a hundredfold: at most a few millionths of the errors remain.
SMALLEST_STEP = 1e-4


@dataclass(frozen=True)
class Deviations:
    """Deviations of b replicates from the reference.

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

    def select(self, chosen: Integers | Flags) -> Deviations:
        return Deviations(*(value[chosen] for value in vars(self).values()))

    def with_rows(self, chosen: Integers, replacements: Deviations) -> Deviations:
        """Return deviations with those of chosen replicates replaced."""
        result = Deviations(*(value.copy() for value in vars(self).values()))
        for value, replacement in zip(
            vars(result).values(), vars(replacements).values(), strict=True
        ):
            value[chosen] = replacement
        return result


@dataclass(frozen=True)
class Estimates:
    """Estimates of b replicates with their S^2, passes and convergence, each (b,).

    Passes of a separately estimated replicate are its iterations.
    """

    index: Integers
    found: Deviations
    sum_of_squares: Array
    passes: Integers
    converged: np.ndarray


@dataclass(frozen=True)
class Draw:
    """Noise of b replicates: of readings `moved` (b, d, m), and of the values of each type of
    observation `errors` (b, m).
    """

    moved: Array
    errors: tuple[Array, ...]

    def replicate(self, k: int) -> tuple[Array, tuple[Array, ...]]:
        """Noise of readings (d, m) and of values of one replicate."""
        return self.moved[k], tuple(error[k] for error in self.errors)

    def select(self, chosen: Integers | Flags) -> Draw:
        return Draw(self.moved[chosen], tuple(error[chosen] for error in self.errors))


def draw(shared: Reference, seed: int, batch: int) -> Draw:
    """Draw the noise of one batch, with the random part of the true machine's errors."""
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(batch,)))
    design = shared.design

    # Always a whole batch, also if fewer replicates are wanted: a replicate has the same noise in a
    # run of any length.
    def noise(some: slice) -> Array:
        shape = (BATCH, *shared.noise[:, some].shape)
        return design.noise.draw(generator, shape, shared.position[some], 2)

    count = len(design.plate_readings)
    of_plates = noise(slice(count))
    errors = tuple(kind.errors(generator, BATCH) for kind in design.observations)
    moved = np.concatenate([of_plates, noise(slice(count, None))], axis=2)
    moved *= shared.noise
    # Last, so that all else is drawn as on a machine without a random part.
    if isinstance(shared.truth.model, HasRandomPart):
        random = random_of_machine(design, shared.truth, shared.exact, generator, BATCH)
        moved += random[:, :, shared.order]
    return Draw(moved, errors)


@single_threaded
def estimate_batch(shared: Reference, seed: int, batch: int, count: int = BATCH) -> Estimates:
    """Estimate the `BATCH` replicates of one batch, or the first `count`."""
    drawn = draw(shared, seed, batch)
    if count < BATCH:
        drawn = drawn.select(np.arange(count))
    estimates = _refined(shared, drawn, batch * BATCH + np.arange(count))
    for k in np.flatnonzero(~estimates.converged).tolist():
        estimates = _with_estimate(estimates, k, shared, complete_fit(shared, *drawn.replicate(k)))
    return estimates


def _refined(shared: Reference, drawn: Draw, index: Integers) -> Estimates:
    """Return estimates refined with the shared factor."""
    count, d, layout = len(index), shared.design.dimension, shared.factor.layout
    columns, offset = layout.pose_columns, layout.offset_columns
    at = _no_deviations(shared, count)
    passes, converged = np.zeros(count, np.int64), np.zeros(count, bool)
    squares, first, previous = np.full(count, np.nan), np.zeros(count), np.zeros(count)
    is_separate = np.zeros(count, bool)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        for number in range(PASSES):
            # The gradient is that of the replicate itself, and exact. Only the matrix of the step
            # is shared, so that it decides how fast passes converge, not what to.
            before, by_ball, by_shared = _gradient(shared, drawn, at)
            balls, common = _step(shared, by_ball, by_shared)
            # A converged replicate stays unchanged, so that its result does not depend on others.
            active = ~(converged | is_separate)
            balls, common = balls * active[:, None, None], common * active[:, None]
            poses = np.where(columns >= 0, common[:, np.maximum(columns, 0)], 0.0)
            # Rotation vectors do not add. The second term is the first correction for that (Baker,
            # Campbell, Hausdorff): a turn t after a turn r has the vector r + t + t x r / 2.
            turn = poses[:, :, d:]
            at = Deviations(
                at.balls + balls,
                at.rotations + turn + 0.5 * _bracket(turn, at.rotations),
                at.origins + poses[:, :, :d],
                at.a + common[:, layout.model],
                at.offsets + np.where(offset >= 0, common[:, np.maximum(offset, 0)], 0.0),
                at.shared + common,
            )
            # S^2 after the step, predicted by the quadratic approximation of the factor.
            after = before + (by_ball * balls).sum(axis=(1, 2)) + (by_shared * common).sum(axis=1)
            squares[active] = after[active]
            size = np.maximum(
                np.abs(common / layout.scale).max(axis=1, initial=0.0),
                np.abs(balls).max(axis=(1, 2), initial=0.0),
            )
            passes += active
            if number == 0:
                first = size
            else:
                # One that is left to a separate estimate makes no step, and has not converged.
                converged |= active & (size <= SMALLEST_STEP * first)
                # The negation includes NaN.
                is_separate |= ~(converged | (size <= SLOWEST * previous))
            previous = size
            if (converged | is_separate).all():
                break
    converged &= np.isfinite(squares)
    return Estimates(index, at, squares, passes, converged)


def _no_deviations(shared: Reference, count: int) -> Deviations:
    design, layout = shared.design, shared.factor.layout
    n, d = design.balls.places.shape
    k, turns = layout.pose_columns.shape[0], layout.pose_columns.shape[1] - d
    return Deviations(
        np.zeros((count, d, n)),
        np.zeros((count, k, turns)),
        np.zeros((count, k, d)),
        np.zeros((count, len(shared.start.a))),
        np.zeros((count, *design.probes.offsets.shape)),
        np.zeros((count, len(layout))),
    )


def _with_estimate(
    estimates: Estimates, k: int, shared: Reference, solution: Solution
) -> Estimates:
    """Return the estimates with replicate k from a separate fit."""
    squares, passes = estimates.sum_of_squares.copy(), estimates.passes.copy()
    converged = estimates.converged.copy()
    squares[k], passes[k] = solution.factor.sum_of_squares, len(solution.iterations) - 1
    converged[k] = solution.status == "converged"
    deviations = estimates.found.with_rows(np.array([k]), _deviation(shared, solution.state))
    return Estimates(estimates.index, deviations, squares, passes, converged)


def _deviation(shared: Reference, state: State) -> Deviations:
    """Return the deviation of a single estimate from the reference."""
    start, layout = shared.start, shared.factor.layout
    turns = vector_from_rotation(state.rotations @ start.rotations.transpose(0, 2, 1))
    origins, a = state.origins - start.origins, state.a - start.a
    offsets = state.probes - start.probes
    # Columns of held parameters are -1: the extra one.
    common = np.zeros(len(layout) + 1)
    common[layout.pose_columns] = np.concatenate([origins, turns], axis=1)
    common[layout.model], common[layout.offset_columns] = a, offsets
    common[layout.lengths] = state.lengths - start.lengths
    common[layout.influences] = state.influences - start.influences
    balls = (state.balls - start.balls).T
    values = (balls, turns, origins, a, offsets, common[:-1])
    return Deviations(*(value[None] for value in values))


def _gradient(shared: Reference, drawn: Draw, at: Deviations) -> tuple[Array, Array, Array]:
    """Return S^2 (b,), its half gradient by the balls (b, d, n) and by the shared parameters (b,
    s).
    """
    layout, d = shared.factor.layout, shared.design.dimension
    squares = np.zeros(len(at.a))
    by_ball = np.zeros_like(at.balls)
    by_pose = np.zeros((len(at.a), *layout.pose_columns.shape))
    by_shared = np.zeros((len(at.a), len(layout)))
    # Readings of one position share its rotation, and every ball is in a group once. All replicates
    # of a group are then a few products of arrays, and sums over balls are plain additions to
    # columns.
    less = _turns_less_one(at.rotations)
    for group in shared.groups:
        k = group.position
        moved = drawn.moved[:, :, group.rows]
        rotation = (less[:, k] + np.eye(d)) @ shared.start.rotations[k]
        pull, arm = _pull(shared, group, moved, at, less[:, k])
        squares += np.einsum("bim,bim->b", pull, pull)
        pull *= group.weight
        by_pose[:, k, :d] -= pull.sum(axis=2)
        # A turn moves a ball by its cross product with the arm, so that the gradient by it is a
        # moment.
        by_pose[:, k, d:] -= _moment(arm, pull)
        by_ball[:, :, group.ball] -= np.swapaxes(rotation, -1, -2) @ pull
        by_shared[:, layout.model] += group.model.gather(
            moved, at.a, pull, _offsets(at, group.probe)
        )
        if group.by_influence is not None:
            by_shared[:, layout.influences] += np.tensordot(
                pull, group.by_influence, ((1, 2), (1, 2))
            )
        if group.probe is not None:
            _add_by_offset(by_shared, layout, group.probe, group.model.gather_offsets(at.a, pull))
    position, parameter = np.nonzero(layout.pose_columns >= 0)
    by_shared[:, layout.pose_columns[position, parameter]] += by_pose[:, position, parameter]
    among = Replicates(
        shared.start,
        shared.truth.state,
        at.balls,
        at.shared,
        squares,
        by_ball,
        by_shared,
        layout.offset_columns,
    )
    for kind, rows, errors in zip(
        shared.design.observations, shared.rows, drawn.errors, strict=True
    ):
        if not isinstance(kind, Lengths):
            kind.add_misfit(rows, errors, among)
        elif shared.ends is not None:
            _lengths(shared, drawn.moved, errors, at, squares, by_shared)
    return squares, by_ball, by_shared


def _pull(
    shared: Reference,
    group: PositionReadings,
    moved: Array,
    at: Deviations,
    less: Array,
) -> tuple[Array, Array]:
    """Return weighted residuals (b, d, m) of a group, and its balls about their position's origin
    (b, d, m).

    `less` (b, d, d) are the position's rotations, less the unit matrix.
    """
    residual = group.residual + moved + group.model.change(moved, at.a, _offsets(at, group.probe))
    # From the rotation less unity, to avoid the small difference of two large vectors.
    rotation = shared.start.rotations[group.position]
    displaced = less @ group.arm + (rotation + less @ rotation) @ at.balls[:, :, group.ball]
    residual -= displaced + at.origins[:, group.position, :, None]
    if group.by_influence is not None:
        influences = at.shared[:, shared.factor.layout.influences]
        residual += np.tensordot(influences, group.by_influence, (1, 0))
    return residual * group.weight, group.arm + displaced


def _turn_less_one(turn: Array) -> Array:
    """Return rotation matrices (b, d, d) of rotation vectors (b, r), less the unit matrix, to full
    relative accuracy.
    """
    if turn.shape[1] == 1:
        # cos t - 1 = -2 sin^2 (t / 2), without the difference, of which a small turn would leave no
        # digits.
        s, half = np.sin(turn[:, 0]), np.sin(0.5 * turn[:, 0])
        less = -2.0 * half**2
        return np.stack([np.stack([less, -s], axis=1), np.stack([s, less], axis=1)], axis=1)
    angle = np.sqrt((turn**2).sum(axis=1))
    # sin(t)/t and (1 - cos t)/t^2, both smooth at 0, where np.sinc is exact.
    first, second = (
        np.sinc(angle / np.pi)[:, None, None],
        (0.5 * np.sinc(angle / (2 * np.pi)) ** 2)[:, None, None],
    )
    cross = cross_matrices(-turn)
    return first * cross + second * (cross @ cross)


def _turns_less_one(turns: Array) -> Array:
    """Return `_turn_less_one` (b, k, d, d) of rotation vectors (b, k, r)."""
    less = _turn_less_one(turns.reshape(-1, turns.shape[2]))
    return less.reshape(*turns.shape[:2], *less.shape[1:])


def _moment(arm: Array, pull: Array) -> Array:
    """Return the sum over m of arm x pull, both (b, d, m): (b, 3), in the plane (b, 1)."""
    planes = [(0, 1)] if pull.shape[1] == 2 else [(1, 2), (2, 0), (0, 1)]
    # A sum of cross products is the antisymmetric part of one product of matrices, so that no
    # vector is formed for each reading.
    products = np.einsum("bim,bjm->bij", arm, pull)
    return np.stack([products[:, i, j] - products[:, j, i] for i, j in planes], axis=1)


def _bracket(turn: Array, before: Array) -> Array:
    """Return turn x before, both (b, k, r): twice the excess of two successive small rotations over
    their sum.
    """
    if turn.shape[2] == 1:
        return np.zeros_like(turn)
    return np.cross(turn, before)


def _add_by_offset(
    by_shared: Array, layout: SharedLayout, probe: Integers, gradient: Array
) -> None:
    """Add a gradient (b, d, m) by the offsets of the readings' probes (m,)."""
    for k in np.unique(probe):
        columns = layout.offset_columns[k]
        free = columns >= 0
        by_shared[:, columns[free]] += gradient[:, :, probe == k].sum(axis=2)[:, free]


def _offsets(at: Deviations, probe: Integers | None) -> Array | None:
    """Return deviations (b, d, m) of the offsets of probes (m,), if these are parameters."""
    return None if probe is None else at.offsets[:, probe].swapaxes(1, 2)


def _lengths(
    shared: Reference,
    moved: Array,
    errors: Array,
    at: Deviations,
    squares: Array,
    by_shared: Array,
) -> None:
    """Add the contribution of length standards read in the volume, with the readings' noise."""
    step = at.a
    lengths = shared.design.of(Lengths)
    assert shared.ends is not None
    first, second = shared.ends
    design = shared.design
    layout, pivoted = shared.factor.layout, lengths.to_pivot
    has_second = slice(None) if not pivoted.any() else np.flatnonzero(~pivoted)
    pivot = design.readings.position[lengths.first[pivoted]]
    at_ends = lengths.first, lengths.second[has_second]
    probes = [None if not design.probes.free.any() else design.readings.probe[k] for k in at_ends]
    offsets = [_offsets(at, probe) for probe in probes]
    ends = [moved[:, :, shared.place[k]] for k in at_ends]
    difference = shared.end_difference.T + (ends[0] + first.change(ends[0], step, offsets[0]))
    difference[:, :, has_second] -= ends[1] + second.change(ends[1], step, offsets[1])
    difference[:, :, pivoted] -= at.origins[:, pivot].swapaxes(1, 2)
    unit = difference / np.sqrt((difference**2).sum(axis=1))[:, None]
    unit = np.where(lengths.projected, lengths.direction.T, unit)
    length = (unit * difference).sum(axis=1)
    white = design.once(length_whitening)
    expected = length_values(design, shared.start) + errors
    is_free = lengths.free is not None and len(design.unknown_lengths.names) > 0
    if lengths.free is not None and is_free:
        changed = at.shared[:, layout.lengths][:, lengths.free]
        expected = expected + np.where(lengths.free >= 0, changed, 0.0)
    # Lengths are non-linear in the corrected points, and are formed before they are whitened. The
    # transpose of the whitening leads back from residuals to a force along each length, and this
    # acts on both of its ends.
    residual = white.whitened((length - expected).T)
    squares += (residual**2).sum(axis=0)
    pull = unit * white.pulled(residual).T[:, None]
    pulls = pull, pull[:, :, has_second]
    for sign, end, moved_end, probe, moved_probe, end_pull in zip(
        (1.0, -1.0), shared.ends, ends, probes, offsets, pulls, strict=True
    ):
        by_shared[:, layout.model] += sign * end.gather(moved_end, step, end_pull, moved_probe)
        if probe is not None:
            _add_by_offset(by_shared, layout, probe, sign * end.gather_offsets(step, end_pull))
    for k in np.unique(pivot):
        columns = layout.pose_columns[k, : design.dimension]
        by_shared[:, columns] -= pull[:, :, np.flatnonzero(pivoted)[pivot == k]].sum(axis=2)
    if lengths.free is not None and is_free:
        tight = white.pulled(residual).T
        for number in range(len(design.unknown_lengths.names)):
            by_shared[:, layout.lengths.start + number] -= tight[:, lengths.free == number].sum(
                axis=1
            )


def _step(reference: Reference, by_ball: Array, by_shared: Array) -> tuple[Array, Array]:
    """Solve R'R step = -gradient for all replicates: steps of the balls (b, d, n), shared
    parameters (b, s), zero along held directions.
    """
    # With the factor R of balls and shared parameters, R' z = gradient is solved first, by balls,
    # then for what they leave of the shared ones. R step = z follows in the opposite order. Where
    # directions are held, the root of the covariance takes the place of the shared triangle: it has
    # none of them.
    factor = reference.factor
    b, d, n = by_ball.shape
    e, s = len(factor.eliminated), by_shared.shape[1]
    rows = factor.ball_shared.reshape(e * d, s)
    # Replicates become columns of the systems.
    of_ball = np.ascontiguousarray(by_ball.transpose(2, 1, 0))
    single = solve_balls(factor, of_ball[factor.eliminated], transposed=True)
    right = by_shared.T - rows.T @ single.reshape(e * d, b)
    kept_balls = of_ball[factor.kept].reshape(-1, b)
    if len(factor.kept):
        kept_balls = solve_kept(factor, kept_balls, transposed=True)
        right = right - factor.kept_shared.T @ kept_balls
    if reference.drawn is None:
        shared = solve_shared(factor, solve_shared(factor, right, transposed=True))
    else:
        shared = reference.spectrum.root @ (reference.spectrum.root.T @ right)
    steps = np.zeros((n, d, b))
    carried = (rows @ shared).reshape(e, d, b)
    steps[factor.eliminated] = solve_balls(factor, single - carried)
    if len(factor.kept):
        kept_balls = solve_kept(factor, kept_balls - factor.kept_shared @ shared)
        steps[factor.kept] = kept_balls.reshape(-1, d, b)
    return -np.ascontiguousarray(steps.transpose(2, 1, 0)), -shared.T
