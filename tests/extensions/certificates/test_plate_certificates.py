"""`certificate` as a user meets it."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import ballplate as bp
import pytest
import yaml
from ballplate.cli import main

from tests.extensions.certificates.campaigns import IN_SPACE


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An experiment, its readings, and the map that they give."""
    sections = {**IN_SPACE, "error_model": {"kind": "metric"}, "coverage_factor": 3}
    (tmp_path / "e.yaml").write_text(yaml.safe_dump(sections))
    experiment = bp.load(tmp_path / "e.yaml")
    bp.simulate(experiment, 1).to_csv(tmp_path / "r.csv", index=False)
    bp.simulate(experiment, 2).to_csv(tmp_path / "r2.csv", index=False)
    return tmp_path


def test_tables_come_in_two_and_neither_is_overwritten(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = ["certificate", str(folder / "e.yaml"), str(folder / "r.csv"), "-o"]
    (folder / "plate-covariance.csv").write_text("mine")
    assert main([*line, str(folder / "plate.csv")]) == 3
    assert "plate-covariance.csv: exists already" in capsys.readouterr().err
    assert not (folder / "plate.csv").exists()
    assert main([*line, str(folder / "plate.csv"), "--force"]) == 0
    out, err = capsys.readouterr()
    assert out == "" and err.count(" written") == 2
    assert (folder / "plate-covariance.csv").read_text().startswith("covariance_um2,r1c1 x,")
    # What is read is not written, not even with --force.
    shutil.copy(folder / "r.csv", folder / "plate-covariance.csv")
    line = ["certificate", str(folder / "e.yaml"), str(folder / "plate-covariance.csv"), "-o"]
    assert main([*line, str(folder / "plate.csv"), "--force"]) == 2
    assert "which is read" in capsys.readouterr().err


def test_printed_and_written_are_the_same(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = ["certificate", str(folder / "e.yaml"), str(folder / "r.csv")]
    assert main([*line, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["coverage_factor"] == 3.0
    assert main([*line, "--json", "-o", str(folder / "p.csv"), "--force"]) == 0
    assert json.loads(capsys.readouterr().out) == told
    with (folder / "p.csv").open(newline="", encoding="utf-8") as stream:
        table = (line for line in stream if not line.startswith("#"))
        rows = {row["ball"]: row for row in csv.DictReader(table)}
    assert float(rows["r3c3"]["y_mm"]) == pytest.approx(1e3 * told["balls"]["r3c3"]["y"]["value"])
    assert main(line) == 0
    text = capsys.readouterr().out
    assert "U = 3 u" in text and "not a calibration certificate" in text


def test_wrong_usage_is_told_in_one_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    experiment, readings = str(folder / "e.yaml"), str(folder / "r.csv")
    for more, told in (
        (["certificate", readings, "--datum", "r1c1,r9c9,r1c3"], 'no ball "r9c9"'),
        (["certificate", readings, "--about", "datum=x"], "the certificate has no entry"),
        (["certificate", readings, "-o", str(folder / "p.xml")], "when the plate was measured"),
    ):
        assert main([more[0], experiment, *more[1:]]) == 2
        assert told in capsys.readouterr().err.splitlines()[-1]
