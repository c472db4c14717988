"""Replicates estimated many at a time against the estimator run on each of them by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ballplate.montecarlo._expansion import Direct, Expansion
from ballplate.montecarlo._reference import Reference, Truth, reference
from ballplate.montecarlo._replicates import BATCH, Estimates, draw, estimate_batch
from ballplate.simulator.design.arrays import Design, Readings
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.objects import Machine, Volume
from ballplate.simulator.design.observations.coordinates import CalibratedCoordinates
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.design.state import State
from ballplate.simulator.estimation.gauss_newton import iterate
from ballplate.simulator.geometry.motions import rotation_from_vector
from ballplate.simulator.machines.metric import MetricModel

from tests.reference.designs import (
    altered,
    corner_sides,
    grid,
    neighbours,
    plate_design,
    six_positions,
)


def truth(design: Design, seed: int = 1, size: float = 2e-6) -> Truth:
    """Artefacts and poses a little off the drawing, on a machine with errors."""
    generator = np.random.default_rng(seed)
    drawn = nominal_state(design)
    free = (~design.positions.held[:, : design.dimension]).all(axis=1)
    turn = rotation_from_vector(
        1e-4
        * generator.standard_normal((len(free), design.positions.held.shape[1] - design.dimension))
    )
    state = State(
        drawn.balls + 1e-5 * generator.standard_normal(drawn.balls.shape),
        np.where(free[:, None, None], turn @ drawn.rotations, drawn.rotations),
        drawn.origins + 1e-5 * free[:, None] * generator.standard_normal(drawn.origins.shape),
        size
        * generator.standard_normal(len(drawn.a))
        / [p.effect for p in design.model.parameters],
        drawn.probes,
        drawn.lengths,
    )
    if design.probes.free.any():
        moved = 1e-5 * design.probes.free * generator.standard_normal(design.probes.offsets.shape)
        state = replace(state, probes=design.probes.offsets + moved)
    return Truth(state, design.model)


def small(pairs: bool = True, kept: bool = False) -> Design:
    balls = grid(4)
    sides = neighbours(balls) if kept else corner_sides(balls)
    design = plate_design(
        balls,
        six_positions(),
        sides if pairs else (),
        () if pairs else (0, 3, 12, 15),
        position_coefficients=4,
        rotation_coefficients=4,
        repeatability=(2e-7, 3e-7, 1e-7),
    )
    generator = np.random.default_rng(3)
    return replace(
        design,
        readings=replace(
            design.readings, repeats=generator.integers(1, 4, len(design.readings.ball))
        ),
    )


def with_length_standard(projected: bool) -> Design:
    """A step gauge of two marks beside the plate, in two places."""
    design = small()
    ends = np.array([[0.0, 0.0, 0.0], [0.6, 0.0, 0.0]])
    n, k, m = len(design.balls.places), len(design.positions.names), len(design.readings)
    direction = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    turned = np.array([np.eye(3), [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    return altered(
        design,
        artefacts={
            "names": ("plate", "bar"),
            "is_plate": np.array([True, False]),
            "is_gauge": np.zeros(2, bool),
        },
        balls={
            "names": (*design.balls.names, "left", "right"),
            "artefact": np.append(design.balls.artefact, [1, 1]),
            "places": np.concatenate([design.balls.places, ends]),
        },
        positions={
            "names": (*design.positions.names, "bar x", "bar y"),
            "artefact": np.append(design.positions.artefact, [1, 1]),
            "rotations": np.concatenate([design.positions.rotations, turned]),
            "origins": np.concatenate(
                [design.positions.origins, [[0.1, 0.5, 0.5], [0.5, 0.1, 0.5]]]
            ),
            "held": np.concatenate([design.positions.held, np.ones((2, 6), bool)]),
        },
        readings=Readings(
            np.append(design.readings.ball, [n, n + 1, n, n + 1]),
            np.append(design.readings.position, [k, k, k + 1, k + 1]),
            np.append(design.readings.probe, [0, 0, 0, 0]),
            np.append(design.readings.repeats, [2, 2, 3, 3]),
        ),
        lengths=Lengths(
            np.array([m, m + 2]),
            np.array([m + 1, m + 3]),
            np.array([0.6, 0.6]),
            np.array([1e-7, 2e-7]),
            np.array([projected, projected]),
            -direction,
            np.array([True, True]),
            np.array([0, 0]),
        ),
    )


def with_unknown_probes() -> Design:
    """Offsets of all probes but the first are parameters, known a little, and so is a machine error
    and an origin.
    """
    design = with_length_standard(False)
    free = np.ones(design.probes.offsets.shape, bool)
    free[0] = False
    of_model = np.zeros((15, len(design.model.parameters)))
    of_model[13, 3] = 1.0
    offsets = np.argwhere(free)
    readings = design.readings
    # The ends of the standard with probes of unknown offset.
    readings = replace(readings, probe=np.append(readings.probe[:-4], [0, 1, 2, 3]))
    return altered(
        design,
        readings=readings,
        probes={"free": free},
        priors=Priors(
            (*(f"offset {k}" for k in range(12)), "origin", "function", "turn"),
            np.append(np.full(12, -1), [2, -1, 3]),
            np.append(offsets[:, 0], [-1, -1, -1]),
            np.append(offsets[:, 1], [1, -1, 4]),
            of_model,
            np.zeros(15),
            np.append(np.full(12, 1e-6), [1e-6, 1e-6, 1e-6]),
        ),
    )


def plane() -> Design:
    """A plate turned on a two-dimensional machine."""
    balls = grid(4)[:, :2]
    turns = rotation_from_vector(np.array([[0.0], [np.pi / 2], [2.0]]))
    ball, position = np.tile(np.arange(16), 3), np.repeat(np.arange(3), 16)
    design = small()
    certified = np.repeat(np.arange(16), 2)
    return altered(
        design,
        model=MetricModel(scale="x"),
        machine=Machine(Volume(np.zeros(2), np.ones(2)), np.array([2e-7, 4e-7])),
        probes={"names": ("tip",), "offsets": np.zeros((1, 2)), "free": np.zeros((1, 2), bool)},
        balls={"places": balls},
        positions={
            "names": ("a", "b", "c"),
            "artefact": np.zeros(3, np.int64),
            "rotations": turns,
            "origins": np.array([[0.1, 0.1], [0.9, 0.1], [0.9, 0.3]]),
            "held": np.zeros((3, 3), bool),
        },
        readings=Readings(ball, position, np.zeros(48, np.int64), np.ones(48, np.int64)),
        distances=small(pairs=False).of(CalibratedDistances),
        coordinates=CalibratedCoordinates(
            certified, np.tile([0, 1], 16), balls.ravel(), np.full(32, 3e-7)
        ),
        evaluation={"points": np.zeros((0, 2))},
    )


def alone(shared: Reference, seed: int, index: int) -> tuple[State, float]:
    """The estimator's answer to the readings of one replicate."""
    drawn, k = draw(shared, seed, index // BATCH), index % BATCH
    design, start, real = shared.design, shared.start, shared.truth.state
    x = shared.exact.copy()
    plates = design.plate_readings
    for group in shared.groups:
        readings = design.readings.select(plates)
        balls = np.arange(len(design.balls.places))[group.ball]
        own = plates[(readings.position == group.position) & np.isin(readings.ball, balls)]
        # A ball's repeats stand in the groups of a position in the order of the readings.
        earlier = [
            g
            for g in shared.groups
            if g.position == group.position and g.rows.start < group.rows.start
        ]
        for place, ball in enumerate(balls):
            turn = sum(
                int((np.arange(len(design.balls.places))[g.ball] == ball).sum()) for g in earlier
            )
            row = own[design.readings.ball[own] == ball][turn]
            x[row] += drawn.moved[k, :, group.rows.start + place]
    given = design.of(Lengths)
    for row in np.union1d(given.first, given.second):
        x[row] += drawn.moved[k, :, shared.order.tolist().index(row)]
    errors = {
        one.word: of_one[k] for one, of_one in zip(design.observations, drawn.errors, strict=True)
    }
    pairs, known = design.of(CalibratedDistances), design.of(CalibratedCoordinates)
    counts = np.arange(design.dimension) < pairs.dimensions[:, None]
    apart = (real.balls[pairs.first] - real.balls[pairs.second]) * counts
    observed = design.observed(
        replace(pairs, value=np.sqrt((apart**2).sum(axis=1)) + errors["distance"]),
        replace(known, value=real.balls[known.ball, known.axis] + errors["coordinate"]),
        replace(given, value=given.value + errors["length"]),
        replace(design.of(Priors), value=design.of(Priors).value + errors["prior"]),
    )
    solution = iterate(observed, x, start)
    return solution.state, solution.factor.sum_of_squares


def assert_agree(shared: Reference, found: Estimates, state: State, squares: float, k: int) -> None:
    """To a few millionths of what the replicates differ by."""
    start, own = shared.start, found.found

    def assert_close(value: np.ndarray, expected: np.ndarray, spread: np.ndarray) -> None:
        np.testing.assert_allclose(
            value, expected, rtol=0, atol=5e-6 * float(spread.std(axis=0).max())
        )

    assert_close(start.balls + own.balls[k].T, state.balls, own.balls)
    assert_close(start.origins + own.origins[k], state.origins, own.origins)
    assert_close(start.a + own.a[k], state.a, own.a)
    assert_close(start.probes + own.offsets[k], state.probes, own.offsets)
    turned = rotation_from_vector(own.rotations[k]) @ start.rotations
    assert_close(turned, state.rotations, own.rotations)
    assert found.sum_of_squares[k] == pytest.approx(squares, rel=1e-6)


@pytest.mark.parametrize(
    "design",
    [
        small(kept=True),
        small(pairs=False),
        with_length_standard(True),
        plane(),
        with_unknown_probes(),
    ],
    ids=["neighbours", "co-ordinates", "projected", "plane", "probes and length"],
)
def test_each_replicate_is_the_estimate_of_its_own_readings(design: Design) -> None:
    shared = reference(design, truth(design))
    found = estimate_batch(shared, seed=5, batch=2)
    assert found.converged.all() and (found.passes >= 2).all()
    for k in (0, 17):
        state, squares = alone(shared, 5, 2 * BATCH + k)
        assert_agree(shared, found, state, squares, k)


def test_a_model_that_is_not_linear_is_evaluated_itself() -> None:
    design = with_unknown_probes()
    design = replace(design, model=replace(design.model, full_rotations=True))
    shared = reference(design, truth(design, size=2e-4))
    assert isinstance(shared.groups[0].model, Direct)
    found = estimate_batch(shared, 5, 0, 8)
    state, squares = alone(shared, 5, 3)
    assert found.converged.all()
    assert_agree(shared, found, state, squares, 3)


def test_an_expansion_serves_the_linearised_model() -> None:
    shared = reference(small(), truth(small()))
    assert isinstance(shared.groups[0].model, Expansion)


def test_the_first_of_a_batch_are_what_they_are_among_all() -> None:
    design = small()
    shared = reference(design, truth(design))
    whole, part = estimate_batch(shared, 1, 0), estimate_batch(shared, 1, 0, 5)
    assert len(part.index) == 5 and part.converged.all()
    for name, value in vars(part.found).items():
        same = vars(whole.found)[name][:5]
        np.testing.assert_allclose(value, same, rtol=0, atol=1e-10 * np.abs(same).max(initial=1e-9))
    np.testing.assert_allclose(part.sum_of_squares, whole.sum_of_squares[:5], rtol=1e-12)


def test_replicates_of_a_deficient_design_move_in_nothing_open() -> None:
    design = small().observed(small(pairs=False).of(CalibratedDistances))
    design = altered(design, probes={"offsets": np.zeros_like(design.probes.offsets)})
    shared = reference(design, truth(design))
    assert shared.drawn is not None and shared.spectrum.deficiency > 0
    found = estimate_batch(shared, 1, 0, 4)
    assert found.converged.all()
    scaled = found.found.shared / shared.spectrum.scale
    null = shared.drawn.spectrum.null / shared.spectrum.scale[:, None]
    along = scaled @ np.linalg.qr(null)[0]
    assert np.abs(along).max() < 1e-9 * np.abs(scaled).max()
