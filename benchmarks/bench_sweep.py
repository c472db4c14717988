"""How much of a sweep's time is spent on anything but its cells, what a case costs in terms of
`run`, and how long a large store takes to read.

Run with

    python -m pytest benchmarks/bench_sweep.py

Two thousand small cells go through the command as a user starts it. What a cell takes is what its
worker counts from the cell's first line of Python to the last; the share of that in wall time times
workers leaves the start of all processes, the traffic between them and the writing of the store as
what it costs.
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.extensions.sweeps.bundle import bundle_of, definition
from ballplate.extensions.sweeps.load import load_sweep
from ballplate.extensions.sweeps.running import stored_result
from ballplate.extensions.sweeps.store import add_rows, add_sweep, open_store
from ballplate.extensions.sweeps.task import CellTask, compute

ROOT = Path(__file__).parents[1]
SWEEP = """\
title: two thousand small cells
base: {base}
axes:
  size: {{paths: ["artefacts.plate.size[0]", "artefacts.plate.size[1]"], from: 500 mm, to: 750 mm, count: {count}}}
  balls: {{paths: ["artefacts.plate.balls[0]", "artefacts.plate.balls[1]"], values: [4, 5]}}
"""
LINES: list[str] = []


def written(folder: Path, count: int) -> Path:
    path = folder / "many.yaml"
    path.write_text(
        SWEEP.format(base=ROOT / "designs" / "quickstart.yaml", count=count), encoding="utf-8"
    )
    return path


@pytest.mark.parametrize("workers", [1, 2])
def test_share_of_computation(tmp_path: Path, workers: int) -> None:
    path = written(tmp_path, 1000)
    command = [sys.executable, "-m", "ballplate", "sweep", str(path), "--workers", str(workers)]
    begun = time.perf_counter()
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    wall = time.perf_counter() - begun
    store = open_store(tmp_path / "many.sqlite")
    table = stored_result(store).table
    store.close()
    assert len(table) == 2000 and (table["status"] == "done").all()
    share = table["duration_s"].sum() / (workers * wall)
    LINES.append(
        f"2000 cells, {workers} workers: {wall:.1f} s, {1000 * table['duration_s'].mean():.1f} ms a"
        f" cell, {100 * share:.1f} % of the time in the cells"
    )


def test_a_large_store(tmp_path: Path) -> None:
    path = written(tmp_path, 50_000)
    sweep = load_sweep(path)
    row = compute(sweep, CellTask(0))
    begun = time.perf_counter()
    store = open_store(tmp_path / "large.sqlite", create=True)
    number = add_sweep(store, definition(sweep, bundle_of(sweep)))
    add_rows(
        store,
        number,
        (type(row)(**{**row.__dict__, "number": k, "key": f"{k:040d}"}) for k in range(100_000)),
    )
    store.close()
    made = time.perf_counter() - begun
    begun = time.perf_counter()
    store = open_store(tmp_path / "large.sqlite")
    table = stored_result(store).table
    store.close()
    read = time.perf_counter() - begun
    assert table.shape[0] == 100_000
    size = (tmp_path / "large.sqlite").stat().st_size / 2**20
    LINES.append(
        f"100,000 cells: {made:.1f} s to write at one go, {size:.0f} MiB, {read:.1f} s to open and"
        " read"
    )


def test_a_case_costs_little_more_than_a_run() -> None:
    """In one process, in turn; the first round loads what both need."""
    experiment, path = bp.quickstart(), "machine.repeatability"
    values = [f"{200 + k / 4:.2f} nm" for k in range(200)]
    rounds = []
    for _ in range(6):
        begun = time.perf_counter()
        for value in values:
            bp.run(experiment.with_({path: value}))
        between = time.perf_counter()
        bp.sweep(experiment, {path: values})
        rounds.append((between - begun, time.perf_counter() - between))
    ratios = sorted(swept / run for run, swept in rounds[1:])
    LINES.append(f"a case in terms of run: {ratios[0]:.2f} to {ratios[-1]:.2f} times")


def test_lines(capsys: pytest.CaptureFixture[str]) -> None:
    with capsys.disabled():
        print("\n" + "\n".join(LINES))
