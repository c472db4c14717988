"""The non-linear estimate: exact data come back, in few iterations, from starting values of the
readings alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.coordinates import CalibratedCoordinates
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.state import State
from ballplate.simulator.estimation.gauss_newton import (
    GaussNewtonSettings,
    as_drawn,
    estimate,
    iterate,
)
from ballplate.simulator.estimation.initial import initial_state
from ballplate.simulator.geometry.motions import rotation_from_vector
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.machines.kinematic import kinematic_model
from ballplate.simulator.readings.simulated import exact_readings, noisy_readings, scale_readings
from ballplate.simulator.readings.true_artefacts import noisy_certificate
from scipy.stats import f

from tests.reference.designs import altered, corner_sides, grid, plate_design, six_positions


def truth_of(design: Design, seed: int = 3, errors: float = 1e-5) -> State:
    """A machine with errors, a plate that is not as drawn, in poses that are not as drawn."""
    generator = np.random.default_rng(seed)
    poses = len(design.positions.names)
    turn = rotation_from_vector(1e-2 * generator.standard_normal((poses, 3)))
    shift = 1e-3 * generator.standard_normal((poses, 3))
    turn[design.positions.held.all(axis=1)], shift[design.positions.held.all(axis=1)] = (
        np.eye(3),
        0.0,
    )
    return State(
        design.balls.places + 1e-5 * generator.standard_normal(design.balls.places.shape),
        turn @ design.positions.rotations,
        design.positions.origins + shift,
        errors * generator.standard_normal(len(design.model.parameters)),
        design.probes.offsets,
        design.unknown_lengths.drawn,
    )


def exactly_calibrated(design: Design, truth: State) -> Design:
    """The design with the certificate of the true plate."""
    none = np.random.default_rng(0)
    certified = noisy_certificate(
        design.observed(
            replace(
                design.of(CalibratedDistances),
                uncertainty=0 * design.of(CalibratedDistances).uncertainty,
            ),
            replace(
                design.of(CalibratedCoordinates),
                uncertainty=0 * design.of(CalibratedCoordinates).uncertainty,
            ),
        ),
        truth,
        none,
    )
    return design.observed(
        replace(design.of(CalibratedDistances), value=certified.of(CalibratedDistances).value),
        replace(design.of(CalibratedCoordinates), value=certified.of(CalibratedCoordinates).value),
    )


def design_with(calibration: str, full: bool = False) -> Design:
    balls = grid(5)
    built = plate_design(
        balls,
        six_positions(),
        corner_sides(balls) if calibration == "distances" else (),
        range(25) if calibration == "coordinates" else (),
    )
    return replace(
        built, model=kinematic_model(ARRANGEMENTS["MB2"], 5, 5, (0, 0, 0), (1, 1, 1), full)
    )


@pytest.mark.parametrize("calibration", ["distances", "coordinates"])
@pytest.mark.parametrize("full", [False, True])
def test_exact_readings_give_the_truth_back(calibration: str, full: bool) -> None:
    design = design_with(calibration, full)
    truth = truth_of(design)
    design = exactly_calibrated(design, truth)
    readings, x = exact_readings(design, truth)
    # No position reads all balls.
    seen = readings.ball % 6 != readings.position
    design, x = replace(design, readings=readings.select(seen)), x[seen]
    solution = iterate(design, x, initial_state(design, x))
    assert solution.status == "converged"
    assert len(solution.iterations) <= 5
    steps = [iteration.step for iteration in solution.iterations[1:]]
    assert steps[0] > 1e-5 and steps[1] < 1e-3 * steps[0] and steps[2] < 1e-3 * steps[1]
    np.testing.assert_allclose(solution.state.a, truth.a, rtol=0, atol=1e-13)
    np.testing.assert_allclose(solution.state.balls, truth.balls, rtol=0, atol=1e-14)
    np.testing.assert_allclose(solution.state.rotations, truth.rotations, rtol=0, atol=1e-14)
    np.testing.assert_allclose(solution.state.origins, truth.origins, rtol=0, atol=1e-14)


def test_starting_values_do_not_need_the_nominal_poses() -> None:
    """Plates put down far from where they were meant to lie, and read in part only."""
    design = design_with("distances")
    truth = truth_of(design)
    readings, x = exact_readings(design, replace(truth, a=0 * truth.a))
    seen = readings.ball % 6 != readings.position
    wrong = rotation_from_vector(np.tile([[0.3, -0.9, 1.1]], (6, 1))) @ design.positions.rotations
    wrong[0] = design.positions.rotations[0]
    design = altered(
        design,
        readings=readings.select(seen),
        positions={
            "rotations": wrong,
            "origins": design.positions.origins + [[0]] + 0.2 * (wrong[:, 0] != wrong[0, 0]),
        },
    )
    start = initial_state(design, x[seen])
    np.testing.assert_allclose(start.rotations, truth.rotations, rtol=0, atol=1e-10)
    np.testing.assert_allclose(start.balls, truth.balls, rtol=0, atol=1e-10)


def test_positions_that_share_too_few_balls_are_joined_by_the_nominal_plate() -> None:
    design = design_with("coordinates")
    truth = replace(truth_of(design), balls=design.balls.places)
    readings, x = exact_readings(design, replace(truth, a=0 * truth.a))
    # Even balls in the first three positions, odd ones in the others: the two groups share none.
    seen = readings.ball % 2 == readings.position // 3
    design = replace(design, readings=readings.select(seen))
    start = initial_state(design, x[seen])
    np.testing.assert_allclose(start.rotations, truth.rotations, rtol=0, atol=1e-10)
    np.testing.assert_allclose(start.balls, truth.balls, rtol=0, atol=1e-10)


@pytest.mark.parametrize("noise", [1.0, 4.0])
@pytest.mark.parametrize(("turned", "is_followed"), [(1e-2, True), (2e-3, False)])
def test_what_is_open_is_followed_where_an_f_test_says_so(
    turned: float, is_followed: bool, noise: float
) -> None:
    """Poses that are turned a lot, of readings with more noise than stated in the same proportion,
    tell of what is open as drawn by far more than noise explains.
    """
    balls = grid(4)
    design = plate_design(balls, six_positions(), corner_sides(balls), position_coefficients=7)
    generator = np.random.default_rng(1)
    turn = rotation_from_vector(noise * turned * generator.standard_normal((6, 3)))
    turn[0] = np.eye(3)
    truth = replace(truth_of(design, 1), rotations=turn @ design.positions.rotations)
    design = exactly_calibrated(design, truth)
    noisy = altered(design, machine={"repeatability": noise * design.machine.repeatability})
    readings, x = noisy_readings(noisy, truth, generator)
    design = replace(design, readings=readings)
    start, drawn = initial_state(design, x), as_drawn(design)
    held, followed = (
        iterate(design, x, start, None, one).factor.sum_of_squares for one in (drawn, None)
    )
    freedom = design.observation_count - design.parameter_count
    assert drawn.deficiency == 6
    chance = f.sf((held - followed) / 6 / (followed / freedom), 6, freedom)
    assert chance < 1e-6 if is_followed else chance > 0.01
    found = estimate(design, x)
    wanted = followed if is_followed else held
    assert found.factor.sum_of_squares == pytest.approx(wanted, rel=1e-9)
    assert found.spectrum.deficiency == 6


def test_too_few_iterations_are_a_status() -> None:
    design = design_with("distances")
    readings, x = exact_readings(design, truth_of(design))
    design = replace(design, readings=readings)
    solution = iterate(design, x, initial_state(design, x), GaussNewtonSettings(iterations=1))
    assert solution.status == "not converged"
    assert len(solution.iterations) == 2


def test_impossible_errors_have_no_reading() -> None:
    from ballplate.simulator.readings.simulated import NoReadingError

    model = kinematic_model(ARRANGEMENTS["MB2"], 5, 5, (0, 0, 0), (1, 1, 1))
    with pytest.raises(NoReadingError):
        scale_readings(model, np.full((1, 3), 0.7), np.full(69, 5.0), np.zeros((1, 3)))
