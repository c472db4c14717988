"""Re-indexing of an articulating head against readings whose noise is correlated, and the offsets
that its angles make.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate.results.prediction import predict
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import written_in_python
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError

from tests.reference import dense
from tests.reference.small_quickstart import small_sections

QUICKSTART: dict[str, Any] = yaml.safe_load(Path("designs/quickstart.yaml").read_text("utf-8"))
ANGLES: dict[str, Any] = {
    "down": {"A": "0 deg"},
    "right": {"A": "90 deg", "B": "90 deg"},
    "left": {"A": "90 deg", "B": "-90 deg"},
    "back": {"A": "90 deg", "B": "180 deg"},
    "front": {"A": "90 deg", "B": "0 deg"},
}
U, SIGMA = 5e-7, 2e-7
REINDEXED = [{"kind": "re-indexing", "standard_uncertainty": "0.5 um"}]


def small(**changes: Any) -> Experiment:
    """The quickstart with few balls and coefficients, its tips those of a head."""
    head = {"head": {"tip": ["0 mm", "0 mm", "-50 mm"]}, "probes": ANGLES}
    return written_in_python(small_sections(**head | changes), Path())


def test_a_head_makes_the_offsets_of_a_star() -> None:
    """A stylus that points down is tilted towards -y by A, and turned about z by B."""
    made = small().probes
    for name, stated in QUICKSTART["probes"].items():
        expected = [float(text.removesuffix(" mm")) / 1e3 for text in stated]
        np.testing.assert_array_equal(made[name].offset, expected)


def test_an_offset_of_any_angles_is_that_of_two_turns_one_after_the_other() -> None:
    tip, centre = np.array([0.01, -0.02, -0.15]), np.array([-0.001, -0.002, -0.08])
    a, b = np.radians(37.5), np.radians(-112.5)
    # Tilted first, in the plane of y and z, then swept about z.
    y, z = tip[1] * np.cos(a) + tip[2] * np.sin(a), tip[2] * np.cos(a) - tip[1] * np.sin(a)
    x, y = tip[0] * np.cos(b) - y * np.sin(b), tip[0] * np.sin(b) + y * np.cos(b)
    head = {"centre": [f"{v!r} m" for v in centre.tolist()]}
    own = {"A": "37.5 deg", "B": "-112.5 deg", "tip": [f"{v!r} m" for v in tip.tolist()]}
    head = {"tip": ["0 mm", "0 mm", "-50 mm"], **head}
    plate = {"kind": "grid", "balls": [3, 3], "size": ["600 mm", "600 mm"]}
    made = small(head=head, probes={**ANGLES, "other": own}, artefacts={"plate": plate})
    found = made.probes["other"].offset
    np.testing.assert_allclose(found, centre + [x, y, z], rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"head": {}}, "has no tip"),
        ({"probes": {**ANGLES, "down": {"B": "0 deg"}}}, 'needs either "offset" or the angle "A"'),
        (
            {"influences": [{"kind": "re-indexing", "probes": ["dwon"]}]},
            'unknown probe "dwon"; did you mean "down"',
        ),
        (
            {"influences": REINDEXED + REINDEXED},
            "re-indexing of down in z low: x is stated by two of them",
        ),
        (
            {"influences": [{"kind": "re-indexing", "standard_uncertainty": "-1 um"}]},
            "is below zero",
        ),
    ],
)
def test_what_is_wrong_is_told(changes: dict[str, Any], expected: str) -> None:
    with pytest.raises(ExperimentError, match=expected):
        lay_out(small(**changes))


def whitening(design: Design) -> np.ndarray:
    """The inverse root of the covariance of all readings' co-ordinates, in standard deviations:
    readings of one position and probe share an error of U along each axis.
    """
    readings = design.readings
    place = readings.position * len(design.probes.names) + readings.probe
    same = (place[:, None] == place).astype(float)
    covariance = np.eye(3 * len(readings)) + (U / SIGMA) ** 2 * np.kron(same, np.eye(3))
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))


def test_uncertainties_are_those_of_correlated_noise() -> None:
    experiment = small(influences=REINDEXED)
    design = lay_out(experiment)
    plain = lay_out(small())
    problem, white = dense.planned(plain, 3, 3), whitening(plain)

    def rows(step: np.ndarray) -> np.ndarray:
        found = dense.residuals(problem, step)
        count = 3 * len(plain.readings)
        return np.concatenate([white @ found[:count], found[count:]])

    spread = dense.spread(dense.jacobian(rows, problem.parameters))
    expected = dense.standard_uncertainties(problem, spread)
    got = predict(experiment).quantities
    for symbol in ("U1", "U4", "U5", "U6"):
        assert got[symbol].average == pytest.approx(float(expected[symbol].mean()), rel=1e-6)
        assert got[symbol].maximum == pytest.approx(float(expected[symbol].max()), rel=1e-6)
    # Shifts are estimated and known by as much; they change no degrees of freedom.
    assert design.observation_count - design.parameter_count == (
        plain.observation_count - plain.parameter_count
    )


def test_one_probe_a_position_hides_shifts_in_poses() -> None:
    """Where each position has one probe, no distance between balls notices; where it has two, U6
    grows.
    """

    def with_one(**changes: Any) -> float:
        places = [{**one, "probes": one["probes"][:1]} for one in QUICKSTART["positions"]]
        return predict(small(positions=places, **changes)).quantities["U5"].average

    assert with_one(influences=REINDEXED) == pytest.approx(with_one(), rel=1e-6)
    grown = predict(small(influences=REINDEXED)).quantities["U6"].average
    assert grown > 1.02 * predict(small()).quantities["U6"].average
