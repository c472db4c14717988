"""The readings of NBSIR 79-1752 through the general estimator."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analysis.study import Fit, fit
from simulator.experiment.load import load
from simulator.layout import lay_out
from simulator.readings import read_readings

FOLDER = Path("designs/hocken_borchardt")
INCH = 0.0254
# Computed co-ordinates of Table 1, in inches, with the misprint of point 8 (1.110020) put right. Point 5 comes out
# 7 microinches below the "true" y of 13.777777 that the table gives: the readings do not contain that value.
PUBLISHED = np.array(
    [
        (0.0, 0.0),
        (12.526471, 0.0),
        (3.141597, 2.674327),
        (0.132671, 11.989642),
        (12.026449, 13.777770),
        (6.936245, 7.216943),
        (12.137425, 9.873462),
        (1.111020, 3.762542),
        (9.735164, 3.164786),
    ]
)


def fitted(data: str, variant: str) -> Fit:
    experiment = {e.name: e for e in load(FOLDER / f"{data}.yaml")}[variant]
    return fit(experiment, read_readings(FOLDER / f"{data}-readings.csv", lay_out(experiment)))


def values(found: Fit) -> dict[str, float]:
    return {e.name: e.value * 1e6 for e in found.estimates}


def test_made_up_readings_with_scale() -> None:
    found = fitted("dummy", "with scale")
    estimates = values(found)
    assert estimates["alpha"] == pytest.approx(4.81, abs=0.005)
    assert estimates["first: rotation z"] == pytest.approx(-131.24, abs=0.005)
    assert estimates["gamma"] == pytest.approx(13.69, abs=0.005)
    assert found.solution.status == "converged"
    assert found.verdict.deficiency == 0


def test_made_up_readings_without_scale() -> None:
    estimates = values(fitted("dummy", "without scale"))
    assert estimates["alpha"] == pytest.approx(4.66, abs=0.005)
    assert estimates["first: rotation z"] == pytest.approx(-133.98, abs=0.005)


def test_made_up_plate_comes_out() -> None:
    """Distances between the estimated balls are those of the published co-ordinates, given to a microinch."""
    balls = fitted("dummy", "with scale").solution.state.balls / INCH
    i, j = np.triu_indices(len(PUBLISHED), 1)
    published = np.linalg.norm(PUBLISHED[i] - PUBLISHED[j], axis=1)
    np.testing.assert_allclose(np.linalg.norm(balls[i] - balls[j], axis=1), published, rtol=0, atol=2e-6)


@pytest.mark.parametrize("variant", ["with scale", "without scale"])
def test_real_readings(variant: str) -> None:
    found = fitted("real", variant)
    assert found.solution.status == "converged"
    assert found.verdict.deficiency == 0
    estimates = {e.name: e for e in found.estimates}
    assert all(np.isfinite(e.value) and e.standard_uncertainty > 0 for e in found.estimates)
    assert estimates["alpha"].unit == "rad"
    # The residuals are of some ten microinches, what such a machine repeated to in 1979.
    assert 5 < found.sigma < 20
