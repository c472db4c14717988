"""Time and memory of the estimator alone as the plate grows to 10,000 balls.

Run with

    python -m pytest benchmarks/bench_scaling.py

Each size is measured in a process of its own, whose peak resident memory is read off after the
elimination with U1 to U4 and U6, and again after U5, the distances between all pairs of balls.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

SIZES = (25, 50, 100)
ROOT = Path(__file__).parents[1]
MEBIBYTE = 2.0**20


def peak() -> float:
    """Largest resident memory of this process so far, MiB; Linux counts in KiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / MEBIBYTE


def measure(n: int) -> dict[str, float]:
    """Figures for a grid of n x n balls, in this process: memory of one estimate, and seconds of
    the processor, the best of three.
    """
    from ballplate.simulator.estimation.linearisation import linearise
    from ballplate.uncertainty.summaries import point_pairs, uncertainties

    from tests.reference.designs import grid_experiment

    def estimate(size: int):  # type: ignore[no-untyped-def]
        design = grid_experiment(size)
        start = time.process_time()
        found = linearise(design)
        layout = found.layout
        eliminated = time.process_time()
        found.of_balls()
        linear = np.zeros((len(design.model.reported().names), len(layout)))
        linear[:, layout.model] = design.model.reported().matrix
        found.of_shared(np.eye(len(layout))[layout.poses])
        found.of_shared(linear)
        point_pairs(found)
        return design, found, eliminated - start, time.process_time() - eliminated

    estimate(5)
    base = peak()
    design, found, *first = estimate(n)
    memory = peak() - base
    seconds = [first, *(estimate(n)[2:] for _ in range(2))]
    before = peak()
    start = time.process_time()
    pairs = uncertainties(found, symbols=("U5",))["U5"]
    return {
        "readings": len(design.readings),
        "pairs": pairs.count,
        "elimination": min(run[0] for run in seconds),
        "uncertainties": min(run[1] for run in seconds),
        "memory": memory,
        "U5": time.process_time() - start,
        "U5 memory": peak() - before,
    }


@pytest.fixture(scope="module")
def measured() -> dict[int, dict[str, float]]:
    found = {}
    for n in SIZES:
        command = [sys.executable, "-m", "benchmarks.bench_scaling", str(n)]
        run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
        found[n] = json.loads(run.stdout)
    return found


def test_table(measured: dict[int, dict[str, float]], capsys: pytest.CaptureFixture[str]) -> None:
    with capsys.disabled():
        print(
            "\n\n|   n | readings | elimination, s | U1-U4, U6, s | both, us a reading | memory,"
            " MiB | U5 pairs | U5, s | U5 memory, MiB |"
        )
        print("|----:|---------:|---------------:|------:|---:|---:|---------:|------:|------:|")
        for n, figure in measured.items():
            each = 1e6 * (figure["elimination"] + figure["uncertainties"]) / figure["readings"]
            print(
                f"| {n} | {figure['readings']} | {figure['elimination']:.3f} |"
                f" {figure['uncertainties']:.3f} | {each:.1f} | {figure['memory']:.0f} |"
                f" {figure['pairs']} | {figure['U5']:.3f} | {figure['U5 memory']:.0f} |"
            )


def test_memory_grows_no_faster_than_readings(measured: dict[int, dict[str, float]]) -> None:
    small, large = measured[SIZES[1]], measured[SIZES[-1]]
    assert large["memory"] / large["readings"] < 1.25 * small["memory"] / small["readings"]


def test_time_grows_no_faster_than_readings(measured: dict[int, dict[str, float]]) -> None:
    small, large = measured[SIZES[1]], measured[SIZES[-1]]
    for stage in ("elimination", "uncertainties"):
        # The smaller one has the larger share of what does not depend on the readings.
        assert large[stage] / large["readings"] < 1.5 * small[stage] / small["readings"]


def test_all_pairs_are_worked_through_in_bounded_memory(
    measured: dict[int, dict[str, float]],
) -> None:
    """50 million pairs would take 400 MB as one array of results."""
    assert measured[SIZES[-1]]["pairs"] == 10_000 * 9_999 // 2
    assert measured[SIZES[-1]]["U5 memory"] < 100


if __name__ == "__main__":
    print(json.dumps(measure(int(sys.argv[1]))))
