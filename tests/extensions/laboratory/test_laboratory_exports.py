"""Exports of programs and spreadsheets in five languages, of one campaign: each fits to the very
estimates of its plain CSV file, at the first command or after the answer to one question.
"""

from __future__ import annotations

import csv
import json
import sys
import tracemalloc
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import pytest
from ballplate.cli import main
from openpyxl import Workbook

from tests.extensions.laboratory import wording

FOLDER = Path("tests/extensions/laboratory/exports")
PLATE, PLAIN = FOLDER / "plate.yaml", FOLDER / "plain.csv"
HEADINGS = ["Läge", "Kula", "Mätspets", "X [mm]", "Y [mm]", "Z [mm]"]
WORKBOOK = "arbetsbok-sv.xlsx"

# What is told of those that fit at once, and the questions with the answers of the others.
AT_ONCE = {
    "program-en.txt": 'position from "SETUP", ball from "SPHERE", probe from "TIP"',
    "programma-it.txt": "one row per axis",
    "programme-fr.txt": "T1 = down, T2 = right, T3 = left, T4 = back, T5 = front",
    "axes-en.csv": "one row per axis",
    "spreadsheet-en.csv": "commas between thousands",
    "spreadsheet-de.csv": "points between thousands",
    "tableur-fr.csv": "blanks between thousands",
    "hoja-es.csv": 'unit from "Unidad"',
    "kalkylblad-sv.csv": 'probe from "Mätspets", unit from "Enhet"',
    WORKBOOK: 'sheet "Readings", header in line 3',
}
AFTER_A_QUESTION = {
    "merged-en.csv": (wording.NO_POSITION_OR_PROBE, ["--fill-down"]),
    "programm-de.txt": (wording.NO_UNIT_IS_STATED_FOR_THE_ISTWERT, ["--unit", "mm"]),
}


def rows() -> list[list[str]]:
    with PLAIN.open(encoding="utf-8") as stream:
        return list(csv.reader(stream))[1:]


def workbook(folder: Path, sheets: dict[str, list[list[str]]]) -> Path:
    """A workbook of sheets of rows, the positions of which are merged cells."""
    book = Workbook()
    book.active.title = "Notes"
    book.active.append(["Measured on 20 November 2026"])
    for name, table in sheets.items():
        sheet = book.create_sheet(name)
        for line in (["Ball plate 3 x 3"], [], HEADINGS):
            sheet.append(line)
        positions = [row[0] for row in table]
        for row in table:
            sheet.append([*row[:3], *map(float, row[3:])])
        for position in dict.fromkeys(positions):
            first, count = positions.index(position), positions.count(position)
            sheet.merge_cells(None, first + 4, 1, first + count + 3, 1)
    path = folder / WORKBOOK
    book.save(path)
    return path


def fitted(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[object, str]:
    capsys.readouterr()
    status = main(["fit", str(PLATE), *arguments, "--json"])
    out, err = capsys.readouterr()
    return (json.loads(out)["estimates"] if status == 0 else None), err


def export(name: str, folder: Path) -> str:
    return str(workbook(folder, {"Readings": rows()}) if name == WORKBOOK else FOLDER / name)


@pytest.fixture
def expected(capsys: pytest.CaptureFixture[str]) -> object:
    found, err = fitted(capsys, str(PLAIN))
    assert isinstance(found, dict) and len(found) > 60, err
    return found


@pytest.mark.parametrize("name", AT_ONCE)
def test_an_export_fits_at_the_first_command(
    name: str, expected: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found, err = fitted(capsys, export(name, tmp_path))
    assert AT_ONCE[name] in err and wording.PLANNED_BUT_NOT_READ_2 not in err, err
    assert found == expected


@pytest.mark.parametrize("name", AFTER_A_QUESTION)
def test_an_export_fits_after_the_answer_to_one_question(
    name: str, expected: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    question, answer = AFTER_A_QUESTION[name]
    found, err = fitted(capsys, export(name, tmp_path))
    assert found is None and question in err and err.count("\n") == 1, err
    found, err = fitted(capsys, export(name, tmp_path), *answer)
    assert found == expected, err


def test_sheets_with_tables_are_asked_for(
    expected: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    half = len(rows()) // 2
    sheets = {"Monday": rows()[:half], "Tuesday": rows()[half:]}
    path = str(workbook(tmp_path, sheets))
    found, err = fitted(capsys, path)
    assert found is None and wording.THE_SHEETS_HAVE_TABLES in err and err.count("\n") == 1
    assert fitted(capsys, path, "--sheet", "all")[0] == expected
    assert wording.PLANNED_BUT_NOT_READ_2 in fitted(capsys, path, "--sheet", "Monday")[1]
    assert wording.NO_SHEET in fitted(capsys, path, "--sheet", "Friday")[1]
    assert wording.IS_NO_WORKBOOK in fitted(capsys, str(PLAIN), "--sheet", "Monday")[1]


def test_workbooks_that_cannot_be_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = workbook(tmp_path, {"Readings": rows()})
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    assert wording.WORKBOOKS_NEED_OPENPYXL in fitted(capsys, str(path))[1]
    monkeypatch.undo()
    whole = path.read_bytes()
    book = Workbook()
    book.active.cell(1_048_576, 16_384, "far away")
    book.save(tmp_path / "large.xlsx")
    large = (tmp_path / "large.xlsx").read_bytes()
    for content in (whole[:-200], whole[:2000], b"PK\x03\x04", b"", PLAIN.read_bytes(), large):
        path.write_bytes(content)
        assert wording.IS_DAMAGED_OR_NO_WORKBOOK in fitted(capsys, str(path))[1]


WHOLE = "A1:XFD1048576"
RANGES = {
    "merged": f'<mergeCells count="1"><mergeCell ref="{WHOLE}"/></mergeCells>',
    "linked": f'<hyperlinks><hyperlink ref="{WHOLE}" location="A1"/></hyperlinks>',
    "columns merged": '<mergeCells count="1"><mergeCell ref="A:Z"/></mergeCells>',
    "many merged": "<mergeCells>"
    + "".join(f'<mergeCell ref="A{k}:XFD{k}"/>' for k in range(20, 60))
    + "</mergeCells>",
}


@pytest.mark.parametrize("ranges", RANGES)
def test_ranges_over_a_sheet_are_refused_before_cells_are_made(
    ranges: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = workbook(tmp_path, {"Readings": rows()})
    with ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    sheet = parts["xl/worksheets/sheet1.xml"].decode()
    assert "</sheetData>" in sheet and "<mergeCell" not in sheet
    sheet = sheet.replace("</sheetData>", f"</sheetData>{RANGES[ranges]}")
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        for name, content in (parts | {"xl/worksheets/sheet1.xml": sheet.encode()}).items():
            archive.writestr(name, content)
    assert wording.IS_DAMAGED_OR_NO_WORKBOOK in told_in_little_memory(path, capsys)


def told_in_little_memory(path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    tracemalloc.start()
    try:
        told = fitted(capsys, str(path))[1]
        # Reading a file reserves 200 MB.
        assert tracemalloc.get_traced_memory()[1] < 300_000_000
    finally:
        tracemalloc.stop()
    return told


def test_cells_of_all_sheets_are_counted_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    book = Workbook()
    for k in range(30):
        book.create_sheet(f"{k}").cell(100_000, 10, "far away")
    book.save(tmp_path / WORKBOOK)
    told = told_in_little_memory(tmp_path / WORKBOOK, capsys)
    assert wording.IS_DAMAGED_OR_NO_WORKBOOK in told


def changed(folder: Path, name: str, before: str, after: str) -> str:
    text = (FOLDER / name).read_text(encoding="utf-8")
    assert before in text
    path = folder / name
    path.write_text(text.replace(before, after, 1), encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    ("name", "before", "after", "refusal"),
    [
        ("kalkylblad-sv.csv", ";mm\n", ";in\n", wording.ARE_SAID_TO_BE_IN),
        ("kalkylblad-sv.csv", ";X;", ";X [in];", wording.ARE_SAID_TO_BE_IN),
        ("kalkylblad-sv.csv", ";mm\n", ";stycken\n", wording.NO_UNIT_IS_STATED_2),
        ("axes-en.csv", "down,y,", "down,w,", wording.IS_NO_AXIS),
        ("axes-en.csv", "down,y,", "down,x,", wording.X_AGAIN),
        ("axes-en.csv", "down,y,", "up,y,", wording.NO_Y_WRITE),
        ("merged-en.csv", "z low,", ",", wording.NO_POSITION_OR_PROBE_2),
        ("merged-en.csv --fill-down", "z low,", ",", wording.NOR_ONE_ABOVE_IT),
        ("kalkylblad-sv.csv", "Läge;Kula;", "A;B;", wording.MISSING_BALL_AND_POSITION),
        ("programme-fr.txt", "\tT2\t", "\tT3\t", wording.FITS_THE_PROBE_RIGHT),
        ("spreadsheet-en.csv", '"1,', '"1', wording.HAS_SIGNS_BETWEEN_THOUSANDS),
    ],
)
def test_tables_of_two_meanings_are_refused(
    name: str,
    before: str,
    after: str,
    refusal: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file, *options = name.split()
    assert refusal in fitted(capsys, changed(tmp_path, file, before, after), *options)[1]


def test_names_continue_from_rows_without_co_ordinates(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The row of a merged cell may be of a ball that was not read."""
    lines = (FOLDER / "merged-en.csv").read_text(encoding="utf-8").splitlines()
    place = next(i for i, line in enumerate(lines) if line.startswith("z high"))
    lines[place] = ",".join([*lines[place].split(",")[:3], "", "", ""])
    path, plain = tmp_path / "merged.csv", tmp_path / "plain.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    kept = PLAIN.read_text(encoding="utf-8").splitlines()
    plain.write_text("\n".join([*kept[:place], *kept[place + 1 :]]) + "\n", encoding="utf-8")
    found, err = fitted(capsys, str(path), "--fill-down")
    assert found is not None and found == fitted(capsys, str(plain))[0], err


def test_probes_of_ball_centres_are_those_planned(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The places of centres are the same for all probes: two of a position are asked for."""
    path = str(FOLDER / "programme-fr.txt")
    asked = fitted(capsys, path, "--coordinates", "ball centres")[1]
    assert wording.THE_PROBES_ARE_NOT_IN_THE_EXPERIMENT in asked
