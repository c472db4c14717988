"""The operations of a batch of replicates in bare NumPy, for the experiment of the benchmark alone.

One plate with calibrated distances, read without length standards, priors or free probe offsets,
and two passes: nothing is asked that the experiment answers by itself. The arrays are those that
are prepared once for all replicates.
"""

from __future__ import annotations

import numpy as np
from ballplate.montecarlo._expansion import Expansion
from ballplate.montecarlo._reference import Reference
from ballplate.montecarlo._replicates import BATCH
from ballplate.simulator.design.observations.distances import CalibratedDistances
from scipy.linalg import solve_triangular

from .linear_problem import Real

PASSES = 2


def bare_batch(shared: Reference, seed: int, batch: int) -> tuple[Real, Real]:
    """Deviations of the balls (b, 3, n) and of the shared parameters (b, s) of one batch."""
    design, factor, start = shared.design, shared.factor, shared.start
    layout, n = factor.layout, len(design.balls.places)
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(batch,)))
    noise = shared.noise * generator.standard_normal((BATCH, *shared.noise.shape))
    given = design.of(CalibratedDistances)
    errors = given.uncertainty * generator.standard_normal((BATCH, len(given)))
    real = shared.truth.state.balls
    true_length = np.sqrt(((real[given.first] - real[given.second]) ** 2).sum(axis=1))
    base = (start.balls[given.first] - start.balls[given.second]).T

    balls, total = np.zeros((BATCH, 3, n)), np.zeros((BATCH, len(layout)))
    turns = np.zeros((BATCH, len(design.positions.origins), 3))
    for number in range(PASSES):
        by_ball, by_shared = np.zeros(balls.shape), np.zeros(total.shape)
        a = total[:, layout.model]
        less = turned(turns.reshape(-1, 3)).reshape(*turns.shape, 3)
        for group in shared.groups:
            k, model, moved = group.position, group.model, noise[:, :, group.rows]
            assert isinstance(model, Expansion)
            columns = layout.pose_columns[k]
            residual, arm, rotation = group.residual + moved, group.arm, start.rotations[k]
            for i in range(3):
                if number == 0:
                    residual[:, i] += np.einsum("am,bam->bm", model.by_place[i], moved)
                    continue
                residual[:, i] += a[:, model.columns[i]] @ model.by_parameters[i]
                slopes = a[:, model.mixed_columns[i]] @ model.mixed[i]
                slopes = slopes.reshape(moved.shape) + model.by_place[i]
                residual[:, i] += np.einsum("bam,bam->bm", slopes, moved)
            if number:
                displaced = less[:, k] @ group.arm
                rotation = rotation + less[:, k] @ rotation
                displaced += rotation @ balls[:, :, group.ball]
                residual -= displaced
                if columns[0] >= 0:
                    residual -= total[:, columns[:3], None]
                arm = arm + displaced
            residual *= group.weight**2
            if columns[0] >= 0:
                by_shared[:, columns[:3]] -= residual.sum(axis=2)
                x, y, z = (arm[..., i, :] for i in range(3))
                fx, fy, fz = residual.transpose(1, 0, 2)
                moments = (y * fz - z * fy, z * fx - x * fz, x * fy - y * fx)
                for i in range(3):
                    by_shared[:, columns[3 + i]] -= moments[i].sum(axis=1)
            by_ball[:, :, group.ball] -= np.swapaxes(rotation, -1, -2) @ residual
            gathered = by_shared[:, layout.model]
            for i in range(3):
                gathered[:, model.columns[i]] += residual[:, i] @ model.by_parameters[i].T
                if number:
                    both = (moved * residual[:, i, None]).reshape(BATCH, -1)
                    gathered[:, model.mixed_columns[i]] += both @ model.mixed[i].T
        difference = base + balls[:, :, given.first] - balls[:, :, given.second]
        length = np.sqrt((difference**2).sum(axis=1))
        force = (length - true_length - errors) / (given.uncertainty**2 * length)
        for i in range(len(given)):
            pull = force[:, i, None] * difference[:, :, i]
            by_ball[:, :, given.first[i]] += pull
            by_ball[:, :, given.second[i]] -= pull
        step, common = steps(shared, by_ball, by_shared)
        balls += step
        turn = np.where(layout.pose_columns >= 0, common[:, layout.pose_columns], 0.0)[:, :, 3:]
        turns += turn + 0.5 * np.cross(turn, turns)
        total += common
    return balls, total


def turned(vector: Real) -> Real:
    """Rotation matrices (m, 3, 3) of rotation vectors (m, 3), less the unit matrix."""
    angle = np.sqrt((vector**2).sum(axis=1))[:, None, None]
    cross = np.zeros((len(vector), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2] = -vector[:, 2], vector[:, 1]
    cross[:, 1, 0], cross[:, 1, 2] = vector[:, 2], -vector[:, 0]
    cross[:, 2, 0], cross[:, 2, 1] = -vector[:, 1], vector[:, 0]
    second = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    return np.asarray(np.sinc(angle / np.pi) * cross + second * (cross @ cross))


def steps(shared: Reference, by_ball: Real, by_shared: Real) -> tuple[Real, Real]:
    """Steps of the balls and of the shared parameters from the factor R: R'R step = -gradient."""
    factor = shared.factor
    single, kept = factor.eliminated, factor.kept
    back = np.linalg.inv(factor.ball_root)
    of_ball = np.ascontiguousarray(by_ball.transpose(2, 1, 0))
    rows = factor.ball_shared.reshape(3 * len(single), -1)
    first = back.transpose(0, 2, 1) @ of_ball[single]
    tied = solve_triangular(factor.kept_root, of_ball[kept].reshape(3 * len(kept), -1), trans="T")
    right = by_shared.T - rows.T @ first.reshape(len(rows), -1) - factor.kept_shared.T @ tied
    common = solve_triangular(factor.root, solve_triangular(factor.root, right, trans="T"))
    found = np.empty(of_ball.shape)
    found[single] = back @ (first - (rows @ common).reshape(first.shape))
    tied = solve_triangular(factor.kept_root, tied - factor.kept_shared @ common)
    found[kept] = tied.reshape(len(kept), 3, -1)
    return -found.transpose(2, 1, 0), -common.T
