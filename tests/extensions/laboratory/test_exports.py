"""Tables as measuring programs and laboratories write them: each fits to the estimates of the plain
CSV file of the same readings, with one command.
"""

from __future__ import annotations

import csv
import json
import random
from collections.abc import Callable, Sequence
from pathlib import Path

import ballplate as bp
import numpy as np
import pandas
import pytest
from ballplate.cli import main

from tests.extensions.laboratory import wording

DESIGN = "designs/quickstart.yaml"
OFFSETS = {
    "down": (0, 0, -50),
    "right": (50, 0, 0),
    "left": (-50, 0, 0),
    "back": (0, 50, 0),
    "front": (0, -50, 0),
}
AXES = ("x_mm", "y_mm", "z_mm")
Rows = list[dict[str, str]]

# Digits behind the point of millimetres, as a CMM program writes them.
DIGITS = 6


@pytest.fixture(scope="module")
def readings(tmp_path_factory: pytest.TempPathFactory) -> Rows:
    """Readings rounded to the file's digits."""
    path = tmp_path_factory.mktemp("plain") / "readings.csv"
    assert main(["simulate", DESIGN, "-o", str(path)]) == 0
    with path.open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    for row in rows:
        row |= {axis: f"{float(row[axis]):.{DIGITS}f}" for axis in AXES}
    return rows


def plain(rows: Rows) -> str:
    columns = ("position", "ball", "probe", *AXES)
    return "".join(
        ",".join(line) + "\n" for line in [columns, *([r[c] for c in columns] for r in rows)]
    )


@pytest.fixture(scope="module")
def estimates(readings: Rows, tmp_path_factory: pytest.TempPathFactory) -> pandas.DataFrame:
    path = tmp_path_factory.mktemp("plain") / "readings.csv"
    path.write_text(plain(readings), encoding="utf-8")
    return pandas.DataFrame(bp.fit(DESIGN, path).rows())


def fitted(
    files: Sequence[Path], capsys: pytest.CaptureFixture[str], *options: str, design: str = DESIGN
) -> tuple[dict[str, dict[str, float]], str]:
    """Estimates by the command, and what it tells."""
    capsys.readouterr()
    status = main(["fit", design, *map(str, files), *options, "--json"])
    out, err = capsys.readouterr()
    assert status == 0, err
    return json.loads(out)["estimates"], err


def same(found: dict[str, dict[str, float]], expected: pandas.DataFrame, within: float) -> None:
    """Whether estimates are those expected, to a part of their standard uncertainties."""
    by_name = {row["parameter"]: row for row in expected.to_dict("records")}
    assert set(found) == set(by_name) and len(found) > 100
    for name, one in found.items():
        u = one["standard_uncertainty"]
        assert abs(one["value"] - by_name[name]["value"]) <= within * max(u, 1e-9), name


def comma(text: str) -> str:
    return text.replace(".", ",")


def centre(row: dict[str, str]) -> list[float]:
    return [
        round(float(row[axis]) + offset, DIGITS)
        for axis, offset in zip(AXES, OFFSETS[row["probe"]], strict=True)
    ]


def lines(*rows: Sequence[object], separator: str = ";") -> str:
    return "".join(separator.join(map(str, row)) + "\n" for row in rows)


def semicolons(rows: Rows) -> bytes:
    table = [
        [row["position"], row["ball"], row["probe"], *(comma(row[a]) for a in AXES), "0,0012"]
        for row in rows
    ]
    head = "Prüfbericht;Kugelplatte\nDatum;22.11.2026\n\n"
    names = ["Lage", "Kugel", "Taster", "X [mm]", "Y [mm]", "Z [mm]", "Form"]
    return (head + lines(names, *table) + "\n\nEnde des Berichts\n").encode("cp1252")


def utf_16(rows: Rows) -> bytes:
    table = [[row["position"], row["ball"], row["probe"], *(row[a] for a in AXES)] for row in rows]
    names = ["position", "ball", "probe", "X/mm", "Y/mm", "Z/mm"]
    return lines(names, *table, separator="\t").encode("utf-16")


def unit_below(rows: Rows) -> bytes:
    table = [
        [row["position"], row["ball"], row["probe"], *(comma(row[a]) for a in AXES), "", ""]
        for row in rows
    ]
    names = ["Position", "Ball", "Probe", "X", "Y", "Z"]
    return lines(names, ["", "", "", "mm", "mm", "mm"], *table).encode("utf-8-sig")


def micrometres(rows: Rows) -> bytes:
    table = [
        [row["position"], row["ball"], row["probe"], *(f"{1e3 * float(row[a]):.3f}" for a in AXES)]
        for row in rows
    ]
    names = ["position", "ball", "probe", "x (µm)", "y (µm)", "z (µm)"]
    return lines(names, *table, separator=" | ").encode("latin-1")


def inches(rows: Rows) -> bytes:
    table = [
        [row["position"], row["ball"], row["probe"], *(repr(float(row[a]) / 25.4) for a in AXES)]
        for row in rows
    ]
    names = ["position", "ball", "probe", "x in", "y in", "z in"]
    return lines(names, *table, separator=",").encode()


def other_order(rows: Rows) -> bytes:
    """Columns in another order, beside columns of nominal values and deviations."""
    table = [
        [row["z_mm"], row["y_mm"], row["x_mm"], "0.0", "0.001", row["probe"], row["ball"]]
        + [row["position"]]
        for row in rows
    ]
    names = ["Z actual", "Y actual", "X actual", "X nominal", "dX", "stylus", "feature", "setup"]
    return ("# units: mm\n" + lines(names, *table, separator="\t")).encode()


def shuffled(rows: Rows) -> bytes:
    order = np.random.default_rng(2).permutation(len(rows))
    return unit_below([rows[i] for i in order])


def blanks(rows: Rows) -> bytes:
    table = [
        [f'"{row["position"]}"', row["ball"], row["probe"], *(row[a] for a in AXES)] for row in rows
    ]
    return lines(
        ["position", "ball", "probe", "x [mm]", "y [mm]", "z [mm]"], *table, separator=" "
    ).encode()


def aligned(rows: Rows) -> bytes:
    text = "".join(
        f"{row['position']:12}{row['ball']:10}{row['probe']:10}"
        + "".join(f"{row[a]:>15}" for a in AXES)
        + "\n"
        for row in rows
    )
    return f"{'position':12}{'ball':10}{'probe':10}{'x_mm':>15}{'y_mm':>15}{'z_mm':>15}\n{text}".encode()


def side_by_side(rows: Rows) -> bytes:
    """One row for each ball of a position, with columns for each probe."""
    by_ball: dict[tuple[str, str], dict[str, dict[str, str]]] = {}
    for row in rows:
        by_ball.setdefault((row["position"], row["ball"]), {})[row["probe"]] = row
    names = [f"{axis[0].upper()} {probe} [mm]" for probe in OFFSETS for axis in AXES]
    table = []
    for (position, ball), of in by_ball.items():
        cells = [comma(of[p][a]) if p in of else "" for p in OFFSETS for a in AXES]
        table.append([position, ball, *cells])
    return lines(["position", "ball", *names], *table).encode()


def numbered(rows: Rows) -> bytes:
    """Balls by their numbers in reading order, positions by theirs."""
    balls = list(dict.fromkeys(row["ball"] for row in rows))
    positions = list(dict.fromkeys(row["position"] for row in rows))
    table = [
        [f"P{positions.index(row['position']) + 1:02}", balls.index(row["ball"]) + 1]
        + [row["probe"].upper(), *(row[a] for a in AXES)]
        for row in rows
    ]
    return lines(["Position", "No.", "Probe", "X_MM", "Y_MM", "Z_MM"], *table).encode()


def elsewhere(rows: Rows) -> bytes:
    """Positions and balls of other names, which only their places tell."""
    names = {row["ball"]: f"K-{k * 7 % 25:x}{'abcde'[k % 5]}" for k, row in enumerate(rows[:25])}
    table = [
        [f"Aufbau {row['position'][::-1]}", names[row["ball"]], row["probe"]]
        + [row[a] for a in AXES]
        for row in rows
    ]
    return lines(["Lage", "Kugel", "Taster", "x_mm", "y_mm", "z_mm"], *table).encode()


EXPORTS: dict[str, tuple[Callable[[Rows], bytes], str]] = {
    "semicolons": (semicolons, "semicolons, decimal commas, cp1252, header in line 4, mm"),
    "utf-16": (utf_16, "tabs, decimal points, UTF-16, header in line 1, mm"),
    "unit below": (unit_below, "semicolons, decimal commas, UTF-8, header in line 1, mm"),
    "micrometres": (micrometres, "bars, decimal points, cp1252, header in line 1, um"),
    "inches": (inches, "commas, decimal points, UTF-8, header in line 1, in"),
    "other order": (other_order, 'not used: "X nominal", "dX"'),
    "shuffled": (shuffled, "semicolons, decimal commas"),
    "blanks": (blanks, "read as: blanks, decimal points"),
    "aligned": (aligned, "read as: two or more blanks"),
    "side by side": (side_by_side, "co-ordinates of down, right, left, back, front side by side"),
    "numbered": (numbered, "balls matched by number in reading order: 1 = r1c1, 2 = r1c2"),
    "elsewhere": (elsewhere, "positions matched by location: Aufbau wol z = z low"),
}


@pytest.mark.parametrize("name", EXPORTS)
def test_an_export_fits_to_the_estimates_of_the_plain_file(
    name: str,
    readings: Rows,
    estimates: pandas.DataFrame,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    write, told = EXPORTS[name]
    path = tmp_path / "export.txt"
    path.write_bytes(write(readings))
    found, err = fitted([path], capsys)
    assert told in err and wording.PLANNED_BUT_NOT_READ_2 not in err, err
    same(found, estimates, 1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_two_positions_of_other_names_are_those_that_are_left(
    seed: int,
    readings: Rows,
    estimates: pandas.DataFrame,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    names = list(dict.fromkeys(row["position"] for row in readings))
    first, second = random.Random(seed).sample(names, 2)
    other = {first: "Lage 1", second: "Lage 2"}
    path = tmp_path / "renamed.csv"

    renamed = [row | {"position": other.get(row["position"], row["position"])} for row in readings]
    path.write_text(plain(renamed), encoding="utf-8")
    found, err = fitted([path], capsys)
    told = f"positions matched by location among those left: Lage 1 = {first}, Lage 2 = {second}"
    swapped = f"positions matched by location among those left: Lage 2 = {second}, Lage 1 = {first}"
    assert told in err or swapped in err
    same(found, estimates, 1e-9)
    # A slip within a position that is known stays one, even where its place is clear.
    readings = [dict(row) for row in readings]
    readings[3]["position"] = "Lage 1"
    path.write_text(plain(readings), encoding="utf-8")
    assert main(["fit", DESIGN, str(path)]) == 3
    assert 'unknown position "Lage 1"' in capsys.readouterr().err


def test_a_file_for_each_position(
    readings: Rows,
    estimates: pandas.DataFrame,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    paths = []
    for k, position in enumerate(dict.fromkeys(row["position"] for row in readings)):
        own = [row for row in readings if row["position"] == position]
        table = [[row["ball"], row["probe"], *(comma(row[a]) for a in AXES)] for row in own]
        text = lines(["ball", "probe", "x [mm]", "y [mm]", "z [mm]"], *table)
        # Half of them say it in a line above the headings.
        name = position.replace(" ", "_").upper() if k % 2 else f"run{k}"
        paths.append(tmp_path / f"{name}.csv")
        paths[-1].write_text(text if k % 2 else f"Position: {position}\n\n{text}", encoding="utf-8")
    found, err = fitted(paths, capsys)
    assert wording.POSITION_BY_THE_NAME in err
    assert wording.POSITION_ABOVE_THE_HEADINGS in err
    assert wording.POSITIONS_MATCHED_BY_NAME_BUT in err and "Z_HIGH = z high" in err
    same(found, estimates, 1e-9)


def test_missing_balls(readings: Rows, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Balls that were not read have rows without co-ordinates."""
    dropped = (7, 60, 61)
    path, other = tmp_path / "export.csv", tmp_path / "plain.csv"
    table = [
        [
            row["position"],
            row["ball"],
            row["probe"],
            *(["---"] * 3 if i in dropped else [comma(row[a]) for a in AXES]),
        ]
        for i, row in enumerate(readings)
    ]
    path.write_text(lines(["position", "ball", "probe", "x_mm", "y_mm", "z_mm"], *table))
    other.write_text(plain([row for i, row in enumerate(readings) if i not in dropped]))
    found, err = fitted([path], capsys)
    assert "without co-ordinates, left out: lines 9, 62, 63" in err
    assert wording.PLANNED_BUT_NOT_READ in err
    same(found, pandas.DataFrame(bp.fit(DESIGN, other).rows()), 1e-9)
