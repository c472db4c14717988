"""Signals at random moments, to commands started as their user would: status, words, files, and
processes left.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from tests.cli import wording
from tests.extensions.sweeps.support import (
    ROOT,
    command,
    hearing_interruptions,
    run,
    small_sweep,
    stored,
)

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/stat").exists(), reason="looks processes up in /proc"
)

DESIGNS = ROOT / "designs"
PLAN = ("plan", DESIGNS / "planning/campaign.yaml", "--curve")
PLAN += ("-o", "choice.yaml", "--sheet", "sheet.html")
TRIALS = ("run", DESIGNS / "npl/6.2.7.yaml", "--trials", "1000000")

# Commands that may last over a second, with the seconds of processor time up to which they are
# interrupted.
ENDLESS = {
    "run by one": ((*TRIALS, "--workers", 1), 8.0),
    "run by two": ((*TRIALS, "--workers", 2), 8.0),
    "compare": (("compare", DESIGNS / "quickstart.yaml", "--trials", 100000), 4.0),
}
ENDING = {
    "plan by one": ((*PLAN, "--workers", 1), 9.0),
    "plan by two": ((*PLAN, "--workers", 2), 9.0),
    "sweep by one": (("sweep", "many.yaml", "--workers", 1, "--store", "new.sqlite"), 5.0),
    "sweep by two": (("sweep", "many.yaml", "--workers", 2, "--store", "new.sqlite"), 7.0),
    "report": (("sweep", "--report", "small.sqlite", "-o", "page.html"), 2.0),
    "export": (("sweep", "--export", "small.sqlite", "-o", "table.csv"), 0.8),
    "reach": (("reach", DESIGNS / "npl/5.3.yaml", "--variant", "kinematic fit"), 1.5),
    "reliability": (
        (
            *("run", "--reliability", DESIGNS / "npl/6.2.7.yaml"),
            *("--variant", "7 x 7", "-o", "all.csv"),
        ),
        1.0,
    ),
    "fit": (
        ("fit", DESIGNS / "certified/three-planes.yaml", DESIGNS / "certified/three-planes.csv"),
        2.0,
    ),
    "reproduce": (("reproduce", "npl", "--designs", DESIGNS / "npl"), 12.0),
    "check": (("check", "--suggest", DESIGNS / "npl/6.1.2.yaml"), 1.5),
    "map": (("map", DESIGNS / "park/machines/gec-like.yaml", "--plot", "map.png"), 1.2),
    "simulate": (
        ("simulate", DESIGNS / "quickstart.yaml", "-o", "readings.csv", "--certificate", "c.csv"),
        0.8,
    ),
}
OUTPUTS = ("choice.yaml", "sheet.html", "page.html", "table.csv", "points.csv", "all.csv")
OUTPUTS += ("map.png", "readings.csv", "c.csv")
WORDS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}


def processes_of(group: int) -> dict[int, float]:
    """The processes of a group that have not ended, with the processor time that they took, in
    seconds.
    """
    found = {}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            # It may end at any moment.
            with suppress(OSError):
                words = (folder / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
                if int(words[2]) == group and words[0] != "Z":
                    found[int(folder.name)] = (int(words[11]) + int(words[12])) / os.sysconf(
                        "SC_CLK_TCK"
                    )
    return found


def answers(process: int) -> bool:
    """Whether a process has begun to answer SIGTERM itself."""
    with suppress(OSError):
        for line in Path(f"/proc/{process}/status").read_text(encoding="utf-8").splitlines():
            if line.startswith("SigCgt:"):
                return bool(int(line.split()[1], 16) >> (signal.SIGTERM - 1) & 1)
    return False


def wait_until(condition: Callable[[], bool], process: subprocess.Popen[str] | None = None) -> bool:
    """Whether a condition came true, before the process ended if there is one."""
    end = time.monotonic() + 120
    while not condition():
        assert time.monotonic() < end, "hangs"
        if process is not None and process.poll() is not None:
            return False
        time.sleep(0.005)
    return True


Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts a command in a session of its own; what is left of it at the end is killed."""
    started: list[subprocess.Popen[str]] = []

    def begin(
        folder: Path, *arguments: object, program: list[str] | None = None
    ) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            program or command(*arguments),
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"},
            start_new_session=True,
            preexec_fn=hearing_interruptions,
        )
        started.append(process)
        return process

    yield begin
    for process in started:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small sweep, done, and a larger one."""
    folder = tmp_path_factory.mktemp("small")
    small_sweep(folder, 40, "trials: 16\n").rename(folder / "many.yaml")
    assert run("sweep", small_sweep(folder, 4), "--workers", 1).returncode in (0, 1)
    return folder


def copied(small: Path, folder: Path) -> Path:
    folder.mkdir()
    for path in small.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    return folder


def interrupted(
    start: Start, folder: Path, arguments: tuple[object, ...], spent: float, number: int, to: str
) -> bool:
    """Whether a command, sent a signal after some processor time, ended by it; it is checked
    however it ends.
    """
    process = start(folder, *arguments)
    in_time = wait_until(lambda: answers(process.pid), process)
    in_time = in_time and wait_until(
        lambda: sum(processes_of(process.pid).values()) >= spent, process
    )
    with suppress(ProcessLookupError):
        (os.killpg if to == "group" else os.kill)(process.pid, number)
    _, err = process.communicate(timeout=60)
    wait_until(lambda: not processes_of(process.pid))
    assert not list(Path("/dev/shm").glob(f"joblib_memmapping_folder_{process.pid}_*"))
    assert "Traceback" not in err and "leaked" not in err, err
    if process.returncode in (0, 1):
        return False
    assert in_time and process.returncode == 128 + number, (process.returncode, err)
    last = err.splitlines()[-1]
    assert last.startswith(WORDS[signal.Signals(number)]), err
    if (folder / "new.sqlite").exists() and stored(folder / "new.sqlite"):
        assert wording.FINISHED_CELLS_ARE_IN_NEW_SQLITE in last
    return True


# With workers and without, with files and without, with a store; the others are as these.
SOME = ("run by two", "plan by one", "sweep by one")


@pytest.mark.parametrize("name", SOME)
def test_a_signal_at_a_random_moment(name: str, small: Path, tmp_path: Path, start: Start) -> None:
    chance = random.Random(name)
    arguments, most = (ENDLESS | ENDING)[name]
    number = chance.choice((signal.SIGINT, signal.SIGTERM))
    to = chance.choice(("group", "process"))
    # One moment for each, early enough for any machine.
    spent = chance.uniform(0.1, min(0.6 * most, 1.5))
    done = interrupted(start, copied(small, tmp_path / "work"), arguments, spent, number, to)
    assert done or name in ENDING


@pytest.mark.long
@pytest.mark.parametrize("name", [*ENDLESS, *ENDING])
def test_signals_at_ten_random_moments(
    name: str, small: Path, tmp_path: Path, start: Start
) -> None:
    """Files are whole where there are some: the same as of a run that nothing disturbed."""
    chance = random.Random(f"ten of {name}")
    arguments, most = (ENDLESS | ENDING)[name]
    undisturbed = copied(small, tmp_path / "undisturbed")
    if name in ENDING and arguments[0] != "sweep":
        assert start(undisturbed, *arguments).wait(300) in (0, 1)
    count = 0
    for k in range(10):
        folder = copied(small, tmp_path / str(k))
        number, to = (signal.SIGINT, signal.SIGTERM)[k % 2], ("group", "process")[k // 2 % 2]
        count += interrupted(start, folder, arguments, chance.uniform(0.0, most), number, to)
        for output in OUTPUTS:
            # Pictures carry the moment at which they were drawn.
            if (folder / output).exists() and not output.endswith((".png", ".svg")):
                assert (folder / output).read_bytes() == (undisturbed / output).read_bytes()
    assert count == 10 if name in ENDLESS else count >= 3


@pytest.mark.parametrize(
    "arguments",
    [
        pytest.param((*TRIALS, "--workers", 2), marks=pytest.mark.long),
        # One of these workers has nothing to do.
        pytest.param((*PLAN, "--workers", 3), marks=pytest.mark.long),
        ("sweep", "many.yaml", "--workers", 2, "--store", "new.sqlite"),
    ],
    ids=["run", "plan", "sweep"],
)
def test_no_process_is_left_where_the_command_is_killed(
    small: Path, tmp_path: Path, start: Start, arguments: tuple[object, ...]
) -> None:
    folder = copied(small, tmp_path / "work")
    process = start(folder, *arguments)

    def at_work() -> bool:
        others = {
            one: spent for one, spent in processes_of(process.pid).items() if one != process.pid
        }
        return (
            len(others) >= arguments[arguments.index("--workers") + 1]
            and max(others.values()) > 0.3
        )

    assert wait_until(at_work, process)
    process.kill()
    wait_until(lambda: not processes_of(process.pid))
    _, err = process.communicate()
    assert "Traceback" not in err and "leaked" not in err, err
    assert not list(Path("/dev/shm").glob(f"joblib_memmapping_folder_{process.pid}_*"))
