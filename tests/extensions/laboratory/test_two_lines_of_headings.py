"""Tables with a line above the names of co-ordinates, without any names of balls or columns, and
with everything twice: each is read, or refused in one line.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.laboratory.tables import ROWS, assert_all_planned, names_read, of_table

NOMINAL = [[f"{value:.1f}" for value in row[3:]] for row in ROWS]
NUMBERS = {"position": "1", "ball": "2", "probe": "3", "x": "4", "y": "5", "z": "6"}


def observed(
    tmp_path: Path, lines: Sequence[Sequence[object]], name: str = "lab.csv", **readings: object
) -> Any:
    text = "".join(";".join(map(str, line)) + "\n" for line in lines)
    return of_table(tmp_path, text, name, **{"unit": "mm", **readings})


HEADINGS = {
    "kinds above": (["", "", "", "Nominal", "", "", "Actual", "", ""], ["position", "ball", "probe", *"XYZXYZ"]),
    "names above": (["Lage", "Kugel", "Taster", "Sollwerte", "", "", "Istwerte", "", ""], ["", "", "", *"XYZXYZ"]),
    "names and units": (["Lage", "Kugel", "Taster", "Soll [mm]", "", "", "Ist [mm]", "", ""], ["", "", "", *"XYZXYZ"]),
}  # fmt: skip


@pytest.mark.parametrize("kind", HEADINGS)
def test_a_line_above_tells_columns_of_one_name_apart(tmp_path: Path, kind: str) -> None:
    above, below = HEADINGS[kind]
    rows = [[*row[:3], *nominal, *row[3:]] for row, nominal in zip(ROWS, NOMINAL, strict=True)]
    assert_all_planned(observed(tmp_path, [["Report 7"], above, below, *rows]))


def test_a_line_above_states_the_probe(tmp_path: Path) -> None:
    rows = [row for row in ROWS if row[2] == "left"]
    lines = [[*row[:2], *row[3:]] for row in rows]
    head = [["", "", "left", "", ""], ["position", "ball", "X", "Y", "Z"]]
    found = observed(tmp_path, [*head, *lines])
    assert names_read(found) == [row[:3] for row in rows]


def test_a_title_above_changes_nothing(tmp_path: Path) -> None:
    head = [["Report", "of", "plate", "KP 44", "", ""], ["position", "ball", "probe", *"XYZ"]]
    assert_all_planned(observed(tmp_path, [*head, *ROWS]))


@pytest.mark.parametrize("above", [[], [["Report"]] * 2, [["Wo", "Was", "Womit", "A", "B", "C"]]])
def test_columns_by_number_leave_the_first_reading(tmp_path: Path, above: list[Any]) -> None:
    assert_all_planned(observed(tmp_path, [*above, *ROWS], columns=NUMBERS))


def test_a_table_without_names_is_matched_by_its_nominal_places(tmp_path: Path) -> None:
    kinds = ("nominal", "actual")
    head = ["position", "probe", *(f"{axis} {kind}" for kind in kinds for axis in "XYZ")]
    lines = [[row[0], row[2], *own, *row[3:]] for row, own in zip(ROWS, NOMINAL, strict=True)]
    found = observed(tmp_path, [head, *lines])
    assert_all_planned(found)
    assert any("balls by nominal co-ordinates" in one for one in found.remarks)


def test_a_feature_at_another_place_is_no_ball(tmp_path: Path) -> None:
    rows = [row for row in ROWS if row[0] == "z high"]
    lines = [[*row[3:], *row[3:]] for row in rows]
    lines[3] = [500.0, 500.0, 500.0] * 2
    head = ["x nom", "y nom", "z nom", *"xyz"]
    with pytest.raises(ExperimentError, match="from the nearest ball"):
        observed(tmp_path, [head, *lines], "z high.csv")


@pytest.mark.parametrize("times", [2, 3])
def test_repeats_that_are_not_planned_are_one_message(tmp_path: Path, times: int) -> None:
    lines = [["position", "ball", "probe", "x_mm", "y_mm", "z_mm"]]
    lines += [
        [*row[:3], *(value + 0.0001 * k for value in row[3:])] for k in range(times) for row in ROWS
    ]
    with pytest.raises(ExperimentError) as caught:
        observed(tmp_path, lines)
    (message,) = caught.value.messages
    assert message.line == 252 and "(first in line 2), and 249 other readings" in message.text
    assert f"state repeats: {times}" in message.text
