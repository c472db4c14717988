"""Measured curves with runs there and back: means, counts and reversal values (ISO 230-2)."""

from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.machine_files.curve_files import read_numbered_curves
from ballplate.simulator.inputs import ExperimentError

PLACES = [0.0, 100.0, 200.0, 300.0, 400.0]
THERE, BACK = [0.0, 0.9, 1.6, 1.9, 1.7], [0.4, 1.3, 2.0, 2.3, 2.1]
UP = [*zip(PLACES, THERE, strict=True)]
DOWN = [*zip(PLACES, BACK, strict=True)][::-1]
MEAN = [0.2, 1.1, 1.8, 2.1, 1.9]
SHIFT = 0.2


def again(run: list[tuple[float, float]], by: float = SHIFT) -> list[tuple[float, float]]:
    return [(x, value + by) for x, value in run]


def read(folder: Path, rows: list[tuple[float, float]]) -> tuple[list[float], list[float], str]:
    path = folder / "x.csv"
    lines = ["position_mm,EXX_um", *(f"{x},{value}" for x, value in rows), ""]
    path.write_text("\n".join(lines), encoding="utf-8")
    curves, _, note = read_numbered_curves(path)
    points = curves["EXX"]
    return [1e3 * x for x in points.positions], [1e6 * y for y in points.values], note


RUNS = {
    "there and back": (UP + DOWN, MEAN, "10 values at 5 positions", "EXX 0.4 µm"),
    "back and there": (DOWN + UP, MEAN, "10 values at 5 positions", "EXX 0.4 µm"),
    "the turn once": (UP + DOWN[1:], [*MEAN[:-1], 1.7], "9 values at 5", "EXX 0.4 µm"),
    "twice there and back": (
        UP + DOWN + again(UP) + again(DOWN),
        [value + SHIFT / 2 for value in MEAN],
        "20 values at 5 positions",
        "EXX 0.4 µm",
    ),
    # Both directions weigh alike: the mean of four values at the ends only would be another.
    "twice there, once back": (
        UP + again(UP) + DOWN,
        [value + SHIFT / 4 for value in MEAN],
        "15 values at 5 positions",
        "EXX 0.3 µm",
    ),
    "twice there": (UP + again(UP), [value + SHIFT / 2 for value in THERE], "10 values at 5", ""),
    "sorted by position": (sorted(UP + DOWN), MEAN, "10 values at 5 positions", ""),
    "once": (UP, THERE, "", ""),
    "once, backwards": (DOWN, BACK, "", ""),
}


@pytest.mark.parametrize("name", RUNS)
def test_runs_have_one_mean(tmp_path: Path, name: str) -> None:
    rows, expected, count, reversal = RUNS[name]
    positions, values, note = read(tmp_path, rows)
    np.testing.assert_allclose(positions, PLACES, rtol=1e-12)
    np.testing.assert_allclose(values, expected, rtol=0, atol=1e-9)
    assert count in note and bool(note) == bool(count)
    assert note.endswith(reversal) and ("reversal" in note) == bool(reversal)


def test_places_at_odd_distances(tmp_path: Path) -> None:
    """Steps of very different lengths; reversal by place, of which the largest is told."""
    x = np.array([0.0, 1.0, 20.0, 150.0, 151.0, 1000.0])
    up, reversal = np.sin(x / 300.0), np.array([0.1, 0.2, 0.3, 0.25, 0.15, 0.05])
    rows = [*zip(x, up, strict=True), *[*zip(x, up + reversal, strict=True)][::-1]]
    _, values, note = read(tmp_path, rows)
    np.testing.assert_allclose(values, up + reversal / 2, rtol=0, atol=1e-9)
    assert note.endswith("EXX 0.3 µm")


def test_several_curves_and_one_position(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("position_mm,EXX_um,EBX_urad\n0,0,1\n500,2,5\n500,4,3.5\n0,1,2\n")
    curves, numbers, note = read_numbered_curves(path)
    assert curves["EXX"].values == (5e-07, 3e-06) and numbers == (2, 3)
    np.testing.assert_allclose(curves["EBX"].values, [1.5e-6, 4.25e-6], rtol=1e-12)
    assert note.endswith("EXX 2 µm, EBX 1.5 µrad")
    path.write_text("position_mm,EXX_um\n500,2\n500,4\n")
    with pytest.raises(ExperimentError, match="a curve needs at least two points"):
        read_numbered_curves(path)


def test_targets_met_within_hundredths_are_one(tmp_path: Path) -> None:
    """Forwards and backwards differ in position, at the turn to either side, twice there and back;
    position and value are means of both directions."""
    for miss in (0.02, -0.02):
        back = [(x + miss, value) for x, value in DOWN]
        for rows, shift in (
            (UP + back, 0.0),
            (back + UP, 0.0),
            (UP + back + again(UP) + again(back), SHIFT / 2),
        ):
            positions, values, note = read(tmp_path, rows)
            np.testing.assert_allclose(positions, np.array(PLACES) + miss / 2, atol=1e-9)
            np.testing.assert_allclose(values, np.array(MEAN) + shift, atol=1e-9)
            assert f"{len(rows)} values at 5 positions" in note and note.endswith("EXX 0.4 µm")
            assert "one direction" not in note


def test_a_fine_run_keeps_its_points(tmp_path: Path) -> None:
    x = [0.0, 0.01, 0.02, 100.0, 400.0]
    positions, values, note = read(tmp_path, [*zip(x, THERE, strict=True)])
    np.testing.assert_allclose(positions, x, atol=1e-9)
    np.testing.assert_allclose(values, THERE, atol=1e-9)
    assert not note


def test_targets_of_one_direction_are_named(tmp_path: Path) -> None:
    """The turn once; and a turn at two places, too far from each other for one target."""
    assert "; read in one direction only: 400 mm; " in read(tmp_path, UP + DOWN[1:])[2]
    positions, _, note = read(tmp_path, [*UP, (401.0, 2.1), *DOWN[1:]])
    np.testing.assert_allclose(positions, [*PLACES, 401.0], atol=1e-9)
    assert "; read in one direction only: 400 mm, 401 mm; " in note


MACHINE = """\
title: measured there and back
arrangement: MB2
volume: {x: [0 mm, 400 mm], y: [0 mm, 400 mm], z: [0 mm, 400 mm]}
reference_point: [0 mm, 0 mm, 0 mm]
errors: {EXX: {file: x.csv}}
"""


def test_a_machine_file_has_the_mean_curve(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    read(tmp_path, UP + DOWN)
    (tmp_path / "m.yaml").write_text(MACHINE, encoding="utf-8")
    line = ["--line", "y = 0 mm, z = 0 mm", "--points", "5", "--format", "csv"]
    assert main(["map", str(tmp_path / "m.yaml"), *line]) == 0
    out, err = capsys.readouterr()
    values = [float(text.split(",")[3]) for text in out.splitlines()[1:]]
    np.testing.assert_allclose(values, np.array(MEAN) - MEAN[0], rtol=0, atol=1e-9)
    assert "errors.EXX.file: x.csv: means of 10 values at 5 positions" in err
    assert "EXX 0.4 µm" in err
