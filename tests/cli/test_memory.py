"""A want of memory, wherever it shows, is told in one line with status 3."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from argparse import Namespace
from collections.abc import Callable
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import _module_of, commands_of_all, main
from ballplate.cli.memory import SMALLER, no_memory
from ballplate.cli.run import run
from ballplate.simulator.computing.processes import in_processes

QUICKSTART = "designs/quickstart.yaml"


def _array() -> None:
    np.empty(1 << 58)


def _plain() -> None:
    raise MemoryError


def _fork() -> None:
    raise OSError(errno.ENOMEM, "Cannot allocate memory")


@pytest.mark.parametrize(
    "command", ["check", "run", "plan", "reach", "run --reliability", "compare"]
)
@pytest.mark.parametrize(
    ("failure", "told"),
    [(_array, ": there is no room for another 2.00 EiB; "), (_plain, "; "), (_fork, "; ")],
)
def test_no_memory_in_any_command(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: str,
    failure: Callable[..., None],
    told: str,
) -> None:
    module = _module_of(command)

    def fails(options: Namespace) -> int:
        failure()
        return 0

    monkeypatch.setattr(module, "run", fails)
    arguments = ["--target", "1 um"] if command == "reach" else []
    assert main([command, QUICKSTART, *arguments]) == 3
    out, err = capsys.readouterr()
    assert out == ""
    assert (
        err
        == f"{QUICKSTART}: {command} needs more memory than is available{told}{SMALLER[command]}\n"
    )


def _killed() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.parametrize(
    ("work", "told"),
    [(_killed, "a worker process of run was ended"), (_array, "run needs more memory")],
)
def test_no_memory_in_a_worker(work: Callable[[], None], told: str) -> None:
    """The first as if the system had ended it for want of memory."""
    with pytest.raises((BrokenProcessPool, MemoryError)) as caught:
        list(in_processes(work, [(), ()], 2))
    options = Namespace(command="run", run=run, files=[Path(QUICKSTART)])
    message = no_memory(caught.value, options)
    assert message is not None and message.startswith(f"{QUICKSTART}: {told}")


@pytest.mark.parametrize(
    "error", [ValueError("1 GiB"), OSError(errno.ENOSPC, "No space left on device")]
)
def test_other_errors_are_none_of_memory(error: Exception) -> None:
    assert no_memory(error, Namespace(command="run", run=run, files=[])) is None


def test_a_process_with_little_memory(tmp_path: Path) -> None:
    """The design's plates have 40,000 balls; the limit is what the program has once it is loaded,
    and a little more.
    """
    text = (
        Path(QUICKSTART).read_text(encoding="utf-8").replace("balls: [5, 5]", "balls: [200, 200]")
    )
    (tmp_path / "large.yaml").write_text(text, encoding="utf-8")
    code = (
        "import os, resource, sys, scipy.linalg, scipy.spatial;"
        "import ballplate.cli.run, ballplate.results.checked_designs;"
        "taken = int(open('/proc/self/statm').read().split()[0]) * os.sysconf('SC_PAGE_SIZE');"
        "resource.setrlimit(resource.RLIMIT_AS, (taken + 200_000_000,) * 2);"
        "from ballplate.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    if not sys.platform.startswith("linux"):
        pytest.skip("the limit is set and the memory taken is read as on Linux")
    found = subprocess.run(
        [sys.executable, "-c", code, "run", str(tmp_path / "large.yaml")],
        capture_output=True,
        text=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    assert found.returncode == 3, found.stderr
    assert found.stdout == ""
    (line,) = found.stderr.splitlines()
    assert line.startswith(f"{tmp_path}/large.yaml: run needs more memory than is available")


def test_remedies_are_of_commands() -> None:
    assert set(SMALLER) <= set(commands_of_all())
