"""Time and memory of replicates, estimated many at a time.

Run with

    python -m pytest benchmarks/bench_montecarlo.py

Experiment 6.2.1 of NPL Report CISE 15/98 on grids of n x n balls, on a machine with errors of some
micrometres. SciPy's least_squares is given the same residuals and derivatives, and its answers must
agree with ours to a few millionths of what replicates differ by. Whole runs are timed on two
processes that are there already, everything else in this one.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ballplate.montecarlo._expansion import Expansion
from ballplate.montecarlo._reference import Reference, Truth, reference
from ballplate.montecarlo._replicates import BATCH, draw, estimate_batch
from ballplate.montecarlo._targets import targets
from ballplate.montecarlo.experiments import TASK, run_trials, sum_of_task
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.observations.readings import reading_blocks
from ballplate.simulator.design.state import State
from ballplate.simulator.geometry.motions import rotation_from_vector
from ballplate.simulator.machines.protocol import Array
from joblib import Parallel, delayed
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from tests.reference.designs import grid_experiment

from .bare import bare_batch

ROOT = Path(__file__).parents[1]
LINES: list[str] = []
BARE: list[str] = []


@cache
def prepared(n: int) -> Reference:
    design = grid_experiment(n)
    generator = np.random.default_rng(1)
    effect = np.array([p.effect for p in design.model.parameters])
    state = replace(nominal_state(design), a=2e-6 * generator.standard_normal(len(effect)) / effect)
    return reference(design, Truth(state, design.model))


def best(work: Callable[[], Any], rounds: int) -> float:
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def several(shared: Reference, first: int, last: int) -> list[Array]:
    return [estimate_batch(shared, 1, batch).found.a for batch in range(first, last)]


@pytest.mark.parametrize(("n", "singles"), [(5, 4), (9, 4), (20, 1)])
def test_thousand_replicates(n: int, singles: int) -> None:
    shared = prepared(n)
    batches = -(-1000 // BATCH)
    middle = batches // 2
    pool = Parallel(n_jobs=2)
    jobs = [delayed(several)(shared, 0, middle), delayed(several)(shared, middle, batches)]
    pool(jobs)
    rounds = 9
    both = best(lambda: pool(jobs), rounds)
    one = best(lambda: several(shared, 0, batches), 3)
    whole = best(lambda: run_trials(shared, 1, 1000, workers=2), 3)
    found = estimate_batch(shared, 1, 0)
    seconds = []
    for k in range(singles):
        start = time.perf_counter()
        state = by_scipy(shared, k)
        seconds.append(time.perf_counter() - start)
        ours = shared.start.a + found.found.a[k]
        assert np.abs(ours - state.a).max() < 5e-6 * found.found.a.std(axis=0).max()
        balls = shared.start.balls + found.found.balls[k].T
        assert np.abs(balls - state.balls).max() < 5e-6 * found.found.balls.std(axis=0).max()
    times = 1000 * min(seconds) / (both * 1000 / (batches * BATCH))
    rate = product_rate(shared)
    LINES.append(
        f"| {n} | {len(shared.design.readings)} | {one:.3f} | {both:.3f} | {whole:.3f} |"
        f" {min(seconds):.2f} | {times:.0f} | {100 * rate:.0f} |"
    )


@pytest.mark.parametrize(("n", "rounds"), [(5, 15), (9, 9), (20, 5)])
def test_against_bare_numpy(n: int, rounds: int) -> None:
    """A thousand replicates on one process, without and with statistics, in turns with bare
    NumPy: processor time.
    """
    shared = prepared(n)
    aims = targets(shared)
    found, (balls, _) = estimate_batch(shared, 1, 0).found, bare_batch(shared, 1, 0)
    assert np.abs(found.balls - balls).max() < 1e-8 * found.balls.std()
    batches, tasks = range(-(-1000 // BATCH)), range(-(-1000 // TASK))
    work: tuple[Callable[[], Any], ...] = (
        lambda: [estimate_batch(shared, 1, batch) for batch in batches],
        lambda: [bare_batch(shared, 1, batch) for batch in batches],
        lambda: [sum_of_task(shared, aims, 1, task, 1000) for task in tasks],
    )
    times = np.zeros((rounds, len(work)))
    with threadpool_limits(1, user_api="blas"):
        for row in times:
            for place, one in enumerate(work):
                start = time.process_time()
                one()
                row[place] = time.process_time() - start
    own, bare, whole = times.T
    BARE.append(
        f"| {n} | {np.median(own):.3f} | {np.median(bare):.3f} | {np.median(own / bare):.2f} |"
        f" {np.median(whole):.3f} | {np.median(whole / own):.2f} |"
    )


def by_scipy(shared: Reference, k: int) -> State:
    """One replicate by a general-purpose optimiser with dense derivatives."""
    design, start, layout = shared.design, shared.start, shared.factor.layout
    drawn = draw(shared, 1, 0)
    x = shared.exact.copy()
    for group in shared.groups:
        match = {
            (int(b), int(p)): i
            for i, (b, p) in enumerate(
                zip(design.readings.ball, design.readings.probe, strict=True)
            )
            if design.readings.position[i] == group.position
        }
        # Groups of a position hold its probes one after the other.
        earlier = [
            g
            for g in shared.groups
            if g.position == group.position and g.rows.start < group.rows.start
        ]
        own = sorted({p for _, p in match})
        turn = sum(1 for g in earlier if g.ball == group.ball)
        rows = [
            match[ball, own[turn]]
            for ball in np.arange(len(design.balls.places))[group.ball].tolist()
        ]
        x[rows] += drawn.moved[k][:, group.rows].T
    pairs = design.of(CalibratedDistances)
    real = shared.truth.state.balls
    apart = np.sqrt(((real[pairs.first] - real[pairs.second]) ** 2).sum(axis=1))
    observed = design.observed(replace(pairs, value=apart + drawn.errors[0][k]))
    n, d = design.balls.places.shape
    columns = layout.pose_columns

    def state_of(v: Array) -> State:
        shared_part = v[n * d :]
        poses = np.where(columns >= 0, shared_part[np.maximum(columns, 0)], 0.0)
        return State(
            start.balls + v[: n * d].reshape(n, d),
            rotation_from_vector(poses[:, d:]) @ start.rotations,
            start.origins + poses[:, :d],
            start.a + shared_part[layout.model],
            start.probes,
            start.lengths,
        )

    def residuals(v: Array) -> Array:
        state = state_of(v)
        blocks = reading_blocks(observed, state, observed.readings, x)
        tied = observed.of(CalibratedDistances).rows(observed, state, x)
        return np.concatenate([blocks.residual.ravel(), tied.residual])

    def jacobian(v: Array) -> Array:
        state, readings = state_of(v), observed.readings
        blocks = reading_blocks(observed, state, readings, x)
        m = len(readings)
        rows = np.zeros((m, d, len(v)))
        at = np.arange(m)
        for axis in range(d):
            rows[at, :, d * readings.ball + axis] = blocks.by_ball[:, :, axis]
        used = columns[readings.position]
        for j in range(columns.shape[1]):
            free = used[:, j] >= 0
            rows[at[free], :, n * d + used[free, j]] = blocks.by_pose[free, :, j]
        rows[:, :, n * d + layout.model.start :] = blocks.by_model
        tied = observed.of(CalibratedDistances).rows(observed, state, x)
        below = np.zeros((len(tied.residual), len(v)))
        for axis in range(d):
            below[np.arange(len(below)), d * pairs.first + axis] = tied.by_ball[:, 0, axis]
            below[np.arange(len(below)), d * pairs.second + axis] = tied.by_ball[:, 1, axis]
        return np.concatenate([rows.reshape(m * d, -1), below])

    tight = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    solution = least_squares(
        residuals, np.zeros(n * d + len(layout)), jacobian, x_scale="jac", **tight
    )
    return state_of(solution.x)


def product_rate(shared: Reference) -> float:
    """Rate of the products with the derivatives by the model, as a share of dgemm's on arrays of
    the same shapes.
    """
    from scipy.linalg.blas import dgemm

    generator = np.random.default_rng(1)
    step = generator.standard_normal((BATCH, len(shared.start.a)))
    work, plain = [], []
    for group in shared.groups:
        assert isinstance(group.model, Expansion)
        pull = generator.standard_normal((BATCH, *group.arm.shape))
        for i, columns in enumerate(group.model.columns):
            matrix = group.model.by_parameters[i]
            work.append((matrix, step, columns, pull[:, i]))
            a, b, c = (np.asfortranarray(v) for v in (matrix, step[:, columns], pull[:, i]))
            plain.append((a, b, c, np.asfortranarray(matrix.T)))

    def ours() -> None:
        for matrix, parameters, columns, force in work:
            parameters[:, columns] @ matrix
            force @ matrix.T

    def bare() -> None:
        for a, b, c, transposed in plain:
            dgemm(1.0, b, a)
            dgemm(1.0, c, transposed)

    with threadpool_limits(1, user_api="blas"):
        ours(), bare()
        ratios = []
        for _ in range(15):
            start = time.perf_counter()
            ours()
            middle = time.perf_counter()
            bare()
            ratios.append((time.perf_counter() - middle) / (middle - start))
    return float(np.median(ratios))


def test_memory_does_not_grow_with_replicates() -> None:
    """A run of a hundred thousand, and a million if asked for, in a process of its own."""
    peaks = {}
    for count in (1024, 100_000):
        command = [sys.executable, "-m", "benchmarks.bench_montecarlo", str(count)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
        peaks[count] = json.loads(done.stdout)
        seconds, peak = peaks[count]["seconds"], peaks[count]["peak"]
        LINES.append(
            f"{count} replicates at n = 5 in one process: {seconds:.1f} s, peak {peak:.0f} MiB"
        )
    assert peaks[100_000]["peak"] < 1.1 * peaks[1024]["peak"] + 10


def test_table(capsys: pytest.CaptureFixture[str]) -> None:
    with capsys.disabled():
        print(
            "\n\n| n | readings | one process, s | two, s | and statistics, s | SciPy, one, s |"
            " ratio | of dgemm, % |"
        )
        print("\n".join(LINES))
        print("\n| n | estimates, s | bare NumPy, s | ratio | and statistics, s | to estimates |")
        print("\n".join(BARE))


if __name__ == "__main__":
    begun = time.perf_counter()
    run_trials(prepared(5), 1, int(sys.argv[1]))
    # Of this program alone: the resource usage that the system counts begins with that of whoever
    # started it.
    status = Path("/proc/self/status").read_text(encoding="utf-8")
    peak = int(status.partition("VmHWM:")[2].split()[0]) / 1024
    print(json.dumps({"seconds": time.perf_counter() - begun, "peak": peak}))
