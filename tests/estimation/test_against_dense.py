"""Every standard uncertainty behind U1 to U6, and the rank, against a dense computation of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from ballplate.simulator.design.arrays import Design, Readings
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.coordinates import CalibratedCoordinates
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.design.observations.readings import expected_readings
from ballplate.simulator.design.parameters import shared_layout
from ballplate.simulator.design.state import State
from ballplate.simulator.estimation.functions import Displacements, displacements, linear_functions
from ballplate.simulator.estimation.gauss_newton import newton_step
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.geometry.motions import rotation_from_vector
from ballplate.uncertainty.pairs import all_pairs
from ballplate.uncertainty.quantities import QUANTITIES, evaluation_points
from ballplate.uncertainty.summaries import point_pairs, uncertainties
from numpy.typing import NDArray

from tests.reference import dense
from tests.reference.designs import (
    altered,
    corner_sides,
    four_positions,
    grid,
    neighbours,
    placed,
    plate_design,
    six_positions,
)

Real = NDArray[np.float64]
RELATIVE = 1e-9


def with_points(design: Design, count: int = 15) -> Design:
    """The design with random evaluation points in its volume, read with a tip on the side."""
    unit = np.random.default_rng(7).random((count, 3))
    return altered(
        design,
        evaluation={
            "points": design.machine.volume.lower + unit * design.machine.volume.size,
            "probe": 1,
        },
    )


def grid_of_four() -> Design:
    balls = grid(4)
    return plate_design(balls, six_positions(), corner_sides(balls))


def certified_coordinates() -> Design:
    """Experiment 6.1.1 C: all co-ordinates calibrated, all poses free."""
    balls = grid(5)
    return plate_design(balls, four_positions(), coordinates=range(len(balls)))


def unequal_axes() -> Design:
    """A repeatability of its own for each axis, and a volume that is no unit cube."""
    balls = grid(4)
    sigmas, lower, upper = (1e-7, 3e-7, 7e-7), (-0.1, 0.0, -0.2), (1.2, 1.05, 1.0)
    return plate_design(
        balls, six_positions(), corner_sides(balls), repeatability=sigmas, lower=lower, upper=upper
    )


def repeats() -> Design:
    """Each reading taken once to four times."""
    design = grid_of_four()
    readings = design.readings
    return replace(
        design, readings=replace(readings, repeats=1 + (np.arange(len(readings)) * 5) % 4)
    )


def some_balls_only() -> Design:
    """The second and the last position read but a part of the balls, one ball there with one tip
    only.
    """
    balls = grid(5)
    design = plate_design(balls, six_positions(), corner_sides(balls))
    readings = design.readings
    missing = (readings.position == 1) & (readings.ball % 3 == 0)
    missing |= (readings.position == 5) & (readings.ball > 14)
    missing |= (readings.position == 5) & (readings.ball == 3) & (readings.probe == 3)
    return replace(design, readings=readings.select(~missing))


def planar_distances() -> Design:
    """Distances of which only the first two co-ordinates count, with a few certified
    co-ordinates.
    """
    balls = grid(4) + np.array([0.0, 0.0, 0.02]) * (np.arange(16) % 3)[:, None]
    design = plate_design(balls, six_positions(), neighbours(grid(4)), coordinates=(0, 3, 12))
    flat = np.full(len(design.of(CalibratedDistances)), 2)
    flat[::3] = 3
    first, second = design.of(CalibratedDistances).first, design.of(CalibratedDistances).second
    between = (balls[first] - balls[second]) * (np.arange(3) < flat[:, None])
    value = np.sqrt((between**2).sum(axis=1))
    return design.observed(replace(design.of(CalibratedDistances), dimensions=flat, value=value))


def with_length_standard(design: Design, projected: bool) -> Design:
    """A bar of two balls is added, read three times over in three places; its length is known."""
    half = 0.3
    places = np.array([[0.5, 0.5, 0.4], [0.5, 0.4, 0.5], [0.4, 0.6, 0.6]])
    directions = np.array([[1.0, 0.0, 0.0], [0.0, 0.8, 0.6], [0.6, -0.48, 0.64]])
    rotations = []
    for direction in directions:
        full, _ = np.linalg.qr(np.column_stack([direction, np.roll(np.eye(3), 1, 0)[:, :2]]))
        full[:, 0] = direction
        full[:, 2] *= np.sign(np.linalg.det(full))
        rotations.append(full)
    ball, position = len(design.balls.places), len(design.positions.names)
    readings, start = design.readings, len(design.readings)
    count = len(places)
    joined = Readings(
        np.concatenate([readings.ball, np.tile([ball, ball + 1], count)]),
        np.concatenate([readings.position, position + np.repeat(np.arange(count), 2)]),
        np.concatenate([readings.probe, np.repeat(np.arange(count) % 2, 2)]),
        np.concatenate([readings.repeats, np.array([1, 3, 2, 2, 5, 1])]),
    )
    index = start + 2 * np.arange(count)
    # The stated direction is a little off the bar's, so that projections differ from distances.
    stated = directions + 0.1 * np.roll(directions, 1, axis=1)
    stated /= np.sqrt((stated**2).sum(axis=1))[:, None]
    return altered(
        design,
        artefacts={
            "names": (*design.artefacts.names, "bar"),
            "is_plate": np.append(design.artefacts.is_plate, False),
            "is_gauge": np.zeros(2, bool),
        },
        balls={
            "names": (*design.balls.names, "left", "right"),
            "artefact": np.append(design.balls.artefact, [len(design.artefacts.is_plate)] * 2),
            "places": np.concatenate([design.balls.places, [[half, 0.0, 0.0], [-half, 0.0, 0.0]]]),
        },
        positions={
            "names": (*design.positions.names, *(f"bar {k}" for k in range(count))),
            "artefact": np.append(
                design.positions.artefact, [len(design.artefacts.is_plate)] * count
            ),
            "rotations": np.concatenate([design.positions.rotations, rotations]),
            "origins": np.concatenate([design.positions.origins, places]),
            "held": np.concatenate([design.positions.held, np.zeros((count, 6), bool)]),
        },
        readings=joined,
        lengths=Lengths(
            first=index,
            second=index + 1,
            value=np.full(count, 2 * half),
            uncertainty=np.array([1e-7, 2e-7, 3e-7]),
            projected=np.full(count, projected),
            direction=stated,
            with_repeatability=np.array([True, False, True]),
            certificate=np.array([0, 1, 0]),
        ),
    )


def two_artefacts() -> Design:
    """A grid with calibrated sides and a smaller one, certified, whose poses are all free."""
    large, small = grid_of_four(), grid(3, 0.4)
    extra = plate_design(
        small,
        [placed("z", 0.5, (0.3, 0.1), 1, 0.4), placed("x", 0.4, (0.2, 0.4), 3, 0.4)],
        coordinates=(0, 2, 6, 8),
    )
    balls, positions = len(large.balls.places), len(large.positions.names)
    first, second = large.readings, extra.readings
    return altered(
        large,
        artefacts={
            "names": ("large", "small"),
            "is_plate": np.array([True, True]),
            "is_gauge": np.zeros(2, bool),
        },
        balls={
            "names": large.balls.names + extra.balls.names,
            "artefact": np.repeat([0, 1], [balls, len(small)]),
            "places": np.concatenate([large.balls.places, small]),
        },
        positions={
            "names": (*large.positions.names, "s0", "s1"),
            "artefact": np.repeat([0, 1], [positions, 2]),
            "rotations": np.concatenate([large.positions.rotations, extra.positions.rotations]),
            "origins": np.concatenate([large.positions.origins, extra.positions.origins]),
            "held": np.concatenate([large.positions.held, extra.positions.held]),
        },
        readings=Readings(
            np.concatenate([first.ball, second.ball + balls]),
            np.concatenate([first.position, second.position + positions]),
            np.concatenate([first.probe, second.probe]),
            np.concatenate([first.repeats, second.repeats]),
        ),
        coordinates=replace(
            extra.of(CalibratedCoordinates), ball=extra.of(CalibratedCoordinates).ball + balls
        ),
    )


def deficient_grid_of_four() -> Design:
    balls = grid(4)
    return plate_design(balls, six_positions(), corner_sides(balls), position_coefficients=7)


def pair_values(moved: Displacements) -> Real:
    """The uncertainty of every single pair, NaN where open, each from a call with two places."""
    values = []
    for i, j in zip(*np.triu_indices(len(moved.places), 1), strict=True):
        two = np.array([i, j])
        summary = all_pairs(moved.select(two), two)
        values.append(np.nan if summary.undetermined else summary.maximum)
    return np.array(values)


def individual(found: Linearisation) -> dict[str, Real]:
    """All that stands behind U1 to U6, in the order of the dense reference."""
    design, layout = found.design, found.layout
    reported = np.zeros((len(design.model.reported().names), len(layout)))
    reported[:, layout.model] = design.model.reported().matrix
    of_balls = QUANTITIES["U5"].functions(design, layout)
    return {
        "U1": found.of_balls()[design.plate_balls].ravel(),
        "U2": found.of_shared(np.eye(len(layout))[layout.poses]),
        "U3": found.of_shared(reported),
        "U4": point_pairs(found)[0].ravel(),
        "U5": np.concatenate([pair_values(displacements(found, one.places)) for one in of_balls]),
        "U6": pair_values(displacements(found, evaluation_points(design))),
    }


def compare(design: Design, state: State, problem: dense.Problem, x: Real | None = None) -> int:
    """Check all uncertainties; returns the rank deficiency that both found."""
    found = linearise(design, state, x)
    reference = dense.linearised(problem)
    assert found.deficiency == reference.deficiency
    assert len(found.layout) + 3 * len(design.plate_balls) == problem.parameters
    assert list(design.model.reported().names) == dense.monomial_names(problem)
    expected = dense.standard_uncertainties(problem, reference)
    summary = uncertainties(found)
    for symbol, values in individual(found).items():
        np.testing.assert_array_equal(np.isnan(values), np.isnan(expected[symbol]), err_msg=symbol)
        np.testing.assert_allclose(values, expected[symbol], rtol=RELATIVE, atol=0, err_msg=symbol)
        quantity, open_ = summary[symbol], np.isnan(expected[symbol])
        assert (quantity.count, quantity.undetermined) == (len(open_), open_.sum()), symbol
        # Neither is one of the determined part alone.
        for own, value in (
            (quantity.maximum, expected[symbol].max()),
            (quantity.average, expected[symbol].mean()),
        ):
            assert own == pytest.approx(value, rel=RELATIVE, nan_ok=True), symbol
    return found.deficiency


@pytest.mark.parametrize(
    "make",
    [
        certified_coordinates,
        unequal_axes,
        repeats,
        some_balls_only,
        planar_distances,
        two_artefacts,
    ],
)
def test_every_uncertainty_of_a_design_of_full_rank(make: Callable[[], Design]) -> None:
    design = with_points(make())
    assert compare(design, nominal_state(design), dense.planned(design, 5, 5)) == 0


def test_rank_and_what_is_left_determined_of_a_deficient_design(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With evaluation points some at a time."""
    monkeypatch.setattr("ballplate.simulator.estimation.functions.PLACES_AT_ONCE", 3)
    design = with_points(deficient_grid_of_four(), 8)
    assert compare(design, nominal_state(design), dense.planned(design, 7, 5)) == 6


@pytest.mark.parametrize(
    ("make", "coefficients"), [(two_artefacts, 5), (deficient_grid_of_four, 7)]
)
def test_covariances_of_functions_with_one_another(
    make: Callable[[], Design], coefficients: int
) -> None:
    """Of balls that distances tie together, of points, of parameters and of distances, all with
    all.
    """
    design = with_points(make(), 8)
    found, problem = linearise(design), dense.planned(design, coefficients, 5)
    reference = dense.linearised(problem)
    quoted = design.model.reported().matrix.any(axis=1)
    functions, jacobians = [], []
    for symbol, function in dense.quantities(problem).items():
        groups = QUANTITIES[symbol].functions(design, found.layout)
        own = dense.jacobian(function, problem.parameters)
        own = own[quoted] if symbol == "U3" else own
        made = [linear_functions(found, one) for one in groups]
        values = np.concatenate([found.uncertainty(one) for one in made])
        expected = reference.of(own)
        np.testing.assert_array_equal(np.isnan(values), np.isnan(expected), err_msg=symbol)
        np.testing.assert_allclose(values, expected, rtol=RELATIVE, err_msg=symbol)
        functions.append(made[0])
        jacobians.append(own[: len(made[0].shared)])
    if reference.deficiency:
        return
    for one, left in zip(functions, jacobians, strict=True):
        for other, right in zip(functions, jacobians, strict=True):
            size = np.outer(reference.of(left), reference.of(right))
            expected = left @ reference.covariance @ right.T
            np.testing.assert_allclose(
                found.covariance(one, other) / size, expected / size, atol=1e-8
            )


@pytest.mark.parametrize("make", [unequal_axes, two_artefacts])
def test_away_from_the_nominal_point_with_errors_and_scatter(make: Callable[[], Design]) -> None:
    """Balls, poses, machine errors and readings off nominal: uncertainties, S^2 and the Newton
    step.
    """
    design = with_points(make(), 8)
    random = np.random.default_rng(3)
    nominal = nominal_state(design)
    # What is held stays where it is; the plates stand free.
    turn = (
        0.02
        * random.standard_normal((len(design.positions.origins), 3))
        * ~design.positions.held[:, 3:]
    )
    shift = (
        1e-3
        * random.standard_normal(design.positions.origins.shape)
        * ~design.positions.held[:, :3]
    )
    # What the first pose shows of the balls counts as their frame: small errors only.
    state = State(
        nominal.balls + 1e-5 * random.standard_normal(nominal.balls.shape),
        rotation_from_vector(turn) @ nominal.rotations,
        nominal.origins + shift,
        1e-4 * random.standard_normal(nominal.a.shape),
        nominal.probes,
        nominal.lengths,
    )
    scatter = random.standard_normal((len(design.readings), 3))
    x = expected_readings(design, nominal, design.readings) + 1e-4 * scatter
    problem = dense.planned(design, 5, 5)
    problem = replace(
        problem,
        scales=x,
        rotations=state.rotations,
        origins=state.origins,
        balls=state.balls,
        a=in_reference_basis(problem, design, state.a),
    )
    assert compare(design, state, problem, x) == 0

    layout = shared_layout(design)
    found = linearise(design, state, x)
    shared, balls = newton_step(design, found.factor, found.spectrum)
    expected, squares = dense.least_squares_step(problem)
    n, poses = 3 * len(design.plate_balls), len(problem.free_poses)
    expected_a = in_reference_basis(problem, design, shared[layout.model])
    ours = np.concatenate([balls[design.plate_balls].ravel(), shared[layout.poses], expected_a])
    assert found.factor.sum_of_squares == pytest.approx(squares, rel=RELATIVE)
    for part in (slice(0, n), slice(n, n + poses), slice(n + poses, None)):
        assert np.abs(ours[part] - expected[part]).max() < 1e-8 * np.abs(expected[part]).max()


def in_reference_basis(problem: dense.Problem, design: Design, a: Real) -> Real:
    """The same error functions in the reference's coefficients, by way of the monomials both can
    report.
    """
    monomials = design.model.reported().matrix @ a
    found, start = [], 0
    for function in problem.functions:
        size = function.coefficients - 1
        matrix = dense.monomial_matrix(function)
        found.append(np.linalg.lstsq(matrix, monomials[start : start + size], rcond=None)[0])
        start += size
    return np.concatenate(found)
