"""Lengths that share readings, against dense computations and data sets drawn as they come about.

The dense reference has the full covariance of all lengths and its pseudo-inverse; ours goes by
positions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from ballplate.extensions.estimators.alternative_estimators import (
    AlternativeName,
    alternative_estimate,
)
from ballplate.extensions.estimators.length_equations import length_estimate
from ballplate.montecarlo.experiments import trials
from ballplate.results.prediction import predict
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.lengths import Lengths, length_whitening
from ballplate.simulator.design.observations.readings import expected_readings
from ballplate.simulator.design.parameters import shared_layout
from ballplate.simulator.design.state import State
from ballplate.simulator.estimation.covariance import spectrum
from ballplate.simulator.estimation.elimination import eliminate
from ballplate.simulator.estimation.gauss_newton import iterate, newton_step
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.geometry.motions import rotation_from_vector
from ballplate.simulator.machines.metric import SpatialMetricModel
from ballplate.simulator.machines.truth import true_machine
from ballplate.simulator.readings.simulated import exact_readings, on_true_machine
from ballplate.simulator.readings.true_artefacts import true_artefacts
from numpy.typing import NDArray

from tests.estimation.test_against_dense import compare, in_reference_basis
from tests.reference import dense
from tests.reference.designs import altered
from tests.reference.standards import POSES, bar, experiment, flat, spatial

Real = NDArray[np.float64]
Make = Callable[[Path], Experiment]

ALL = {"pairs": "all", "standard_uncertainty": "0.5 um"}
GROWING = {"pairs": "all", "standard_uncertainty": "0.2 um + L/200000"}
PROJECTED = GROWING | {"form": "projection"}
COARSE: dict[str, Any] = {"error_model": {"kind": "metric"}}


def consecutive(balls: int) -> dict[str, Any]:
    return {
        "pairs": [[f"b{k}", f"b{k + 1}"] for k in range(balls - 1)],
        "standard_uncertainty": "0.3 um",
    }


def some_of_it() -> list[dict[str, Any]]:
    """Positions in which different balls of a bar are read, more often than once, with one probe or
    two.
    """
    return [
        {"balls": ["b0", "b1", "b2"], "probes": ["down"], "repeats": 2},
        {"balls": ["b0", "b2", "b3"], "probes": ["down", "right"]},
        {"balls": ["b1", "b3"], "probes": ["down"], "repeats": 3},
        {"probes": ["right"]},
        {"probes": ["down"]},
    ]


def twice_certified() -> list[dict[str, Any]]:
    """Two certificates of one bar: of all its lengths, and of some again, one of these each time
    anew.
    """
    return [
        ALL,
        {"pairs": [["b0", "b1"], ["b1", "b3"]], "standard_uncertainty": "0.4 um"},
        {"pairs": [["b0", "b3"]], "standard_uncertainty": "0.8 um", "repeatability": "ignored"},
    ]


CASES: dict[str, Make] = {
    "three balls, projected": lambda folder: experiment(folder, bar(3), PROJECTED),
    "six balls, all pairs": lambda folder: experiment(folder, bar(6), GROWING),
    "plate, all pairs projected": lambda folder: experiment(folder, flat(3), PROJECTED),
    "plate, neighbours": lambda folder: experiment(
        folder, flat(3), {**GROWING, "pairs": "neighbours"}
    ),
    "six balls in space": lambda folder: experiment(folder, spatial(), GROWING),
    "some balls only": lambda folder: experiment(folder, bar(4), GROWING, some_of_it()),
    "two certificates": lambda folder: experiment(folder, bar(4), twice_certified(), some_of_it()),
}


@pytest.mark.parametrize("name", CASES)
def test_every_uncertainty_is_that_of_the_full_covariance(name: str, tmp_path: Path) -> None:
    assert_as_dense(lay_out(CASES[name](tmp_path)))


def assert_as_dense(design: Design) -> None:
    assert compare(design, nominal_state(design), dense.planned(design, 3, 2)) == 0
    assert len(design.once(length_whitening)) == np.linalg.matrix_rank(
        dense.length_covariance(design), 1e-21
    )


@pytest.mark.parametrize("name", ["three balls, projected", "six balls, all pairs"])
def test_away_from_the_drawing_with_errors_and_noise(name: str, tmp_path: Path) -> None:
    """Uncertainties, S^2 and the Newton step, of standards whose lengths are as consistent as in
    reality.
    """
    design = lay_out(CASES[name](tmp_path))
    random, nominal = np.random.default_rng(3), nominal_state(design)
    of_plate = np.zeros((len(design.balls.places), 1))
    of_plate[design.plate_balls] = 1.0
    turn = (
        1e-3
        * random.standard_normal((len(design.positions.origins), 3))
        * ~design.positions.held[:, 3:]
    )
    state = State(
        nominal.balls + 1e-5 * of_plate * random.standard_normal(nominal.balls.shape),
        rotation_from_vector(turn) @ nominal.rotations,
        nominal.origins
        + 1e-4 * random.standard_normal(nominal.origins.shape) * ~design.positions.held[:, :3],
        1e-5 * random.standard_normal(nominal.a.shape),
        nominal.probes,
        nominal.lengths,
    )
    scatter = random.standard_normal((len(design.readings), 3))
    x = expected_readings(design, nominal, design.readings) + 1e-6 * scatter
    error = random.standard_normal(len(np.unique(design.of(Lengths).certificate)))[
        design.of(Lengths).certificate
    ]
    value = design.of(Lengths).value + design.of(Lengths).uncertainty * error
    design = design.observed(replace(design.of(Lengths), value=value))
    problem = dense.planned(design, 3, 2)
    a = in_reference_basis(problem, design, state.a)
    problem = replace(
        problem, scales=x, rotations=state.rotations, origins=state.origins, balls=state.balls, a=a
    )
    assert compare(design, state, problem, x) == 0
    layout = shared_layout(design)
    factor = eliminate(design, layout, state, x)
    shared, balls = newton_step(design, factor, spectrum(factor))
    expected, squares = dense.least_squares_step(problem)
    ours = np.concatenate(
        [
            balls[design.plate_balls].ravel(),
            shared[layout.poses],
            in_reference_basis(problem, design, shared[layout.model]),
        ]
    )
    assert factor.sum_of_squares == pytest.approx(squares, rel=1e-9)
    np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


PLANE = """
title: a bar and a tile on a table
machine: {volume: [600 mm, 500 mm], repeatability: [1 um, 2 um]}
error_model: {kind: metric}
probes: {one: [0 mm, 0 mm], two: [30 mm, 0 mm]}
artefacts:
  bar: {kind: balls, coordinates: {a: [0 mm, 0 mm], b: [90 mm, 0 mm], c: [250 mm, 0 mm]}, role: length_standard}
  tile: {kind: grid, balls: [2, 3], size: [200 mm, 150 mm], role: length_standard}
positions:
  - {name: along, artefact: bar, pose: {origin: [100 mm, 100 mm]}, probes: [one, two], standard_uncertainty: 0.4 um}
  - {name: across, artefact: bar, pose: {origin: [300 mm, 100 mm], rotation: 70 deg}, probes: [one], repeats: 2}
  - {name: part, artefact: bar, pose: {origin: [200 mm, 100 mm], rotation: 20 deg}, probes: [one], balls: [a, c]}
  - {name: flat, artefact: tile, pose: {origin: [200 mm, 200 mm], rotation: 30 deg}, probes: [two]}
calibration:
  - {kind: distances, artefact: bar, pairs: all, standard_uncertainty: 0.3 um + L/500000}
  - {kind: distances, artefact: tile, pairs: all, standard_uncertainty: 0.5 um}
"""


def test_what_is_whitened_twice_over_is_the_inverse(tmp_path: Path) -> None:
    """W'W is the pseudo-inverse of the covariance, W by itself and its transpose; on a machine of
    two dimensions, with readings of unequal uncertainty.
    """
    path = tmp_path / "plane.yaml"
    path.write_text(PLANE, encoding="utf-8")
    design = lay_out(load(path)[0])
    white, m = design.once(length_whitening), len(design.of(Lengths))
    covariance = 1e12 * dense.length_covariance(design)
    twice = 1e-12 * white.pulled(white.whitened(np.eye(m)))
    expected = np.linalg.pinv(covariance, rcond=1e-12, hermitian=True)
    np.testing.assert_allclose(
        covariance @ twice @ covariance, covariance, atol=1e-9 * np.abs(covariance).max()
    )
    # Outside the range of the covariance nothing is ever observed, so that roots may differ there.
    within = covariance @ expected
    np.testing.assert_allclose(
        within @ twice @ within, expected, atol=1e-9 * np.abs(expected).max()
    )
    whitened = white.whitened(white.whitened(1e-12 * covariance).T)
    np.testing.assert_allclose(whitened, np.eye(len(white)), atol=1e-9)


TRUE = {"true_machine": {"kind": "random", "position": "3 um", "rotation": "6 urad", "seed": 3}}
FULL = {
    "error_model": {
        "kind": "kinematic",
        "arrangement": "MB2",
        "position_coefficients": 2,
        "rotation_coefficients": 2,
        "rotations": "full",
    }
}


def test_replicates_of_a_model_that_is_not_linear(tmp_path: Path) -> None:
    count = 64
    found = trials(experiment(tmp_path, bar(3), ALL, **TRUE, **FULL), count).outcome
    assert found is not None
    assert found.trials == count and not found.failed
    for symbol in ("U1", "U2", "U3", "U4", "U5", "U6"):
        one = found.comparisons[symbol]
        assert abs(one.spread.value - 1.0) < 4 * one.spread.error, symbol
        for share in (one.known, one.estimated):
            assert abs(share.value - 0.95) < 4 * share.error, symbol
    misfit = found.misfit
    assert abs(misfit.mean.value - misfit.degrees_of_freedom) < 4 * misfit.mean.error
    assert abs(misfit.rejected.value - 0.05) < 4 * misfit.rejected.error


def physical(
    made: Experiment, generator: np.random.Generator
) -> tuple[Design, Real, Design, State]:
    """Readings of a true standard, and certificates that err about it, without any of the program's
    random numbers.

    The standard's balls are off the drawing by 20 um, and each certified length by its uncertainty
    from what it truly is; the design has a reading for each of the readings drawn.
    """
    design = lay_out(made)
    corners = design.machine.volume.corners
    on_truth, truth = on_true_machine(
        design, true_machine(made.true_machine, design.model, *corners)
    )
    balls = truth.balls.copy()
    balls[~design.artefacts.is_plate[design.balls.artefact]] += 2e-5 * generator.standard_normal(3)
    off = 2e-5 * generator.standard_normal(balls.shape)
    # What is drawn in line or in a plane stays there.
    standard = np.flatnonzero(~design.artefacts.is_plate[design.balls.artefact])
    extent = np.ptp(design.balls.places[standard], axis=0) > 0.0
    balls[standard] += off[standard] * extent
    truth = replace(truth, balls=balls)
    _, exact = exact_readings(on_truth, truth)
    x = exact + design.machine.repeatability * generator.standard_normal(exact.shape)
    given = design.of(Lengths)
    ends = [balls[design.readings.ball[k]] for k in (given.first, given.second)]
    error = generator.standard_normal(int(given.certificate.max()) + 1)[given.certificate]
    value = np.linalg.norm(ends[0] - ends[1], axis=1) + given.uncertainty * error
    return design.observed(replace(given, value=value)), x, on_truth, truth


@pytest.mark.parametrize(
    ("standard", "known"), [(bar(6), GROWING), (flat(2), ALL)], ids=["six", "plate"]
)
def test_fits_of_readings_drawn_by_hand(
    standard: dict[str, Any], known: dict[str, Any], tmp_path: Path
) -> None:
    """Over 50 data sets each parameter scatters by its uncertainty, and S^2 about its degrees of
    freedom.
    """
    made = experiment(tmp_path, standard, known, **COARSE, **TRUE_METRIC)
    uncertainty = {name: one.maximum for name, one in predict(made).quantities.items()}
    generator, errors, squares = np.random.default_rng(4), [], []
    count = 50
    for _ in range(count):
        design, x, _, truth = physical(made, generator)
        found = iterate(design, x, truth)
        assert found.status == "converged"
        errors.append(found.state.a - truth.a)
        squares.append(found.factor.sum_of_squares)
    design = lay_out(made)
    layout, state = shared_layout(design), nominal_state(design)
    root = spectrum(eliminate(design, layout, state)).root[layout.model]
    stated = root @ root.T
    assert np.sqrt(np.diag(stated)[:3].max()) == pytest.approx(uncertainty["U3 ratios"], rel=1e-9)
    # The sum of squares in units of the stated covariance is chi-square with six degrees of freedom
    # for each data set.
    total = float(np.einsum("ri,ij,rj->", errors, np.linalg.inv(stated), errors))
    expected = 6 * count
    assert abs(total - expected) < 4 * np.sqrt(2 * expected)
    freedom = design.observation_count - design.parameter_count
    assert abs(np.mean(squares) - freedom) < 4 * np.sqrt(2 * freedom / count)


TRUE_METRIC = {
    "true_machine": {"kind": "coefficients", "values": {"scale x": "20 ppm", "C0Y": "30 urad"}}
}


@pytest.mark.parametrize("estimator", get_args(AlternativeName))
def test_estimators_of_distances_take_the_same_lengths(
    estimator: AlternativeName, tmp_path: Path
) -> None:
    """Without a plate the lengths are all there is, and every estimator is the weighted one of the
    dense covariance.
    """
    made = experiment(tmp_path, flat(3), GROWING, **COARSE, **TRUE_METRIC)
    design, x, _, _ = physical(made, np.random.default_rng(8))
    alone = without_plate(design)
    found = alternative_estimate(alone, x, np.zeros((0, 2), np.int64), estimator)
    expected, spread = weighted(alone, x)
    assert found.status == "converged" and found.observations == np.linalg.matrix_rank(
        dense.length_covariance(alone), 1e-21
    )
    np.testing.assert_allclose(found.a, expected, rtol=0, atol=1e-6 * spread.min())


def without_plate(design: Design) -> Design:
    """Only the lengths count; the plate's readings stay, of no artefact that is estimated."""
    return altered(
        design,
        artefacts={"is_plate": np.zeros_like(design.artefacts.is_plate)},
        positions={"held": np.ones_like(design.positions.held)},
    )


def weighted(design: Design, x: Real) -> tuple[Real, Real]:
    """Gauss-Newton on the lengths alone, with the pseudo-inverse of their covariance: values and
    uncertainties.
    """
    given, inverse = (
        design.of(Lengths),
        np.linalg.pinv(1e12 * dense.length_covariance(design), 1e-12, hermitian=True),
    )

    def off(a: Real) -> Real:
        seen = x + design.model.error(x, a, design.probes.offsets[design.readings.probe])
        return 1e6 * (np.linalg.norm(seen[given.first] - seen[given.second], axis=1) - given.value)

    a = np.zeros(len(design.model.parameters))
    for _ in range(8):
        rows = np.stack([(off(a + s) - off(a - s)) / 2e-5 for s in 1e-5 * np.eye(len(a))], axis=1)
        a = a - np.linalg.solve(rows.T @ inverse @ rows, rows.T @ inverse @ off(a))
    return a, np.sqrt(np.diag(np.linalg.inv(rows.T @ inverse @ rows)))


@pytest.mark.parametrize(
    ("pairs", "lengths", "independent"), [("corner sides", 4, 4), ("all", 6, 5)]
)
def test_length_equations_of_shared_balls(
    pairs: str, lengths: int, independent: int, tmp_path: Path
) -> None:
    """Of four balls in a plane, whose six distances are five pieces of information."""
    known = {"pairs": pairs, "standard_uncertainty": "0.1 um"}
    made = experiment(tmp_path, flat(2), known, machine=MACHINE, **COARSE, **TRUE_METRIC)
    design, x, _, _ = physical(made, np.random.default_rng(2))
    assert isinstance(design.model, SpatialMetricModel)
    found = length_estimate(design, x)
    equations = independent * len(POSES)
    assert (found.equations, found.degrees_of_freedom) == (equations, equations - 6)
    given = design.of(Lengths)
    seen = x + design.probes.offsets[design.readings.probe]
    difference = seen[given.first] - seen[given.second]
    rows = np.stack(
        [difference[:, i] * difference[:, j] for i in range(3) for j in range(3)], axis=1
    )
    rows = rows[:, [0, 1, 2, 4, 5, 8]] * [1, 2, 2, 1, 2, 1]
    off = (difference**2).sum(axis=1) - given.value**2
    # The noise of an equation is 2 D (n - m); it is the same in all three co-ordinates of all
    # readings.
    noise = np.zeros((len(given), 3 * len(seen)))
    for k, (first, second, along) in enumerate(
        zip(given.first, given.second, given.direction, strict=True)
    ):
        for sign, end in ((2.0, first), (-2.0, second)):
            noise[k, 3 * end : 3 * end + 3] = sign * along * given.value[k]
    assert len(given) == lengths * len(POSES)
    inverse = np.linalg.pinv(noise @ noise.T, 1e-10, hermitian=True)
    expected = -np.linalg.solve(rows.T @ inverse @ rows, rows.T @ inverse @ off)
    np.testing.assert_allclose(found.factors, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


MACHINE = {"volume": ["600 mm", "500 mm", "500 mm"], "repeatability": "1 um"}


def test_a_ball_a_little_off_the_line_counts_as_in_line(tmp_path: Path) -> None:
    """What it would add to first order is less than what nobody knows of its place."""
    crooked = bar(3)
    crooked["coordinates"]["b1"][1] = "0.003 mm"
    found = [
        predict(experiment(tmp_path, one, ALL)).quantities["U6"].average
        for one in (bar(3), crooked)
    ]
    assert found[1] == pytest.approx(found[0], rel=1e-4)


def test_lengths_that_follow_from_others_tell_nothing_of_the_machine(tmp_path: Path) -> None:
    """With certificates that are all but exact, the outer length of three balls follows from the
    other two.
    """
    exact = {"standard_uncertainty": "1 pm"}
    every = experiment(tmp_path, bar(3), {"pairs": "all"} | exact)
    two = experiment(tmp_path, bar(3), {"pairs": [["b0", "b1"], ["b1", "b2"]]} | exact)
    for symbol in ("U4", "U5", "U6"):
        found = [predict(one).quantities[symbol].maximum for one in (every, two)]
        assert found[0] == pytest.approx(found[1], rel=1e-9)
    assert lay_out(every).observation_count == lay_out(two).observation_count


def test_true_standards_differ_from_their_certificates_as_stated(tmp_path: Path) -> None:
    design = lay_out(experiment(tmp_path, bar(4), consecutive(4)))
    given = design.of(Lengths)
    generator, off = np.random.default_rng(6), []
    for _ in range(400):
        balls = true_artefacts(design, generator)
        ends = [balls[design.readings.ball[k]] for k in (given.first[:3], given.second[:3])]
        off.append(
            (np.linalg.norm(ends[0] - ends[1], axis=1) - given.value[:3]) / given.uncertainty[:3]
        )
    scatter = np.array(off).T @ np.array(off) / 400
    np.testing.assert_allclose(scatter, np.eye(3), atol=4 * np.sqrt(2 / 400))
