"""Names that a spreadsheet would compute are written as text, and read again as they were."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest
from ballplate.cli import main
from ballplate.simulator.inputs.writing import CsvWriter, cell_of_text, text_of_cell
from hypothesis import given, strategies as st

EXPERIMENT = """\
title: "=HYPERLINK(1)"
machine: {volume: [1 m, 1 m, 1 m], repeatability: 0.2 um}
error_model: {kind: metric}
probes: {"@down": [0 mm, 0 mm, -50 mm]}
artefacts: {"-plate": {kind: balls, coordinates: {"=1+1": [0 mm, 0 mm], "+b": [300 mm, 0 mm], "'=c": [0 mm, 300 mm], "d'": [300 mm, 300 mm]}}}
positions:
  - {name: "=cmd|' /C calc'!A0", pose: {origin: [100 mm, 100 mm, 100 mm]}}
  - {name: "+two", pose: {origin: [200 mm, 100 mm, 300 mm], rotation: [20 deg, 10 deg, 0 deg]}}
  - {name: "'=three", pose: {origin: [200 mm, 500 mm, 300 mm], rotation: [70 deg, 10 deg, 20 deg]}}
  - {name: "'four", pose: {origin: [500 mm, 500 mm, 300 mm], rotation: [0 deg, 80 deg, 20 deg]}}
calibration: [{kind: coordinates, standard_uncertainty: 0.2 um}]
"""


@given(st.text(st.characters(blacklist_categories=["Cs"], blacklist_characters="\0"), max_size=8))
def test_every_text_comes_back(text: str) -> None:
    assert text_of_cell(cell_of_text(text)) == text


@given(st.text("'=+-@\t1.e aN\"", max_size=6))
def test_texts_near_formulas_come_back_and_are_none(text: str) -> None:
    stream = io.StringIO()
    CsvWriter(stream).writerow([text, "x"])
    (row,) = csv.reader(io.StringIO(stream.getvalue(), newline=""))
    assert text_of_cell(row[0]) == text
    if len(row[0]) > 1:
        assert row[0][0] not in "=@\t\r"
    if len(row[0]) > 1 and row[0][0] in "+-":
        float(row[0])


@given(st.floats())
def test_numbers_are_left_alone(value: float) -> None:
    assert cell_of_text(repr(value)) == repr(value)


def test_readings_and_other_tables(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, readings, table = tmp_path / "e.yaml", tmp_path / "r.csv", tmp_path / "t.csv"
    path.write_text(EXPERIMENT, encoding="utf-8")
    assert main(["simulate", str(path), "-o", str(readings)]) == 0
    lines = readings.read_text(encoding="utf-8").splitlines()
    assert lines[1].startswith("'=cmd|' /C calc'!A0,'=1+1,'@down,")
    assert all(line[0] not in "=+-@" for line in lines)
    assert main(["fit", str(path), str(readings)]) == 0
    assert main(["run", "--reliability", str(path), "-o", str(table)]) == 0
    for row in csv.reader(io.StringIO(table.read_text(encoding="utf-8"), newline="")):
        for cell in row:
            if len(cell) > 1:
                assert cell[0] not in "=@"
            if len(cell) > 1 and cell[0] in "+-":
                float(cell)
