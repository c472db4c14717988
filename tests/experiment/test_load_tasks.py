"""Measuring tasks of a file: what they say when right, and what is said when not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError

TEXT = """\
title: good
machine: {volume: [1 m, 1 m, 1 m], repeatability: 0.2 um}
error_model: {kind: kinematic}
probes: {down: [0 mm, 0 mm, -50 mm], side: [50 mm, 0 mm, 0 mm]}
artefacts: {plate: {kind: grid, balls: [3, 3], size: [500 mm, 500 mm]}}
positions:
  - {name: low, plane: z, level: 0 mm, corner: {x: 0 mm, y: 0 mm}, probes: [down]}
target_uncertainty: 1 um
evaluation:
  probe: side
  tasks:
    - {name: a, from: [0 mm, 0 mm, 0 mm], to: [1 m, 0 mm, 0 mm]}
    - {name: b, from: [0 mm, 0 mm, 0 mm], to: [1 m, 0 mm, 0 mm], probe: down, target_uncertainty: 0.2 um + L/1000000}
    - {name: c, from: [0 mm, 0 mm, 0 mm], to: [0 mm, 0 mm, 0 mm], probes: [down, side]}
"""


def test_defaults_are_those_of_the_evaluation_and_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "good.yaml").write_text(TEXT, encoding="utf-8")
    found = load(tmp_path / "good.yaml")[0].evaluation
    assert found.points.shape == (0, 3)
    assert [task.probes for task in found.tasks] == [
        ("side", "side"),
        ("down", "down"),
        ("down", "side"),
    ]
    assert [task.target.stated.constant for task in found.tasks if task.target] == [
        1e-6,
        0.2e-6,
        1e-6,
    ]
    np.testing.assert_array_equal(found.tasks[0].points, [[0, 0, 0], [1, 0, 0]])


WRONG = [
    ("to: [1 m, 0 mm, 0 mm]}", "to: [1 m, 0 mm]}",
     "12:47: evaluation.tasks[0].to: has 2 co-ordinates, but the experiment has 3 dimensions; give 3"),
    ("to: [1 m, 0 mm, 0 mm]}", "to: [0 mm, 0 mm, 0 mm]}",
     "12:47: evaluation.tasks[0].to: coincides with the start of the length; give two points"),
    ("probes: [down, side]", "probes: [down, sid]",
     '14:82: evaluation.tasks[2].probes[1]: unknown probe "sid"; did you mean "side"?'),
    ("name: b", "name: a",
     '13:14: evaluation.tasks[1].name: "a" is the name of tasks[0] already; names must differ'),
    ("probes: [down, side]", "probes: [down, side], probe: down",
     '14:89: evaluation.tasks[2].probe: cannot be combined with "probes"; give only one of the two'),
    (TEXT[TEXT.index("  tasks"):], "",
     '9:1: evaluation: has neither points nor tasks; add "points", such as {random: 200, seed:'
     ' 1}, or "tasks"'),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message"), WRONG)
def test_what_is_wrong_with_a_task(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in TEXT
    file = tmp_path / "wrong.yaml"
    file.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ExperimentError) as raised:
        load(file)
    assert [str(one).removeprefix(f"{file}:") for one in raised.value.messages] == [message]
