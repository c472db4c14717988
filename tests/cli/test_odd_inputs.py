"""Inputs that no planner writes and a slip makes: each ends with a message of its file."""

from __future__ import annotations

import re
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.designs import shipped
from ballplate.extensions.studio.folder import DesignFolder, RefusedError

QUICKSTART = Path(shipped("quickstart.yaml"))


def test_links_in_a_circle(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    try:
        (tmp_path / "loop").symlink_to("loop")
    except OSError:
        pytest.skip("no links here")
    text = QUICKSTART.read_text(encoding="utf-8")
    own = "error_model: {kind: python, object: 'own:build', folder: loop}\n"
    (tmp_path / "own.yaml").write_text(re.sub(r"error_model:.*\n(?: .*\n)*", own, text))
    for line in ("studio loop --no-browser", "check loop", "run own.yaml", "check loop/*.yaml"):
        assert main(line.split()) == 3, line
        told = capsys.readouterr().err
        assert "internal error" not in told and ("loop" in told or "own" in told)


@pytest.mark.parametrize("value", [-1.7e308, 1e5])
def test_a_map_of_no_machine(
    value: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    quickstart = bp.quickstart()
    bp.write_map(bp.fit(quickstart, bp.simulate(quickstart)).to_map(), tmp_path / "map.yaml")
    text = (tmp_path / "map.yaml").read_text(encoding="utf-8")
    text = re.sub(r"(?m)^(checksum|check|files):.*\n(- .*\n)*", "", text)
    changed = re.sub(r'("EXX\[1\]".*"value": )[^}]+', rf"\g<1>{value!r}", text, count=1)
    assert repr(value) in changed
    (tmp_path / "odd.yaml").write_text(changed, encoding="utf-8")
    assert main(["diff", str(tmp_path / "map.yaml"), str(tmp_path / "odd.yaml")]) == 3
    assert "parameters[0].value" in capsys.readouterr().err


def test_long_names_on_the_first_page(tmp_path: Path) -> None:
    folder = DesignFolder(tmp_path / "first.yaml", "")
    for name in ("n" * 300 + ".yaml", "ü" * 120 + ".yaml", "n" * 10_000 + ".yaml"):
        with pytest.raises(RefusedError, match="is not the name of a design"):
            folder.free(name, "first.yaml")
    assert folder.free("n" * 150 + ".yaml", "first.yaml")


def test_workbooks_where_text_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from openpyxl import Workbook

    monkeypatch.chdir(tmp_path)
    book = Workbook()
    book.active.append(["ball", "x_mm", "y_mm"])
    book.save("book.xlsx")
    Path("machine.yaml").write_text(
        "title: m\narrangement: MB2\nvolume: [1 m, 1 m, 1 m]\nerrors: {EXX: {file: book.xlsx}}\n"
    )
    assert main(["simulate", str(QUICKSTART), "-o", "readings.csv"]) == 0
    for line in (
        f"fit {QUICKSTART} readings.csv --certificate book.xlsx",
        "map machine.yaml",
        "spline book.xlsx",
        "check book.xlsx",
    ):
        capsys.readouterr()
        assert main(line.split()) == 3
        assert "is a workbook" in capsys.readouterr().err


def test_no_printed_line_is_a_command_of_a_workflow(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """GitHub takes lines that begin with two colons, blanks before them or not, as commands."""
    monkeypatch.chdir(tmp_path)
    text = QUICKSTART.read_text(encoding="utf-8")
    text = re.sub("title:.*", 'title: "::stop-commands::x"', text)
    text = text.replace("name: z low", 'name: "::error::position"').replace(
        "plate:", '"::error::plate":', 1
    )
    names = ("::error::file.yaml", "  ::error::blank.yaml")
    for name in names:
        Path(name).write_text(text, encoding="utf-8")
        for command in ("check", "run", "check --json", "sheet", "run --errors"):
            main([*command.split(), name])
            told = "".join(capsys.readouterr())
            assert not re.search(r"(?m)^\s*::", told), told
