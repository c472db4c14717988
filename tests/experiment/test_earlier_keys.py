"""Files, paths and changes with the earlier name of a key mean the same as with that of today."""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import pytest
from ballplate.extensions.sweeps.fingerprint import fingerprint
from ballplate.extensions.sweeps.load import experiment_of, load_sweep
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError

QUICKSTART = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
NEW, OLD = "target_uncertainty", "target_accuracy"
TASKS = """evaluation:
  tasks:
    - {name: bore, from: [0 mm, 0 mm, 0 mm], to: [1 m, 0 mm, 0 mm], target_uncertainty: 0.2 um}
"""
VARIANTS = """variants:
  plain: {sigma: given}
  tight: {target_uncertainty: 0.1 um}
  other task: {"evaluation.tasks[bore].target_uncertainty": 0.3 um}
"""


def experiments(folder: Path, text: str) -> tuple[Experiment, ...]:
    file = folder / "e.yaml"
    file.write_text(text, encoding="utf-8")
    return load(file)


def with_task(text: str) -> str:
    assert text.count("evaluation:\n") == 1
    return text.replace("evaluation:\n", TASKS)


def test_both_keys_mean_the_same_everywhere_in_a_file(tmp_path: Path) -> None:
    text = with_task(QUICKSTART) + VARIANTS
    assert text.count(NEW) >= 4
    new = experiments(tmp_path, text)
    old = experiments(tmp_path, text.replace(NEW, OLD))
    assert list(map(fingerprint, new)) == list(map(fingerprint, old))
    # The variants differ in their targets, so that none of them was passed over.
    targets = {
        (str(one.target_uncertainty), str([task.target for task in one.evaluation.tasks]))
        for one in old
    }
    assert len(targets) == 3


def test_one_of_the_two_is_refused_beside_the_other(tmp_path: Path) -> None:
    with pytest.raises(
        ExperimentError, match="61:1: target_accuracy: .* target_uncertainty, which"
    ):
        experiments(tmp_path, QUICKSTART + "target_accuracy: 1 um\n")


def test_changes_from_python_take_both() -> None:
    quickstart = bp.quickstart()
    new, old = (quickstart.with_(**{key: "0.7 um"}) for key in (NEW, OLD))
    assert fingerprint(new) == fingerprint(old) != fingerprint(quickstart)


def test_axes_of_sweeps_take_both(tmp_path: Path) -> None:
    base = tmp_path / "quickstart.yaml"
    found = []
    for key in (NEW, OLD):
        base.write_text(QUICKSTART.replace(NEW, key), encoding="utf-8")
        sweep = tmp_path / "sweep.yaml"
        sweep.write_text(
            "title: targets\nbase: quickstart.yaml\naxes:\n"
            f"  target: {{path: {key}, values: [0.2 um, 0.9 um]}}\n",
            encoding="utf-8",
        )
        loaded = load_sweep(sweep)
        found.append([fingerprint(experiment_of(loaded, number)) for number in range(2)])
    assert found[0] == found[1] and found[0][0] != found[0][1]


def test_both_at_once_from_python_are_refused() -> None:
    with pytest.raises(ExperimentError, match="same entry"):
        bp.quickstart().with_({OLD: "1 um", NEW: "2 um"})


def test_names_that_a_person_chose_stay(tmp_path: Path) -> None:
    """Probes, artefacts, positions, tasks and variants may be called like a key."""
    text = with_task(QUICKSTART).replace("name: bore", f"name: {OLD}")
    text = text.replace("down", OLD).replace("plate:", f"{OLD}:").replace("artefact: plate", "")
    text = text.replace("{name: z low", "{name: " + OLD).replace("name: z low", f"name: {OLD}")
    text += f"""variants:
  {OLD}: {{"positions[{OLD}].repeats": 2, "evaluation.tasks[{OLD}].{OLD}": 0.3 um}}
  other: {{"probes.{OLD}": [0 mm, 0 mm, -60 mm]}}
"""
    first, second = experiments(tmp_path, text)
    assert first.name == OLD
    assert OLD in first.probes and OLD in first.layouts and NEW not in first.probes
    assert first.positions[0].name == OLD and first.positions[0].readings[0].repeats == 2
    assert first.evaluation.tasks[0].name == OLD
    assert first.evaluation.tasks[0].target.stated.constant == pytest.approx(3e-7)
    assert second.probes[OLD].offset[2] == pytest.approx(-0.06)
