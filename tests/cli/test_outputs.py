"""Files that commands write: whatever goes wrong, it is told before the work.

Every command and every option that names a file to be written is walked through; one that is added
and is not in `WALK` fails here.
"""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest
from ballplate.cli import main
from ballplate.cli.outputs import OutputAction

from tests.cli import wording
from tests.cli.walk import BALLS, DESIGN, METAVARS, WALK, commands, content, label, line, refused

__all__ = ["BALLS", "DESIGN"]
WRITING = [(command, option) for command, walk in WALK.items() for option in walk.writes]
# Of each kind: a name without an option, a table, a page, a picture, a second file.
KINDS = [("init", "NAME.yaml"), ("simulate", "-o"), ("fit", "--report"), ("map", "--plot")]
KINDS += [("correct", "--covariance")]


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


@pytest.mark.usefixtures("idle")
class TestToldBeforeTheWork:
    """The command must not begin."""

    @pytest.mark.parametrize(("command", "option"), KINDS)
    def test_what_cannot_be_written(
        self,
        command: str,
        option: str,
        files: Path,
        tmp_path: Path,
        capsys: pytest.CaptureFixture[str],
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        """That every option of every command goes the same way is seen above."""
        name = WALK[command].writes[option]
        old = tmp_path / name
        old.write_text("old")
        (tmp_path / "folder" / name).mkdir(parents=True)
        before, opened, by_path = content(tmp_path), os.open, Path.open

        def told(path: Path, words: str, *more: str) -> None:
            refused(line(command, files, {option: path}, *more), capsys, 3, f"{path}: ", words)

        told(old, "exists already; name a new file, or overwrite it with --force\n")
        for path, words in (
            (tmp_path / "none" / name, "cannot be written (No such file or directory); check the"),
            (files / "balls.csv" / name, "cannot be written (Not a directory); check the folder"),
            (tmp_path / "folder" / name, "is a folder; name a file in it"),
            (tmp_path / (300 * "n" + name), "cannot be written (File name too long); check the"),
        ):
            told(path, words, "--force")
        for number in (errno.EROFS, errno.EACCES, errno.ENOSPC, errno.EDQUOT):

            def refuse(
                name: Any, flags: int, *arguments: Any, number: int = number, **others: Any
            ) -> int:
                if flags & os.O_CREAT and Path(name).parent == tmp_path:
                    raise OSError(number, os.strerror(number), name)
                return opened(name, flags, *arguments, **others)

            with monkeypatch.context() as patch:
                patch.setattr(os, "open", refuse)
                told(old, f"cannot be written ({os.strerror(number)}); ", "--force")

        def held(self: Path, mode: str = "r", *arguments: Any, **others: Any) -> Any:
            if self == old and mode != "rb":
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(self))
            return by_path(self, mode, *arguments, **others)

        with monkeypatch.context() as patch:
            patch.setattr(Path, "open", held)
            told(old, "whether another program has the file open", "--force")
        assert content(tmp_path) == before

    def test_an_extra_that_is_missing(
        self, files: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        extras = {".svg": "report", ".png": "report", ".pdf": "report", ".parquet": "parquet"}
        extras[".xlsx"] = "xlsx"
        for name in ("matplotlib", "pyarrow", "openpyxl"):
            monkeypatch.setitem(sys.modules, name, None)
        for command, option in WRITING:
            path = files / f"new-{WALK[command].writes[option]}"
            arguments = line(command, files, {option: path})
            if path.suffix in extras:
                told = f"python -m pip install 'ballplate[{extras[path.suffix]}]'"
                refused(arguments, capsys, 3, f"{path}: ", f"install it with: {told}")
            else:
                # The work begins: nothing is missing.
                with pytest.raises(AssertionError, match="has begun"):
                    main(arguments)
            assert not path.exists()

    def test_an_input(
        self, files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        before = content(files)
        for command, option in WRITING:
            walk = WALK[command]
            path = tmp_path / walk.writes[option]
            told = f"ballplate {command}: {option} {path} would overwrite ", "which is read"
            for one, name in (*walk.reads.items(), *(("", name) for name in walk.also)):
                for make_link, force in ((os.symlink, ()), (os.link, ("--force",))):
                    make_link(files / name, path)
                    arguments = line(command, files, {option: path}, *force, reads=(one,))
                    refused(arguments, capsys, 2, *told)
                    path.unlink()
        assert content(files) == before

    def test_another_output(
        self, files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        told = "are the same file; name another"
        for command, walk in WALK.items():
            for pair in combinations(walk.writes, 2):
                paths = {one: tmp_path / f"{k}{walk.writes[one]}" for k, one in enumerate(pair)}
                # Names that are different lead to the same place, where there is nothing yet.
                for path in paths.values():
                    path.symlink_to(tmp_path / "both")
                refused(line(command, files, paths), capsys, 2, told)
                for path in paths.values():
                    path.unlink()
        # There are disks that take no capitals for different.
        paths = {"-o": tmp_path / "all.csv", "--covariance": tmp_path / "ALL.csv"}
        refused(line("correct", files, paths), capsys, 2, told)

    def test_the_screen(
        self, files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        every = commands()
        for command, option in WRITING:
            (action,) = (one for one in every[command]._actions if label(one) == option)
            assert isinstance(action, OutputAction)
            arguments = line(command, files, {option: Path("-")})
            if action.takes_screen:
                more = ["-o", str(tmp_path / "r.csv")] if option == "--certificate" else []
                with pytest.raises(AssertionError, match="has begun"):
                    main([*arguments, *more])
            elif action.type is Path:
                told = "would be standard output, which has the rest; name a file"
                refused(arguments, capsys, 2, told)
            else:
                with pytest.raises(SystemExit) as left:
                    main(arguments)
                assert left.value.code == 2
        arguments = line("simulate", files, {"-o": Path("-"), "--certificate": Path("-")})
        told = "-o and --certificate both go to the screen; name a file for one"
        refused(arguments, capsys, 2, told)

    def test_a_module_that_the_experiment_runs(
        self, files: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        own = DESIGN.replace("{kind: metric}", '{kind: python, object: "my_model:build"}')
        (files / "own.yaml").write_text(own, encoding="utf-8")
        for name, text in (("my_model.py", "import my_other\n"), ("my_other.py", "")):
            (files / name).write_text(text, encoding="utf-8")
        for name in ("my_model.py", "my_other.py"):
            arguments = ["simulate", str(files / "own.yaml"), "-o", str(files / name), "--force"]
            told = f"-o {files / name} would overwrite {files / name}, which is read"
            refused(arguments, capsys, 2, told)

    def test_the_log_of_a_store(self, files: Path, capsys: pytest.CaptureFixture[str]) -> None:
        log = files / "store.sqlite-wal"
        log.write_bytes(b"rows that are not in the store yet")
        arguments = line("sweep --report", files, {"-o": log}, "--format", "text", "--force")
        refused(arguments, capsys, 2, f"-o {log} would overwrite {log}, which is read")

    def test_every_reason(
        self, files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        (tmp_path / "l.csv").write_text("old")
        paths = {"-o": tmp_path / "l.csv", "--covariance": tmp_path / "none" / "p.csv"}
        assert main(line("correct", files, paths)) == 3
        first, second = capsys.readouterr().err.splitlines()
        assert first.startswith(f"{paths['-o']}: exists already")
        assert second.startswith(f"{paths['--covariance']}: cannot be")


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
