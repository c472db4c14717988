"""Rows of diameters and form in tables of one row per axis."""

from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.simulator.inputs import ExperimentError
from ballplate.simulator.readings import read_readings

EXPERIMENT = """\
title: balls
machine: {volume: [1 m, 1 m, 1 m], repeatability: 1 um}
error_model: {kind: metric}
probes: {p: [0 mm, 0 mm, 0 mm]}
artefacts: {plate: {kind: balls, coordinates: {A: [0 mm, 0 mm, 0 mm], B: [300 mm, 0 mm, 0 mm], C: [0 mm, 300 mm, 0 mm], D: [0 mm, 0 mm, 300 mm]}}}
positions: [{name: P1, pose: {origin: [100 mm, 100 mm, 100 mm], rotation: [0 deg, 0 deg, 0 deg]}}]
calibration: [{kind: coordinates, standard_uncertainty: 1 um}]
readings: {coordinates: ball centres}
evaluation: {points: {random: 20, seed: 1}}
"""
PLACES = {
    "A": (100.0012, 99.9991, 100.0007),
    "B": (400.0035, 100.0001, 100.0003),
    "C": (100.001, 399.998, 100.0),
    "D": (100.001, 99.9995, 400.004),
}
HEAD = "Feature,Axis,Unit,Nominal,Measured,Deviation"
AXES = ("X", "Y", "Z")


def rows(ball: str, *others: str) -> list[str]:
    """The rows of a ball, those of other characteristics below the first."""
    of_axes = [
        f"{ball},{axis},mm,0,{value},0" for axis, value in zip(AXES, PLACES[ball], strict=True)
    ]
    return [of_axes[0], *(f"{ball},{other}" for other in others), *of_axes[1:]]


def fitted(folder: Path, lines: list[str], head: str = HEAD) -> tuple[np.ndarray, str]:
    """The readings (4, 3) in millimetres as `fit` has them, and how the table was read."""
    (folder / "e.yaml").write_text(EXPERIMENT, encoding="utf-8")
    (folder / "t.csv").write_text("\n".join([head, *lines, ""]), encoding="utf-8")
    experiment = bp.load(folder / "e.yaml")
    observed = read_readings(folder / "t.csv", bp.lay_out(experiment), True, experiment.readings)
    return 1e3 * observed.x, "\n".join(observed.table_notes)


DIAMETER, FORM = "D,mm,22,21.9998,-0.0002", "RN,um,,0.3,"
TABLES = {
    "diameters and form of some": (
        [*rows("A", DIAMETER, FORM), *rows("B", DIAMETER), *rows("C"), *rows("D", FORM)],
        'rows of no axis, left out: "D" (2), "RN" (2)',
    ),
    # A unit that is none of length, no number, and a feature that is no ball.
    "other units and texts": (
        ["PLN1,Flatness,mm,0,0.0021,", *rows("A", "Angle,deg,90,90.001,", "Result,,,in tolerance,")]
        + [line for ball in "BCD" for line in rows(ball)],
        'left out: "Flatness" (1), "Angle" (1), "Result" (1)',
    ),
    "none": ([line for ball in PLACES for line in rows(ball)], ""),
}


@pytest.mark.parametrize("name", TABLES)
def test_other_characteristics_are_left_out_and_counted(tmp_path: Path, name: str) -> None:
    lines, expected = TABLES[name]
    x, told = fitted(tmp_path, lines)
    np.testing.assert_allclose(x, [*PLACES.values()], rtol=0, atol=1e-9)
    assert expected in told and ("left out" in told) == bool(expected)


@pytest.mark.parametrize("axis", ["Centre {}", "{} actual", "{}-Koordinate", "{} Axis"])
def test_axes_of_several_words(tmp_path: Path, axis: str) -> None:
    lines = [line for ball in PLACES for line in rows(ball, DIAMETER)]
    for letter in AXES:
        lines = [line.replace(f",{letter},", f",{axis.format(letter)},") for line in lines]
    np.testing.assert_allclose(fitted(tmp_path, lines)[0], [*PLACES.values()], rtol=0, atol=1e-9)


def test_misspelt_axes_are_named(tmp_path: Path) -> None:
    lines = [line for ball in PLACES for line in rows(ball)]
    for letter in AXES:
        lines = [line.replace(f",{letter},", f",E{letter},") for line in lines]
    with pytest.raises(ExperimentError, match='t.csv:2:1: "EX" is no axis'):
        fitted(tmp_path, lines)


def test_a_reading_that_lacks_an_axis_beside_diameters(tmp_path: Path) -> None:
    lines = [line for ball in PLACES for line in rows(ball, DIAMETER) if not line.startswith("B,Y")]
    with pytest.raises(ExperimentError) as caught:
        fitted(tmp_path, lines)
    assert "no y; write a number" in str(caught.value) and "no axis" not in str(caught.value)
