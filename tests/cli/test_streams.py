"""Standard streams that are closed or full: what is said of them, and that nothing else takes their
place.
"""

from __future__ import annotations

import errno
import os
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest
from ballplate.cli import main, schema

from tests.cli import wording
from tests.extensions.sweeps.support import ROOT, small_sweep

COMMAND = f'"{sys.executable}" -m ballplate'


def found_by(
    line: list[str], folder: Path, unbuffered: str = ""
) -> subprocess.CompletedProcess[str]:
    environment = {
        **os.environ,
        "PYTHONUNBUFFERED": unbuffered,
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONPATH": str(ROOT),
    }
    return subprocess.run(line, cwd=folder, env=environment, capture_output=True, text=True)


@pytest.mark.parametrize(("arguments", "unbuffered"), [("--version", "1"), ("schema", "")])
def test_help_and_version_are_data_too(arguments: str, unbuffered: str, tmp_path: Path) -> None:
    reason = "No space left on device"
    found = found_by(["bash", "-c", f"{COMMAND} {arguments} >/dev/full"], tmp_path, unbuffered)
    assert found.stderr == f"standard output: cannot be written ({reason}); give it room\n"
    assert found.returncode == 3
    for to in (">&-", "| true"):
        line = f"set -o pipefail; {COMMAND} {arguments} {to}"
        found = found_by(["bash", "-c", line], tmp_path, unbuffered)
        assert (found.returncode, found.stderr) == (0, "")


def test_a_store_is_not_blamed_for_standard_output(tmp_path: Path) -> None:
    file = small_sweep(tmp_path, 2)
    found = found_by(["bash", "-c", f'{COMMAND} sweep "{file}" --workers 1 >/dev/full'], tmp_path)
    assert found.returncode == 3
    told = [line for line in found.stderr.splitlines() if "cannot be written" in line]
    assert told == [wording.STANDARD_OUTPUT_CANNOT_BE_WRITTEN_NO_SPACE]
    connection = sqlite3.connect(tmp_path / "small.sqlite")
    assert connection.execute("SELECT count(*) FROM result").fetchone()[0] >= 2
    connection.close()


def test_workers_print_nothing_where_standard_error_is_closed(tmp_path: Path) -> None:
    file = small_sweep(tmp_path, 2)
    found = found_by(["bash", "-c", f'{COMMAND} sweep "{file}" --workers 2 <&- 2>&-'], tmp_path)
    assert found.stdout.count("\n") == 1 and "Traceback" not in found.stdout


def test_other_errors_of_files_are_not_those_of_standard_output(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(_: object) -> int:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), "/a\nfile")

    monkeypatch.setattr(schema, "run", fail)
    assert main(["schema"]) == 3
    told = (
        "/a\\x0afile: cannot be used (Read-only file system); check the name, the permissions and"
        " the room there\n"
    )
    assert capsys.readouterr() == ("", told)


def test_a_current_folder_that_has_been_deleted_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert main(["init", "new.yaml"]) == 3
    assert capsys.readouterr().err.splitlines() == [wording.CANNOT_BE_WRITTEN]
    monkeypatch.setattr(schema, "run", lambda _: Path.cwd())
    assert main(["schema"]) == 3
    told = "ballplate schema: the current folder no longer exists; change to another\n"
    assert capsys.readouterr() == ("", told)
