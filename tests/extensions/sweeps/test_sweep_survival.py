"""A sweep that is killed, starved or interrupted goes on, and ends with exactly the rows of an
undisturbed one.
"""

from __future__ import annotations

import os
import resource
import shutil
import signal
import sqlite3
import subprocess
import time
from collections.abc import Callable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, nullcontext, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from ballplate.cli import main
from ballplate.extensions.sweeps import local
from ballplate.extensions.sweeps.execute import run_sweep
from ballplate.extensions.sweeps.load import load_sweep
from ballplate.extensions.sweeps.task import CellResult, CellTask
from ballplate.simulator.computing import ProgressStep
from joblib.externals.loky.process_executor import TerminatedWorkerError

from tests.cli.cuts import COMMIT, remains
from tests.cli.test_outputs import BALLS, DESIGN
from tests.extensions.sweeps import wording
from tests.extensions.sweeps.stores import axis, made_up
from tests.extensions.sweeps.support import (
    ROOT,
    assert_same,
    command,
    hearing_interruptions,
    rows,
    run,
    small_sweep,
    stored,
)

Change = Callable[[], None]


def children(process: int) -> list[int]:
    """Processes started by another that compute."""
    path = Path(f"/proc/{process}/task/{process}/children")
    found = []
    # Each of them may end at any moment.
    with suppress(OSError):
        for word in path.read_text(encoding="ascii").split():
            if b"popen_loky" in Path(f"/proc/{word}/cmdline").read_bytes():
                found.append(int(word))
    return found


def wait_until(condition: Callable[[], bool], process: subprocess.Popen[str]) -> bool:
    """Whether a condition came true before the process ended."""
    end = time.monotonic() + 120
    while process.poll() is None:
        assert time.monotonic() < end, "hangs"
        if condition():
            return True
        time.sleep(0.01)
    return False


@pytest.fixture
def started(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    processes: list[subprocess.Popen[str]] = []

    def start(path: Path, *options: str, **how: object) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            command("sweep", path, "--workers", "2", *options),
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            **how,  # type: ignore[call-overload]
        )
        processes.append(process)
        return process

    yield start
    for process in processes:
        process.kill()
        process.wait()
        for stream in (process.stdout, process.stderr):
            if stream is not None:
                stream.close()


CUT = """\
title: cut short
base: design.yaml
axes: {read: {path: machine.repeatability, values: [1 um, 2 um]}}
trials: 6
"""


def row_seconds(store: Path) -> dict[tuple[str, int], float]:
    """How long each row took, by key and block; none before there are rows."""
    with closing(sqlite3.connect(store)) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        tables = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        found = connection.execute("SELECT key, block, seconds FROM result") if any(tables) else []
        return {(key, block): seconds for key, block, seconds in found}


# At each commit, or at each statement.
@pytest.mark.long
@pytest.mark.parametrize("every", [10**6, 1])
def test_killed_before_a_statement(tmp_path: Path, every: int) -> None:
    """No row that was stored is lost or computed twice, that of a replicate block neither."""
    for name, text in (("design.yaml", DESIGN), ("balls.csv", BALLS), ("cut.yaml", CUT)):
        (tmp_path / name).write_text(text, encoding="utf-8")

    def laid_out(left: dict[str, Any]) -> Path:
        folder = tmp_path / "left"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for name, content in left["there"].items():
            (folder / name).write_bytes(content.encode("latin-1"))
        return folder / "store.sqlite"

    store = tmp_path / "cut" / "store.sqlite"
    line = ["sweep", str(tmp_path / "cut.yaml"), "--store", str(store), "--workers", "1"]
    task = {"lines": {"sweep": line}, "before": {"sweep": {}}, "folder": str(store.parent)}
    how = {"signals": [signal.SIGKILL], "every": every, "slow": False, "blocks": 4}
    whole, *found = remains(**task, **how)
    expected, commits = rows(laid_out(whole)), whole["met"].count(COMMIT)
    assert list(expected["status"]) == ["done", "done"] and len(found) >= 2 * commits
    for killed, continued in zip(found[::2], found[1::2], strict=True):
        assert (killed["status"], continued["status"]) == (-signal.SIGKILL, 0)
        before = row_seconds(laid_out(killed))
        path = laid_out(continued)
        assert_same(rows(path), expected)
        after, cut = row_seconds(path), killed["cut"]
        assert all(after[one] == spent for one, spent in before.items() if one[1] == 0)
        left = whole["met"][cut - 1 :].count(COMMIT)
        assert continued["met"].count(COMMIT) == left, cut


@pytest.mark.slow
def test_a_worker_is_killed_and_a_disk_takes_no_more(
    tmp_path: Path,
    started: Callable[..., subprocess.Popen[str]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    path, store = small_sweep(tmp_path, 4, "trials: 2\n"), tmp_path / "small.sqlite"
    undisturbed = tmp_path / "undisturbed.sqlite"
    assert main(["sweep", str(path), "--store", str(undisturbed), "--workers", "1"]) == 1

    def starve() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))

    starved = started(path, preexec_fn=starve)
    _, err = starved.communicate(timeout=120)
    assert starved.returncode == 3 and "make room" in err and "Traceback" not in err, err
    process = started(path)
    before = stored(store)
    assert wait_until(lambda: stored(store) > before, process)
    os.kill(children(process.pid)[0], signal.SIGKILL)
    process.communicate(timeout=240)
    capsys.readouterr()
    assert main(["sweep", str(path), "--workers", "1"]) == 1
    last = capsys.readouterr()
    assert "8 cases" in last.out and "left" not in last.out and "Traceback" not in last.err
    assert_same(rows(store), rows(undisturbed))


@pytest.mark.long
def test_a_worker_that_dies_each_time_fails_its_cell_alone(tmp_path: Path) -> None:
    """An error model that ends its process, as one that takes all memory would."""
    path = small_sweep(tmp_path, 2)
    (tmp_path / "deadly.py").write_text(
        "import multiprocessing, os\n"
        "from ballplate.simulator.machines.kinematic import kinematic_model\n"
        "from ballplate.simulator.machines.arrangement import ARRANGEMENTS\n"
        "def build(lower, upper, deadly=False):\n"
        "    if deadly and multiprocessing.current_process().name != 'MainProcess':\n"
        "        os.kill(os.getpid(), 9)\n"
        "    return kinematic_model(ARRANGEMENTS['MB2'], 3, 3, lower, upper)\n",
        encoding="utf-8",
    )
    text = (tmp_path / "quickstart.yaml").read_text(encoding="utf-8")
    before, _, after = text.partition("error_model:\n")
    after = after[after.index("\n\n") :]
    model = "error_model: {kind: python, object: 'deadly:build', options: {deadly: false}}"
    (tmp_path / "quickstart.yaml").write_text(before + model + after, encoding="utf-8")
    axes = "deadly: {path: error_model.options.deadly, values: [false, true]}"
    path.write_text(f"title: t\nbase: quickstart.yaml\naxes: {{{axes}}}\n", encoding="utf-8")
    done = run("sweep", path, "--workers", "2")
    assert done.returncode == 1, done.stderr
    assert "2 cases, 1 done, 1 failed" in done.stdout
    assert (
        wording.THE_PROCESS_THAT_COMPUTED_IT_WAS in done.stderr and "Traceback" not in done.stderr
    )


def test_what_ends_each_process_is_tried_alone_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four by two workers after every third death."""
    deaths, tried = [], list[int]()

    def dying(*given: object, **how: object) -> Any:
        deaths.append(len(tried))
        raise TerminatedWorkerError

    def submit(work: object, source: object, digest: str, task: CellTask) -> Any:
        tried.append(task.number)
        raise BrokenProcessPool

    alone = SimpleNamespace(submit=submit)
    monkeypatch.setattr(local, "in_processes", dying)
    monkeypatch.setattr(local, "ProcessPoolExecutor", lambda *_, **__: nullcontext(alone))
    monkeypatch.setattr(local, "lost", lambda sweep, task: f"lost {task.number}")
    rows = local._in_workers(None, None, "", [CellTask(k) for k in range(5)], 2)
    assert [*rows] == [f"lost {k}" for k in range(5)]
    assert tried == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4] and deaths[:6] == [0, 0, 0, 8, 8, 8]


def test_one_writer_at_a_time_which_can_be_interrupted(
    tmp_path: Path,
    started: Callable[..., subprocess.Popen[str]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    path, store = small_sweep(tmp_path, 40, "trials: 16\n"), tmp_path / "small.sqlite"
    process = started(path, preexec_fn=hearing_interruptions)
    assert wait_until(lambda: stored(store) > 2, process)
    assert main(["sweep", str(path)]) == 3
    assert wording.ANOTHER_PROCESS_IS_COMPUTING_INTO in capsys.readouterr().err
    # Reading goes on meanwhile.
    assert main(["sweep", "--export", str(store), "-o", str(tmp_path / "t.csv")]) == 0
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert wording.THE_SAME_COMMAND_CONTINUES_FROM_THERE in err and "Traceback" not in err
    assert 2 < stored(store) < 80


@pytest.mark.parametrize("fail_fast", [False, True])
def test_a_run_reports_each_row(
    fail_fast: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Seven blocks of data sets of four cells, of at most 16 at once; a block of one fails."""
    monkeypatch.setattr("ballplate.extensions.sweeps.task.BLOCK", 100)
    sweep = load_sweep(small_sweep(tmp_path, 2, "trials: 650\n"))
    calls, told, steps = [], list[CellResult](), list[ProgressStep]()

    def runner(tasks):
        calls.append([(task.number, task.block) for task in tasks])
        for task in tasks:
            status = "failed" if (task.number, task.block) == (1, 4) else "done"
            told.append(CellResult(task.number, task.block, f"key {task.number}", status, "why"))
            yield told[-1]

    with closing(made_up(tmp_path / "s.sqlite", "s", [axis("k", "abcd")], [])) as store:
        summary = run_sweep(store, 1, sweep, runner, fail_fast=fail_fast, report=steps.append)
    blocks = [[(k, block) for k in pair for block in range(1, 8)] for pair in ((0, 1), (2, 3))]
    every = [blocks[0], [(0, 0)], blocks[1], [(2, 0), (3, 0)]]
    assert calls == (every[:1] if fail_fast else every)
    assert len(told) == (7 + 4 if fail_fast else 14 + 1 + 14 + 2)
    for k, step in enumerate(steps):
        failed = sum(row.status == "failed" for row in told[:k])
        done = sum(row.block == 0 for row in told[:k]) + failed
        count = sum(row.block > 0 for row in told[:k]) - failed
        words = [f"{count} block{'s' * (count > 1)} of data sets"] * (count > 0)
        words = [f"{done} of 4 cases", *words, *[f"{failed} failed"] * failed]
        assert str(step) == ", ".join(words)
    assert (len(steps), summary.failed, summary.done) == (1 + len(told), 1, 3 - 3 * fail_fast)
