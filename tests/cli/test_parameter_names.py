"""What a parameter is called is the user's business: tables go by what it is."""

from __future__ import annotations

import json
from itertools import count
from pathlib import Path

import pytest
from ballplate.cli import main
from ballplate.results.study import fit
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.readings.reading_files import read_readings

NUMBER = count()

MODEL = """\
import numpy as np
from ballplate.models import Parameter, Reported


class Scales:
    dimension = 3
    parameters = tuple(
        Parameter(name, "1", name, "a scale", 1.0) for name in ("scale: x", "a: origin y", "z: origin high: rotation x")
    )

    def error(self, x, a, p):
        return x * a + p

    def jacobian(self, x, a, p):
        return x[:, :, None] * np.eye(3)

    def reported(self):
        return Reported(tuple(one.name for one in self.parameters), ("1",) * 3, np.eye(3))


def build(lower, upper):
    return Scales()
"""
EXPERIMENT = """\
title: names that look like others
machine: {{volume: [1 m, 1 m, 1 m], repeatability: 1 um}}
error_model: {{kind: python, object: "{module}:build"}}
probes: {{tip: [0 mm, 0 mm, 0 mm]}}
artefacts:
  plate:
    kind: balls
    coordinates: {{": origin x": [0 mm, 0 mm, 0 mm], b: [300 mm, 0 mm, 0 mm], c: [0 mm, 300 mm, 0 mm]}}
positions:
  - {{name: a, plane: z, level: 100 mm, corner: {{x: 0 mm, y: 0 mm}}}}
  - {{name: "z: origin high", plane: x, level: 300 mm, corner: {{y: 0 mm, z: 0 mm}}}}
  - {{name: "end: x", plane: y, level: 300 mm, corner: {{x: 300 mm, z: 0 mm}}}}
calibration:
  - {{kind: coordinates, standard_uncertainty: 1 um}}
"""


def test_the_table_of_a_fit_shows_machine_and_rotations_whatever_they_are_called(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    module = f"scales_of_its_own_{next(NUMBER)}"
    (tmp_path / f"{module}.py").write_text(MODEL)
    path, readings = tmp_path / "e.yaml", tmp_path / "r.csv"
    path.write_text(EXPERIMENT.format(module=module))
    assert main(["simulate", str(path), "-o", str(readings)]) == 0
    experiment = load(path)[0]
    found = fit(experiment, read_readings(readings, lay_out(experiment)))
    assert main(["fit", str(path), str(readings)]) == 0
    lines = capsys.readouterr().out.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("parameter "))
    end = next(i for i, line in enumerate(lines) if line.startswith("(origins of positions"))
    shown = [line[:40].split("  ")[0] for line in lines[start + 1 : end]]
    scales = ["scale: x", "a: origin y", "z: origin high: rotation x"]
    turns = [
        f"{name}: rotation {axis}" for name in ("a", "z: origin high", "end: x") for axis in "xyz"
    ]
    assert shown == scales + turns
    # Every parameter is in --json, those of the same name by their kinds.
    assert len(found.estimates) == 3 + 18 + 9
    assert main(["fit", str(path), str(readings), "--json"]) == 0
    estimates = json.loads(capsys.readouterr().out)["estimates"]
    assert len(estimates) == len(found.estimates)
    twice = {
        "a: origin y": ("machine", "origin"),
        "z: origin high: rotation x": ("machine", "rotation"),
    }
    for name, kinds in twice.items():
        assert name not in estimates and {f"{kind}: {name}" for kind in kinds} <= estimates.keys()
