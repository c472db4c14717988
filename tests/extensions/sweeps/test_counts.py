"""What sweeps count: subsets, steps while blocks are computed, seconds to come."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import pytest
from ballplate.extensions.sweeps import estimate
from ballplate.extensions.sweeps.execute import run_sweep
from ballplate.extensions.sweeps.load import load_sweep
from ballplate.extensions.sweeps.task import CellResult
from ballplate.extensions.sweeps.values import subset_count, subsets
from ballplate.simulator.computing import ProgressStep

from tests.extensions.sweeps.stores import axis, made_up
from tests.extensions.sweeps.support import small_sweep


@pytest.mark.parametrize("always, among", [("", "abcdef"), ("c", "abcdef"), ("bf", "ade")])
@pytest.mark.parametrize("sizes", [(1, 3), (2,), (4, 5, 6)])
def test_subsets_are_all_of_a_size(always: str, among: str, sizes: tuple[int, ...]) -> None:
    found = subsets([*"abcdef"], (*always,), (*among,), sizes)
    allowed = {*always, *among}
    expected = [
        some
        for size in sizes
        for some in combinations("abcdef", size)
        if {*always} <= {*some} <= allowed
    ]
    assert [names for _, names in found] == expected
    if len(allowed) == 6:
        assert subset_count(6, len(always), sizes) == len(expected)
    for label, names in found:
        others = [name for name in "abcdef" if name not in names]
        without = label.removeprefix("all").removeprefix(" but ")
        is_short = 2 * len(others) < len(names)
        assert label.startswith("all") is is_short
        assert without == (" and ".join(others) if is_short else " + ".join(names))


@pytest.mark.parametrize("fail_fast", [False, True])
def test_a_run_reports_each_row(
    fail_fast: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Seven blocks of data sets of four cells, of at most 16 at once; a block of one fails."""
    monkeypatch.setattr("ballplate.extensions.sweeps.task.BLOCK", 100)
    sweep = load_sweep(small_sweep(tmp_path, 2, "trials: 650\n"))
    calls, rows, steps = [], list[CellResult](), list[ProgressStep]()

    def runner(tasks):
        calls.append([(task.number, task.block) for task in tasks])
        for task in tasks:
            status = "failed" if (task.number, task.block) == (1, 4) else "done"
            rows.append(CellResult(task.number, task.block, f"key {task.number}", status, "why"))
            yield rows[-1]

    with closing(made_up(tmp_path / "s.sqlite", "s", [axis("k", "abcd")], [])) as store:
        summary = run_sweep(store, 1, sweep, runner, fail_fast=fail_fast, report=steps.append)
    blocks = [[(k, block) for k in pair for block in range(1, 8)] for pair in ((0, 1), (2, 3))]
    every = [blocks[0], [(0, 0)], blocks[1], [(2, 0), (3, 0)]]
    assert calls == (every[:1] if fail_fast else every)
    assert rows[-1].status == ("failed" if fail_fast else "done")
    for k, step in enumerate(steps):
        failed = sum(row.status == "failed" for row in rows[:k])
        done = sum(row.block == 0 for row in rows[:k]) + failed
        count = sum(row.block > 0 for row in rows[:k]) - failed
        words = [f"{count} block{'s' * (count > 1)} of data sets"] * (count > 0)
        words = [f"{done} of 4 cases", *words, *[f"{failed} failed"] * failed]
        assert str(step) == ", ".join(words)
    assert (summary.done, summary.failed, len(steps)) == (
        (3, 1, 1 + 7 + 7 + 1 + 14 + 2) if not fail_fast else (0, 1, 1 + 7 + 4)
    )


def test_the_time_to_come_is_that_of_the_cells_and_data_sets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Cells take 1 s, 2 s, ... and each data set 10 ms; the last of six fails without."""

    def computed(sweep, task) -> CellResult:
        status = "failed" if task.number == 5 else "done"
        seconds = 1.0 + task.number + 0.01 * (sweep.trials or 0)
        return CellResult(task.number, 0, "key", status, seconds=seconds)

    monkeypatch.setattr(estimate, "compute", computed)
    sweep = load_sweep(small_sweep(tmp_path, 3))
    for trials in (None, 100, 5000):
        seconds, rows = estimate.seconds_of(replace(sweep, trials=trials))
        assert [row.number for row in rows] == [0, 2, 5]
        assert seconds == pytest.approx(6 * (1 + 3 + 6 + 2 * 0.01 * (trials or 0)) / 3)
