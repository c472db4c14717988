"""What must hold of uncertainties whatever the design: frames, order, scale, more readings, and
repeated estimates.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.coordinates import CalibratedCoordinates
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.geometry.motions import rotation_from_vector
from ballplate.uncertainty.summaries import Quantity, uncertainties
from hypothesis import given, settings, strategies as st

from tests.reference.designs import (
    altered,
    corner_sides,
    grid,
    neighbours,
    plate_design,
    six_positions,
)

seeds = st.integers(0, 2**31)


def small_design(seed: int = 0, calibration: str = "sides") -> Design:
    """A 4 x 4 plate in six positions, with evaluation points drawn from `seed`."""
    balls = grid(4)
    pairs = corner_sides(balls) if calibration == "sides" else neighbours(balls)
    design = plate_design(
        balls,
        six_positions(),
        pairs if calibration != "coordinates" else (),
        range(16) if calibration == "coordinates" else (),
        position_coefficients=4,
        rotation_coefficients=4,
    )
    return altered(design, evaluation={"points": np.random.default_rng(seed).random((12, 3))})


def judged(
    design: Design, sigma: float = 1.0
) -> tuple[dict[str, Quantity], Linearisation, SharedLayout]:
    at = linearise(design)
    return uncertainties(at, sigma), at, at.layout


def assert_same(found: Quantity, expected: Quantity, relative: float = 1e-9) -> None:
    assert found.count == expected.count
    assert found.maximum == pytest.approx(expected.maximum, rel=relative)
    assert found.average == pytest.approx(expected.average, rel=relative)


@given(seeds)
@settings(max_examples=15, deadline=None)
def test_u5_and_u6_do_not_depend_on_the_frame(seed: int) -> None:
    """Another artefact frame and another pose held change U1 to U4, but no distance."""
    generator = np.random.default_rng(seed)
    design = small_design(seed)
    expected, _, _ = judged(design)
    turn = rotation_from_vector(generator.uniform(-2, 2, (1, 3)))[0]
    shift = generator.uniform(-1, 1, 3)
    held = np.zeros_like(design.positions.held)
    held[generator.integers(len(held))] = True
    moved = altered(
        design,
        balls={"places": design.balls.places @ turn.T + shift},
        positions={
            "rotations": design.positions.rotations @ turn.T,
            "origins": design.positions.origins - (design.positions.rotations @ turn.T) @ shift,
            "held": held,
        },
    )
    found, _, _ = judged(moved)
    assert_same(found["U5"], expected["U5"])
    assert_same(found["U6"], expected["U6"])


@given(seeds)
@settings(max_examples=15, deadline=None)
def test_nothing_depends_on_the_order_of_balls_and_positions(seed: int) -> None:
    generator = np.random.default_rng(seed)
    design = small_design(seed)
    expected, _, _ = judged(design)
    ball_order = generator.permutation(len(design.balls.places))
    new_ball = np.argsort(ball_order)
    position_order = generator.permutation(len(design.positions.rotations))
    new_position = np.argsort(position_order)
    mixed = generator.permutation(len(design.readings))
    readings = design.readings.select(mixed)
    found, _, _ = judged(
        altered(
            design,
            balls={
                "places": design.balls.places[ball_order],
                "names": tuple(design.balls.names[i] for i in ball_order),
            },
            positions={
                "rotations": design.positions.rotations[position_order],
                "origins": design.positions.origins[position_order],
                "held": design.positions.held[position_order],
                "names": tuple(design.positions.names[i] for i in position_order),
            },
            readings=replace(
                readings, ball=new_ball[readings.ball], position=new_position[readings.position]
            ),
            distances=replace(
                design.of(CalibratedDistances),
                first=new_ball[design.of(CalibratedDistances).second],
                second=new_ball[design.of(CalibratedDistances).first],
            ),
        )
    )
    for symbol, quantity in expected.items():
        assert_same(found[symbol], quantity)


@given(st.floats(1e-3, 1e3), st.sampled_from(["sides", "neighbours", "coordinates"]))
@settings(max_examples=15, deadline=None)
def test_u_scales_with_sigma(factor: float, calibration: str) -> None:
    design = small_design(1, calibration)
    expected, _, _ = judged(design)
    scaled = altered(
        design,
        machine={"repeatability": factor * design.machine.repeatability},
        distances=replace(
            design.of(CalibratedDistances),
            uncertainty=factor * design.of(CalibratedDistances).uncertainty,
        ),
        coordinates=replace(
            design.of(CalibratedCoordinates),
            uncertainty=factor * design.of(CalibratedCoordinates).uncertainty,
        ),
    )
    by_statement, _, _ = judged(scaled)
    by_estimate, _, _ = judged(design, factor)
    for symbol, quantity in expected.items():
        assert by_statement[symbol].average == pytest.approx(factor * quantity.average, rel=1e-9)
        assert by_estimate[symbol].maximum == pytest.approx(factor * quantity.maximum, rel=1e-12)


@pytest.mark.parametrize("rows", [10, 64])
def test_batches_do_not_matter(monkeypatch: pytest.MonkeyPatch, rows: int) -> None:
    expected, _, _ = judged(small_design(4, "neighbours"))
    monkeypatch.setattr("ballplate.simulator.estimation.elimination.ROWS_AT_ONCE", rows)
    found, _, _ = judged(small_design(4, "neighbours"))
    for symbol, quantity in expected.items():
        assert_same(found[symbol], quantity)
