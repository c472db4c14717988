"""The random part of a machine file in simulated readings, against rigid bodies and the draws of
many campaigns.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.montecarlo._reference import reference
from ballplate.montecarlo._replicates import BATCH, draw
from ballplate.montecarlo.experiments import trials, true_experiment
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.readings.simulated import exact_readings, noisy_readings, on_stated_machine
from numpy.typing import NDArray

from tests.extensions.machine_files.test_machine_files import MACHINE, TABLE, written
from tests.published.rigid_body import tip_error

Real = NDArray[np.float64]
CAMPAIGNS = 32 * BATCH
EXPERIMENT = """\
title: a random part
machine: {volume: {x: [0 mm, 1 m], y: [0 mm, 1 m], z: [0 mm, 1 m]}, repeatability: 0.1 um}
error_model: {kind: kinematic, arrangement: MB2, position_coefficients: 2, rotation_coefficients: 1}
true_machine: {kind: machine, file: m.yaml}
probes: {down: [0 mm, 0 mm, -50 mm], left: [-80 mm, 0 mm, 0 mm]}
artefacts:
  plate: {kind: grid, balls: [2, 2], size: [600 mm, 600 mm]}
  bar: {kind: two_spheres, length: 500 mm, role: length_standard}
positions:
  - {name: low, artefact: plate, plane: z, level: 100 mm, corner: {x: 100 mm, y: 100 mm}, probes: [down], repeats: 2}
  - {name: up, artefact: plate, plane: x, level: 500 mm, corner: {y: 200 mm, z: 200 mm}, probes: [left]}
  - {name: bar, artefact: bar, pose: {origin: [200 mm, 400 mm, 300 mm]}, probes: [down], repeats: 3}
calibration: [{kind: distances, artefact: bar, pairs: all, standard_uncertainty: 0.5 um}]
"""
# Standard deviations of the file; that of EYX changes along its axis.
APPROACH = {"dx_x": 2e-6, "dy_x": 0.0, "Ey_x": 2e-6}
OF_TABLE = [-0.1, 0.9, 1.8], [0.5e-6, 0.75e-6, 1.0e-6]
SQUARENESS, STRETCH, PROBING, NOISE = 1e-6, 1.1e-6, 1e-6, 1e-7


@pytest.fixture
def drawn(tmp_path: Path) -> Experiment:
    written(tmp_path)
    path = tmp_path / "e.yaml"
    path.write_text(EXPERIMENT, encoding="utf-8")
    return load(path)[0]


def expected(x: Real, p: Real, repeats: Any = 1) -> Real:
    """The covariance (3 m, 3 m) of readings at x (m, 3) with probe offsets p (m, 3): of rigid
    bodies, and of the readings' noise.
    """
    chain = ARRANGEMENTS["MH2"]
    sides = [[*chain.probe_side], [*chain.workpiece_side]]
    own, lasting = [], []
    for place, offset in zip(x - [0.0, 0.1, 0.0], p, strict=True):

        def moved(name: str, size: float, place: Real = place, offset: Real = offset) -> Real:
            return tip_error(sides, place, offset, {name: size}) - tip_error(
                sides, place, offset, {}
            )

        sizes = APPROACH | {"dy_x": float(np.interp(place[0], *OF_TABLE))}
        root = np.array([moved(*size) for size in sizes.items()])
        own.append(root.T @ root + (PROBING**2 + NOISE**2) * np.eye(3))
        lasting.append(np.array([moved("b1", SQUARENESS), [STRETCH * place[0], 0.0, 0.0]]).T)
    covariance = np.einsum("ail,bjl->aibj", lasting, lasting)
    every = np.arange(len(x))
    covariance[every, :, every] += np.array(own) / np.reshape(repeats, (-1, 1, 1))
    return np.asarray(covariance.reshape(3 * len(x), -1))


def many_campaigns(experiment: Experiment) -> tuple[Real, Real, Real]:
    """Displacements (n, m, d) of simulated readings, and the readings and offsets (m, d)."""
    design = bp.lay_out(experiment)
    on_truth, truth = on_stated_machine(experiment, design)
    readings, exact = exact_readings(on_truth, truth)
    generator = np.random.default_rng(20261122)
    samples = [noisy_readings(on_truth, truth, generator)[1] - exact for _ in range(CAMPAIGNS)]
    return np.array(samples), exact, design.probes.offsets[readings.probe]


def in_standard_errors(samples: Real, covariance: Real) -> float:
    """The largest difference of the covariance of samples (n, m) from the expected one."""
    spread = np.diag(covariance)
    error = np.sqrt((np.outer(spread, spread) + covariance**2) / len(samples))
    return float((np.abs(np.cov(samples.T) - covariance) / error).max())


def test_simulated_readings_scatter_as_stated(drawn: Experiment) -> None:
    samples, x, p = many_campaigns(drawn)
    assert in_standard_errors(samples.reshape(CAMPAIGNS, -1), expected(x, p)) < 5.0


def test_replicates_scatter_as_stated(drawn: Experiment) -> None:
    """Repeats of the bar are averaged, those of the plate are readings of their own."""
    shared = reference(*true_experiment(drawn))
    samples = np.concatenate([draw(shared, 4, batch).moved for batch in range(32)])
    readings = shared.design.readings.select(shared.order)
    assert {1, 3} == set(readings.repeats.tolist())
    p = shared.design.probes.offsets[readings.probe]
    covariance = expected(shared.exact[shared.order], p, readings.repeats)
    samples = samples.swapaxes(1, 2).reshape(CAMPAIGNS, -1)
    assert in_standard_errors(samples, covariance) < 5.0


def test_any_number_of_workers_draws_the_same(drawn: Experiment) -> None:
    one, two = (trials(drawn, 600, 5, workers=count).outcome for count in (1, 2))
    # Undetermined numbers are NaN, which differ from themselves.
    assert repr(one) == repr(two)
    assert one and not one.failed
    other = trials(drawn.with_({"true_machine.random_part": "omitted"}), 600, 5).outcome
    assert other and other.misfit.noise_free == one.misfit.noise_free
    # S^2 is in squares of the noise alone.
    expected, found = other.misfit.degrees_of_freedom + other.misfit.noise_free, other.misfit.mean
    assert abs(found.value - expected) < 5.0 * found.error
    assert one.misfit.mean.value > 5.0 * expected


def test_without_it_readings_have_noise_alone(drawn: Experiment, tmp_path: Path) -> None:
    """As with a file that states no random part; nothing else is drawn otherwise."""
    machine = MACHINE
    (doubt,) = [one for one in drawn.doubts if "random part" in one]
    assert "(EXX, EYX, EBX, EB0Z, thermal x, probing)" in doubt
    omitted = drawn.with_({"true_machine.random_part": "omitted"})
    assert not any("random part" in one for one in omitted.doubts)
    with_it, without = (bp.simulate(one, seed=3) for one in (drawn, omitted))
    assert (with_it["x_mm"] != without["x_mm"]).all()
    exact = [bp.simulate(one, exact=True) for one in (drawn, omitted)]
    assert exact[0].equals(exact[1])
    for word in (
        "bandwidth: 6 um, sigmas: 3, ",
        "  EBX: {bandwidth: 4 urad}\n",
        ", sigmas: 2",
        ", bandwidth: 2 urad",
        ", standard_uncertainty: 0.1 K",
        "probing: 1 um\n",
    ):
        assert word in machine
        machine = machine.replace(word, "")
    table = TABLE.replace(",EYX_bandwidth_nm", "")
    for size in (",1500", ",1000", ",2000"):
        table = table.replace(size, "")
    written(tmp_path, machine, table)
    bare = load(tmp_path / "e.yaml")[0]
    assert bare.doubts == omitted.doubts
    assert bp.simulate(bare, seed=3).equals(without)


def test_in_a_plane_it_is_that_at_the_level(drawn: Experiment, tmp_path: Path) -> None:
    path = tmp_path / "plane.yaml"
    path.write_text(
        "title: a plane\n"
        "machine: {volume: {x: [0 mm, 1 m], y: [0 mm, 1 m]}, repeatability: 0.1 um}\n"
        "error_model: {kind: kinematic, arrangement: MB2, position_coefficients: 2,"
        " rotation_coefficients: 1}\n"
        "true_machine: {kind: machine, file: m.yaml, level: 300 mm}\n"
        "probes: {down: [20 mm, 0 mm]}\n"
        "artefacts: {plate: {kind: grid, balls: [2, 2], size: [600 mm, 600 mm]}}\n"
        "positions: [{name: low, corner: {x: 100 mm, y: 100 mm}}]\n",
        encoding="utf-8",
    )
    (plane,) = load(path)
    samples, x, p = many_campaigns(plane)
    every = np.ones(len(x))
    covariance = expected(np.column_stack([x, 0.3 * every]), np.column_stack([p, 0.0 * every]))
    inside = (3 * np.arange(len(x))[:, None] + [0, 1]).ravel()
    covariance = covariance[np.ix_(inside, inside)]
    assert in_standard_errors(samples.reshape(CAMPAIGNS, -1), covariance) < 5.0
