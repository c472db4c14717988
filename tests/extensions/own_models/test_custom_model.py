"""A user's own error model, good and bad, named in an experiment file."""

from __future__ import annotations

import importlib.metadata
import json.decoder
from pathlib import Path
from typing import Any

import pytest
from ballplate.extensions.own_models import custom
from ballplate.results.prediction import check
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError

from tests.machines import wording

# A machine of straight axes in space: three scales and three angles.
GOOD = """
import numpy as np
from ballplate.models import Parameter, Reported


class Straight:
    dimension = 3

    def __init__(self, span, scales):
        self.scales = scales
        names = [*(f"scale {axis}" for axis in "xyz" if scales), "squareness xy", "squareness xz", "squareness yz"]
        self.parameters = tuple(
            Parameter(name, "1" if name.startswith("scale") else "rad", name, name, span) for name in names
        )

    def error(self, x, a, p):
        return np.einsum("mdn,n->md", self.jacobian(x, a, p), a) + p

    def jacobian(self, x, a, p):
        result = np.zeros((len(x), 3, len(self.parameters)))
        if self.scales:
            result[:, [0, 1, 2], [0, 1, 2]] = x
        result[:, 0, -3], result[:, 0, -2], result[:, 1, -1] = -x[:, 1], -x[:, 2], -x[:, 2]
        return result

    def reported(self):
        names = tuple(p.name for p in self.parameters)
        return Reported(names, tuple(p.unit for p in self.parameters), np.eye(len(names)))


def build(lower, upper, scales=True):
    return Straight(max(b - a for a, b in zip(lower, upper)), scales)
"""
EXPERIMENT = """\
title: a model of my own
machine: {volume: [1 m, 1 m, 1 m], repeatability: 0.2 um}
error_model: {kind: python, object: MODEL}
true_machine: {kind: coefficients, values: {squareness xz: 5 urad}}
probes: {down: [0 mm, 0 mm, -50 mm], right: [50 mm, 0 mm, 0 mm]}
artefacts: {plate: {kind: grid, balls: [3, 3], size: [600 mm, 600 mm]}}
positions:
  - {name: low, plane: z, level: 100 mm, corner: {x: 100 mm, y: 100 mm}, probes: [down]}
  - {name: upright, plane: x, level: 500 mm, corner: {y: 200 mm, z: 100 mm}, probes: [right]}
  - {name: turned, plane: y, level: 500 mm, corner: {z: 200 mm, x: 100 mm}, quarter_turns: 1, probes: [down]}
calibration: [{kind: distances, pairs: corners, standard_uncertainty: 0.2 um}]
"""
COUNT = iter(range(1000))


def written(folder: Path, source: str, tail: str = "") -> tuple[Path, str]:
    """An experiment file beside a module of a name of its own."""
    module = f"my_model_{next(COUNT)}"
    (folder / f"{module}.py").write_text(source, encoding="utf-8")
    file = folder / "own.yaml"
    file.write_text(EXPERIMENT.replace("MODEL", f"{module}:build{tail}"), encoding="utf-8")
    return file, module


def refusal(file: Path) -> str:
    with pytest.raises(ExperimentError) as caught:
        load(file)
    assert len(caught.value.messages) == 1
    return str(caught.value.messages[0]).removeprefix(f"{file}:")


def test_a_model_beside_the_file(tmp_path: Path) -> None:
    file, _ = written(tmp_path, GOOD)
    (experiment,) = load(file)
    assert [p.name for p in lay_out(experiment).model.parameters][-1] == "squareness yz"
    assert check(experiment).verdict.deficiency == 0
    file, _ = written(tmp_path, GOOD, ", options: {scales: false}")
    assert len(lay_out(load(file)[0]).model.parameters) == 3


def test_an_installed_entry_point(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file, module = written(tmp_path, GOOD)
    load(file)
    entry = importlib.metadata.EntryPoint("straight", f"{module}:build", custom.GROUP)

    def entry_points(group: str) -> Any:
        assert group == custom.GROUP
        return importlib.metadata.EntryPoints([entry])

    monkeypatch.setattr(importlib.metadata, "entry_points", entry_points)
    file.write_text(EXPERIMENT.replace("MODEL", "straight"), encoding="utf-8")
    assert check(load(file)[0]).verdict.deficiency == 0
    file.write_text(EXPERIMENT.replace("MODEL", "straigth"), encoding="utf-8")
    assert wording.NO_ENTRY_POINT in refusal(file) and wording.DID_YOU_MEAN in refusal(file)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("import numpy as np", "import numpy as", "cannot be imported: SyntaxError"),
        ("def build(", "def built(", 'has no "build"; did you mean "built"?'),
        (
            "    return Straight(",
            "    raise SystemExit('no')\n    return Straight(",
            "SystemExit: no",
        ),
        (
            "    return Straight(",
            "    return (1 / 0) or Straight(",
            "ZeroDivisionError: division by zero (my_model",
        ),
        ("def build(lower, upper, scales=True)", "def build(lower)", "has failed: TypeError"),
        ("def reported(self)", "def report(self)", "has no reported"),
        ("dimension = 3", "dimension = 2", "dimension is 2, but machine.volume has 3"),
        (
            '"squareness xy", "squareness xz"',
            '"squareness xz", "squareness xz"',
            "names must differ",
        ),
        ('"rad", name', '"urad", name', 'the unit of "squareness xy" is "urad"'),
        ("name, span)", "name, 0.0)", "the effect of"),
        ("a) + p", "a) + p * np.nan", "not finite numbers"),
        (
            "a) + p",
            "a)[:3] + p[:3]",
            "in error, code of your own: returns the shape (3, 3); (7, 3) is needed",
        ),
        ("np.eye(len(names)))", "np.eye(2))", "one row for each name"),
    ],
)
def test_what_is_wrong_with_a_model_is_said(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert GOOD.count(old) == 1
    file, _ = written(tmp_path, GOOD.replace(old, new))
    line = refusal(file)
    assert words in line and "Traceback" not in line
    assert line.startswith("3:37: error_model.object: ")


def test_options_that_are_quantities_arrive_in_si_units(tmp_path: Path) -> None:
    source = GOOD.replace(
        "scales=True):", "scales=True, pitch=0.0):\n    assert pitch == 0.2, pitch"
    )
    assert source != GOOD
    file, _ = written(tmp_path, source, ", options: {pitch: 200 mm}")
    assert check(load(file)[0]).verdict.deficiency == 0


def test_options_that_the_function_does_not_know(tmp_path: Path) -> None:
    file, _ = written(tmp_path, GOOD, ", options: {scale: true}")
    line = refusal(file)
    assert ": error_model.options: " in line and "unexpected keyword argument" in line


def test_missing_modules_are_named(tmp_path: Path) -> None:
    file = tmp_path / "own.yaml"
    file.write_text(EXPERIMENT.replace("MODEL", "nobody_has_this.at_all:build"), encoding="utf-8")
    line = refusal(file)
    assert f"no module nobody_has_this.at_all is installed nor in {tmp_path}" in line
    file.write_text(EXPERIMENT.replace("MODEL", "nobody"), encoding="utf-8")
    assert wording.FOR_AN_OBJECT_OF_A_MODULE in refusal(file)


def test_the_file_of_a_module_is_found_without_running_it(tmp_path: Path) -> None:
    (tmp_path / "apart").mkdir()
    (tmp_path / "apart" / "own.py").write_text("raise SystemExit", encoding="utf-8")
    assert custom.module_source("apart.own:build", tmp_path) == tmp_path / "apart" / "own.py"
    assert custom.module_source("json.decoder:JSONDecoder", tmp_path) == Path(json.decoder.__file__)
    # A module without a file, one that is nowhere, and an entry point that nobody has.
    for name in ("sys:exit", "nobody_has_this:at_all", "json.nothing:here", "nobody"):
        for folder in (tmp_path, None):
            assert custom.module_source(name, folder) is None


def test_a_true_machine_of_a_users_own(tmp_path: Path) -> None:
    file, module = written(tmp_path, GOOD)
    text = file.read_text(encoding="utf-8").replace(
        f"{{kind: python, object: {module}:build}}", "{kind: kinematic}"
    )
    own = f"error_model: {{kind: python, object: {module}:build}}"
    file.write_text(text.replace("5 urad}}", f"5 urad}}, {own}}}"), encoding="utf-8")
    load(file)
    file.write_text(
        text.replace("5 urad}}", f"5 urad}}, {own.replace('build', 'buidl')}}}"), encoding="utf-8"
    )
    assert ": true_machine.error_model.object: " in refusal(file)


def test_priors_about_a_model_of_ones_own(tmp_path: Path) -> None:
    file, _ = written(tmp_path, GOOD)
    prior = "priors: [{parameter: squareness xz, standard_uncertainty: 1 urad}]\n"
    file.write_text(file.read_text(encoding="utf-8") + prior, encoding="utf-8")
    (experiment,) = load(file)
    assert [one.name for one in experiment.priors] == ["squareness xz"]
    file.write_text(
        file.read_text(encoding="utf-8").replace("squareness xz, s", "squarness xz, s"),
        encoding="utf-8",
    )
    assert wording.UNKNOWN_PARAMETER_DID_YOU_MEAN in refusal(file)
