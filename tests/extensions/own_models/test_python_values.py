"""Certified functions of a user's own: in every command."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.diagnosis.redundancy import reliability
from ballplate.simulator.design.observations.joint_values import JointValues
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.named_files import named_by
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.trust import UNKNOWN
from scipy.stats import norm

from tests.observations import wording
from tests.observations.test_joint_values import agree, problem, stacked, written
from tests.reference import dense

TOP = Path(__file__).parents[3]
SIDES = {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.2 um"}
ITEM = {
    "kind": "python",
    "object": "diagonals:build",
    "options": {
        "pairs": [[["r1c1", "r3c3"], ["r1c3", "r3c1"]], [["r1c1", "r2c2"], ["r2c2", "r3c3"]]]
    },
    "standard_uncertainty": "0.05 um",
}
NAMES = [("r1c1-r3c3", "r1c3-r3c1"), ("r1c1-r2c2", "r2c2-r3c3")]
# Indices of the balls of the longer and the other distance of each difference.
ENDS = np.array([[0, 8, 2, 6], [0, 4, 4, 8]])


def module() -> str:
    """Functions of a user's own."""
    return Path(__file__).with_name("diagonals.py").read_text(encoding="utf-8")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delitem(sys.modules, "diagonals", raising=False)
    (tmp_path / "diagonals.py").write_text(module(), encoding="utf-8")
    return tmp_path


def differences(of: dense.Problem, step: dense.Values) -> dense.Values:
    """Differences of two distances, written out."""
    places = dense.unpack(of, step)[0][ENDS]
    one, other = (dense.length(places[:, k] - places[:, k + 1]) for k in (0, 2))
    return np.asarray(one - other)


def test_uncertainties_are_those_of_a_dense_computation(folder: Path) -> None:
    experiment = written(folder, SIDES, ITEM)
    of = problem(written(folder, SIDES))
    spread = dense.spread(stacked(of, differences, 2e7 * np.eye(2)))
    agree(experiment, of, spread, 1e-9)
    without = dense.standard_uncertainties(of, symbols=["U1"])["U1"].mean()
    assert without > 1.001 * dense.standard_uncertainties(of, spread, symbols=["U1"])["U1"].mean()


def test_a_bias_is_that_of_the_hat_matrix(folder: Path) -> None:
    of = problem(written(folder, SIDES))
    whole = stacked(of, differences, 2e7 * np.eye(2))
    taken = (np.linalg.qr(whole / np.linalg.norm(whole, axis=0))[0][-2:] ** 2).sum(axis=1)
    limit = norm.isf(0.0005) + norm.isf(0.2)
    result = reliability(written(folder, SIDES, ITEM), sigma="given").to_dict()
    mine = [one for one in result["observations_by_name"] if one["kind"] == "certified value"]
    assert [one["name"] for one in mine] == [f"{b} of {a}" for a, b in NAMES]
    for one, share in zip(mine, taken, strict=True):
        expected = limit * 5e-8 / np.sqrt(1.0 - share)
        assert one["minimal_detectable"] == pytest.approx(expected, rel=1e-4)


def test_every_command_knows_it(folder: Path) -> None:
    experiment = written(folder, SIDES, ITEM)
    assert bp.run(experiment, trials=200).to_dict()["rank_deficiency"] == 0
    stated = bp.certificate(experiment)
    mine = stated[stated["item"] == "calibration[1]"]
    assert list(zip(mine["first"], mine["second"], strict=True)) == NAMES
    fitted = bp.fit(experiment, bp.simulate(experiment), certificate=stated)
    assert fitted.converged
    assert {path.name for path in named_by(folder / "e.yaml")} == {"diagonals.py"}


def test_modules_are_refused_where_they_are_not_allowed(folder: Path) -> None:
    written(folder, SIDES, ITEM)
    (folder / "diagonals.py").write_text("raise SystemExit('was run')", encoding="utf-8")
    with pytest.raises(ExperimentError, match=wording.IS_CODE_IN_PYTHON):
        load(folder / "e.yaml", trust=UNKNOWN)


CHANGED: list[tuple[str, str, str]] = [
    ('unit = "m"', 'unit = "mm"', 'the unit is "mm"; known: m, rad, 1'),
    ("def derivatives", "def slopes", "has no derivatives; add them"),
    ("return length[:, 0] - length[:, 1]", "return length", "returns the shape"),
]


@pytest.mark.parametrize(("old", "new", "words"), CHANGED)
def test_wrong_functions_are_refused(folder: Path, old: str, new: str, words: str) -> None:
    text = module()
    assert old in text
    (folder / "diagonals.py").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ExperimentError, match=re.escape(words)):
        written(folder, SIDES, ITEM)


def test_values_come_from_a_list_or_a_file(folder: Path) -> None:
    of = problem(written(folder, SIDES))
    drawn = differences(of, np.zeros(of.parameters))
    texts = [f"{value + 1e-6!r} m" for value in drawn.tolist()]
    one = written(folder, SIDES, ITEM | {"values": texts})
    rows = ["first,second,value_mm,standard_uncertainty_um"]
    rows += [
        f"{a},{b},{1e3 * (v + 1e-6)!r},0.05"
        for (a, b), v in zip(NAMES, drawn.tolist(), strict=True)
    ]
    (folder / "v.csv").write_text("\n".join(rows), encoding="utf-8")
    of_file: dict[str, Any] = {k: v for k, v in ITEM.items() if k != "standard_uncertainty"}
    two = written(folder, SIDES, of_file | {"values": "v.csv"})
    for experiment in (one, two):
        given = lay_out(experiment).of(JointValues)
        np.testing.assert_allclose(given.value, drawn + 1e-6, rtol=0, atol=1e-15)
        np.testing.assert_allclose(given.uncertainty, 5e-8, rtol=1e-12)
