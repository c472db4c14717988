"""Sweeps on a real scheduler and workers of this machine; a cluster that cannot be used, or not any
longer, is told in one line.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from ballplate.cli import main
from ballplate.extensions.sweeps import cluster
from ballplate.extensions.sweeps.cluster import ClusterError, OtherVersionError, _on_worker
from ballplate.extensions.sweeps.task import CellTask

from tests.extensions.sweeps import wording
from tests.extensions.sweeps.support import (
    ROOT,
    assert_same,
    command,
    planned_sweep,
    rows,
    small_sweep,
    stored,
)

Start = Callable[..., subprocess.Popen[bytes]]

# One with another version.
OTHER = """
import importlib.metadata
real = importlib.metadata.version
importlib.metadata.version = lambda name: "0.0.7" if name == "ballplate" else real(name)
"""
# One with the same version but other code.
OTHER_CODE = """
import ballplate.extensions.sweeps.cluster
ballplate.extensions.sweeps.cluster.code_digest = lambda: "other"
"""
SERVE = """
import asyncio, sys
from distributed import Worker
async def serve():
    async with Worker(sys.argv[1], nthreads=1, dashboard=False) as worker:
        await worker.finished()
asyncio.run(serve())
"""


@pytest.fixture(scope="module")
def start(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Start]:
    processes, folder = [], tmp_path_factory.mktemp("started")

    def begin(*arguments: str) -> subprocess.Popen[bytes]:
        with (folder / "log").open("ab") as log:
            process = subprocess.Popen(
                [sys.executable, *arguments],
                stdout=log,
                stderr=log,
                cwd=ROOT,
                start_new_session=True,
            )
        processes.append(process)
        return process

    yield begin
    for process in reversed(processes):
        ended_at_once(process)


def ended_at_once(process: subprocess.Popen[bytes]) -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@pytest.fixture(scope="module")
def scheduler(
    tmp_path_factory: pytest.TempPathFactory, start: Start
) -> tuple[str, subprocess.Popen[bytes]]:
    """Address and process of a scheduler without workers."""
    file = tmp_path_factory.mktemp("scheduler") / "scheduler.json"
    options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    options += ["--scheduler-file", str(file)]
    process = start("-m", "distributed.cli.dask_scheduler", *options)
    end = time.monotonic() + 60
    # The file may be there before its content.
    while not (file.exists() and file.read_text(encoding="utf-8")):
        assert time.monotonic() < end and process.poll() is None
        time.sleep(0.05)
    return json.loads(file.read_text(encoding="utf-8"))["address"], process


def ended(path: Path, address: str) -> str:
    """What a sweep that ends with status 3 says."""
    arguments = command("sweep", path, "--scheduler", address)
    done = subprocess.run(arguments, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 3 and done.stdout == "" and done.stderr.count("\n") == 1, done.stderr
    return done.stderr


def test_no_worker(
    tmp_path: Path, scheduler: tuple[str, subprocess.Popen[bytes]], monkeypatch: pytest.MonkeyPatch
) -> None:
    from distributed import Client

    monkeypatch.setattr(cluster, "PATIENCE", 0.2)
    with (
        cluster._quiet(),
        Client(scheduler[0], set_as_default=False) as client,
        pytest.raises(ClusterError, match=wording.THE_CLUSTER_HAS_NO_WORKERS),
    ):
        cluster._check_versions(client)


def test_workers_with_other_code_are_refused(
    tmp_path: Path, scheduler: tuple[str, subprocess.Popen[bytes]], start: Start
) -> None:
    address, _ = scheduler
    path = small_sweep(tmp_path, 2)
    for other, words in ((OTHER, "ballplate 0.0.7"), (OTHER_CODE, "other code of ballplate 0.1.0")):
        worker = start("-c", other + SERVE, address)
        err = ended(path, address)
        assert f" has {words}, and this is ballplate 0.1.0; install the same ballplate on" in err
        assert err.startswith("the worker tcp://127.0.0.1:")
        ended_at_once(worker)
    assert stored(tmp_path / "small.sqlite") == 0


def test_a_worker_that_comes_later_computes_nothing_with_other_code() -> None:
    with pytest.raises(OtherVersionError):
        _on_worker(cluster.Bundle("", "", ()), "other", CellTask(0))


def test_files_that_are_lost_are_sent_again_ten_times(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where all workers of a task end each time; four tasks for each thread are sent at once."""
    sent = []

    def result(number: int) -> int:
        if number == 2:
            raise CancelledError
        return number

    class Client:
        status, loop, is_silent = "running", None, True
        wait_for_workers = nthreads = lambda *_, **__: {"one": 1, "two": 1}

        def scatter(self, what: list[str], broadcast: bool) -> list[str]:
            sent.append(what)
            return what

        def run_on_scheduler(self, *_: object) -> None:
            if self.is_silent:
                raise OSError

        def submit(self, _: object, bundle: str, code: str, task: CellTask, **how: Any) -> Any:
            assert bundle == "files" and how == {"pure": False, "retries": 0}
            answers = {"result": lambda: result(task.number), "release": lambda: None}
            return SimpleNamespace(key=(task.number, len(sent)), **answers)

    class Completed(list):
        add = list.append

        def __init__(self, first: list[Any], loop: None) -> None:
            assert len(first) == 8
            super().__init__(first)

    monkeypatch.setattr("distributed.as_completed", Completed)
    monkeypatch.setattr(cluster, "lost", lambda sweep, task: f"lost {task.number}")
    client, tasks = Client(), [CellTask(k) for k in range(11)]
    assert [*cluster._rows(client, None, "files", tasks)] == [0, 1, *range(3, 11), "lost 2"]
    assert sent == 11 * [["files"]]
    for status, is_silent in (("running", True), ("closed", False), ("running", False)):
        client.status, client.is_silent = status, is_silent
        assert cluster._is_there(client) == (status == "running" and not is_silent)
    with pytest.raises(ClusterError, match="worker b has 2, and this is 1, and 1 more differ;"):
        cluster._refuse({"a": "1", "b": "2", "c": "3"}, "1")


def worker_processes(nannies: int) -> list[int]:
    tasks = Path(f"/proc/{nannies}/task").glob("*/children")
    found = [one for task in tasks for one in task.read_text(encoding="ascii").split()]
    return [int(one) for one in found if b"spawn_main" in Path(f"/proc/{one}/cmdline").read_bytes()]


@pytest.mark.slow
def test_a_cluster_gives_the_same_rows_even_if_a_worker_dies(
    tmp_path: Path,
    scheduler: tuple[str, subprocess.Popen[bytes]],
    start: Start,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    address, _ = scheduler
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    options = ["--nworkers", "2", "--nthreads", "1", "--no-dashboard"]
    options += ["--local-directory", str(tmp_path)]
    workers = start("-m", "distributed.cli.dask_worker", address, *options)
    path = small_sweep(tmp_path, 4, "trials: 2\n")
    alone = tmp_path / "alone.sqlite"
    assert main(["sweep", str(path), "--store", str(alone), "--workers", "1"]) == 1
    arguments = command("sweep", path, "--scheduler", address)
    with subprocess.Popen(
        arguments, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        end = time.monotonic() + 120
        while (
            process.poll() is None
            and stored(tmp_path / "small.sqlite") < 2
            and time.monotonic() < end
        ):
            time.sleep(0.05)
        if process.poll() is None:
            os.kill(worker_processes(workers.pid)[0], signal.SIGKILL)
        out, err = process.communicate(timeout=180)
    assert process.returncode == 1 and "8 cases, 6 done, 2 failed" in out, err
    assert "Traceback" not in err
    assert_same(rows(tmp_path / "small.sqlite"), rows(alone))
    # What is unpacked is in the folders of the workers, which dask deletes whatever ends them.
    assert not list(temporary.glob("ballplate-*"))
    ended_at_once(workers)


@pytest.mark.slow
def test_planned_cases_on_a_cluster(
    tmp_path: Path, scheduler: tuple[str, subprocess.Popen[bytes]], start: Start
) -> None:
    worker, path, alone = start("-c", SERVE, scheduler[0]), planned_sweep(tmp_path), "alone.sqlite"
    assert main(["sweep", str(path), "--scheduler", scheduler[0]]) == 0
    assert main(["sweep", str(path), "--store", str(tmp_path / alone), "--workers", "1"]) == 0
    assert_same(rows(tmp_path / "plans.sqlite"), rows(tmp_path / alone))
    ended_at_once(worker)


def test_no_scheduler(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "CONNECTION_TIMEOUT", 1)
    address = "tcp://127.0.0.1:1"
    assert main(["sweep", str(small_sweep(tmp_path, 2)), "--scheduler", address]) == 3
    err = capsys.readouterr().err
    assert err.splitlines()[-1].startswith(f"{address}: there is no scheduler"), err


@pytest.mark.parametrize("address", ["7", "nan", "tcp://x", "foo://a:1", ""])
def test_an_address_that_is_none(
    address: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sweep", str(small_sweep(tmp_path, 2)), "--scheduler", address]) == 3
    err = capsys.readouterr().err
    assert err.splitlines()[-1].startswith(f"{address}: is not the address of a scheduler; ")


@pytest.mark.slow
def test_a_scheduler_that_ends(
    tmp_path: Path, scheduler: tuple[str, subprocess.Popen[bytes]], start: Start
) -> None:
    """The last test, since it ends the one that all use."""
    address, process = scheduler
    start("-c", SERVE, address)
    path, store = small_sweep(tmp_path, 100, "trials: 50\n"), tmp_path / "small.sqlite"
    arguments = command("sweep", path, "--scheduler", address)
    with subprocess.Popen(
        arguments, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as sweep:
        end = time.monotonic() + 100
        while sweep.poll() is None and stored(store) < 2 and time.monotonic() < end:
            time.sleep(0.02)
        process.kill()
        out, err = sweep.communicate(timeout=100)
    last = err.splitlines()[-1]
    assert sweep.returncode == 3 and "Traceback" not in err and out == "", err
    assert last.startswith(f"the scheduler at {address} has ended; finished cases are stored"), err
    assert 2 <= stored(store) < 200
