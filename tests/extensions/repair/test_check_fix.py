"""`check --fix`: files are mended as a whole or left as they were."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

import ballplate as bp
import pytest
import yaml
from ballplate.cli import main
from ballplate.results.prediction import check
from ballplate.simulator.experiment.loading import load

from tests.extensions.repair import wording
from tests.reference.copies import copy_file

SYMMETRICAL = Path("designs/npl/6.1.1.yaml").resolve()
QUICKSTART = Path("designs/quickstart.yaml").resolve()
GAUGE = Path("designs/hurt_foss/bryan-gauge.yaml").resolve()

SHIFTED = """\
# two positions, half a turn missing
title: a plate that is only shifted
machine: {volume: [900 mm, 900 mm], repeatability: 0.2 um}
error_model: {kind: metric, scale: x}
artefacts: {plate: {kind: square, balls: 4, size: 360 mm}}
positions:
  - name: straight
    corner: {x: 250 mm, y: 250 mm}   # the corner of the table
  - {name: shifted, corner: {x: 350 mm, y: 300 mm}}
"""
# Where a pool is, no other positions are added, and one that is there is turned.
COMMENTED = (
    SHIFTED.replace("corner: {x: 250 mm, y: 250 mm}   #", "pose: {origin: [250 mm, 250 mm]}   #")
    + "pool: {}\n"
)


def run(*arguments: str | Path) -> int:
    return main([str(argument) for argument in arguments])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "shifted.yaml").write_text(SHIFTED, encoding="utf-8")
    (tmp_path / "commented.yaml").write_text(COMMENTED, encoding="utf-8")
    copy_file(QUICKSTART, tmp_path / "good.yaml")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def deficiencies(path: Path) -> list[int]:
    return [check(one).verdict.deficiency for one in load(path)]


@pytest.mark.long
def test_deficient_variants_are_mended_and_the_others_left(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / "6.1.1.yaml"
    text = SYMMETRICAL.read_text(encoding="utf-8").replace("random: 100", "random: 12")
    text = text.replace("[7, 7]", "[5, 5]")
    path.write_text(text, encoding="utf-8")
    assert deficiencies(path) == [0, 2, 0, 2]
    assert run("check", "--fix", path) == 0
    out, err = capsys.readouterr()
    assert out.count("\nfull rank, as expected") == 4
    notes = [line for line in err.splitlines() if line.startswith(str(path))]
    assert [line.split(": ")[1:3] for line in notes] == [
        ["6.1.1[A]", "nothing to repair"],
        ["6.1.1[B]", "repaired"],
        ["6.1.1[C]", "nothing to repair"],
        ["6.1.1[D]", "repaired"],
    ]
    assert deficiencies(path) == [0, 0, 0, 0]
    mended = path.read_bytes()
    before = yaml.safe_load(text)
    after = yaml.safe_load(mended)
    for said in (before, after):
        del said["variants"]["B"], said["variants"]["D"]
    assert before == after
    assert run("check", "--fix", path, "--variant", "B") == 0
    assert path.read_bytes() == mended
    assert capsys.readouterr().err.endswith("6.1.1[B]: nothing to repair\n")


def test_line_ends_and_marks_stay(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, text in {"crlf": SHIFTED.replace("\n", "\r\n"), "mark": "\ufeff" + SHIFTED}.items():
        path = folder / f"{name}.yaml"
        path.write_bytes(text.encode())
        new = bp.repair(path)
        assert run("check", "--fix", "-q", path.name) == 0
        assert capsys.readouterr().err == ""
        assert path.read_bytes().decode("utf-8-sig") == new != text.removeprefix("\ufeff")
        assert path.read_bytes().startswith("\ufeff".encode()) == (name == "mark")


def test_each_file_is_mended_by_itself(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (folder / "good.yaml").read_bytes()
    assert run("check", "--fix", "commented.yaml", "shifted.yaml", "good.yaml") == 3
    out, err = capsys.readouterr()
    column = COMMENTED.split("\n")[7].index("#") + 1
    refused = [line for line in err.splitlines() if line.startswith("commented.yaml")]
    assert refused == [
        f"commented.yaml:8:{column}: positions[0].pose: a comment here would be lost by the"
        " change; change it by hand"
    ]
    # What is not mended is told as by --suggest.
    assert "rank deficiency 2" in out and wording.REPAIR_IN_THE_FILE in out
    assert (folder / "commented.yaml").read_text(encoding="utf-8") == COMMENTED
    assert deficiencies(folder / "shifted.yaml") == [0]
    assert (folder / "good.yaml").read_bytes() == before
    assert sorted(os.listdir(folder)) == ["commented.yaml", "good.yaml", "shifted.yaml"]


def test_what_cannot_be_repaired_is_told_as_it_is_suggested(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / "gauge.yaml"
    copy_file(GAUGE, path)
    text = path.read_bytes()
    found = []
    for option in ("--suggest", "--fix"):
        status = run("check", option, path, "--variant", "one height")
        found.append((status, capsys.readouterr().out))
    assert found[0] == found[1] and wording.NO_CHANGES_WERE_FOUND in found[0][1]
    assert path.read_bytes() == text
    with pytest.raises(bp.ExperimentError, match=wording.NO_CHANGES_WERE_FOUND):
        bp.repair(path, "one height")


@pytest.mark.parametrize("failing", ["fsync", "replace"])
@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left"), KeyboardInterrupt()])
def test_a_failure_loses_nothing(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    failing: str,
    error: BaseException,
) -> None:
    def fail(*arguments: Any) -> None:
        raise error

    monkeypatch.setattr(os, failing, fail)
    status = run("check", "--fix", "shifted.yaml")
    out, err = capsys.readouterr()
    assert (folder / "shifted.yaml").read_text(encoding="utf-8") == SHIFTED
    assert sorted(os.listdir(folder)) == ["commented.yaml", "good.yaml", "shifted.yaml"]
    assert "repaired: " not in err and "\nfull rank" not in out
    if isinstance(error, OSError):
        assert status == 3 and wording.THE_EXISTING_FILE_IS_UNCHANGED in err
    else:
        assert status == 130 and err == "interrupted\n"


def test_a_file_that_changes_meanwhile_is_left(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from ballplate.extensions.repair import mending_command as mending

    path = folder / "shifted.yaml"
    mended = mending.mended

    def slow(*arguments: Any) -> str:
        new = mended(*arguments)
        path.write_text("title: other\n", encoding="utf-8")
        return new

    monkeypatch.setattr(mending, "mended", slow)
    assert run("check", "--fix", path) == 3
    assert wording.THE_FILE_HAS_CHANGED_MEANWHILE in capsys.readouterr().err
    assert path.read_text(encoding="utf-8") == "title: other\n"


def test_nothing_is_invented(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A certificate that the file does not state is printed, and never written."""
    path = folder / "invented.yaml"
    copy_file(Path(__file__).parents[3] / "designs/hurt_foss/bar-bell.yaml", path)
    before, variant = path.read_bytes(), "length unknown"
    assert run("check", "--fix", path, "--variant", variant) in (0, 1)
    out, err = capsys.readouterr()
    assert path.read_bytes() == before
    assert wording.NOT_WRITTEN in err and "repaired" not in err
    assert "in the file: add to calibration" in out
    with pytest.raises(bp.ExperimentError, match="does not state"):
        bp.repair(path, variant=variant)


def test_a_weak_design_is_mended_where_weak_ones_fail(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / "weak.yaml"
    copy_file(Path(__file__).parents[3] / "designs/certified/weak.yaml", path)
    before = path.read_bytes()
    assert run("check", "--fix", path) == 0
    assert capsys.readouterr().err.endswith("weak: nothing to repair\n")
    assert path.read_bytes() == before
    assert run("check", "--fail-weak", path) == 1
    assert run("check", "--fail-weak", "--fix", path) == 0
    (found,) = load(path)
    assert not check(found).verdict.weak
