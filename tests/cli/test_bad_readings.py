"""Files of readings that cannot be used: what is said, of which line, and that nothing is
fitted.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main

from tests.cli import wording
from tests.reference.small_quickstart import small_sections

QUICKSTART = "designs/quickstart.yaml"
Lines = list[str]


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Lines:
    path = tmp_path_factory.mktemp("readings") / "good.csv"
    assert main(["simulate", QUICKSTART, "-o", str(path)]) == 0
    return path.read_text(encoding="utf-8").splitlines()


def refusals(
    lines: Lines, tmp_path: Path, capsys: pytest.CaptureFixture[str], design: str = QUICKSTART
) -> Lines:
    path = tmp_path / "r.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    capsys.readouterr()
    status = main(["fit", design, str(path), "--json"])
    out, err = capsys.readouterr()
    assert status == 3 and out == "", err
    return [line.removeprefix(f"{path}:") for line in err.splitlines()]


def exchanged(lines: Lines, first: int, second: int) -> Lines:
    """Names of the balls in two lines, counted from 1, exchanged."""
    changed = [line.split(",") for line in lines]
    changed[first - 1][1], changed[second - 1][1] = changed[second - 1][1], changed[first - 1][1]
    return [",".join(cells) for cells in changed]


def with_cell(lines: Lines, line: int, column: int, change: Callable[[str], str]) -> Lines:
    cells = lines[line - 1].split(",")
    cells[column] = change(cells[column])
    return [*lines[: line - 1], ",".join(cells), *lines[line:]]


def test_swapped_balls(good: Lines, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert refusals(exchanged(good, 17, 18), tmp_path, capsys) == [
        wording.BALL_IN_POSITION_LOW_IS_WHERE_BALL
    ]


def test_all_mistakes_are_named_at_once(
    good: Lines, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = exchanged(exchanged(good, 5, 9), 60, 71)
    lines = with_cell(lines, 20, 0 + 1, lambda _: "r1c1")
    lines = with_cell(lines, 90, 2, lambda probe: "left" if probe == "right" else "right")
    lines = with_cell(lines, 130, 4, lambda y: str(float(y) + 10))
    found = refusals(lines, tmp_path, capsys)
    assert [line.split(":")[0] for line in found] == ["5", "20", "60", "90", "130"]
    assert wording.SWAP_THE_NAMES_OF_THE_BALLS_IN_LINES in found[0]
    assert wording.BALL_IN_POSITION_LOW_IS_WHERE in found[1]
    assert wording.SWAP_THE_NAMES_OF_THE_BALLS in found[2]
    assert wording.FITS_THE_PROBE_LEFT in found[3]
    assert wording.IS_MM_FROM_WHERE_IT_SHOULD in found[4] and "y +10 mm" in found[4]


@pytest.mark.parametrize("amount", [5.0, 300.0])
def test_one_wrong_reading(
    good: Lines, tmp_path: Path, capsys: pytest.CaptureFixture[str], amount: float
) -> None:
    (line,) = refusals(with_cell(good, 40, 5, lambda z: str(float(z) + amount)), tmp_path, capsys)
    assert (
        line.startswith("40:1: ball r3c4 in position z high is ")
        and wording.CORRECT_OR_REMOVE in line
    )


@pytest.mark.parametrize(("quarters", "words"), [(3, "by 90"), (1, "by 270")])
def test_a_position_read_in_a_turned_order(
    good: Lines, tmp_path: Path, capsys: pytest.CaptureFixture[str], quarters: int, words: str
) -> None:
    names = np.array([[f"r{row}c{column}" for column in range(1, 6)] for row in range(1, 6)])
    turned = dict(zip(names.ravel(), np.rot90(names, quarters).ravel(), strict=True))
    lines = [
        with_cell([line], 1, 1, lambda ball: turned[ball])[0] if line.startswith("x high") else line
        for line in good
    ]
    (line,) = refusals(lines, tmp_path, capsys)
    assert (
        f": position x high: the readings fit the plate turned {words} degrees; correct the names"
        in line
    )


def test_a_position_read_in_mirrored_order(
    good: Lines, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Rows and columns confused: the plate as seen from below."""
    lines = [
        (
            with_cell([line], 1, 1, lambda ball: f"r{ball[3]}c{ball[1]}")[0]
            if line.startswith("y low")
            else line
        )
        for line in good
    ]
    (line,) = refusals(lines, tmp_path, capsys)
    assert wording.POSITION_LOW_THE_READINGS_FIT in line


def test_readings_that_are_all_the_same(
    good: Lines, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [good[0], *(f"{line.rsplit(',', 3)[0]},0,0,0" for line in good[1:])]
    found = refusals(lines, tmp_path, capsys)
    assert len(found) == 6 and all(
        ": only " in line and "of 25 readings fit" in line for line in found[:2]
    )


def test_names_in_no_order_at_all(
    good: Lines, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    order = np.random.default_rng(3).permutation(25)
    names = [good[i].split(",")[1] for i in range(1, 26)]
    lines = [
        good[0],
        *(with_cell([good[i + 1]], 1, 1, lambda _, i=i: names[order[i]])[0] for i in range(25)),
    ]
    (line,) = refusals([*lines, *good[26:]], tmp_path, capsys)
    assert (
        line.startswith("2:1: position z low: only ")
        and wording.CORRECT_THE_NAMES_OF_THE_BALLS in line
    )


TWO_POSITIONS = """\
title: two positions
machine: {volume: [1 m, 1 m], repeatability: 0.2 um}
error_model: {kind: metric}
true_machine: {kind: coefficients, values: {alpha: 20 urad}}
artefacts:
  plate: {kind: balls, coordinates: [[0 mm, 0 mm], [310 mm, 20 mm], [40 mm, 290 mm], [305 mm, 330 mm], [150 mm, 99 mm]]}
positions:
  - {name: first, pose: {origin: [100 mm, 100 mm]}}
  - {name: turned, pose: {origin: [600 mm, 100 mm], rotation: 90 deg}}
"""


def test_two_readings_that_disagree(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    design = tmp_path / "two.yaml"
    design.write_text(TWO_POSITIONS, encoding="utf-8")
    assert main(["simulate", str(design), "-o", str(tmp_path / "two.csv")]) == 0
    lines = (tmp_path / "two.csv").read_text(encoding="utf-8").splitlines()
    (line,) = refusals(
        with_cell(lines, 9, 3, lambda x: str(float(x) + 20)), tmp_path, capsys, str(design)
    )
    assert line.startswith(wording.BALL_IN_POSITION_TURNED)
    # With a drawing that is as far off nothing tells which of the two is right.
    rough = TWO_POSITIONS.replace("40 mm, 290 mm", "40 mm, 306 mm").replace("20 mm]", "10 mm]")
    design.write_text(rough, encoding="utf-8")
    (line,) = refusals(
        with_cell(lines, 9, 3, lambda x: str(float(x) + 20)), tmp_path, capsys, str(design)
    )
    assert line.startswith(wording.BALL_IN_POSITION_FIRST) and wording.IN_POSITION_TURNED in line


@pytest.mark.parametrize("seed", [0, 2])
def test_rough_drawings_and_bad_machines_give_no_alarm(seed: int) -> None:
    """Balls up to a tenth of their distance from where they are drawn, a machine a hundred times
    worse than usual.
    """
    generator = np.random.default_rng(seed)
    places = np.array([(187.5 * i, 187.5 * j) for j in range(5) for i in range(5)])
    drawn = places + generator.uniform(-18.75, 18.75, places.shape)
    machine = {"kind": "random", "position": "200 um", "rotation": "400 urad", "seed": 7}
    sections = small_sections(kept=True, true_machine=machine, calibration=[])
    sections["machine"]["volume"] = {axis: ["-100 mm", "1.1 m"] for axis in "xyz"}
    sections.pop("expected_rank_deficiency")

    def of(balls: np.ndarray) -> bp.Experiment:
        listed = [[f"{x} mm", f"{y} mm"] for x, y in balls]
        plate = {"kind": "balls", "coordinates": listed}
        return bp.experiment(sections | {"artefacts": {"plate": plate}})

    readings = bp.simulate(of(places))
    if seed:
        # Not all balls in all positions.
        keep = generator.random(len(readings)) < 0.6
        keep[:25] = True
        readings = readings[keep]
    assert bp.fit(of(drawn), readings).converged


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (
            lambda lines: [line.rpartition(",")[0] for line in lines],
            ["1:1: no column for z; the first line should be position,ball,probe,x_mm,y_mm,z_mm"],
        ),
        (
            lambda lines: with_cell(lines, 3, 3, lambda x: "187,5"),
            [
                "3:1: 7 columns instead of 6; if a comma is meant as the decimal point, write a"
                " point, as in 187.5"
            ],
        ),
        (
            lambda lines: [lines[0], *["z low,r1c1,down,0,0,"] * 250],
            [
                "2:21: no z; write a number, or remove the line (and so in 249 more places, to line"
                " 251)"
            ],
        ),
        (
            lambda lines: [*lines[:2], lines[2].replace(",", ";"), *lines[3:]],
            ["3:1: 1 columns instead of 6; separate them by commas"],
        ),
    ],
)
def test_tables_that_are_none(
    good: Lines,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    change: Callable[[Lines], Lines],
    expected: Lines,
) -> None:
    assert refusals(change(good), tmp_path, capsys) == expected


def test_a_line_copied_is_refused(
    good: Lines, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert refusals([*good, good[3]], tmp_path, capsys) == [wording.BALL_IS_REPEATED_IN_POSITION]
