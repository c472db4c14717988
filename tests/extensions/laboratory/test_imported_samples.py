"""Samples of makers' formats, written by somebody who had not seen the readers, import to the same
readings and estimates as the plain tables of the same campaign.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import ballplate as bp
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


def estimates(table: pd.DataFrame) -> dict[str, Any]:
    return bp.fit(CAMPAIGN, table).to_dict()


def numbers(found: object) -> list[float]:
    """All numbers of plain data, in its order."""
    if isinstance(found, dict):
        return [number for one in found.values() for number in numbers(one)]
    if isinstance(found, list):
        return [number for one in found for number in numbers(one)]
    is_number = isinstance(found, int | float) and not isinstance(found, bool)
    return [float(found)] if is_number else []  # type: ignore[arg-type]


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


def test_readings_that_the_plan_has_and_the_report_not_are_told(tmp_path: Path) -> None:
    """And the other way round: every name of what was removed, and how many of each."""
    lines = (FOLDER / "dmis_mm.dmo").read_text(encoding="utf-8").splitlines(keepends=True)
    readings = bp.read_report(FOLDER / "dmis_mm.dmo", CAMPAIGN).to_frame()
    planned, whole = bp.read_report(FOLDER / "dmis_mm.dmo", CAMPAIGN).imported, len(readings)
    assert not any("planned" in one for one in planned.remarks)
    # Of one position all, and of another the first.
    first, second = list(dict.fromkeys(readings["position"]))[:2]
    gone = readings.index[readings["position"] == first].tolist()
    single = int(readings.index[readings["position"] == second][0])
    marks = [reading.mark.line for reading in planned.readings]
    left = [*gone, single]
    begins = [marks[i] - 1 for i in left]
    ends = [
        begin + 1 + [not _goes_on(line) for line in lines[begin:]].index(True) for begin in begins
    ]
    dropped = {k for begin, end in zip(begins, ends, strict=True) for k in range(begin, end)}
    path = tmp_path / "short.dmo"
    path.write_text("".join(line for k, line in enumerate(lines) if k not in dropped), "utf-8")
    imported = bp.read_report(path, CAMPAIGN).imported
    assert len(imported.readings) == whole - len(left)
    (told,) = (one for one in imported.remarks if "planned" in one)
    assert told.startswith(f"{len(left)} of {whole} planned readings are missing: ")
    assert f"all of {first}" in told and f"{readings['ball'][single]} " in told
    assert f"in {second}" in told and told.count(", ") == 1
    # Planned without the ball, its readings are more than the plan has.
    content = yaml.safe_load(CAMPAIGN.read_text(encoding="utf-8"))
    place = next(one for one in content["positions"] if one.get("name") == second)
    ball = readings["ball"][single]
    unplanned = int(((readings["position"] == second) & (readings["ball"] == ball)).sum())
    place["balls"] = sorted(set(readings["ball"]) - {ball})
    other = tmp_path / "campaign.yaml"
    other.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    (told,) = (
        one
        for one in bp.read_report(FOLDER / "dmis_mm.dmo", other).imported.remarks
        if "planned" in one
    )
    assert f"{unplanned} reading" in told and "not planned: " in told
    assert ball in told and told.endswith(f"in {second}")


def _goes_on(line: str) -> bool:
    return line.rstrip().endswith("$")


def test_points_on_the_surface_fit_to_the_estimates_within_the_rounding_of_points() -> None:
    (row,) = (row for row in REPORTS if "points" in row["file"])
    imported = bp.read_report(FOLDER / row["file"], CAMPAIGN).to_frame()
    found = np.array(numbers(estimates(in_order(scale_readings(imported)))))
    plain = in_order(pd.read_csv(FOLDER / row["plain"]))
    expected, generator = np.array(numbers(estimates(plain))), np.random.default_rng(3)
    spread = np.zeros(len(expected))
    for _ in range(10):
        rounded = plain.copy()
        rounded[AXES] += generator.uniform(-0.5, 0.5, (len(plain), 3)) * 10.0 ** -int(row["digits"])
        spread += (np.array(numbers(estimates(rounded))) - expected) ** 2 / 10
    # Every number within five standard deviations of what rounding the readings alone would do.
    assert (np.abs(found - expected) <= 5 * np.sqrt(spread) + 1e-12).all()
    assert np.sqrt(spread).max() > 0.0
