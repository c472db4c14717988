"""Sweeps of experiments whose certificates are functions in Python."""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.extensions.sweeps.fingerprint import fingerprint
from ballplate.simulator.experiment.loading import load

MODULE = """
import numpy as np


class Distance:
    unit = "m"

    def __init__(self, names, one, other):
        self.names = ((one, other),)
        self.ends = names.index(one), names.index(other)

    def values(self, balls):
        along = balls[self.ends[0]] - balls[self.ends[1]]
        return np.array([np.linalg.norm(along)])

    def derivatives(self, balls):
        along = balls[self.ends[0]] - balls[self.ends[1]]
        result = np.zeros((1, *balls.shape))
        result[0, self.ends[0]] = along / np.linalg.norm(along)
        result[0, self.ends[1]] = -along / np.linalg.norm(along)
        return result


def build(names, balls, one, other):
    return Distance(names, one, other)
"""
ITEM = """  - kind: python
    object: {module}:build
    options: {{one: r1c1, other: r3c3}}
    standard_uncertainty: 0.1 um
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    text = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
    text = text.replace("balls: [5, 5]", "balls: [3, 3]").replace(
        "coefficients: 5", "coefficients: 3"
    )
    # Two modules of one name, in different folders, are refused within one process.
    module = f"lengths_of_{tmp_path.name}"
    text = text.replace("calibration:\n", f"calibration:\n{ITEM.format(module=module)}")
    (tmp_path / "plate.yaml").write_text(text, encoding="utf-8")
    (tmp_path / f"{module}.py").write_text(MODULE, encoding="utf-8")
    return tmp_path


def test_keys_tell_what_the_functions_are(folder: Path) -> None:
    def key() -> str:
        return fingerprint(load(folder / "plate.yaml")[0])

    text, keys = (folder / "plate.yaml").read_text(encoding="utf-8"), [key()]
    (folder / "plate.yaml").write_text(text.replace("other: r3c3", "other: r3c2"), encoding="utf-8")
    keys.append(key())
    (folder / "plate.yaml").write_text(text, encoding="utf-8")
    assert key() == keys[0]
    next(folder.glob("lengths_of_*.py")).write_text(f"{MODULE}\n# changed\n", encoding="utf-8")
    keys.append(key())
    assert len(set(keys)) == 3
