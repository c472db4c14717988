"""What goes wrong while files are written: nothing that was there is lost, and what is new comes as a
whole.
"""

from __future__ import annotations

import errno
import os
import resource
import signal
import stat
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import pytest
from ballplate.cli import main, outputs
from ballplate.cli.outputs import text_writer, write_outputs

from tests.cli import wording
from tests.cli.cuts import remains
from tests.cli.walk import DESIGN, WALK, content, line

WRITING = [command for command, walk in WALK.items() if walk.writes]


class FaultyCall:
    """Stands for a function of the system, and fails at its n-th call."""

    def __init__(self, function: Callable[..., Any], number: int, error: BaseException) -> None:
        self.function, self.left, self.error = function, number, error

    def __call__(self, *arguments: Any, **others: Any) -> Any:
        self.left -= 1
        if self.left == 0:
            raise self.error
        return self.function(*arguments, **others)


@pytest.fixture
def small_disk(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[int], None]]:
    """Lets files grow no larger than so many bytes, by the system's own limit."""
    # A module that is loaded meanwhile would be kept as far as the disk takes it.
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    # The interpreter ignores the signal, so that writing fails.
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


def fault(
    kind: str, count: int, monkeypatch: pytest.MonkeyPatch, small_disk: Callable[[int], None]
) -> int:
    """Let the writing of so many files fail; the status that the command is to have."""
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    if kind == "limit of size":
        small_disk(50)
    elif kind == "full disk at the last":
        monkeypatch.setattr(os, "fsync", FaultyCall(os.fsync, count, full))
    elif kind == "held open by another program":
        denied = PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        monkeypatch.setattr(os, "replace", FaultyCall(os.replace, 1, denied))
    else:
        monkeypatch.setattr(os, "fsync", FaultyCall(os.fsync, count, KeyboardInterrupt()))
        return 130
    return 3


FAULTS = ("limit of size", "full disk at the last", "held open by another program", "interrupted")
# Files of several kinds, on the screen too; other commands write and print by the same functions.
SOME = ("simulate", "sheet", "run --reliability", "map", "sweep --export")


def some_and(commands: Iterable[str], some: Sequence[str] = SOME) -> list[Any]:
    """Commands, of which those that are not among some are tried when asked for."""
    marks = {True: (), False: pytest.mark.long}
    return [pytest.param(one, marks=marks[one in some]) for one in commands]


@pytest.mark.usefixtures("planned_once")
@pytest.mark.parametrize("command", some_and(WRITING))
def test_what_was_there_is_whole_when_writing_fails(
    command: str,
    files: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    small_disk: Callable[[int], None],
) -> None:
    walk, folder = WALK[command], tmp_path / "written"
    folder.mkdir()
    written = {option: folder / name for option, name in walk.writes.items()}
    for path in written.values():
        path.write_bytes(b"old")
    before, read = content(folder), content(files)
    for kind in FAULTS:
        with monkeypatch.context() as patch:
            status = fault(kind, len(written), patch, small_disk)
            assert main(line(command, files, written, "--force")) == status, kind
        small_disk(resource.getrlimit(resource.RLIMIT_FSIZE)[1])
        assert content(folder) == before
        # Beside a store its library may leave a log.
        assert content(files) | read == content(files)
        out, err = capsys.readouterr()
        told = [one for one in err.splitlines() if "cannot be written" in one]
        if status == 3:
            assert len(told) == 1 and told[0].endswith(wording.THE_EXISTING_FILE_IS_UNCHANGED)
            assert any(told[0].startswith(f"{path}: ") for path in written.values())
            # What was computed is told nevertheless.
            assert bool(out) == walk.prints
        claims = [one for one in err.splitlines() if one.endswith(" written")]
        assert not [one for one in claims if "no file was written" not in one]
        assert "written to" not in err
    # And the same command succeeds where nothing fails.
    assert main(line(command, files, written, "--force")) in (0, 1)
    assert content(folder).keys() == before.keys()
    assert all(path.stat().st_size > 50 for path in written.values())
    option, path = next(iter(written.items()))
    path.unlink()
    path.symlink_to("/dev/full")
    # It is no file in whose place another could be put, and needs no --force.
    capsys.readouterr()
    assert main(line(command, files, {option: path})) == 3
    full = f"{path}: cannot be written (No space left on device); check the folder"
    assert full in capsys.readouterr().err
    assert path.is_symlink() and stat.S_ISCHR(Path("/dev/full").stat().st_mode)


def cuts(
    commands: Sequence[str], files: Path, folder: Path, is_there: bool, **task: object
) -> Iterator[tuple[dict[str, Any], dict[str, str], dict[str, str]]]:
    """What each cut of these commands has left, what was there before, and what is there after a
    run that nobody disturbs.
    """
    force = ("--force",) if is_there else ()
    lines = {
        command: line(
            command,
            files,
            {option: folder / name for option, name in WALK[command].writes.items()},
            *force,
        )
        for command in commands
        if WALK[command].writes
    }
    before = {
        command: dict.fromkeys(WALK[command].writes.values(), "old") if is_there else {}
        for command in lines
    }
    after: dict[str, dict[str, str]] = {}
    for left in remains(lines=lines, folder=str(folder), before=before, **task):
        if left["cut"]:
            yield left, before[left["name"]], after[left["name"]]
        else:
            after[left["name"]] = left["there"]
            assert all(one != "old" for one in left["there"].values())
    assert set(after) == set(lines)


def state(there: str, before: str, after: str, name: str) -> str:
    """Whether a file is the old one or the new one."""
    # Other files hold the moment at which they were written.
    is_new = there == after if name.endswith(".csv") else len(there) > 50
    return "old" if there == before else "new" if is_new else "spoilt"


def ensure_whole(left: dict[str, Any], before: dict[str, str], after: dict[str, str]) -> str:
    """Make sure that a command ended by its signal and left all files old or all new; which."""
    there = left["there"]
    where = f"{left['name']}: signal {left['number']} at {left['event']} {left['cut']}"
    assert left["status"] == 128 + left["number"], (where, left["status"])
    if not before and not there:
        return "old"
    assert there.keys() == after.keys(), (where, sorted(there))
    states = {state(there[one], before.get(one, ""), after[one], one) for one in after}
    assert states in ({"old"}, {"new"}), (where, states)
    return states.pop()


SIGNALS = [signal.SIGINT, signal.SIGTERM]


@pytest.mark.parametrize("is_there", [True, False])
def test_a_signal_leaves_files_old_or_new_together(
    is_there: bool, files: Path, tmp_path: Path
) -> None:
    """At a sample of all openings, links, changes of names and removals."""
    task = {"signals": SIGNALS, "every": 11 if is_there else 3, "slow": is_there}
    states = [
        ensure_whole(*one)
        for one in cuts(("simulate", "sheet"), files, tmp_path / "written", is_there, **task)
    ]
    assert states.count("old") > 5 and states.count("new") > 5


@pytest.mark.long
@pytest.mark.parametrize("is_there", [True, False])
@pytest.mark.parametrize("command", WALK)
def test_a_signal_anywhere_leaves_files_old_or_new_together(
    command: str, is_there: bool, files: Path, tmp_path: Path
) -> None:
    task = {"signals": SIGNALS, "every": 1, "slow": False}
    found = list(cuts((command,), files, tmp_path / "written", is_there, **task))
    states = [ensure_whole(*one) for one in found]
    if found:
        print(f"{command}: {len(found)} cuts, {states.count('new')} of them after the work")
        assert {"old", "new"} == set(states)
    else:
        assert not WALK[command].writes


@pytest.mark.long
@pytest.mark.parametrize("command", [name for name, walk in WALK.items() if len(walk.writes) > 1])
def test_what_is_killed_leaves_whole_files_and_the_old_ones(
    command: str, files: Path, tmp_path: Path
) -> None:
    """Of a mixed set the old files are there under names of their own."""
    task = {"signals": [signal.SIGKILL], "every": 1, "slow": False}
    mixed = 0
    for left, before, after in cuts((command,), files, tmp_path / "written", True, **task):
        there = left["there"]
        states = [state(there[one], before[one], after[one], one) for one in after]
        kept = [one for name, one in there.items() if name.startswith(".ballplate-")]
        assert set(states) <= {"old", "new"} and left["status"] == -signal.SIGKILL
        if len(set(states)) > 1:
            mixed += 1
            assert kept.count("old") >= states.count("new")
    assert mixed


@contextmanager
def printing(to: str) -> Iterator[Any]:
    """Standard output to a reader that has left, or to a full disk."""
    if to == "nobody":
        reading, writing = os.pipe()
        os.close(reading)
    else:
        writing = os.open("/dev/full", os.O_WRONLY)
    stream = os.fdopen(writing, "w", encoding="utf-8")
    before, sys.stdout = sys.stdout, stream
    try:
        yield stream
    finally:
        sys.stdout = before
        stream.close()


@pytest.mark.usefixtures("planned_once")
@pytest.mark.parametrize("command", some_and(one for one in WALK if WALK[one].prints))
def test_a_reader_that_leaves_changes_nothing(
    command: str, files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = []
    for to in ("us", "nobody", "a full disk"):
        folder = tmp_path / to
        folder.mkdir()
        written = {option: folder / one for option, one in WALK[command].writes.items()}
        with nullcontext() if to == "us" else printing(to):
            status = main(line(command, files, written))
        found.append(
            (status, set(content(folder)), capsys.readouterr().err.replace(str(folder), ""))
        )
    (status, names, err), left, (status_full, names_full, err_full) = found
    assert status in (0, 1)
    assert left == (status, names, err) and len(names) == len(WALK[command].writes)
    told = "standard output: cannot be written (No space left on device); give it room"
    assert (status_full, names_full) == (3, names) and err_full.splitlines().count(told) == 1


def test_a_verdict_reaches_the_shell_through_head(files: Path) -> None:
    """Of a design that is not as expected, and says so in the lines that nobody reads."""
    bad = files / "bad.yaml"
    bad.write_text(f"{DESIGN}expected_rank_deficiency: 1\n", encoding="utf-8")
    command = f'"{sys.executable}" -m ballplate check "{bad}" "{files / "design.yaml"}"'
    for tail in ("| true", "| head -1 >/dev/null", ">&-"):
        script = f"{command} {tail}; echo ${{PIPESTATUS[0]}}"
        found = subprocess.run(["bash", "-c", script], capture_output=True, text=True)
        assert (found.stdout, found.stderr) == ("1\n", ""), tail


def written_text(text: str) -> outputs.Writer:
    return text_writer(lambda stream: stream.write(text))


def test_permissions_are_kept_or_those_of_new_files(tmp_path: Path) -> None:
    old, new = tmp_path / "old.csv", tmp_path / "new.csv"
    old.write_text("old")
    old.chmod(0o640)
    before = os.umask(0o027)
    try:
        assert write_outputs({old: written_text("a"), new: written_text("b")}, force=True)
        (tmp_path / "plain").write_text("")
    finally:
        os.umask(before)
    assert (old.read_text(), new.read_text()) == ("a", "b")
    assert stat.S_IMODE(old.stat().st_mode) == 0o640
    assert new.stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_link_stays_one(tmp_path: Path) -> None:
    folder = tmp_path / "far"
    folder.mkdir()
    for name, is_there in (("there.csv", True), ("not.csv", False)):
        target, link = folder / name, tmp_path / f"link-{name}"
        if is_there:
            target.write_text("old")
        link.symlink_to(Path("far", name))
        assert write_outputs({link: written_text("new")}, force=is_there)
        assert link.is_symlink() and target.read_text() == "new" and not target.is_symlink()
    assert len(content(folder)) == 2


def test_a_pipe_is_written_as_it_is(tmp_path: Path) -> None:
    pipe, heard = tmp_path / "pipe.svg", list[bytes]()
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: heard.append(pipe.read_bytes()))
    reader.start()
    assert write_outputs({pipe: written_text("through")}, force=False)
    reader.join()
    assert heard == [b"through"] and stat.S_ISFIFO(pipe.stat().st_mode)


@pytest.mark.parametrize("has_links", [True, False])
def test_a_file_that_has_come_meanwhile_stays(
    has_links: bool,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if not has_links:
        # As on disks of cameras and some servers.
        def refuse(*_: object, **__: object) -> None:
            raise PermissionError(errno.EPERM, "not permitted")

        monkeypatch.setattr(os, "link", refuse)
    path = tmp_path / "plan.yaml"

    def write(temporary: Path) -> None:
        temporary.write_text("mine")
        path.write_text("another's")

    assert not write_outputs({path: write}, force=False)
    assert capsys.readouterr().err.startswith(f"{path}: exists already; ")
    assert content(tmp_path) == {"plan.yaml": b"another's"}
    path.unlink()
    assert write_outputs({path: written_text("a")}, force=False)
    assert content(tmp_path) == {"plan.yaml": b"a"}


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize("are_there", [2, 0])
def test_files_come_together_or_not_at_all(
    are_there: int, number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    if not are_there:
        monkeypatch.setattr(os, "link", FaultyCall(os.link, number, full))
    monkeypatch.setattr(os, "replace", FaultyCall(os.replace, number if are_there else 1, full))
    paths = [tmp_path / f"{k}.csv" for k in range(3)]
    for path in paths[:are_there]:
        path.write_text("old")
    before = content(tmp_path)
    new = {path: written_text("new") for path in paths}
    assert not write_outputs(new, force=are_there > 0)
    assert content(tmp_path) == before


def test_an_extra_that_cannot_be_loaded_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(path: Path) -> None:
        raise ImportError("a library of another version", name="matplotlib._path")

    assert not write_outputs({tmp_path / "a.svg": broken}, force=False)
    assert "python -m pip install 'ballplate[report]'" in capsys.readouterr().err
    assert content(tmp_path) == {}
