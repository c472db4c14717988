"""Every sample of a laboratory's export, written by somebody who had not seen the readers, fits by
one command, and to the estimates of the plain table of the same readings; reports import to these.
"""

from __future__ import annotations

import csv
import json
import re
from functools import cache
from pathlib import Path
from shutil import copy
from typing import Any

import ballplate as bp
import numpy as np
import pandas as pd
import pytest
import yaml
from ballplate.cli import main
from scipy.spatial.distance import pdist

from tests.extensions.laboratory import wording

FOLDER = Path(__file__).parent / "samples"
CAMPAIGN = FOLDER / "campaign.yaml"
ROWS = list(csv.DictReader((FOLDER / "index.csv").read_text(encoding="utf-8").splitlines()))
# One of each kind, which the ordinary tests fit.
ORDINARY = {
    *("dmis_points.dmo", "pcdmis_inch.txt", "calypso_chr.txt", "qif_3_0.qif", "german.csv"),
    *("centres.csv", "part.csv", "one_per_position", "swapped.csv"),
}
# What a table does not say of itself.
OPTIONS = {
    "centres.csv": ["--coordinates", "ball centres"],
    "part.csv": ["--coordinates", "part"],
    "swapped.csv": ["--swap-names"],
}
# Largest difference in standard uncertainties, 1e-4 else. Part co-ordinates do not tell the pose;
# centres of points, good to 0.00018 µm, are compared with readings good to 0.3 µm: five of these.
WITHIN = {"part.csv": 0.05, "dmis_points.dmo": 5 * 0.00018 / 0.3}


@cache
def plain(name: str) -> dict[str, dict[str, float]]:
    return dict(bp.fit(CAMPAIGN, FOLDER / name).to_dict()["estimates"])


def fitted(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[Any, str]:
    capsys.readouterr()
    status = main(["fit", *arguments, "--json"])
    out, err = capsys.readouterr()
    assert status == 0, err
    return json.loads(out)["estimates"], err


def largest_difference(found: Any, expected: dict[str, dict[str, float]]) -> float:
    """Of values, in standard uncertainties."""
    assert found.keys() == expected.keys() and len(found) > 30
    return max(
        abs(one["value"] - expected[name]["value"]) / expected[name]["standard_uncertainty"]
        for name, one in found.items()
    )


def split(estimates: Any) -> tuple[Any, Any]:
    """The machine's estimates, and the co-ordinates of balls (n, 3)."""
    places = [
        one["value"] for name, one in estimates.items() if re.fullmatch("r[1-4]c[1-4]: [xyz]", name)
    ]
    machine = {name: one for name, one in estimates.items() if ":" not in name}
    return machine, np.reshape(places, (16, 3))


def chosen(row: dict[str, Any]) -> Any:
    """One of each maker in the ordinary tests, all of them in the long ones."""
    is_ordinary = row["file"] in ORDINARY
    return pytest.param(row, id=row["file"], marks=() if is_ordinary else pytest.mark.long)


@pytest.mark.parametrize("row", [chosen(row) for row in ROWS])
def test_an_export_fits_by_one_command(
    row: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    path = FOLDER / row["file"]
    files = sorted(map(str, path.iterdir())) if path.is_dir() else [str(path)]
    options = OPTIONS.get(row["file"], [])
    found, told = fitted([str(CAMPAIGN), *files, *options], capsys)
    expected = plain(row["plain"])
    if row["coordinates"] == "part":
        # Where the plate stood is not in them: the machine's errors and the plate's shape are.
        assert wording.PLACED_BY_THE_NOMINAL_POSES in told
        found, apart = split(found)
        expected, there = split(expected)
        assert np.abs(pdist(apart) - pdist(there)).max() < 1e-9
    assert largest_difference(found, expected) <= WITHIN.get(row["file"], 1e-4)
    if path.suffix in (".dmo", ".qif") or path.name.startswith(("pcdmis", "calypso")):
        assert "taken: 112 " in told and "left: " in told
        assert wording.CO_ORDINATES_ARE_TAKEN_FOR_BALL in told


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


REPORTS = [row for row in ROWS if Path(row["file"]).suffix in (".dmo", ".txt", ".qif")]


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


def test_an_experiment_names_its_reports(tmp_path: Path) -> None:
    """From Python, without any argument; and a table beside a report, if both are centres."""
    told = yaml.safe_load(CAMPAIGN.read_text(encoding="utf-8"))
    copy(FOLDER / "qif_3_0.qif", tmp_path)
    (tmp_path / "one.yaml").write_text(
        yaml.safe_dump(told | {"readings": {"files": "qif_3_0.qif"}}), encoding="utf-8"
    )
    found = bp.fit(tmp_path / "one.yaml").to_dict()["estimates"]
    assert largest_difference(found, plain("plain/mm6.csv")) <= 1e-4
    # The first position is in a report, all others in a table of centres.
    lines = (FOLDER / "dmis_mm.dmo").read_text(encoding="utf-8").splitlines(keepends=True)
    until = next(k for k, line in enumerate(lines) if "P2_R1C1" in line)
    (tmp_path / "first.dmo").write_text("".join(lines[:until]), encoding="utf-8")
    table = pd.read_csv(FOLDER / "centres.csv")
    table[table["position"] != "P1"].to_csv(tmp_path / "rest.csv", index=False)
    both = [tmp_path / "first.dmo", tmp_path / "rest.csv"]
    with pytest.raises(bp.ExperimentError, match=wording.A_TABLE_BESIDE_REPORTS_STATE_WHAT):
        bp.fit(CAMPAIGN, both)
    found = bp.fit(CAMPAIGN, both, coordinates="ball centres").to_dict()["estimates"]
    assert largest_difference(found, plain("plain/mm5.csv")) <= 1e-4


def test_the_rule_of_names_in_a_report_can_be_stated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (FOLDER / "qif_3_0.qif").read_text(encoding="utf-8")
    text, count = re.subn(r">(P\d) (r\dc\d) (\w+)<", r">\3+\2@\1, one<", text)
    assert count == 112
    path = tmp_path / "other.qif"
    path.write_text(text, encoding="utf-8")
    assert main(["fit", str(CAMPAIGN), str(path)]) == 3
    assert wording.STATE_THE_RULE_WITH_NAME in capsys.readouterr().err
    rule = "{probe}+{ball}@{position}, one"
    found, _ = fitted([str(CAMPAIGN), str(path), "--name", rule], capsys)
    assert largest_difference(found, plain("plain/mm6.csv")) <= 1e-4
    with pytest.raises(bp.ExperimentError, match=r"readings.names: .* needs \{ball\}"):
        bp.fit(CAMPAIGN, path, names="{position}")


@pytest.mark.parametrize(
    ("file", "plain_file"), [("qif_3_0.qif", "plain/mm6.csv"), ("calypso_fet.txt", "plain/mm7.csv")]
)
def test_names_of_reports_are_matched_by_number_and_place_as_those_of_tables(
    file: str, plain_file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    encoding = "cp1252" if file.endswith("txt") else "utf-8"
    text = (FOLDER / file).read_text(encoding=encoding)
    balls = list(dict.fromkeys(pd.read_csv(FOLDER / plain_file)["ball"]))

    def strange(name: re.Match[str]) -> str:
        return f"{name[1]}Lage {name[2]}_K{balls.index(name[3]) + 1:02}_{name[4]}"

    text, count = re.subn(r"([>\t])P(\d)[ _](r\dc\d)[ _](\w+)(?=[<\t])", strange, text)
    assert count == 112
    path = tmp_path / file
    path.write_text(text, encoding=encoding)
    expected = plain(plain_file)
    for rule in ([], ["--name", "{position}_{ball}_{probe}"]):
        found, told = fitted([str(CAMPAIGN), str(path), *rule], capsys)
        assert largest_difference(found, expected) <= 1e-4
        assert wording.POSITIONS_MATCHED_BY_NUMBER in told
        assert wording.BALLS_MATCHED_BY_NUMBER_IN_READING in told


def test_what_reports_say_of_co_ordinates_is_not_contradicted() -> None:
    with pytest.raises(bp.ExperimentError, match=wording.SCALE_READINGS_ARE_STATED):
        bp.fit(CAMPAIGN, FOLDER / "dmis_mm.dmo", coordinates="scale readings")
    # Who names columns says that it is a table.
    with pytest.raises(bp.ExperimentError, match='no column "Kugel"'):
        bp.fit(CAMPAIGN, FOLDER / "calypso_fet.txt", columns={"ball": "Kugel"})


def test_names_are_swapped_only_where_asked_and_only_those_that_are(tmp_path: Path) -> None:
    with pytest.raises(bp.ExperimentError, match=wording.SWAP_THE_NAMES_OF_THE_BALLS):
        bp.fit(CAMPAIGN, FOLDER / "swapped.csv")
    swapped = bp.fit(CAMPAIGN, FOLDER / "swapped.csv", swap_names=True)
    told = [one for one in swapped.remarks if "swapped" in one]
    assert told == [wording.THE_NAMES_OF_BALLS]
    right = bp.fit(CAMPAIGN, FOLDER / "plain" / "mm5.csv", swap_names=True)
    assert not [one for one in right.remarks if "swapped" in one]
    # A ball that has the name of another, which was not read itself, stays wrong.
    table = pd.read_csv(FOLDER / "swapped.csv").drop(index=53)
    with pytest.raises(bp.ExperimentError, match=wording.IS_WHERE_BALL_SHOULD):
        bp.fit(CAMPAIGN, table, swap_names=True)
    # Many exchanges of neighbours in one position, each of which is told.
    table = pd.read_csv(FOLDER / "plain" / "mm5.csv")
    rows = np.flatnonzero(table["position"] == "P2")[:6]
    names = table["ball"].to_numpy().copy()
    names[rows] = names[rows[[1, 0, 3, 2, 5, 4]]]
    found = bp.fit(CAMPAIGN, table.assign(ball=names), swap_names=True)
    assert len([one for one in found.remarks if "swapped" in one]) == 3
    difference = largest_difference(found.to_dict()["estimates"], plain("plain/mm5.csv"))
    assert difference <= 1e-9
