"""What `fit` tells to adjust, against lines of the corrected machine (US 4,437,151)."""

from __future__ import annotations

import re
from itertools import combinations

import ballplate as bp
import numpy as np
import pytest

from tests.extensions.certificates.campaigns import IN_SPACE

NAMES = ("scale x", "scale y", "scale z", "C0Y", "B0Z", "A0Z")
TRUE = (12e-6, -8e-6, 15e-6, 20e-6, -25e-6, 10e-6)
ARCSECOND = np.pi / 180.0 / 3600.0


def test_scales_and_angles_are_those_of_the_corrected_machine() -> None:
    values = {
        name: f"{1e6 * value!r} {'ppm' if k < 3 else 'urad'}"
        for k, (name, value) in enumerate(zip(NAMES, TRUE, strict=True))
    }
    experiment = bp.experiment(
        {
            **IN_SPACE,
            "error_model": {"kind": "metric"},
            "true_machine": {"kind": "coefficients", "values": values},
            "sigma": "given",
        }
    )
    fitted = bp.fit(experiment, bp.simulate(experiment, exact=True))
    ends = np.concatenate([np.zeros((1, 3)), 0.4 * np.eye(3)])
    places = fitted.correct(ends).points
    lines = places[1:] - places[0]
    sizes = np.linalg.norm(lines, axis=1)
    expected = {f"scale {axis}": sizes[k] / 0.4 - 1.0 for k, axis in enumerate("xyz")}
    for i, j in combinations(range(3), 2):
        angle = np.arccos(lines[i] @ lines[j] / (sizes[i] * sizes[j]))
        expected[f"angle {'xyz'[i]}{'xyz'[j]}"] = angle - np.pi / 2
    true = np.array(TRUE) * (1.0, 1.0, 1.0, 1.0, -1.0, 1.0)
    assert list(expected.values()) == pytest.approx(true.tolist(), abs=2e-9)
    assert {one.name: one.value for one in fitted.adjustments} == pytest.approx(expected, abs=2e-9)
    printed = str(fitted).split("\nadjustment")[1].splitlines()
    for one, name in zip(fitted.adjustments, NAMES, strict=True):
        unit, factor = ("µm/m", 1e-6) if name.startswith("scale") else ("arcsec", ARCSECOND)
        line = next(line for line in printed if line.startswith(one.what + "  "))
        shown = re.search(rf"(-?[\d.]+) +([\d.]+) +([\d.]+) +{unit}", line)
        assert shown is not None, line
        figures = (one.value, one.standard_uncertainty, one.expanded_uncertainty)
        printed_figures = [factor * float(part) for part in shown.groups()]
        assert printed_figures == pytest.approx(figures, rel=1e-3)
        assert one.words in line
