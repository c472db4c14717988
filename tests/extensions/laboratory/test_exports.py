"""Tables as measuring programs and laboratories write them: each has the readings of the plain CSV
file.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.laboratory import wording
from tests.extensions.laboratory.tables import ROWS, assert_all_planned, observed, of_table

PROBES = ("down", "right", "left", "back", "front")
AXES = ("x_mm", "y_mm", "z_mm")
PLAIN = ["position", "ball", "probe", *AXES]
Rows = list[list[str]]
# Six digits behind the point of millimetres, as a CMM program writes them.
READINGS: Rows = [[*row[:3], *(f"{value:.6f}" for value in row[3:])] for row in ROWS]
POSITIONS = list(dict.fromkeys(row[0] for row in READINGS))


def lines(*rows: Sequence[object], separator: str = ";") -> str:
    return "".join(separator.join(map(str, row)) + "\n" for row in rows)


def commas(rows: Rows) -> Rows:
    return [[*row[:3], *(cell.replace(".", ",") for cell in row[3:])] for row in rows]


def unit_below(rows: Rows) -> bytes:
    """With a line of units below the headings, shuffled."""
    order = np.random.default_rng(2).permutation(len(rows))
    table = [[*row, "", ""] for row in commas([rows[i] for i in order])]
    names = ["Position", "Ball", "Probe", "X", "Y", "Z"]
    return lines(names, ["", "", "", "mm", "mm", "mm"], *table).encode("utf-8-sig")


def micrometres(rows: Rows) -> bytes:
    table = [[*row[:3], *(f"{1e3 * float(cell):.3f}" for cell in row[3:])] for row in rows]
    names = ["position", "ball", "probe", "x (µm)", "y (µm)", "z (µm)"]
    return lines(names, *table, separator=" | ").encode("latin-1")


def other_order(rows: Rows) -> bytes:
    """Columns in another order, beside columns of nominal values and deviations."""
    table = [[z, y, x, "0.0", "0.001", *names[::-1]] for *names, x, y, z in rows]
    names = ["Z actual", "Y actual", "X actual", "X nominal", "dX", "stylus", "feature", "setup"]
    return ("# units: mm\n" + lines(names, *table, separator="\t")).encode()


def blanks(rows: Rows) -> bytes:
    table = [[f'"{position}"', *more] for position, *more in rows]
    names = ["position", "ball", "probe", "x [mm]", "y [mm]", "z [mm]"]
    return lines(names, *table, separator=" ").encode()


def aligned(rows: Rows) -> bytes:
    table = [[*(f"{cell:12}" for cell in row[:3]), *(f"{cell:>15}" for cell in row[3:])]
             for row in [PLAIN, *rows]]  # fmt: skip
    return lines(*table, separator="").encode()


def side_by_side(rows: Rows) -> bytes:
    """One row for each ball of a position, with columns for each probe."""
    of = {tuple(row[:3]): row[3:] for row in commas(rows)}
    names = [f"{axis[0].upper()} {probe} [mm]" for probe in PROBES for axis in AXES]
    table = [
        [*key, *(cell for probe in PROBES for cell in of.get((*key, probe), [""] * 3))]
        for key in dict.fromkeys(key[:2] for key in of)
    ]
    return lines(["position", "ball", *names], *table).encode()


def numbered(rows: Rows) -> bytes:
    """Balls by their numbers in reading order, positions by theirs."""
    balls = list(dict.fromkeys(row[1] for row in rows))
    table = [
        [f"P{POSITIONS.index(position) + 1:02}", balls.index(ball) + 1, probe.upper(), *xyz]
        for position, ball, probe, *xyz in rows
    ]
    return lines(["Position", "No.", "Probe", "X_MM", "Y_MM", "Z_MM"], *table).encode()


def elsewhere(rows: Rows) -> bytes:
    """Positions and balls of other names, which only their places tell."""
    names = {row[1]: f"K-{k * 7 % 25:x}{'abcde'[k % 5]}" for k, row in enumerate(rows[:25])}
    table = [[f"Aufbau {position[::-1]}", names[ball], *more] for position, ball, *more in rows]
    return lines(["Lage", "Kugel", "Taster", *AXES], *table).encode()


EXPORTS: dict[str, tuple[Callable[[Rows], bytes], str]] = {
    "unit below": (unit_below, "semicolons, decimal commas, UTF-8, header in line 1, mm"),
    "micrometres": (micrometres, "bars, decimal points, cp1252, header in line 1, um"),
    "other order": (other_order, 'not used: "X nominal", "dX"'),
    "blanks": (blanks, "read as: blanks, decimal points"),
    "aligned": (aligned, "read as: two or more blanks"),
    "side by side": (side_by_side, "co-ordinates of down, right, left, back, front side by side"),
    "numbered": (numbered, "balls matched by number in reading order: 1 = r1c1, 2 = r1c2"),
    "elsewhere": (elsewhere, "positions matched by location: Aufbau wol z = z low"),
}


@pytest.mark.parametrize("name", EXPORTS)
def test_an_export_has_the_readings_of_the_plain_file(name: str, tmp_path: Path) -> None:
    write, told = EXPORTS[name]
    found = of_table(tmp_path, write(READINGS), "export.txt")
    assert told in " ".join(found.remarks)
    assert_all_planned(found, 1e-9)


@pytest.mark.parametrize(("first", "second"), [("z low", "y high"), ("x high", "x low")])
def test_two_positions_of_other_names_are_those_that_are_left(
    first: str, second: str, tmp_path: Path
) -> None:
    other = {first: "Lage 1", second: "Lage 2"}
    renamed = [[other.get(position, position), *more] for position, *more in READINGS]
    found = of_table(tmp_path, lines(PLAIN, *renamed))
    told = "positions matched by location among those left: "
    pairs = [f"Lage 1 = {first}", f"Lage 2 = {second}"]
    assert any(told + ", ".join(order) in " ".join(found.remarks) for order in (pairs, pairs[::-1]))
    assert_all_planned(found, 1e-9)
    # A slip within a position that is known stays one, even where its place is clear.
    slip = [*READINGS[:3], ["Lage 1", *READINGS[3][1:]], *READINGS[4:]]
    with pytest.raises(ExperimentError, match='unknown position "Lage 1"'):
        of_table(tmp_path, lines(PLAIN, *slip))


def test_a_file_for_each_position(tmp_path: Path) -> None:
    paths = []
    for k, position in enumerate(POSITIONS):
        table = [row[1:] for row in commas(READINGS) if row[0] == position]
        text = lines(["ball", "probe", "x [mm]", "y [mm]", "z [mm]"], *table)
        # Half of them say it in a line above the headings.
        name = position.replace(" ", "_").upper() if k % 2 else f"run{k}"
        paths.append(tmp_path / f"{name}.csv")
        paths[-1].write_text(text if k % 2 else f"Position: {position}\n\n{text}", encoding="utf-8")
    found = observed(paths)
    told = " ".join(found.remarks)
    assert wording.POSITION_BY_THE_NAME in told and wording.POSITION_ABOVE_THE_HEADINGS in told
    assert wording.POSITIONS_MATCHED_BY_NAME_BUT in told and "Z_HIGH = z high" in told
    assert_all_planned(found, 1e-9)


def test_stated_probes_stay_where_another_file_has_no_column_of_probes(tmp_path: Path) -> None:
    single = [[*row[:2], *row[3:]] for row in READINGS if row[0] == "z low"]
    others = [row for row in READINGS if row[0] != "z low"]
    paths = [tmp_path / "single.csv", tmp_path / "others.csv"]
    paths[0].write_text(lines(["position", "ball", *AXES], *single), encoding="utf-8")
    paths[1].write_text(lines(PLAIN, *others), encoding="utf-8")
    assert_all_planned(observed(paths), 1e-9)


def test_missing_balls(tmp_path: Path) -> None:
    """Balls that were not read have rows without co-ordinates."""
    table = commas(READINGS)
    for k in (7, 60, 61):
        table[k][3:] = ["---"] * 3
    found = of_table(tmp_path, lines(PLAIN, *table))
    assert "without co-ordinates, left out: lines 9, 62, 63" in " ".join(found.remarks)
    assert_all_planned(found, 1e-9, lacks=3)
