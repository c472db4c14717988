"""A machine file as the true machine: the frame that it is told in is none that a misfit could come
from.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ballplate.montecarlo._reference import reference
from ballplate.montecarlo._targets import targets
from ballplate.montecarlo.experiments import true_experiment
from ballplate.simulator.experiment.loading import load

SHIPPED = Path("designs/park")
MIDDLE = "reference_point: [450 mm, 575 mm, 200 mm]\n"
# Criteria of straightness, and what is stated of the reference point.
STATED = [
    ("least squares", ""),
    ("least squares", MIDDLE),
    ("end points", "reference_point: [900 mm, 300 mm, 0 mm]\n"),
    ("minimum zone", MIDDLE),
]
NPL_LIKE = (SHIPPED / "machines/npl-like.yaml").read_text(encoding="utf-8")
MACHINE = "{kind: machine, file: machine.yaml}"


def written(folder: Path, machine: str, **replaced: str) -> Path:
    (folder / "machine.yaml").write_text(machine, encoding="utf-8")
    text = (
        (SHIPPED / "plate.yaml")
        .read_text(encoding="utf-8")
        .replace("machines/npl-like.yaml", "machine.yaml")
    )
    for old, new in replaced.items():
        assert f"{old}: {MACHINE}" in text
        text = text.replace(f"{old}: {MACHINE}", f"{old}: {new}")
    path = folder / "plate.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def assert_followed(path: Path) -> None:
    """Readings without noise leave no residual, and lead to the true machine in the frame of the
    fitted one.
    """
    (experiment,) = load(path)
    shared = reference(*true_experiment(experiment))
    # What is of second order in the misalignment of positions, far below a nanometre, is not part
    # of the model.
    assert shared.sum_of_squares < 1e-8
    for target in targets(shared):
        assert np.abs(target.base / target.uncertainty).max() < 1e-4, target.symbol


@pytest.mark.parametrize(("criterion", "point"), STATED)
@pytest.mark.parametrize("arrangement", ["MB1", "FB1"])
def test_neither_reference_point_nor_straight_lines_are_a_misfit(
    tmp_path: Path, criterion: str, point: str, arrangement: str
) -> None:
    machine = NPL_LIKE.replace("MB1", arrangement) + point
    machine = machine.replace("straightness: least squares", f"straightness: {criterion}")
    if arrangement == "FB1":
        # The lever of a table's rotation is one power more than the rotation.
        machine = machine.replace(
            "EZY: {bandwidth: 3 um}", "EZY: {polynomial: [0 um, 1 um, 2 um, 3 um]}"
        )
        machine = machine.replace("[0 um, 7 um, -7 um]", "[0 um, 7 um, -7 um, 1 um]")
    assert_followed(written(tmp_path, machine))


def test_a_kinematic_model_holds_the_x_axis(tmp_path: Path) -> None:
    model = "{kind: kinematic, arrangement: MB1, position_coefficients: 4"
    model += ", rotation_coefficients: 3}"
    assert_followed(written(tmp_path, NPL_LIKE, error_model=model))


def test_a_part_of_the_volume(tmp_path: Path) -> None:
    wider = NPL_LIKE.replace("x: [0 mm, 900 mm]", "x: [-300 mm, 1200 mm]")
    assert_followed(written(tmp_path, wider))


def test_the_bend_of_an_arm_is_part_of_its_straightness(tmp_path: Path) -> None:
    machine = (SHIPPED / "machines/gec-like.yaml").read_text(encoding="utf-8")
    assert_followed(written(tmp_path, machine))


def test_expansion_is_estimated_where_no_positioning_error_is_stated(tmp_path: Path) -> None:
    stated = [line for line in NPL_LIKE.splitlines() if not line.startswith(("  EYY:", "  EZZ:"))]
    path = written(tmp_path, "\n".join(stated))
    (experiment,) = load(path)
    design, _ = true_experiment(experiment)
    names = [one.name for one in design.model.parameters if one.name.startswith(("EYY", "EZZ"))]
    assert names == ["EYY[1]", "EZZ[1]"]
    assert_followed(path)
