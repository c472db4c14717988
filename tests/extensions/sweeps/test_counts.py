"""What sweeps count: subsets, steps while blocks are computed, seconds to come."""

from __future__ import annotations

from contextlib import closing
from itertools import combinations
from pathlib import Path

import ballplate as bp
import pytest
import yaml
from ballplate.extensions.sweeps.execute import run_sweep
from ballplate.extensions.sweeps.load import load_sweep
from ballplate.extensions.sweeps.model import Choice
from ballplate.extensions.sweeps.task import CellResult
from ballplate.simulator.computing import ProgressStep

from tests.extensions.sweeps.stores import axis, made_up
from tests.extensions.sweeps.support import small_sweep


@pytest.mark.parametrize(
    "always, among", [((), (0, 1, 2, 3, 4, 5)), ((2,), (0, 1, 5)), ((1, 3), ())]
)
def test_subsets_are_all_of_a_size(
    always: tuple[int, ...], among: tuple[int, ...], tmp_path: Path
) -> None:
    names = [one.name for one in bp.quickstart().positions]
    fewest, most = max(len(always), 1), len({*always, *among})

    def subsets(*sizes: int) -> list[Choice]:
        chosen = {"always": [names[k] for k in always], "among": [names[k] for k in among]}
        axes = {"kept": {"path": "positions", "subsets": {"sizes": [*sizes], **chosen}}}
        path = tmp_path / "s.yaml"
        said = {"title": "t", "base": str(Path("designs/quickstart.yaml").resolve()), "axes": axes}
        path.write_text(yaml.safe_dump(said), encoding="utf-8")
        return load_sweep(path).axes[0].choices

    expected = [
        some
        for size in range(fewest, most + 1)
        for some in combinations(range(6), size)
        if {*always} <= {*some} <= {*always, *among}
    ]
    found = subsets(*range(fewest, most + 1))
    for choice, some in zip(found, expected, strict=True):
        kept, others = [names[k] for k in some], [names[k] for k in range(6) if k not in some]
        assert choice.kept is not None and list(choice.kept[1]) == kept
        words = f"all but {' and '.join(others)}" if others else "all"
        assert choice.label == (words if 2 * len(others) < len(kept) else " + ".join(kept))
    for size in {max(fewest - 1, 1), most + 1} - {fewest}:
        with pytest.raises(bp.ExperimentError, match=f" {size} entries; give {fewest} to {most}"):
            subsets(size)


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
