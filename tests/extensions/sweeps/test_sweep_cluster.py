"""Sweeps on a real scheduler with two worker processes on this machine."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from ballplate.cli import main
from ballplate.extensions.sweeps import cluster as cluster_of_workers

from tests.extensions.sweeps.support import (
    ROOT,
    assert_same,
    command,
    rows,
    run,
    small_sweep,
    stored,
)

READY = """
import sys
from distributed import Client
with Client(scheduler_file=sys.argv[1], timeout=60) as client:
    client.wait_for_workers(2, timeout=60)
    print(client.scheduler.address)
"""


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """Address of a scheduler, and the process that looks after its two workers."""
    with (tmp_path / "log").open("wb") as log:
        file = tmp_path / "scheduler.json"
        temporary = tmp_path / "temporary"
        temporary.mkdir()
        quiet: dict[str, Any] = {
            "stdout": log,
            "stderr": log,
            "cwd": ROOT,
            "start_new_session": True,
            "env": {**os.environ, "TMPDIR": str(temporary)},
        }
        arguments = [
            "--host",
            "127.0.0.1",
            "--port",
            "0",
            "--no-dashboard",
            "--scheduler-file",
            str(file),
        ]
        scheduler = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_scheduler", *arguments], **quiet
        )
        options = [
            "--scheduler-file",
            str(file),
            "--nworkers",
            "2",
            "--nthreads",
            "1",
            "--no-dashboard",
        ]
        options += ["--local-directory", str(tmp_path)]
        workers = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_worker", *options], **quiet
        )
        try:
            end = time.monotonic() + 60
            while not file.exists():
                assert time.monotonic() < end and scheduler.poll() is None
                time.sleep(0.1)
            # In a process of its own, whose threads and sockets end with it.
            ready = subprocess.run(
                [sys.executable, "-c", READY, str(file)],
                capture_output=True,
                text=True,
                timeout=120,
            )
            assert ready.returncode == 0, ready.stderr
            yield ready.stdout.strip(), workers
        finally:
            for process in (workers, scheduler):
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


def worker_processes(nannies: int) -> list[int]:
    tasks = Path(f"/proc/{nannies}/task").glob("*/children")
    found = [one for task in tasks for one in task.read_text(encoding="ascii").split()]
    return [int(one) for one in found if b"spawn_main" in Path(f"/proc/{one}/cmdline").read_bytes()]


@pytest.mark.slow
def test_a_cluster_gives_the_same_rows_even_if_a_worker_dies(
    tmp_path: Path, cluster: tuple[str, subprocess.Popen[bytes]]
) -> None:
    address, workers = cluster
    path = small_sweep(tmp_path, 8, "trials: 16\n")
    assert run("sweep", path, "--workers", 1, "--store", tmp_path / "alone.sqlite").returncode == 1
    arguments = command("sweep", path, "--scheduler", address)
    with subprocess.Popen(
        arguments, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        end = time.monotonic() + 120
        while (
            process.poll() is None
            and stored(tmp_path / "small.sqlite") < 4
            and time.monotonic() < end
        ):
            time.sleep(0.05)
        if process.poll() is None:
            os.kill(worker_processes(workers.pid)[0], signal.SIGKILL)
        out, err = process.communicate(timeout=180)
    assert process.returncode == 1 and "16 cases, 12 done, 4 failed" in out, err
    assert "Traceback" not in err
    assert_same(rows(tmp_path / "small.sqlite"), rows(tmp_path / "alone.sqlite"))
    # What is unpacked is in the folders of the workers, which dask deletes whatever ends them.
    assert not list((tmp_path / "temporary").glob("ballplate-*"))


def test_no_scheduler(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster_of_workers, "CONNECTION_TIMEOUT", 1)
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
