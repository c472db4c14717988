"""Derivatives of every kind of observation against differences of its residuals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ballplate.simulator.design.arrays import Design, State, nominal_state
from ballplate.simulator.design.observations import Lengths
from ballplate.simulator.estimation.gauss_newton import moved
from ballplate.simulator.estimation.observations import (
    coordinate_rows,
    distance_rows,
    expected_readings,
    length_rows,
    reading_blocks,
)
from ballplate.simulator.estimation.parameters import shared_layout
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.machines.kinematic import kinematic_model

from tests.reference.derivatives import assert_derivative, central_difference
from tests.reference.designs import corner_sides, plate_design, six_positions, square

# Whitened residuals change by 5e6 a metre and are smooth over millimetres.
STEP, RELATIVE = 1e-3, 1e-7


@pytest.fixture(params=["linearised", "full"])
def design(request: pytest.FixtureRequest) -> Design:
    balls = square(4)
    built = plate_design(
        balls, six_positions(), corner_sides(balls), [0, 3, 5], repeatability=(2e-7, 3e-7, 5e-7)
    )
    full = request.param == "full"
    model = kinematic_model(ARRANGEMENTS["FB1"], 4, 3, (0, 0, 0), (1, 1, 1), full)
    return replace(
        built, model=model, distances=replace(built.distances, dimensions=np.array([2, 3, 2, 3]))
    )


def perturbed(design: Design, seed: int = 3) -> State:
    generator = np.random.default_rng(seed)
    layout = shared_layout(design)
    shared = 1e-3 * generator.standard_normal(len(layout))
    balls = 1e-2 * generator.standard_normal(design.balls.places.shape)
    return moved(nominal_state(design), layout, shared, balls)


def test_readings(design: Design) -> None:
    state, layout = perturbed(design), shared_layout(design)
    chosen = design.readings.select(np.arange(0, len(design.readings), 7))
    x = expected_readings(design, nominal_state(design), chosen)
    blocks = reading_blocks(design, state, chosen, x)

    def residual(shared: np.ndarray, balls: np.ndarray) -> np.ndarray:
        there = moved(state, layout, shared, balls)
        return reading_blocks(design, there, chosen, x).residual

    zero, still = np.zeros(len(layout)), np.zeros(design.balls.places.shape)
    by_shared = central_difference(lambda s: residual(s, still), zero, STEP)
    assert_derivative(blocks.by_model, by_shared[:, :, layout.model], RELATIVE)
    columns = layout.pose_columns[chosen.position]
    found = np.zeros_like(by_shared)
    for i in range(len(chosen)):
        free = columns[i] >= 0
        found[i][:, columns[i][free]] = blocks.by_pose[i][:, free]
    assert_derivative(found[:, :, layout.poses], by_shared[:, :, layout.poses], RELATIVE)

    by_ball = central_difference(
        lambda b: residual(zero, b.reshape(still.shape)), still.ravel(), STEP
    )
    by_ball = by_ball.reshape(*blocks.residual.shape, *still.shape)
    own = by_ball[np.arange(len(chosen)), :, chosen.ball]
    assert_derivative(blocks.by_ball, own, RELATIVE)
    assert np.abs(by_ball).sum() == pytest.approx(np.abs(own).sum())


@pytest.mark.parametrize("rows", [distance_rows, coordinate_rows])
def test_calibration(design: Design, rows) -> None:  # type: ignore[no-untyped-def]
    state = perturbed(design)
    found = rows(design, state)
    given = design.distances if rows is distance_rows else design.coordinates
    expected = central_difference(
        lambda b: rows(design, replace(state, balls=b.reshape(design.balls.places.shape))).residual,
        state.balls.ravel(),
        STEP,
    ).reshape(len(given), *design.balls.places.shape)
    dense = np.zeros_like(expected)
    rows_at = np.arange(len(given))
    if rows is distance_rows:
        dense[rows_at, given.first] = found.derivative
        dense[rows_at, given.second] = -found.derivative
    else:
        dense[rows_at, given.ball] = found.derivative
    assert_derivative(dense, expected, RELATIVE)


def test_lengths(design: Design) -> None:
    first, second = np.array([0, 0, 4]), np.array([3, 3, 9])
    direction = np.array([[1.0, 0, 0], [0.6, 0.8, 0], [0, 0, 1.0]])
    design = replace(
        design,
        lengths=Lengths(
            first,
            second,
            np.array([0.7, 0.7, 0.4]),
            np.array([1e-7, 2e-7, 3e-7]),
            np.array([False, True, False]),
            direction,
            np.array([True, False, True]),
            np.array([0, 1, 0]),
        ),
    )
    state = perturbed(design)
    x = expected_readings(design, nominal_state(design), design.readings)
    _, derivative = length_rows(design, state, x)
    expected = central_difference(
        lambda a: length_rows(design, replace(state, a=a), x)[0], state.a, STEP
    )
    assert_derivative(derivative, expected, RELATIVE)
