"""Certified functions of a user's own: the example of the documentation, in every command."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.gross_errors.redundancy import reliability
from ballplate.simulator.design.observations.joint_values import JointValues
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.load import load
from ballplate.simulator.inputs.messages import ExperimentError
from scipy.stats import norm

from tests.observations.test_joint_values import BALLS, Real, agree, problem, stacked, written
from tests.reference import dense

TOP = Path(__file__).parents[2]
SIDES = {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.2 um"}
ITEM = {
    "kind": "python",
    "object": "straightness:build",
    "options": {"lines": [["r1c1", "r1c2", "r1c3"], ["r1c1", "r2c1", "r3c1"]]},
    "standard_uncertainty": "0.05 um",
}
# Indices of the balls of each line: the two ends, then that between them.
LINES = np.array([[0, 2, 1], [0, 6, 3]])


def module() -> str:
    """The module that the documentation shows."""
    page = (TOP / "docs" / "how-to" / "certificates.md").read_text(encoding="utf-8")
    (found,) = re.findall(r"```python\n(# straightness\.py\n.*?)```", page, re.DOTALL)
    return str(found)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    import sys

    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delitem(sys.modules, "straightness", raising=False)
    (tmp_path / "straightness.py").write_text(module(), encoding="utf-8")
    return tmp_path


def areas(of: dense.Problem, step: dense.Values) -> dense.Values:
    """(|AM|^2 + |BM|^2) / |AB|, of the ends A, B and the middle M, written out."""
    balls = dense.unpack(of, step)[0]
    first, last, middle = (balls[LINES[:, k]] for k in range(3))
    near, far = ((middle - one) for one in (first, last))
    return np.asarray(
        ((near**2).sum(axis=1) + (far**2).sum(axis=1)) / dense.length(last - first)
    )


def test_uncertainties_are_those_of_a_dense_computation(folder: Path) -> None:
    experiment = written(folder, SIDES, ITEM)
    of = problem(written(folder, SIDES))
    spread = dense.spread(stacked(of, areas, 2e7 * np.eye(2)))
    agree(experiment, of, spread, 1e-9)
    without = dense.standard_uncertainties(of)["U1"].mean()
    assert without > 1.001 * dense.standard_uncertainties(of, spread)["U1"].mean()


def test_a_bias_is_that_of_the_hat_matrix(folder: Path) -> None:
    of = problem(written(folder, SIDES))
    whole = stacked(of, areas, 2e7 * np.eye(2))
    taken = (np.linalg.qr(whole / np.linalg.norm(whole, axis=0))[0][-2:] ** 2).sum(axis=1)
    limit = norm.isf(0.0005) + norm.isf(0.2)
    result = reliability(written(folder, SIDES, ITEM), sigma="given").to_dict()
    mine = [one for one in result["observations_by_name"] if one["kind"] == "certified value"]
    assert [one["name"] for one in mine] == ["offset of r1c2", "offset of r2c1"]
    for one, share in zip(mine, taken, strict=True):
        expected = limit * 5e-8 / np.sqrt(1.0 - share)
        assert one["minimal_detectable"] == pytest.approx(expected, rel=1e-4)


def test_every_command_knows_it(folder: Path) -> None:
    experiment = written(folder, SIDES, ITEM, true_machine={"kind": "zero"})
    assert bp.run(experiment, trials=500).to_dict()["rank_deficiency"] == 0
    found = bp.simulate(experiment, certificate=True)
    fitted = bp.fit(found.experiment, found.readings) if hasattr(found, "experiment") else None
    assert fitted is None or fitted.converged
    files = {path.name for path in named(folder)}
    assert files == {"straightness.py"}


def named(folder: Path) -> list[Path]:
    from ballplate.sweeps.named_files import named_by

    return named_by(folder / "e.yaml")


def test_modules_are_refused_where_they_are_not_allowed(folder: Path) -> None:
    written(folder, SIDES, ITEM)
    (folder / "straightness.py").write_text("raise SystemExit('was run')", encoding="utf-8")
    with pytest.raises(ExperimentError, match="a calibration in Python is code"):
        load(folder / "e.yaml", with_modules=False)


CHANGED: list[tuple[str, str, str]] = [
    ("return 2.0 *", "return 1.9 *", "is not the derivative of values"),
    ('unit = "m"', 'unit = "mm"', 'the unit is "mm"; known: m, rad, 1'),
    ("def derivatives", "def slopes", "has no derivatives; add them"),
    ("return (near", "return balls[0, :1] + 0.0 * (near", "returns the shape"),
]


@pytest.mark.parametrize(("old", "new", "words"), CHANGED)
def test_wrong_functions_are_refused(folder: Path, old: str, new: str, words: str) -> None:
    text = module()
    if old not in text:
        old, new = OTHERS[old]
    assert old in text
    (folder / "straightness.py").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ExperimentError, match=re.escape(words)):
        written(folder, SIDES, ITEM)


OTHERS: dict[str, tuple[str, str]] = {}

FRAME = """
import numpy as np

class Height:
    names = (("r1c1", "height"),)
    unit = "m"
    def values(self, balls):
        return balls[:1, 2] + 1.0
    def derivatives(self, balls):
        found = np.zeros((1, *balls.shape))
        found[0, 0, 2] = 1.0
        return found

def build(names, balls):
    return Height()
"""


def test_what_depends_on_the_frame_is_refused(folder: Path) -> None:
    (folder / "straightness.py").write_text(FRAME, encoding="utf-8")
    item = {key: value for key, value in ITEM.items() if key != "options"}
    with pytest.raises(ExperimentError, match="depends on where the frame"):
        written(folder, SIDES, item)


def test_values_come_from_a_list_or_a_file(folder: Path) -> None:
    drawn = areas(problem(written(folder, SIDES)), np.zeros(problem(written(folder, SIDES)).parameters))
    texts = [f"{value + 1e-6!r} m" for value in drawn.tolist()]
    one = written(folder, SIDES, ITEM | {"values": texts})
    rows = ["first,second,value_mm,standard_uncertainty_um"]
    rows += [f"{ball},offset,{1e3 * (v + 1e-6)!r},0.05" for ball, v in zip(["r1c2", "r2c1"], drawn.tolist(), strict=True)]
    (folder / "v.csv").write_text("\n".join(rows), encoding="utf-8")
    of_file: dict[str, Any] = {k: v for k, v in ITEM.items() if k != "standard_uncertainty"}
    two = written(folder, SIDES, of_file | {"values": "v.csv"})
    for experiment in (one, two):
        given = lay_out(experiment).of(JointValues)
        np.testing.assert_allclose(given.value, drawn + 1e-6, rtol=1e-12)
        np.testing.assert_allclose(given.uncertainty, 5e-8, rtol=1e-12)
