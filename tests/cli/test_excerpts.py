"""Lines of files below the errors about them, where a person reads them."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from ballplate.cli import main

QUICKSTART = Path("designs/quickstart.yaml")


@pytest.fixture
def wrong(tmp_path: Path) -> Path:
    """A file with a word where a number should be, in some line and column."""
    file = tmp_path / "wrong.yaml"
    text = QUICKSTART.read_text(encoding="utf-8")
    file.write_text(text.replace("[1 m, 1 m, 1 m]", "[1 m, 1 parsec, 1 m]"), encoding="utf-8")
    return file


def errors(file: Path, capsys: pytest.CaptureFixture[str], *options: str) -> list[str]:
    assert main(["run", str(file), *options]) == 3
    out, err = capsys.readouterr()
    assert out == ""
    return [str(line) for line in err.splitlines()]


def test_logs_have_a_line_for_each_error(wrong: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (line,) = errors(wrong, capsys)
    assert line.startswith(f"{wrong}:") and "parsec" in line


def test_at_a_terminal_the_line_is_shown(
    wrong: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (plain,) = errors(wrong, capsys)
    verbose = errors(wrong, capsys, "-v")
    with monkeypatch.context() as patched:
        patched.setattr(type(sys.stderr), "isatty", lambda self: True)
        told, shown, mark = errors(wrong, capsys)
    assert told == plain and [told, shown, mark] == verbose[-3:]
    number, column = (int(one) for one in told.removeprefix(f"{wrong}:").split(":")[:2])
    line = wrong.read_text(encoding="utf-8").splitlines()[number - 1]
    assert shown.strip() == line.strip()
    # What stands above the mark is what stands at the column.
    assert mark.strip() == "^" and shown[mark.index("^") :].rstrip() == line[column - 1 :].rstrip()
