"""Co-ordinates in a plate's own axes: against a dense computation, by simulation, and from several
frames.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from ballplate.results.fits import Fit
from ballplate.results.fitting import fit
from ballplate.results.plates import PlateAxes
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.coordinates import CalibratedCoordinates
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.protocol import Array
from ballplate.simulator.readings.observed_readings import ObservedReadings
from ballplate.simulator.readings.simulated import simulated_readings
from numpy.typing import NDArray

ANGLES = Path("designs/hocken_borchardt/angles.yaml")
DISTANCES = [{"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.3 um"}]
COORDINATES = [
    {"kind": "coordinates", "balls": ["r1c2", "r3c1", "r4c4"], "standard_uncertainty": "0.5 um"}
]


def experiment(tmp_path: Path, variant: str = "three positions", **changes: object) -> Experiment:
    """A variant of the shipped design with other sections."""
    text = yaml.safe_load(ANGLES.read_text())
    text |= text.pop("variants")[variant] | changes
    path = tmp_path / "plate.yaml"
    path.write_text(yaml.safe_dump(text, sort_keys=False))
    return load(path)[0]


def observed(drawn: Experiment, seed: int) -> ObservedReadings:
    given = simulated_readings(drawn, seed)
    return ObservedReadings(replace(given.design, readings=given.readings), given.x, (), ())


def dense_uncertainties(design: Design, x: Array, found: Fit, axes: PlateAxes) -> Array:
    """Standard uncertainties (n, 2) by complex steps and one pseudo-inverse, written down from the
    definitions.
    """
    state, held = found.solution.state, design.positions.held
    n = len(design.balls.places)
    start = np.concatenate([state.balls.ravel(), np.zeros((~held).sum()), state.a])

    def parts(p: NDArray[np.complex128]) -> tuple[NDArray[np.complex128], ...]:
        poses = np.zeros(held.shape, complex)
        poses[~held] = p[2 * n : len(p) - 2]
        return p[: 2 * n].reshape(n, 2), poses, p[-2:]

    def residuals(p: NDArray[np.complex128]) -> NDArray[np.complex128]:
        balls, poses, (alpha, gamma) = parts(p)
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        turns = np.array([[c, -s], [s, c]]).transpose(2, 0, 1) @ state.rotations
        r = design.readings
        true = (turns[r.position] @ balls[r.ball][:, :, None])[:, :, 0] + (
            state.origins + poses[:, :2]
        )[r.position]
        corrected = x @ np.array([[1.0 / (1.0 + gamma), 0.0], [alpha / (1.0 + gamma), 1.0]])
        d, k = design.of(CalibratedDistances), design.of(CalibratedCoordinates)
        between = balls[d.first] - balls[d.second]
        return np.concatenate(
            [
                ((corrected - true) / design.machine.repeatability).ravel(),
                (np.sqrt((between**2).sum(axis=1)) - d.value) / d.uncertainty,
                (balls[k.ball, k.axis] - k.value) / k.uncertainty,
            ]
        )

    def wanted(p: NDArray[np.complex128]) -> NDArray[np.complex128]:
        moved = parts(p)[0] - parts(p)[0][axes.origin]
        along = moved[axes.ball] * axes.sign
        along = along / np.sqrt((along**2).sum())
        if axes.axis == 1:
            along = np.array([along[1], -along[0]])
        return np.stack(
            [moved @ along, moved[:, 1] * along[0] - moved[:, 0] * along[1]], axis=1
        ).ravel()

    steps = start + 1e-30j * np.eye(len(start))
    jacobian = np.stack([residuals(p).imag / 1e-30 for p in steps], axis=1)
    function = np.stack([wanted(p).imag / 1e-30 for p in steps], axis=1)
    # Columns of one size, so that lengths and angles are told apart from rounding alike.
    size = np.sqrt((jacobian**2).sum(axis=0))
    root = (function / size) @ np.linalg.pinv(jacobian / size, rcond=1e-10)
    assert np.linalg.matrix_rank(jacobian / size, tol=1e-9) == len(start)
    np.testing.assert_allclose(
        wanted(start + 0j).real.reshape(n, 2), found.plates[0].coordinates, rtol=0, atol=1e-15
    )
    return np.asarray(found.sigma * np.sqrt((root**2).sum(axis=1)).reshape(n, 2))


@pytest.mark.parametrize("calibration", [[], DISTANCES, COORDINATES])
@pytest.mark.parametrize("axes", [{"origin": "r1c1", "x": "r1c4"}, {"origin": "r2c3", "y": "r1c2"}])
def test_uncertainties_are_those_of_a_dense_computation(
    tmp_path: Path, calibration: list[object], axes: dict[str, str]
) -> None:
    artefacts = {
        "plate": {"kind": "grid", "balls": [4, 4], "size": ["360 mm", "300 mm"], "axes": axes}
    }
    drawn = experiment(tmp_path, artefacts=artefacts, calibration=calibration)
    seen = observed(drawn, 5)
    found = fit(drawn, seen)
    assert found.verdict.deficiency == 0
    plate = found.plates[0]
    dense = dense_uncertainties(seen.design, seen.x, found, plate.axes)
    np.testing.assert_allclose(plate.standard_uncertainties, dense, rtol=1e-8, atol=1e-18)
    assert plate.axes.sign == (1.0 if "x" in axes else -1.0)
    assert plate.coordinates[plate.axes.ball, plate.axes.axis] * plate.axes.sign > 0
    exact = [(plate.axes.origin, 0), (plate.axes.origin, 1), (plate.axes.ball, 1 - plate.axes.axis)]
    assert all(plate.coordinates[i] == 0.0 == plate.standard_uncertainties[i] for i in exact)
    assert (plate.standard_uncertainties > 0).sum() == plate.standard_uncertainties.size - 3


def test_axes_do_not_depend_on_the_frame_of_the_estimate(tmp_path: Path) -> None:
    """Whichever position is held, and in which order balls are listed, the co-ordinates are the
    same.
    """
    drawn = experiment(tmp_path)
    turned = experiment(tmp_path, positions=yaml.safe_load(ANGLES.read_text())["positions"][2::-1])
    seen = observed(drawn, 3)
    swapped = replace(seen.design.readings, position=2 - seen.design.readings.position)
    there = fit(
        turned, ObservedReadings(replace(lay_out(turned), readings=swapped), seen.x, (), ())
    )
    here = fit(drawn, seen)
    assert np.abs(here.solution.state.balls - there.solution.state.balls).max() > 1e-7
    one, other = here.plates[0], there.plates[0]
    np.testing.assert_allclose(one.coordinates, other.coordinates, rtol=0, atol=1e-13)
    np.testing.assert_allclose(
        one.standard_uncertainties, other.standard_uncertainties, rtol=1e-5, atol=1e-18
    )


def test_what_is_undetermined_has_no_value(tmp_path: Path) -> None:
    drawn = experiment(tmp_path, "half a turn")
    found = fit(drawn, observed(drawn, 1))
    assert found.converged and found.verdict.deficiency == 2 and found.verdict.as_expected
    plate = found.plates[0]
    # The plate may stretch along x and shear: lengths along x are open, and the heights of the
    # first row are zero.
    assert np.isnan(plate.coordinates[:, 0]).sum() == 15 and plate.coordinates[0, 0] == 0.0
    assert np.isfinite(plate.coordinates[:4, 1]).all()
    np.testing.assert_array_equal(
        np.isnan(plate.coordinates), np.isnan(plate.standard_uncertainties)
    )
    without_value = {e.name for e in found.estimates if np.isnan(e.value)}
    assert without_value >= {"alpha", "gamma"}
