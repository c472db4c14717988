"""Tables of hole plates: any form of table, and offsets that are in them already."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import pytest
from ballplate.cli import main

from tests.extensions.laboratory import wording

OFFSETS = {"down": (0, 0, -50), "right": (50, 0, 0), "left": (-50, 0, 0)}
OFFSETS |= {"back": (0, 50, 0), "front": (0, -50, 0)}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Simulated readings of a hole plate, which two probes read in z high with offsets in its
    plane.
    """
    text = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
    text = text.replace("balls: [5, 5]", "balls: [3, 3], reads: in plane, flatness: 5 um")
    text = text.replace("_coefficients: 5", "_coefficients: 3")
    text = text.replace(
        "corner: {x: high, y: high}, quarter_turns: 1, probes: [down]",
        "corner: {x: 125 mm, y: high}, quarter_turns: 1, probes: [right, left]",
    )
    (tmp_path / "holes.yaml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "holes.yaml", "-o", "readings.csv", "-q"]) == 0
    return tmp_path


def fitted(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    capsys.readouterr()
    status = main(["fit", "holes.yaml", *arguments, "--json"])
    return status, *capsys.readouterr()


def test_decimal_commas_are_the_same_readings(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plain = Path("readings.csv").read_text(encoding="utf-8")
    assert ",\n" in plain
    Path("lab.csv").write_text(plain.translate(str.maketrans(",.", ";,")), encoding="utf-8")
    expected, found = fitted(capsys, "readings.csv"), fitted(capsys, "lab.csv")
    assert expected[0] == found[0] == 0
    assert found[1].split('"sum_of_squares"')[1] == expected[1].split('"sum_of_squares"')[1]


def test_a_co_ordinate_that_is_read_may_not_be_empty(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = Path("readings.csv").read_text(encoding="utf-8").splitlines()
    cells = lines[5].split(",")
    lines[5] = ",".join([*cells[:3], "", *cells[4:]])
    Path("lab.csv").write_text("\n".join(lines).replace(",", ";"), encoding="utf-8")
    status, _, complaint = fitted(capsys, "lab.csv")
    assert status == 3
    assert complaint.startswith(wording.NO_WRITE_A)


def centres(source: str) -> str:
    """The readings with the offsets of their probes added, as measuring programs write them."""
    rows = list(csv.reader(io.StringIO(source)))
    for row in rows[1:]:
        for k, offset in enumerate(OFFSETS[row[2]], start=3):
            row[k] = row[k] and repr(float(row[k]) + offset)
    return "\n".join(map(",".join, rows))


def test_offsets_across_the_plate_change_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = Path("holes.yaml").read_text(encoding="utf-8")
    text = text.replace(
        "corner: {x: 125 mm, y: high}, quarter_turns: 1, probes: [right, left]",
        "corner: {x: 125 mm, y: high}, quarter_turns: 1, probes: [down]",
    )
    Path("holes.yaml").write_text(text, encoding="utf-8")
    assert main(["simulate", "holes.yaml", "-o", "readings.csv", "-q", "--force"]) == 0
    Path("centres.csv").write_text(
        centres(Path("readings.csv").read_text(encoding="utf-8")), encoding="utf-8"
    )
    found = [fitted(capsys, name) for name in ("readings.csv", "centres.csv")]
    assert found[0] == found[1]


def test_circles_of_a_report_are_readings_of_holes(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A report has all three co-ordinates of a circle's centre; that across the plate is not
    read.
    """
    plain = Path("readings.csv").read_text(encoding="utf-8")
    rows = list(csv.reader(io.StringIO(centres(plain))))[1:]
    lines = ["FILNAM/'HOLES'", "UNITS/MM,ANGDEC"]
    for position, ball, probe, *x in rows:
        name = f"{position.replace(' ', '').upper()}_{ball.upper()}_{probe.upper()}"
        place = ",".join(f"{float(cell or 250.0):.9f}" for cell in x)
        lines.append(f"FA({name})=FEAT/CIRCLE,INNER,CART,{place},0,0,1,20.0")
    Path("holes.dmo").write_text("\n".join([*lines, "ENDFIL", ""]), encoding="utf-8")
    options = ["--circles", "--for", "holes.yaml", "-o", "imported.csv"]
    assert main(["import", "holes.dmo", *options]) == 0
    assert f"in their plane, {len(rows)}, are left out" in capsys.readouterr().err
    status, out, _ = fitted(capsys, "imported.csv", "--coordinates", "ball centres")
    assert status == 0
    expected = json.loads(fitted(capsys, "readings.csv")[1])
    # Reports have nine decimals of a millimetre at most.
    assert json.loads(out)["sum_of_squares"] == pytest.approx(expected["sum_of_squares"], rel=1e-4)
    # The report itself says as much.
    status, straight, _ = fitted(capsys, "holes.dmo")
    assert status == 0
    assert json.loads(straight)["estimates"] == json.loads(out)["estimates"]


def test_a_plan_goes_on_from_readings_of_holes(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = Path("holes.yaml").read_text(encoding="utf-8")
    Path("holes.yaml").write_text(f"{text}pool: {{limits: {{keep: all}}}}\n", encoding="utf-8")
    options = ["--positions", "6", "--done", "readings.csv", "-o", "rest.yaml"]
    status = main(["plan", "holes.yaml", *options])
    captured = capsys.readouterr()
    assert status == 0, captured.err


@pytest.mark.parametrize(
    ("influence", "column"),
    [
        ("", "u_um"),
        ("influences: [{kind: drift, scale: {standard_uncertainty: 0.3 ppm/h}}]", "time_h"),
        (
            "influences: [{kind: temperature, artefact_expansion: {value: 11 um/m/K},"
            " artefact_temperature: {value: 21 degC}}]",
            "temperature_artefact_degC",
        ),
    ],
)
def test_some_cells_of_a_column_are_missing(
    folder: Path, capsys: pytest.CaptureFixture[str], influence: str, column: str
) -> None:
    """Otherwise those that are there would count for nothing, or others be made up."""
    text = Path("holes.yaml").read_text(encoding="utf-8")
    Path("holes.yaml").write_text(f"{text}{influence}\n", encoding="utf-8")
    lines = Path("readings.csv").read_text(encoding="utf-8").splitlines()
    for sign in ",;":
        for wanted in (0, 3):
            rows = [
                f"{line},{'' if k == 1 and wanted else 20 + 0.01 * k}"
                for k, line in enumerate(lines[1:])
            ]
            table = "\n".join([f"{lines[0]},{column}", *rows]).replace(",", sign)
            Path("lab.csv").write_text(table, encoding="utf-8")
            status, _, complaint = fitted(capsys, "lab.csv")
            assert status == wanted, complaint
            assert not wanted or complaint.startswith("lab.csv:3:")
            assert wording.LEAVE_THE_COLUMN_OUT in complaint or not wanted or influence
