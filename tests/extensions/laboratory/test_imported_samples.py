"""Samples of makers' formats, written by somebody who had not seen the readers, import to the same
readings and estimates as the plain tables of the same campaign.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from ballplate.cli import main

FOLDER = Path(__file__).parent / "samples"
CAMPAIGN = FOLDER / "campaign.yaml"
REPORTS = [
    row
    for row in csv.DictReader((FOLDER / "index.csv").read_text(encoding="utf-8").splitlines())
    if Path(row["file"]).suffix in (".dmo", ".txt", ".qif")
]
KEYS = ["position", "ball", "probe"]
AXES = ["x_mm", "y_mm", "z_mm"]


def in_order(table: pd.DataFrame) -> pd.DataFrame:
    return table.sort_values(KEYS).reset_index(drop=True)


def scale_readings(centres: pd.DataFrame) -> pd.DataFrame:
    """Centres less the offset of the tip that read them, from the experiment's text alone."""
    texts = yaml.safe_load(CAMPAIGN.read_text(encoding="utf-8"))["probes"]
    offsets = {name: [float(text.split()[0]) for text in one] for name, one in texts.items()}
    found = centres.copy()
    found[AXES] = centres[AXES] - np.array([offsets[probe] for probe in centres["probe"]])
    return found


def test_there_are_reports_of_every_format() -> None:
    told = " ".join(row["format"] for row in REPORTS)
    assert len(REPORTS) >= 9
    assert all(word in told for word in ("DMIS", "QIF 3", "QIF 2", "text report", "table"))


@pytest.mark.parametrize("row", REPORTS, ids=lambda row: row["file"])
def test_a_report_imports_to_the_readings_of_the_plain_table(
    row: dict[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, written = FOLDER / row["file"], tmp_path / "readings.csv"
    assert main(["import", str(path), "--for", str(CAMPAIGN), "-o", str(written)]) == 0
    said = capsys.readouterr().err
    assert "taken: 112 " in said and "112 readings written" in said
    assert "readings: {coordinates: ball centres}" in said
    found = in_order(scale_readings(pd.read_csv(written, comment="#")))
    expected = in_order(pd.read_csv(FOLDER / row["plain"]))
    assert found[KEYS].equals(expected[KEYS])
    # The plain table has the report's digits; points on the surface have rounding of their own.
    unit = 25.4 if "inch" in row["unit"] else 1.0
    tolerance = unit * 10.0 ** -int(row["digits"]) if "points" in row["file"] else 1e-8
    assert np.abs(found[AXES] - expected[AXES]).to_numpy().max() < tolerance
