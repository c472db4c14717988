"""A want of memory, wherever it shows, is told in one line with status 3."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.cli._parsers import module_of
from ballplate.simulator.computing.processes import in_processes

QUICKSTART = "designs/quickstart.yaml"


def _array() -> None:
    np.empty(1 << 58)


def _plain() -> None:
    raise MemoryError


def _fork() -> None:
    raise OSError(errno.ENOMEM, "Cannot allocate memory")


def _killed() -> None:
    """As if the system had ended a worker for want of memory."""
    list(in_processes(_end, [(), ()], 2))


def _end() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


WANT = "ballplate run needs more memory than is available"
REMEDY = "; make the design smaller, or use fewer --workers\n"


@pytest.mark.parametrize(
    ("failure", "told"),
    [
        (_array, f"{WANT}: there is no room for another 2.00 EiB{REMEDY}"),
        (_plain, f"{WANT}{REMEDY}"),
        (_fork, f"{WANT}{REMEDY}"),
        (_killed, "ballplate run: a worker process was ended from outside, as a rule because"),
    ],
)
def test_no_memory(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    failure: Callable[..., None],
    told: str,
) -> None:
    monkeypatch.setattr(module_of("run"), "run", lambda _: failure())
    assert main(["run", QUICKSTART]) == 3
    out, err = capsys.readouterr()
    assert out == "" and err.startswith(told) and err.count("\n") == 1


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
        "import ballplate.cli.run, ballplate.results.checked_files;"
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
    assert line.startswith(WANT)
