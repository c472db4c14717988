"""Fits of readings without any scatter, whose estimated sigma is zero or nothing but rounding."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.cli import main

from tests.reference.small_quickstart import small_sections

ACROSS = {"from": ["100 mm", "100 mm", "100 mm"], "to": ["600 mm", "100 mm", "100 mm"]}
TASK = ACROSS | {"name": "across", "probes": ["down", "right"], "target_uncertainty": "1 um"}
ZERO = {"kind": "zero"}
RANDOM = {"kind": "random", "position": "2 um", "rotation": "4 urad", "seed": 7}
PLANE = """
title: plane
machine: {volume: [1 m, 1 m], repeatability: 0.2 um}
error_model: {kind: metric}
true_machine: {kind: zero}
artefacts:
  plate: {kind: grid, balls: [3, 3], size: [600 mm, 600 mm]}
positions:
  - {name: first, pose: {origin: [100 mm, 100 mm]}}
  - {name: turned, pose: {origin: [700 mm, 100 mm], rotation: 90 deg}}
calibration:
  - {kind: distances, pairs: [[r1c1, r1c3]], standard_uncertainty: 0.1 um}
evaluation: {points: {random: 12, seed: 1}}
"""


def written(path: Path, truth: dict[str, Any], target: bool) -> Path:
    """The first example with a machine of a kind, and with or without a target and a task."""
    sections = small_sections(true_machine=truth)
    if target:
        sections["evaluation"]["tasks"] = [TASK]
    else:
        del sections["target_uncertainty"]
    path.write_text(yaml.safe_dump(sections), encoding="utf-8")
    return path


@pytest.mark.parametrize("truth", [ZERO, RANDOM], ids=["zero", "rounding"])
@pytest.mark.parametrize("target", [True, False], ids=["target", "none"])
def test_a_fit_without_scatter_says_so(
    truth: dict[str, Any], target: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, readings = written(tmp_path / "it.yaml", truth, target), tmp_path / "it.csv"
    assert main(["simulate", str(path), "--exact", "-o", str(readings)]) == 0
    capsys.readouterr()
    picture = tmp_path / "residuals.svg"
    assert main(["fit", str(path), str(readings), "--plot", str(picture)]) == 0
    said = capsys.readouterr()
    told = "sigma is zero within rounding, since the readings agree exactly with the model"
    assert told in said.err and "--sigma given" in said.err and picture.exists()
    start = said.out.index("largest residuals")
    assert [line.split()[-1] for line in said.out[start:].splitlines()[1:4]] == ["-"] * 3
    assert main(["fit", str(path), str(readings), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["sigma"] < 1e-7 and any(told in words for words in found["warnings"])
    assert (found["sigma"] == 0.0) is (truth == ZERO)
    assert {one["standard_uncertainties"] for one in found["largest_residuals"]} == {None}
    # No reading is the worst one.
    assert main(["validate", str(path), str(readings)]) == 0
    assert " nan" not in capsys.readouterr().out
    # With sigma as stated nothing of this is said, and uncertainties are those of the design.
    assert main(["fit", str(path), str(readings), "--sigma", "given", "--json"]) == 0
    given = json.loads(capsys.readouterr().out)
    assert not any("sigma is zero" in words for words in given["warnings"])
    assert all(one["standard_uncertainties"] is not None for one in given["largest_residuals"])
    planned = bp.run(bp.load(path)).to_dict()["quantities"]["U6"]
    for name in ("maximum", "average"):
        assert given["quantities"]["U6"][name] == pytest.approx(planned[name], rel=1e-4)
        expected = found["sigma"] * planned[name]
        assert found["quantities"]["U6"][name] == pytest.approx(expected, rel=1e-4, abs=1e-30)


def test_from_python(tmp_path: Path) -> None:
    experiment = bp.load(written(tmp_path / "it.yaml", ZERO, True))
    fit = bp.fit(experiment, bp.simulate(experiment, exact=True))
    assert fit.sigma == 0.0 and fit.without_scatter and "sigma 0" in repr(fit)
    assert not fit.covariance("machine").to_numpy().any()
    assert np.isnan(fit.correlation("machine").to_numpy()).all()
    assert fit.correct([[0.1, 0.2, 0.3]]).standard_uncertainties.tolist() == [[0.0] * 3]
    assert len(fit.to_frame()) and fit.plot() is not None
    noisy = bp.fit(experiment, bp.simulate(experiment))
    assert not noisy.without_scatter and not any("sigma is zero" in one for one in noisy.cautions)


@pytest.mark.parametrize("estimator", ["full", "distances", "cresto", "kruth", "reversal"])
def test_every_estimator_in_the_plane(
    estimator: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, readings = tmp_path / "it.yaml", tmp_path / "it.csv"
    path.write_text(PLANE, encoding="utf-8")
    assert main(["simulate", str(path), "--exact", "-o", str(readings)]) == 0
    for options in ([], ["--json"]):
        assert main(["fit", str(path), str(readings), "--estimator", estimator, *options]) == 0
        assert "nan" not in capsys.readouterr().out.lower().split()
