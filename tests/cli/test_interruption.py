"""Interruptions from the keyboard (SIGINT) at awkward moments: status 130, one line, no
traceback.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import types
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from ballplate.cli import main
from ballplate.cli.dispatch import Interruption
from ballplate.extensions.sweeps import execute
from ballplate.simulator.computing import processes
from ballplate.simulator.computing.processes import in_processes

from tests.cli import wording
from tests.extensions.sweeps.support import ROOT, hearing_interruptions, small_sweep, stored


@pytest.fixture(autouse=True)
def heard() -> Iterator[None]:
    """Interruptions are heard here too if the tests run in the background, where shells have them
    ignored.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def swallowed() -> None:
    """An interruption in a place that lets no exception out."""
    with suppress(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def test_one_that_was_swallowed_ends_a_sweep(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, store = small_sweep(tmp_path, 3), tmp_path / "small.sqlite"
    add_rows = execute.add_rows

    def interrupted_once(*arguments: Any) -> None:
        add_rows(*arguments)
        if stored(store) == 2:
            swallowed()

    monkeypatch.setattr(execute, "add_rows", interrupted_once)
    assert main(["sweep", str(path), "--workers", "1"]) == 130
    out, err = capsys.readouterr()
    assert out == "" and err.startswith(wording.INTERRUPTED_FINISHED_CELLS) and err.count("\n") == 1
    assert stored(store) == 2
    assert main(["sweep", str(path), "--workers", "1"]) == 1
    assert wording.CELLS_DONE_FAILED_OF_THEM_BEFORE in capsys.readouterr().out


def test_one_that_was_swallowed_ends_monte_carlo(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from ballplate.montecarlo import experiments as trials

    accuracy_of = trials.accuracy_of

    def interrupted(*arguments: Any) -> float:
        swallowed()
        return accuracy_of(*arguments)

    monkeypatch.setattr(trials, "accuracy_of", interrupted)
    quickstart = str(ROOT / "designs" / "quickstart.yaml")
    assert main(["run", quickstart, "--trials", "1000000", "--workers", "1"]) == 130
    assert wording.THE_RESULTS_ARE_THOSE in capsys.readouterr().err


@pytest.mark.parametrize("module", ["ballplate.simulator.inputs.messages", "numpy", "joblib"])
def test_while_modules_are_loaded(tmp_path: Path, module: str) -> None:
    """The first second of every command is this."""
    path = small_sweep(tmp_path, 3)
    code = (
        "import signal, sys\n"
        "class Interrupting:\n"
        "    def find_spec(self, name, *_):\n"
        f"        if name == {module!r}:\n"
        "            signal.raise_signal(signal.SIGINT)\n"
        "sys.meta_path.insert(0, Interrupting())\n"
        "from ballplate.cli import main\n"
        "sys.exit(main(sys.argv[1:]))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "sweep", path, "--workers", "2"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
        preexec_fn=hearing_interruptions,
    )
    assert done.returncode == 130, done.stderr
    assert done.stderr.startswith("interrupted") and done.stderr.count("\n") == 1


def test_work_of_one_process_leaves_signals_alone() -> None:
    before = signal.getsignal(signal.SIGINT)
    assert list(in_processes(abs, [(-1,), (2,)], 1)) == [1, 2]
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_processes_are_started_undisturbed(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    """A signal amid their start is answered after it, and they end then."""
    import joblib

    class Interrupted(joblib.Parallel):  # type: ignore[misc]
        def __call__(self, tasks: Any) -> Any:
            results = super().__call__(tasks)
            signal.raise_signal(number)
            begun.append(number)
            return results

    begun: list[int] = []
    monkeypatch.setattr(joblib, "Parallel", Interrupted)
    interruption = Interruption()
    before = signal.signal(number, interruption.handle)
    try:
        with pytest.raises(KeyboardInterrupt):
            list(in_processes(abs, [(-1,), (2,)], 2))
    finally:
        signal.signal(number, before)
    assert begun == [number] and interruption.came == signal.Signals(number).name
    assert not [one for one in multiprocessing.active_children() if "Loky" in one.name]


def test_where_signals_cannot_be_blocked(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows."""
    monkeypatch.delattr(signal, "pthread_sigmask")
    assert list(in_processes(abs, [(-1,), (2,)], 2)) == [1, 2]


def test_a_worker_of_windows_waits_for_its_parent(monkeypatch: pytest.MonkeyPatch) -> None:
    """Windows keeps the number of a parent that has ended."""
    done: list[object] = []
    fake = types.SimpleNamespace(
        INFINITE=-1,
        OpenProcess=lambda rights, inherited, process: done.append(("opened", process)) or "handle",
        WaitForSingleObject=lambda handle, limit: done.append(("waited", handle, limit)),
    )
    monkeypatch.setitem(sys.modules, "_winapi", fake)
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(os, "_exit", done.append)
    processes._end_with(17)
    assert done == [("opened", 17), ("waited", "handle", -1), 1]
