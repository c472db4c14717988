"""Files that commands write: whatever goes wrong, it is told before the work, and nothing that was
there is lost.

Every command and every option that names a file to be written is walked through; one that is added
and is not in `WALK` fails here.
"""

from __future__ import annotations

import argparse
import errno
import os
import resource
import shutil
import signal
import stat
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import ballplate as bp
import pytest
from ballplate.cli import _module_of, main, outputs, parser
from ballplate.cli.outputs import OutputAction, text_writer, write_outputs

from tests.cli import wording
from tests.cli.cuts import remains
from tests.extensions.repair.test_check_fix import SHIFTED as OPEN
from tests.extensions.sweeps.stores import axis, done, made_up
from tests.planning.small_pool import TEXT as POOL
from tests.reference.copies import copy_file, copy_tree

DESIGN = """\
title: a plate in two positions
machine: {volume: [500 mm, 500 mm], repeatability: 1 um}
error_model: {kind: metric}
artefacts:
  plate: {kind: balls, file: balls.csv}
positions:
  - {name: first, artefact: plate, pose: {origin: [50 mm, 50 mm]}}
  - {name: turned, artefact: plate, pose: {origin: [450 mm, 50 mm], rotation: 90 deg}}
calibration:
  - {kind: distances, artefact: plate, pairs: [[a, b]], standard_uncertainty: 0.5 um}
target_uncertainty: 2 um
evaluation: {points: {random: 10, seed: 1}}
seed: 1
"""
BALLS = "ball,x_mm,y_mm\na,0,0\nb,300,0\nc,0,300\nd,300,310\ne,150,120\n"

# Of files and pictures that a command writes or reads: how their options are shown in its help.
METAVARS = ("FILE", "CSV", "YAML", "NAME.yaml", "STORE", "READINGS", "FOLDER")


@dataclass(frozen=True)
class Walk:
    """A command: what it reads, in the order of its arguments, the options and names of what it
    writes, other options.

    `also` are files that those read name.
    """

    reads: dict[str, str]
    writes: dict[str, str]
    options: tuple[str, ...] = ()
    also: tuple[str, ...] = ()
    prints: bool = True


EXPERIMENT = {"FILE": "design.yaml"}
WALK = {
    "init": Walk({}, {"NAME.yaml": "new.yaml"}, prints=False),
    "simulate": Walk(
        EXPERIMENT, {"-o": "r.csv", "--certificate": "c.csv"}, also=("balls.csv",), prints=False
    ),
    "import": Walk(
        {"REPORT": "report.dmo", "--for": "design.yaml"},
        {"-o": "i.csv"},
        also=("balls.csv",),
        prints=False,
    ),
    "fit": Walk(
        EXPERIMENT | {"READINGS": "readings.csv", "--certificate": "certificate.csv"},
        {"--plot": "fit.svg", "-o": "fitted.yaml", "--report": "fit.html"},
        also=("balls.csv",),
    ),
    "certificate": Walk(
        EXPERIMENT | {"READINGS": "readings.csv", "--certificate": "certificate.csv"},
        {"-o": "p.html"},
        also=("balls.csv",),
        prints=False,
    ),
    "correct": Walk(
        {
            "MAP": "map.yaml",
            "POINTS": "corners.csv",
            "--tasks": "design.yaml",
        },
        {"-o": "o.csv", "--covariance": "v.csv"},
        ("--probe", "probe"),
    ),
    "models": Walk(
        EXPERIMENT | {"READINGS": "readings.csv", "--certificate": "certificate.csv"},
        {},
        ("--coefficients", "3"),
        also=("balls.csv",),
    ),
    "validate": Walk(
        EXPERIMENT | {"READINGS": "readings.csv", "--certificate": "certificate.csv"},
        {},
        also=("balls.csv",),
    ),
    "run --budget": Walk(
        EXPERIMENT | {"READINGS": "readings.csv", "--certificate": "certificate.csv"},
        {},
        also=("balls.csv",),
    ),
    "run --errors": Walk(EXPERIMENT, {}, also=("balls.csv",)),
    "next": Walk(EXPERIMENT | {"READINGS": "readings.csv"}, {}, also=("balls.csv",)),
    "map --curves": Walk({"FILE": "curved-map.yaml"}, {}),
    "diff": Walk(
        {
            "MAP": "map.yaml",
            "SECOND": "second-map.yaml",
            "--readings": "readings.csv",
        },
        {"-o": "d.csv", "--plot": "d.svg"},
    ),
    "plan": Walk(
        {"FILE": "pool.yaml", "--from": "drawn.yaml", "--done": "done.csv"},
        {"-o": "plan.yaml", "--sheet": "sheet.html", "--plot": "plan.svg"},
        ("--positions", "3", "--workers", "1"),
    ),
    "sheet": Walk(
        EXPERIMENT,
        {"-o": "sheet.html", "--readings": "table.csv", "--points": "points.csv"},
        prints=False,
    ),
    "run --reliability": Walk(EXPERIMENT, {"-o": "o.csv"}, also=("balls.csv",)),
    "map": Walk(
        {"FILE": "machine.yaml"},
        {"--plot": "map.png"},
        ("--grid", "2,2,2"),
        ("measured/exx.csv",),
    ),
    "spline": Walk(
        {"FILE": "points.csv"},
        {
            "-o": "s.csv",
            "--compensated": "m.csv",
            "--plot": "s.pdf",
            "--whiskers": "w.svg",
        },
        ("--y", "semi_finish_error", "--points", "12-32"),
    ),
    "sweep --export": Walk({"STORE": "store.sqlite"}, {"-o": "t.parquet"}, prints=False),
    "sweep --report": Walk({"STORE": "store.sqlite"}, {"-o": "t.md"}, prints=False),
    "check": Walk(EXPERIMENT, {}),
    "run": Walk(EXPERIMENT, {"--report": "design.html"}, also=("balls.csv",)),
    "reach": Walk(EXPERIMENT, {}, ("--by", "repeatability")),
    "compare": Walk(EXPERIMENT, {}, ("--trials", "2", "--points", "5")),
    # A store is no file that is replaced; what it refuses is tested with it.
    "sweep": Walk(
        {"FILE": "sweep.yaml", "--store": "new.sqlite", "--folder": "."}, {}, ("--dry-run",)
    ),
    "reproduce": Walk({"--designs": "npl"}, {}, ("npl", "--experiment", "5.2", "--quick")),
    "schema": Walk({}, {}),
}
WRITING = [(command, option) for command, walk in WALK.items() for option in walk.writes]
# Of each kind: a name without an option, a table, a page, a picture, a second file.
KINDS = [
    ("init", "NAME.yaml"),
    ("simulate", "-o"),
    ("fit", "--report"),
    ("map", "--plot"),
]
KINDS += [("correct", "--covariance")]
# Those that are read only where they are asked for, and not needed to walk through.
LEFT_OUT = ("--from", "--done", "--nominal", "--store", "--folder", "--results", "--designs")
LEFT_OUT += ("--tasks", "--readings")


@pytest.fixture(scope="module")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All that the commands read."""
    folder = tmp_path_factory.mktemp("shelf")
    (folder / "design.yaml").write_text(DESIGN, encoding="utf-8")
    (folder / "balls.csv").write_text(BALLS, encoding="utf-8")
    (folder / "pool.yaml").write_text(POOL, encoding="utf-8")
    sphere = "UNITS/MM\nFA(FIRST_A)=FEAT/SPHERE,CART,50,50,0,22\nENDFIL\n"
    (folder / "report.dmo").write_text(sphere, encoding="utf-8")
    axes = "axes: {repeatability: {path: machine.repeatability, values: [1 um, 2 um]}}"
    (folder / "sweep.yaml").write_text(f"title: two\nbase: design.yaml\n{axes}\n", encoding="utf-8")
    for name in ("drawn.yaml", "done.csv", "nominal.csv"):
        (folder / name).write_text("is not read\n", encoding="utf-8")
    copy_file("designs/gilsinn/table-1.csv", folder / "points.csv")
    copy_file("designs/park/machines/measured-errors.yaml", folder / "machine.yaml")
    copy_tree("designs/park/machines/measured", folder / "measured")
    figures = {
        "rank_deficiency": 0.0,
        "as_expected": 1.0,
        "U6_maximum_m": 2e-6,
        "U6_average_m": 1e-6,
    }
    rows = [done(k, figures) for k in range(2)]
    sizes = axis("size", ["1 mm", "2 mm"], [1e-3, 2e-3], "m")
    made_up(folder / "store.sqlite", "made up", [sizes], rows).close()
    readings, certificate = folder / "readings.csv", folder / "certificate.csv"
    arguments = [
        "simulate",
        str(folder / "design.yaml"),
        "-o",
        str(readings),
        "--certificate",
        str(certificate),
    ]
    assert main(arguments) == 0
    (folder / "corners.csv").write_text("name,x_mm,y_mm\nA,50,50\nB,450,50\n", encoding="utf-8")
    fit = ["fit", str(folder / "design.yaml"), str(readings), "-o", str(folder / "map.yaml")]
    assert main(fit) == 0
    shutil.copy(folder / "map.yaml", folder / "second-map.yaml")
    # In the plane, where a model has few curves to be drawn.
    few = {"kind": "kinematic", "position_coefficients": 2, "rotation_coefficients": 1}
    own = bp.load(folder / "design.yaml").with_({"error_model": few})
    bp.write_map(bp.fit(own, bp.simulate(own)).to_map(), folder / "curved-map.yaml")
    return folder


@pytest.fixture
def files(shelf: Path, tmp_path: Path) -> Path:
    """A copy of them that may be destroyed."""
    return Path(shutil.copytree(shelf, tmp_path / "files"))


@pytest.fixture
def idle(monkeypatch: pytest.MonkeyPatch) -> None:
    """No command may begin its work."""

    def fail(options: argparse.Namespace) -> int:
        raise AssertionError(f"{options.command} has begun")

    for command in WALK:
        monkeypatch.setattr(_module_of(command), "run", fail)


@pytest.fixture
def planned_once(monkeypatch: pytest.MonkeyPatch, shelf: Path) -> None:
    """The search of `plan` is done once for all tests: what is tested is what comes after it."""
    from ballplate.planning import campaign_choice as campaign

    search = campaign.campaign

    def once(*arguments: Any) -> Any:
        if not FOUND:
            FOUND.append(search(*arguments))
        return FOUND[0]

    monkeypatch.setattr(campaign, "campaign", once)


FOUND: list[Any] = []


def line(
    command: str, files: Path, written: dict[str, Path], *more: str, reads: tuple[str, ...] = ()
) -> list[str]:
    """The command line that reads the files and writes these; `reads` are further files to be
    read.
    """
    walk = WALK[command]
    words = [command]
    for option, name in walk.reads.items():
        if option not in LEFT_OUT or option in reads:
            count = 2 if option == "--readings" else 1
            words += [option] * option.startswith("-") + [str(files / name)] * count
    words += walk.options
    if command in ("simulate", "sweep --export") and "-o" not in written:
        words += ["-o", "-"]
    for option, path in written.items():
        words += [option, str(path)] if option.startswith("-") else [str(path)]
    return [*words, *more]


def content(folder: Path) -> dict[str, bytes | None]:
    """Everything below a folder, hidden files too."""
    found: dict[str, bytes | None] = {}
    for path in sorted(folder.rglob("*")):
        found[str(path.relative_to(folder))] = path.read_bytes() if path.is_file() else None
    return found


def commands() -> dict[str, argparse.ArgumentParser]:
    (found,) = (
        action for action in parser()._actions if isinstance(action, argparse._SubParsersAction)
    )
    return dict(found.choices)


def label(action: argparse.Action) -> str:
    return action.option_strings[0] if action.option_strings else str(action.metavar)


def test_every_option_that_names_a_file_is_walked_through() -> None:
    every = commands()
    # The studio runs until it is interrupted, and writes when it is told to in the browser.
    assert set(every) == {*WALK, "studio"}
    for command, walk in WALK.items():
        actions = every[command]._actions
        named = {label(one) for one in actions if one.type is Path or one.metavar in METAVARS}
        written = {label(one) for one in actions if isinstance(one, OutputAction)}
        assert written == set(walk.writes), command
        assert named - written == set(walk.reads) - {"SECOND"}, command
        assert bool(written) == any("--force" in one.option_strings for one in actions), command


def refused(
    arguments: list[str], capsys: pytest.CaptureFixture[str], status: int, *told: str
) -> None:
    """A command ends with the status, one line, nothing printed, and no file touched."""
    capsys.readouterr()
    assert main(arguments) == status
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1, err
    for words in told:
        assert words in err


everywhere = pytest.mark.parametrize(("command", "option"), WRITING)
of_each_kind = pytest.mark.parametrize(("command", "option"), KINDS)


@pytest.mark.usefixtures("idle")
class TestToldBeforeTheWork:
    """The command must not begin.

    That every option of every command goes the same way is seen above, and in what it is told of
    its own inputs.
    """

    @of_each_kind
    def test_folder(
        self,
        command: str,
        option: str,
        files: Path,
        tmp_path: Path,
        capsys: pytest.CaptureFixture[str],
    ) -> None:
        name = WALK[command].writes[option]
        (tmp_path / name).mkdir()
        before = content(tmp_path)
        for path, told in (
            (
                tmp_path / "none" / name,
                "cannot be written (No such file or directory); check the folder",
            ),
            (files / "balls.csv" / name, "cannot be written (Not a directory); check the folder"),
            (tmp_path / name, "is a folder; name a file in it"),
            (
                tmp_path / (300 * "n" + name),
                "cannot be written (File name too long); check the folder",
            ),
        ):
            refused(line(command, files, {option: path}, "--force"), capsys, 3, f"{path}: {told}")
        assert content(tmp_path) == before

    @of_each_kind
    def test_folder_that_takes_no_file(
        self,
        command: str,
        option: str,
        files: Path,
        tmp_path: Path,
        capsys: pytest.CaptureFixture[str],
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        path = tmp_path / WALK[command].writes[option]
        path.write_text("old")
        before, opened = content(tmp_path), os.open
        for number in (errno.EROFS, errno.EACCES, errno.ENOSPC, errno.EDQUOT):

            def refuse(
                name: Any, flags: int, *arguments: Any, number: int = number, **others: Any
            ) -> int:
                if flags & os.O_CREAT and Path(name).parent == tmp_path:
                    raise OSError(number, os.strerror(number), name)
                return opened(name, flags, *arguments, **others)

            monkeypatch.setattr(os, "open", refuse)
            told = f"{path}: cannot be written ({os.strerror(number)}); "
            refused(line(command, files, {option: path}, "--force"), capsys, 3, told)
        assert content(tmp_path) == before

    @of_each_kind
    def test_file_that_may_not_be_changed(
        self,
        command: str,
        option: str,
        files: Path,
        tmp_path: Path,
        capsys: pytest.CaptureFixture[str],
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        path = tmp_path / WALK[command].writes[option]
        path.write_text("old")
        opened = Path.open

        def refuse(self: Path, mode: str = "r", *arguments: Any, **others: Any) -> Any:
            if self == path and mode != "rb":
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(self))
            return opened(self, mode, *arguments, **others)

        monkeypatch.setattr(Path, "open", refuse)
        refused(
            line(command, files, {option: path}, "--force"),
            capsys,
            3,
            "whether another program has the file open",
        )
        assert path.read_bytes() == b"old"

    @of_each_kind
    def test_existing_file(
        self,
        command: str,
        option: str,
        files: Path,
        tmp_path: Path,
        capsys: pytest.CaptureFixture[str],
    ) -> None:
        path = tmp_path / WALK[command].writes[option]
        path.write_text("old")
        told = f"{path}: exists already; name a new file, or overwrite it with --force\n"
        refused(line(command, files, {option: path}), capsys, 3, told)
        assert path.read_text() == "old"

    @everywhere
    def test_extra(
        self,
        command: str,
        option: str,
        files: Path,
        tmp_path: Path,
        capsys: pytest.CaptureFixture[str],
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        path = tmp_path / WALK[command].writes[option]
        extras = {".svg": "report", ".png": "report", ".pdf": "report", ".parquet": "parquet"}
        for name in ("matplotlib", "pyarrow"):
            monkeypatch.setitem(sys.modules, name, None)
        if path.suffix in extras:
            told = f"install it with: python -m pip install 'ballplate[{extras[path.suffix]}]'"
            refused(line(command, files, {option: path}), capsys, 3, f"{path}: ", told)
        else:
            # The work begins: nothing is missing.
            with pytest.raises(AssertionError, match="has begun"):
                main(line(command, files, {option: path}))
        assert not path.exists()

    @everywhere
    @pytest.mark.parametrize("make_link", [os.symlink, os.link])
    def test_input(
        self,
        command: str,
        option: str,
        make_link: Callable[[Path, Path], None],
        files: Path,
        tmp_path: Path,
        capsys: pytest.CaptureFixture[str],
    ) -> None:
        walk = WALK[command]
        before = content(files)
        path = tmp_path / walk.writes[option]
        for name in (*walk.reads.values(), *walk.also):
            make_link(files / name, path)
            for force in ((), ("--force",)):
                arguments = line(command, files, {option: path}, *force, reads=LEFT_OUT)
                refused(
                    arguments,
                    capsys,
                    2,
                    f"ballplate {command}: {option} {path} would overwrite ",
                    "which is read",
                )
            path.unlink()
        assert content(files) == before

    @pytest.mark.parametrize(
        "command", [name for name, walk in WALK.items() if len(walk.writes) > 1]
    )
    def test_other_output(
        self, command: str, files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        for option, other in combinations(WALK[command].writes, 2):
            paths = {
                one: tmp_path / f"{k}{WALK[command].writes[one]}"
                for k, one in enumerate((option, other))
            }
            # Names that are different lead to the same place, where there is nothing yet.
            for path in paths.values():
                path.symlink_to(tmp_path / "both")
            refused(line(command, files, paths), capsys, 2, "are the same file; name another")
            for path in paths.values():
                path.unlink()

    @everywhere
    def test_screen(
        self,
        command: str,
        option: str,
        files: Path,
        capsys: pytest.CaptureFixture[str],
        tmp_path: Path,
    ) -> None:
        (action,) = (one for one in commands()[command]._actions if label(one) == option)
        assert isinstance(action, OutputAction)
        arguments = line(command, files, {option: Path("-")})
        if action.takes_screen:
            with pytest.raises(AssertionError, match="has begun"):
                main(
                    [
                        *arguments,
                        *(["-o", str(tmp_path / "r.csv")] if option == "--certificate" else []),
                    ]
                )
        elif action.type is Path:
            refused(
                arguments, capsys, 2, "would be standard output, which has the rest; name a file"
            )
        else:
            with pytest.raises(SystemExit) as left:
                main(arguments)
            assert left.value.code == 2


@pytest.mark.usefixtures("idle")
def test_readings_are_not_written_over_the_experiment(
    files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    design = files / "design.yaml"
    refused(
        ["simulate", str(design), "-o", str(design), "--force"],
        capsys,
        2,
        "would overwrite",
        "which is read",
    )
    assert design.read_text(encoding="utf-8") == DESIGN


@pytest.mark.usefixtures("idle")
def test_a_module_that_the_experiment_runs_is_an_input(
    files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = DESIGN.replace("{kind: metric}", '{kind: python, object: "my_model:build"}')
    (files / "own.yaml").write_text(own, encoding="utf-8")
    for name, text in (("my_model.py", "import my_other\n"), ("my_other.py", "")):
        (files / name).write_text(text, encoding="utf-8")
    for name in ("my_model.py", "my_other.py"):
        arguments = ["simulate", str(files / "own.yaml"), "-o", str(files / name), "--force"]
        refused(
            arguments, capsys, 2, f"-o {files / name} would overwrite {files / name}, which is read"
        )


@pytest.mark.usefixtures("idle")
def test_the_log_of_a_store_is_an_input(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = files / "store.sqlite-wal"
    log.write_bytes(b"rows that are not in the store yet")
    arguments = [
        "sweep",
        "--report",
        str(files / "store.sqlite"),
        "--format",
        "text",
        "-o",
        str(log),
        "--force",
    ]
    refused(arguments, capsys, 2, f"-o {log} would overwrite {log}, which is read")


@pytest.mark.usefixtures("idle")
def test_two_outputs_on_the_screen(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = line("simulate", files, {"-o": Path("-"), "--certificate": Path("-")})
    refused(arguments, capsys, 2, "-o and --certificate both go to the screen; name a file for one")


@pytest.mark.usefixtures("idle")
def test_capitals_make_no_other_file(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """There are disks that take none for different."""
    paths = {"-o": tmp_path / "all.csv", "--covariance": tmp_path / "ALL.csv"}
    refused(line("correct", files, paths), capsys, 2, "are the same file; name another")


@pytest.mark.usefixtures("idle")
def test_every_reason_is_told_at_once(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "l.csv").write_text("old")
    paths = {"-o": tmp_path / "l.csv", "--covariance": tmp_path / "none" / "p.csv"}
    assert main(line("correct", files, paths)) == 3
    first, second = capsys.readouterr().err.splitlines()
    assert first.startswith(f"{paths['-o']}: exists already") and second.startswith(
        f"{paths['--covariance']}: cannot be"
    )


def test_a_file_to_which_standard_output_goes(files: Path, tmp_path: Path) -> None:
    path = tmp_path / "l.csv"
    arguments = line("run --reliability", files, {"-o": path}, "--force")
    with path.open("w") as stream:
        found = subprocess.run(
            [sys.executable, "-m", "ballplate", *arguments], stdout=stream, stderr=subprocess.PIPE
        )
    told = (
        f"ballplate run --reliability: -o {path} is where standard output goes; name another file\n"
    )
    assert (found.returncode, found.stderr.decode()) == (2, told)


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
# What becomes of several files is the same whatever command writes them.
SEVERAL = ("simulate", "run --reliability")
WRITING = [command for command, walk in WALK.items() if walk.writes]


@pytest.mark.usefixtures("planned_once")
@pytest.mark.parametrize(
    ("command", "faults"),
    [
        *((command, FAULTS if command in SEVERAL else FAULTS[:2]) for command in WRITING),
        *(
            pytest.param(command, FAULTS[2:], marks=pytest.mark.long)
            for command in WRITING
            if command not in SEVERAL
        ),
    ],
)
def test_what_was_there_is_whole_when_writing_fails(
    command: str,
    faults: Sequence[str],
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
    for kind in faults:
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
        claims = [
            one
            for one in err.splitlines()
            if one.endswith(" written") and "no file was written" not in one
        ]
        assert "written to" not in err and not claims
    # And the same command succeeds where nothing fails.
    assert main(line(command, files, written, "--force")) in (0, 1)
    assert content(folder).keys() == before.keys()
    assert all(path.stat().st_size > 50 for path in written.values())


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
    if is_there and "check" in commands:
        lines["check"] = ["check", "--fix", str(folder / "open.yaml")]
        before["check"] = {"open.yaml": OPEN}
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
    task = {"signals": SIGNALS, "every": 5 if is_there else 3, "slow": is_there}
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


@pytest.mark.parametrize("number", [1, 2, 3])
def test_exchanged_files_come_back_when_one_cannot_be_exchanged(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    paths = [tmp_path / f"{k}.csv" for k in range(3)]
    for path in paths[:2]:
        path.write_text("old")
    before = content(tmp_path)
    denied = PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    monkeypatch.setattr(os, "replace", FaultyCall(os.replace, number, denied))
    assert not write_outputs({path: written_text("new") for path in paths}, force=True)
    assert content(tmp_path) == before


@pytest.mark.usefixtures("planned_once")
@pytest.mark.parametrize("command", [command for command, walk in WALK.items() if walk.writes])
def test_a_full_device_is_told(
    command: str, files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    option, name = next(iter(WALK[command].writes.items()))
    path = tmp_path / name
    path.symlink_to("/dev/full")
    # It is no file in whose place another could be put, and needs no --force.
    assert main(line(command, files, {option: path})) == 3
    told = f"{path}: cannot be written (No space left on device); check the folder"
    assert told in capsys.readouterr().err
    assert path.is_symlink() and stat.S_ISCHR(Path("/dev/full").stat().st_mode)


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
@pytest.mark.parametrize("command", [command for command, walk in WALK.items() if walk.prints])
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


def test_standard_output_by_its_name(files: Path) -> None:
    """Before what is printed."""
    arguments = line("run --reliability", files, {"-o": Path("/dev/stdout")})
    command = [sys.executable, "-m", "ballplate", *arguments]
    found = subprocess.run(command, stdout=subprocess.PIPE, encoding="utf-8")
    assert found.returncode in (0, 1)
    assert found.stdout.startswith("name,kind,redundancy,")
    assert wording.A_PLATE_IN_TWO in found.stdout.splitlines()


def test_an_open_file_is_an_input_too(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    experiment = files / "design.yaml"
    before = experiment.read_bytes()
    with experiment.open("a") as stream:
        for name in (f"/proc/self/fd/{stream.fileno()}", f"/dev/fd/{stream.fileno()}"):
            assert main(["simulate", str(experiment), "-o", name, "--force"]) == 2
            assert f"would overwrite {experiment}, which is read" in capsys.readouterr().err
    assert experiment.read_bytes() == before


@pytest.mark.parametrize("start", ["/proc/self/cwd", "/proc/self/root"])
def test_files_reached_through_a_process_are_files(
    start: str,
    files: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "readings.csv"
    path.write_text("mine")
    monkeypatch.chdir(tmp_path)
    name = f"{start}/readings.csv" if start.endswith("cwd") else f"{start}{path}"
    assert main(["simulate", str(files / "design.yaml"), "-o", name]) == 3
    assert capsys.readouterr().err.startswith(f"{name}: exists already; ")
    assert path.read_text() == "mine"


@pytest.mark.parametrize("has_links", [True, False])
def test_a_file_that_has_come_meanwhile_stays(
    has_links: bool,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if not has_links:
        # As on disks of cameras and some servers.
        monkeypatch.setattr(
            os, "link", FaultyCall(os.link, 1, PermissionError(errno.EPERM, "not permitted"))
        )
    path = tmp_path / "plan.yaml"

    def write(temporary: Path) -> None:
        temporary.write_text("mine")
        path.write_text("another's")

    assert not write_outputs({path: write}, force=False)
    assert capsys.readouterr().err.startswith(f"{path}: exists already; ")
    assert content(tmp_path) == {"plan.yaml": b"another's"}


def test_disks_without_hard_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        os, "link", FaultyCall(os.link, 1, PermissionError(errno.EPERM, "not permitted"))
    )
    assert write_outputs({tmp_path / "a.csv": written_text("a")}, force=False)
    assert content(tmp_path) == {"a.csv": b"a"}


@pytest.mark.parametrize("number", [1, 2, 3])
def test_new_files_come_together_or_not_at_all(
    number: int, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    monkeypatch.setattr(os, "link", FaultyCall(os.link, number, full))
    monkeypatch.setattr(os, "replace", FaultyCall(os.replace, 1, full))
    paths = [tmp_path / f"{k}.csv" for k in range(3)]
    assert not write_outputs({path: written_text(path.name) for path in paths}, force=False)
    assert capsys.readouterr().err.startswith(f"{paths[number - 1]}: cannot be written")
    assert content(tmp_path) == {}


def test_an_extra_that_cannot_be_loaded_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(path: Path) -> None:
        raise ImportError("a library of another version", name="matplotlib._path")

    assert not write_outputs({tmp_path / "a.svg": broken}, force=False)
    assert "python -m pip install 'ballplate[report]'" in capsys.readouterr().err
    assert content(tmp_path) == {}


def test_a_folder_in_the_place_of_a_store(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "page.html").write_text("mine")
    assert main(["sweep", "--report", ".", "--output", "page.html"]) == 3
    assert (tmp_path / "page.html").read_text() == "mine"
    assert main(["sweep", "--report", ".", "--output", "page.html", "--force"]) == 3
    assert (tmp_path / "page.html").read_text() == "mine"
    assert all(line for line in capsys.readouterr().err.splitlines())
