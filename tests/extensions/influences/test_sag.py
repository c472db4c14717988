"""Sag of plates against closed forms, dense computations and simulated campaigns by a law written
down beside the program.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.cli import main
from ballplate.rank.verdicts import verdict
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import influence_shifts, nominal_state
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.influences.campaigns import Real, file_with

SAG = 2e-6
SPREAD = np.array([SAG])
STATED = {"kind": "sag", "standard_uncertainty": "2 um"}

# How far balls of the plate of 3 x 3 hang through, as a share of the ball in the middle, row by row.
BOWL = np.array([0.0, 0.5, 0.0, 0.5, 1.0, 0.5, 0.0, 0.5, 0.0])
TROUGH = np.array([0.0, 1.0, 0.0] * 3)

# Across z a plate lies, its normal up; across x and y it stands.
UP, DOWN = ["0 deg", "0 deg", "0 deg"], ["180 deg", "0 deg", "0 deg"]


def law(design: Design, x: Any, e: Any, shape: Real = BOWL) -> Any:
    """Only the plates that lie hang through, straight down."""
    flat = np.array([name.startswith("z") for name in design.positions.names])
    readings = design.readings
    share = np.where(flat[readings.position], shape[readings.ball], 0.0)
    return -e[0] * share[:, None] * np.array([0.0, 0.0, 1.0])


def small(
    folder: Path, influence: dict[str, Any], *rotations: list[str], **told: Any
) -> Experiment:
    """A plate of 300 mm turned about x, y and z within the volume, on a machine without errors."""
    linear = {"position_coefficients": 2, "rotation_coefficients": 1}
    model = {"kind": "kinematic", "arrangement": "MB2"} | linear
    straight = [
        {"parameter": f"{name} t", "standard_uncertainty": "1e-3 nm"}
        for name in ("EXX", "EXY", "EYY", "EXZ", "EYZ", "EZZ")
    ]
    plate = {"kind": "grid", "balls": [3, 3], "size": ["300 mm", "300 mm"]}
    told = {"artefacts": {"plate": plate}, "probes": {"down": ["0 mm", "0 mm", "-50 mm"]}} | told
    told |= {"positions": posed(*rotations), "error_model": model, "priors": straight}
    return file_with(folder, [influence], **told)


def posed(*rotations: list[str]) -> list[dict[str, Any]]:
    """Positions of the plate, turned about x, y and z, and well inside the volume."""
    return [
        {
            "name": f"place {k}",
            "pose": {"origin": ["500 mm", "500 mm", "500 mm"], "rotation": rotation},
            "probes": ["down"],
        }
        for k, rotation in enumerate(rotations)
    ]


def shifts(design: Design) -> Real:
    """What a sag of 1 m in the middle adds to locations (positions, balls, 3)."""
    x = np.zeros((len(design.readings), design.dimension))
    _, by_parameter = influence_shifts(design, nominal_state(design), design.readings, x)
    return by_parameter[:, :, 0].reshape(len(design.positions.names), -1, design.dimension)


def test_a_plate_hangs_down_lying_and_turned_over_and_not_standing(tmp_path: Path) -> None:
    tilted, standing = ["30 deg", "0 deg", "0 deg"], ["90 deg", "0 deg", "0 deg"]
    design = lay_out(small(tmp_path, STATED, UP, DOWN, standing, tilted))
    lying, over, upright, oblique = shifts(design)
    down = np.array([0.0, 0.0, -1.0])
    np.testing.assert_allclose(lying, BOWL[:, None] * down, atol=1e-12)
    np.testing.assert_allclose(over, BOWL[:, None] * down, atol=1e-12)
    np.testing.assert_allclose(upright, 0.0, atol=1e-12)
    # The part of gravity along the normal, along the normal.
    normal = np.array([0.0, -0.5, np.sqrt(0.75)])
    np.testing.assert_allclose(oblique, -np.sqrt(0.75) * BOWL[:, None] * normal, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, BOWL),
        ({"shape": "both"}, BOWL),
        ({"shape": "x"}, TROUGH),
        ({"shape": "y"}, TROUGH.reshape(3, 3).T.ravel()),
        ({"shape": {"x": 2}}, np.array([1.0, 0.0, 1.0] * 3)),
        # 2 x^2 - x^4 y^2 at -1, 0 and 1 along both axes, its largest value 2.
        (
            {"shape": [{"factor": 2.0, "x": 2}, {"factor": -1.0, "x": 4, "y": 2}]},
            np.array([0.5, 0.0, 0.5, 1.0, 0.0, 1.0, 0.5, 0.0, 0.5]),
        ),
    ],
)
def test_shapes_are_one_where_they_are_largest(
    tmp_path: Path, change: dict[str, Any], expected: Real
) -> None:
    design = lay_out(small(tmp_path, STATED | change, UP))
    np.testing.assert_allclose(shifts(design)[0, :, 2], -expected, atol=1e-12)


def test_values_of_a_file_are_a_shape_with_its_size(tmp_path: Path) -> None:
    values = np.array([0.0, 0.4, 0.1, 0.3, 1.6, 0.2, 0.0, 0.7, -0.2])
    balls = [f"r{row}c{column}" for row in (1, 2, 3) for column in (1, 2, 3)]
    lines = ["ball,sag_um", *(f"{ball},{v}" for ball, v in zip(balls, values, strict=True))]
    (tmp_path / "sag.csv").write_text("\n".join(lines[:1] + lines[:0:-1]) + "\n", encoding="utf-8")
    design = lay_out(small(tmp_path, STATED | {"values": "sag.csv"}, UP))
    np.testing.assert_allclose(shifts(design)[0, :, 2], -values / 1.6, atol=1e-12)
    (parameter,) = design.influence_parameters
    assert parameter.value == pytest.approx(1.6e-6) and parameter.uncertainty == SAG
    x = np.zeros((9, 3))
    moved, _ = influence_shifts(design, nominal_state(design), design.readings, x)
    np.testing.assert_allclose(moved[:, 2], -1e-6 * values, atol=1e-15)


def test_gravity_may_be_along_another_axis(tmp_path: Path) -> None:
    turned = STATED | {"gravity": "y"}
    design = lay_out(small(tmp_path, turned, UP, ["90 deg", "0 deg", "0 deg"]))
    lying, standing = shifts(design)
    np.testing.assert_allclose(lying, 0.0, atol=1e-12)
    np.testing.assert_allclose(standing, BOWL[:, None] * np.array([0.0, 1.0, 0.0]), atol=1e-12)


PLANE = """
title: a plate in a plane
machine: {volume: [1 m, 1 m], repeatability: 0.2 um}
error_model: {kind: metric}
probes: {down: [0 mm, 0 mm]}
artefacts: {plate: {kind: grid, balls: [3, 3], size: [600 mm, 600 mm]}}
positions:
  - {name: one, pose: {origin: [100 mm, 100 mm]}, probes: [down]}
  - {name: two, pose: {origin: [800 mm, 100 mm], rotation: 90 deg}, probes: [down]}
calibration: [{kind: distances, pairs: corner sides, standard_uncertainty: 0.2 um}]
"""


def test_a_plane_beam_hangs_down_in_its_plane(tmp_path: Path) -> None:
    told = yaml.safe_load(PLANE) | {"influences": [STATED]}
    (tmp_path / "plane.yaml").write_text(yaml.safe_dump(told), encoding="utf-8")
    lying, standing = shifts(lay_out(load(tmp_path / "plane.yaml")[0]))
    np.testing.assert_allclose(lying, TROUGH[:, None] * np.array([0.0, -1.0]), atol=1e-12)
    np.testing.assert_allclose(standing, 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("rotations", "more"),
    [
        # Lying in one orientation only, the sag is part of what is taken for the plate's shape.
        ([UP], 1),
        ([UP, ["0 deg", "0 deg", "90 deg"], ["0 deg", "0 deg", "180 deg"]], 1),
        ([UP, DOWN], 0),
        ([UP, ["90 deg", "0 deg", "0 deg"]], 0),
        # Standing only, there is none to be seen.
        ([["90 deg", "0 deg", "0 deg"]], 1),
    ],
)
def test_the_verdict_tells_whether_sag_and_shape_are_told_apart(
    tmp_path: Path, rotations: list[list[str]], more: int
) -> None:
    # On a machine without errors only the sag and the plate are open.
    design = lay_out(small(tmp_path, {"kind": "sag"}, *rotations, calibration=[]))
    found = verdict(linearise(design))
    assert found.deficiency == more
    assert ("sag of plate" in "; ".join(map(str, found.null))) == (more > 0)


def test_a_plan_weighs_the_sag_and_its_file_finds_the_values(tmp_path: Path) -> None:
    balls = [f"r{row}c{column}" for row in (1, 2, 3) for column in (1, 2, 3)]
    lines = ["ball,sag_um", *(f"{ball},{v}" for ball, v in zip(balls, BOWL, strict=True))]
    (tmp_path / "sag.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    whole = file_with(tmp_path, [STATED | {"values": "sag.csv"}])
    told = yaml.safe_load((tmp_path / "file.yaml").read_text(encoding="utf-8"))
    told["pool"] = {"candidates": told.pop("positions")}
    (tmp_path / "pool.yaml").write_text(yaml.safe_dump(told), encoding="utf-8")
    (tmp_path / "there").mkdir()
    chosen = tmp_path / "there" / "chosen.yaml"
    main(["plan", str(tmp_path / "pool.yaml"), "--positions", "6", "-q", "-o", str(chosen)])
    average = bp.run(chosen).to_dict()["quantities"]["U6"]["average"]
    assert average == pytest.approx(
        bp.run(whole).to_dict()["quantities"]["U6"]["average"], rel=1e-6
    )


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"artefact": "plat"}, 'did you mean "plate"?'),
        ({"value": "2 ppm"}, "is a ratio; a length is expected"),
        ({"standard_uncertainty": "-2 um"}, "is below zero"),
        ({"shape": "x", "values": "sag.csv"}, "stands beside values"),
        ({"values": "none.csv"}, "none.csv"),
        ({"shape": [{"x": 1, "factor": 0.0}]}, "bends no ball of plate"),
    ],
)
def test_what_is_wrong_is_told_at_its_place(
    tmp_path: Path, change: dict[str, Any], expected: str
) -> None:
    (tmp_path / "sag.csv").write_text("ball,sag_um\nr1c1,1\n", encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        file_with(tmp_path, [STATED | change])
    assert expected in str(caught.value)


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        (["r1c1,1", "r1c1,2"], 'ball "r1c1" is there twice'),
        (["r1c9,1"], 'unknown ball "r1c9"'),
        (["r1c1,1"], "no line for r1c2, r1c3"),
        (["r1c1,much"], "much"),
    ],
)
def test_a_wrong_file_of_values_is_told_line_by_line(
    tmp_path: Path, rows: list[str], expected: str
) -> None:
    (tmp_path / "sag.csv").write_text("\n".join(["ball,sag_um", *rows, ""]), encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        file_with(tmp_path, [STATED | {"values": "sag.csv"}])
    assert expected in str(caught.value) and "sag.csv:" in str(caught.value)
