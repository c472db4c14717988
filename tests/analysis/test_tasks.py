"""Measuring tasks: their uncertainty is that of U6 for the same two points, with estimated probe
offsets counted.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ballplate.results.prediction import predict
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.quantities import Target
from ballplate.uncertainty.summaries import uncertainties

from tests.analysis.test_invariants import judged, small_design
from tests.reference.designs import altered

QUICKSTART = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
TASKS = """\
evaluation:
  probe: down
  tasks:
    - {name: bore distance, from: [100 mm, 200 mm, 0 mm], to: [600 mm, 200 mm, 50 mm], target_uncertainty: 0.1 um}
    - {name: from side to side, from: [0 mm, 300 mm, 400 mm], to: [900 mm, 400 mm, 450 mm], probes: [right, left]}
    - {name: height, from: [0 mm, 0 mm, 0 mm], to: [0 mm, 0 mm, 1 m], probe: front}
"""


def with_tasks(tmp_path: Path, tasks: str = TASKS, text: str = QUICKSTART) -> Experiment:
    before, _, after = text.partition("evaluation:\n")
    rest = after.partition("\n\n")[2]
    file = tmp_path / "tasks.yaml"
    file.write_text(f"{before}{tasks}\n{rest}", encoding="utf-8")
    return load(file)[0]


def test_a_task_is_as_uncertain_as_the_distance_between_the_same_points(tmp_path: Path) -> None:
    found = predict(with_tasks(tmp_path)).tasks[0]
    points = (
        "evaluation:\n  points: [[100 mm, 200 mm, 0 mm], [600 mm, 200 mm, 50 mm]]\n  probe: down\n"
    )
    expected = predict(with_tasks(tmp_path, points)).quantities["U6"]
    assert expected.count == 1
    assert found.standard_uncertainty == pytest.approx(expected.maximum, rel=1e-9)
    assert found.length == pytest.approx(np.hypot(0.5, 0.05))
    assert found.expanded_uncertainty == 2.0 * found.standard_uncertainty


def test_tasks_are_judged_by_their_own_target_or_that_of_the_file(tmp_path: Path) -> None:
    planned = predict(with_tasks(tmp_path))
    bore, side, height = planned.tasks
    assert bore.target == 1e-7 and bore.is_within is False
    assert side.length == pytest.approx(np.linalg.norm([0.9 - 0.1, 0.1, 0.05]))
    assert side.target == pytest.approx(0.5e-6 + side.length * 1e-6) and side.is_within
    told = planned.quantities["tasks"]
    values = [task.standard_uncertainty for task in planned.tasks]
    assert (told.count, told.largest) == (3, planned.tasks[int(np.argmax(values))].name)
    assert told.average == pytest.approx(np.mean(values)) and told.maximum == max(values)
    assert told.within_target == pytest.approx(2 / 3)
    data = planned.to_dict()
    assert data["tasks"]["height"]["standard_uncertainty"] == height.standard_uncertainty
    assert data["tasks"]["bore distance"]["within_target"] is False
    lines = planned.lines()
    assert any(line.startswith("bore distance") and line.endswith("no") for line in lines)
    assert len(planned.design.evaluation.points) == 200


def test_undetermined_tasks_are_told_as_such() -> None:
    """Without a calibrated distance no length is known, whatever the task."""
    design = small_design()
    design = altered(
        design,
        distances=replace(
            design.of(CalibratedDistances),
            **{name: v[:0] for name, v in vars(design.of(CalibratedDistances)).items()},
        ),
        probes={"offsets": np.zeros_like(design.probes.offsets)},
        tasks={
            "names": ("edge", "none"),
            "points": np.array([[[0.0, 0, 0], [1, 0, 0]], [[0, 0, 0], [0, 1, 0]]]),
            "probes": np.zeros((2, 2), int),
            "targets": (None, None),
        },
    )
    quantity = judged(design)[0]["tasks"]
    assert (quantity.count, quantity.undetermined, quantity.within_target) == (2, 2, None)
    assert np.isnan(quantity.maximum)


def test_share_within_counts_only_tasks_with_a_target(tmp_path: Path) -> None:
    at = linearise(lay_out(with_tasks(tmp_path)))
    targets = at.design.tasks.targets

    def share(*targets: Target | None) -> float | None:
        changed = altered(at.design, tasks={"targets": targets})
        return uncertainties(replace(at, design=changed))["tasks"].within_target

    assert share(targets[0], None, None) == 0.0
    assert share(None, None, None) is None
    assert share(targets[0], targets[1], None) == 0.5
