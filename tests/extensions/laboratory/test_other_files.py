"""Files that hold no readings are named for what they are, each made by what makes it."""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.cli import main

from tests.extensions.laboratory import wording

DESIGN, POOL = "designs/quickstart.yaml", "designs/planning/campaign.yaml"
SAMPLES = Path("tests/extensions/laboratory/samples")


def refusal(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    capsys.readouterr()
    assert main(["fit", DESIGN, *map(str, arguments)]) == 3
    return capsys.readouterr().err


@pytest.mark.parametrize("name", ["calypso_fet.txt", "dmis_mm.dmo", "pcdmis_mm.txt", "qif_3_0.qif"])
def test_reports_of_another_experiment_are_told_by_their_names(
    capsys: pytest.CaptureFixture[str], name: str
) -> None:
    text = refusal(capsys, SAMPLES / name)
    assert 'the positions "P1", "P2", "P3"' in text and wording.ARE_NOT_IN_THE_EXPERIMENT in text
    assert len(text.splitlines()) == 1


def test_what_was_done_of_a_plan_is_told_by_tables(capsys: pytest.CaptureFixture[str]) -> None:
    """A report has names of an experiment, which the pool of a plan is not yet."""
    report = str(SAMPLES / "dmis_mm.dmo")
    assert main(["plan", POOL, "--positions", "4", "--done", report, "-q"]) == 3
    text = capsys.readouterr().err
    assert wording.THIS_IS_A_REPORT in text
    assert wording.RUN_BALLPLATE_IMPORT_FIRST in text and len(text.splitlines()) == 1


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_what_sheet_writes_holds_no_readings(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, separator: str
) -> None:
    made = {name: tmp_path / name for name in ("empty.csv", "points.csv", "p.dmi")}
    sheet = ["sheet", DESIGN, "--readings", str(made["empty.csv"])]
    assert main([*sheet, "--points", str(made["points.csv"])]) == 0
    program = ["sheet", DESIGN, "--points", str(made["p.dmi"]), "--ball-diameter", "22 mm"]
    assert main(program) == 0
    for name in ("empty.csv", "points.csv"):
        made[name].write_text(made[name].read_text().replace(",", separator))
    assert wording.NOTHING_IS_FILLED in refusal(capsys, made["empty.csv"])
    assert wording.TABLE_OF_THE_NOMINAL_CENTRES in refusal(capsys, made["points.csv"])
    assert wording.THIS_IS_A_DMIS in refusal(capsys, made["p.dmi"])


def test_certificate_values_belong_elsewhere(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    readings, values = tmp_path / "readings.csv", tmp_path / "values.csv"
    assert main(["simulate", DESIGN, "-o", str(readings), "--certificate", str(values)]) == 0
    assert wording.GIVE_THEM_WITH_CERTIFICATE in refusal(capsys, values)
    assert main(["fit", DESIGN, str(readings), "--certificate", str(values)]) == 0
    for heads, row in (
        ("first,second,value_mm,standard_uncertainty_um", "r1c1,r1c5,600.0001,0.3"),
        ("ball,x_mm,y_mm,z_mm", "r1c1,0,0,0"),
    ):
        sides = tmp_path / "sides.csv"
        sides.write_text(f"{heads}\n{row}\n")
        text = refusal(capsys, readings, "--certificate", sides)
        assert "under calibration: values: sides.csv" in text


def test_a_file_that_is_named_twice(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    readings, link = tmp_path / "readings.csv", tmp_path / "link.csv"
    assert main(["simulate", DESIGN, "-o", str(readings)]) == 0
    link.symlink_to(readings)
    for other in (readings, tmp_path / ".." / tmp_path.name / "readings.csv", link):
        text = refusal(capsys, readings, other)
        assert wording.THE_FILE_IS_NAMED_TWICE in text and len(text.splitlines()) == 1
        assert ("as well" in text) == (other != readings)
