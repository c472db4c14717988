"""True machines with measured error curves: they pass through their points, and wrong files are
told.
"""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.machines.truth import TrueMachine, true_machine

EXPERIMENT = """\
title: measured curves
machine: {volume: {x: [-200 mm, 800 mm], y: [0 mm, 1 m], z: [0 mm, 1 m]}, repeatability: 0.2 um}
error_model: {kind: kinematic}
true_machine: {kind: curves, files: [x.csv, y.csv]}
probes: {down: [0 mm, 0 mm, -50 mm]}
artefacts: {plate: {kind: grid, balls: [3, 3], size: [600 mm, 600 mm]}}
positions: [{name: low, plane: z, level: 100 mm, corner: {x: 100 mm, y: 100 mm}}]
"""
# Out of order, in mixed units, not zero at the lower end, and short of the upper one.
X = (
    "position_mm,EXX_um,EAX_arcsec,EYX_nm\n# a"
    " comment\n300,1,2,-500\n-200,0.5,0,0\n100,-1,1,250\n\n700,2,0.5,100\n"
)
Y = "position_m,EYY_um\n0,0\n1,4\n"
ARCSEC = np.pi / 180 / 3600


def written(folder: Path, x: str = X, y: str = Y, more: str = "") -> Path:
    (folder / "x.csv").write_text(x, encoding="utf-8")
    (folder / "y.csv").write_text(y, encoding="utf-8")
    file = folder / "e.yaml"
    file.write_text(EXPERIMENT.replace("y.csv]", f"y.csv]{more}"), encoding="utf-8")
    return file


def machine_of(experiment: Experiment) -> TrueMachine:
    design = lay_out(experiment)
    corners = design.machine.volume.corners
    return true_machine(experiment.true_machine, design.model, *corners)


@pytest.mark.parametrize("interpolation", ["linear", "cubic", "monotone"])
def test_curves_pass_through_their_points_as_they_are(tmp_path: Path, interpolation: str) -> None:
    (experiment,) = load(written(tmp_path, more=f", interpolation: {interpolation}"))
    machine = machine_of(pickle.loads(pickle.dumps(experiment)))
    x = np.array([[position, 0.0, 0.0] for position in (-0.2, 0.1, 0.3, 0.7)])
    down = np.broadcast_to([0.0, 0.0, -0.1], x.shape)
    roll = np.array([0, 1, 2, 0.5]) * ARCSEC
    straightness = np.array([0, 0.25e-6, -0.5e-6, 0.1e-6])
    expected = np.stack(
        [np.array([0.5, -1, 1, 2]) * 1e-6, straightness + 0.1 * roll, np.full(4, -0.1)], axis=1
    )
    np.testing.assert_allclose(
        machine.model.error(x, machine.a, down), expected, rtol=0, atol=1e-18
    )
    beyond = machine.model.error(
        np.array([[0.8, 0.0, 0.0], [-0.3, 0.0, 0.0]]), machine.a, np.zeros((2, 3))
    )
    np.testing.assert_allclose(beyond[:, 0], [2e-6, 0.5e-6], rtol=0, atol=1e-18)


def test_between_the_points_curves_are_as_asked_for(tmp_path: Path) -> None:
    between = {}
    for interpolation in ("linear", "cubic", "monotone"):
        machine = machine_of(load(written(tmp_path, more=f", interpolation: {interpolation}"))[0])
        x = np.stack([np.linspace(-0.2, 0.1, 50), np.full(50, 0.25), np.zeros(50)], axis=1)
        between[interpolation] = machine.model.error(x, machine.a, np.zeros((50, 3)))[:, :2]
        np.testing.assert_allclose(between[interpolation][0, 1], 1e-6, atol=1e-18)
    np.testing.assert_allclose(between["linear"][:, 0], np.linspace(0.5e-6, -1e-6, 50), atol=1e-18)
    assert between["monotone"][:, 0].min() >= -1e-6 - 1e-18 > between["cubic"][:, 0].min()


@pytest.mark.parametrize(
    ("x", "lines"),
    [
        ("", ["x.csv:1:1: the file is empty; its first line should be position_mm"]),
        ("position_mm,EXX\n0,1\n", ["x.csv:1:13: the column \"EXX\" has no unit; write for example EXX_um"]),
        ("position_mm,EQX_um\n0,1\n", ["x.csv:1:13: unknown column \"EQX_um\"; did you mean \"E"]),
        ("position_mm,EXX_urad\n0,1\n", ["x.csv:1:13: unknown unit in the column \"EXX_urad\""]),
        ("EXX_um,EYX_um\n0,1\n", ["x.csv:1:1: no column for position; the first line should be position_mm"]),
        ("position_mm,EXX_um,EYY_um\n0,1,1\n", ["x.csv:1:1: errors of the axes X, Y; write one file for each axis"]),
        ("position_mm,EXX_um\n0,1\n", ["x.csv:1:1: a curve needs at least two points"]),
        ("position_mm,EXX_um\n0,1\n5\n9,one\n", ["x.csv:3:1: 1 columns instead of 2", "x.csv:4:3: \"one\" is not"]),
        ("position_mm,EXX_um\n0,4,11\n9,\"5,3\"\n8.0,\n",
         ["x.csv:2:1: 3 columns instead of 2; if a comma is meant as the decimal point, write a point, as in 4.11",
          "x.csv:3:3: \"5,3\" has a decimal comma; write 5.3", "x.csv:4:5: no EXX; write a number"]),
        ("position_mm,EXX_um\n0,1\n300,2\n", ["e.yaml:4:38: true_machine.files[0]: covers 0 mm to 300 mm, but"]),
        ("position_mm,EYY_um\n0,1\n900,2\n", ["e.yaml:4:45: true_machine.files[1]: EYY is in an earlier file"]),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_file(tmp_path: Path, x: str, lines: list[str]) -> None:
    with pytest.raises(ExperimentError) as caught:
        load(written(tmp_path, x))
    told = str(caught.value).replace(f"{tmp_path}/", "").split("\n")
    assert len(told) == len(lines)
    assert all(line.removeprefix("e.yaml:4:38: true_machine.files[0]: ").startswith(start) or line.startswith(start)
               for line, start in zip(told, lines, strict=True)), told  # fmt: skip


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    file = written(tmp_path)
    (tmp_path / "y.csv").unlink()
    with pytest.raises(ExperimentError, match=r"true_machine.files\[1\]: .*y.csv"):
        load(file)
