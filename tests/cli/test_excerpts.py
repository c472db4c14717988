"""Lines of files below the errors about them, where a person reads them."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest
from ballplate.cli import main
from ballplate.cli.excerpts import excerpt, has_colour

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
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "200")
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


def test_colour_by_the_environment_alone(
    wrong: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert not any("\x1b" in line for line in errors(wrong, capsys, "-v"))
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert any("\x1b" in line for line in errors(wrong, capsys, "-v"))
    assert not any("\x1b" in line for line in errors(wrong, capsys))
    monkeypatch.setenv("NO_COLOR", "1")
    assert not any("\x1b" in line for line in errors(wrong, capsys, "-v"))


def test_no_colour_where_there_is_no_terminal() -> None:
    file = io.StringIO()
    assert not has_colour(file, {}) and not has_colour(file, {"NO_COLOR": ""})
    assert has_colour(file, {"FORCE_COLOR": "1"}) and not has_colour(
        file, {"FORCE_COLOR": "1", "NO_COLOR": "1"}
    )


@pytest.mark.parametrize("width", [20, 40, 80])
@pytest.mark.parametrize("column", [1, 2, 50, 99, 100, 101])
def test_long_lines_are_cut_around_the_place(width: int, column: int) -> None:
    line = "".join(chr(ord("a") + k % 26) for k in range(100))
    shown, mark = excerpt(line, column, width)
    assert len(shown) < width and len(mark) < width
    above = shown[mark.index("^") :][:1]
    assert above == line[column - 1 : column] and shown.strip() in line


def test_characters_of_other_widths() -> None:
    assert excerpt("\t名前: x", 5, 80) == ("     名前: x", "    " + " " * 6 + "^")
    assert excerpt("a\x1b[31mb", 7, 80) == ("    a\\x1b[31mb", "    " + " " * 9 + "^")


def test_a_line_of_a_million_characters_is_shown_at_once() -> None:
    shown, mark = excerpt("x" * 500_000 + "y" + "x" * 500_000, 500_001, 80)
    assert shown[mark.index("^")] == "y" and len(shown) < 80
