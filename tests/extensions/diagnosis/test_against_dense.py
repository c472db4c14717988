"""Redundancy, information, effects and patterns against explicit matrices, re-estimation and finite
differences.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.diagnosis.bias_patterns import Patterns, patterns
from ballplate.extensions.diagnosis.hat import row_places, whitened_residuals
from ballplate.extensions.diagnosis.redundancy import reliability_of
from ballplate.extensions.diagnosis.reliability_result import Reliability
from ballplate.simulator.design.arrays import Design, Readings
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.coordinates import CalibratedCoordinates
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.design.observations.readings import expected_readings
from ballplate.simulator.design.parameters import shared_layout
from ballplate.simulator.design.state import State
from ballplate.simulator.estimation.gauss_newton import iterate, moved
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.geometry.motions import rotation_from_vector
from numpy.typing import NDArray

from tests.estimation.test_against_dense import certified_coordinates, repeats, with_length_standard
from tests.extensions.diagnosis.designs import MIXED, PLANE, PLATE, experiment
from tests.reference import dense
from tests.reference.designs import altered

Real = NDArray[np.float64]


def quickstart() -> Design:
    return lay_out(load(Path("designs/quickstart.yaml"))[0])


def two_open_directions() -> Design:
    """Experiment 6.1.1 B, of rank deficiency 2, with 5 x 5 balls."""
    text = (
        Path("designs/npl/6.1.1.yaml")
        .read_text(encoding="utf-8")
        .replace("balls: [7, 7]", "balls: [5, 5]")
    )
    return lay_out(next(one for one in _loaded(text) if one.name == "B"))


def _loaded(text: str) -> list:  # type: ignore[type-arg]
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "it.yaml"
        path.write_text(text, encoding="utf-8")
        return list(load(path))


def shared_certificate() -> Design:
    """A bar is read in three positions, of which two have the same certificate."""
    design = with_length_standard(repeats(), projected=False)
    return design.observed(replace(design.of(Lengths), certificate=np.array([0, 1, 0])))


def numeric(function: Callable[[Real], Real], count: int, scale: Real, step: float = 1e-5) -> Real:
    """Derivative (m, count) by central differences of steps `scale` (count,) times `step`."""
    columns = []
    for k in range(count):
        move = np.zeros(count)
        move[k] = step * scale[k]
        columns.append((function(move) - function(-move)) / (2.0 * move[k]))
    return np.stack(columns, axis=1)


def dense_jacobian(design: Design) -> Real:
    """Derivative of all whitened residuals by balls and shared parameters, by central
    differences.
    """
    layout, state = shared_layout(design), nominal_state(design)
    x = expected_readings(design, state, design.readings)
    balls, s = design.plate_balls, len(layout)

    def residuals(step: Real) -> Real:
        shift = np.zeros_like(design.balls.places)
        shift[balls] = step[s:].reshape(-1, design.dimension)
        there = moved(state, layout, step[:s], shift)
        return whitened_residuals(design, there, x)

    scale = np.concatenate([layout.scale, np.ones(len(balls) * design.dimension)])
    return numeric(residuals, len(scale), scale, 1e-4) * scale


def orthonormal(jacobian: Real, deficiency: int) -> Real:
    """Orthonormal columns that span those of a Jacobian of known rank deficiency."""
    scaled = jacobian / np.maximum(np.sqrt((jacobian**2).sum(axis=0)), 1e-300)
    left, values, _ = np.linalg.svd(scaled, full_matrices=False)
    rank = jacobian.shape[1] - deficiency
    assert rank == len(values) or values[rank] < 1e-6 * values[rank - 1]
    return left[:, :rank]


def check(result: Reliability, basis: Real, rows: NDArray[np.int64], tolerance: float) -> None:
    """Compare with H = basis basis', of rows that stand in `rows` for a result's rows."""
    hat = (basis**2).sum(axis=1)[rows]
    np.testing.assert_allclose(result.redundancy, 1.0 - hat, atol=tolerance)
    pattern = np.zeros((len(basis), len(result.patterns)))
    pattern[rows] = result.patterns.matrix.toarray()
    left = ((pattern - basis @ (basis.T @ pattern)) ** 2).sum(axis=0)
    square = (pattern**2).sum(axis=0)
    nil = result.information == 0.0
    assert (left[nil] <= 1e-8 * square[nil]).all()
    np.testing.assert_allclose(
        result.information[~nil] / square[~nil], left[~nil] / square[~nil], atol=tolerance
    )
    total = result.redundancy.sum() + result.among_repeats
    np.testing.assert_allclose(total, result.degrees_of_freedom, rtol=1e-9)


@pytest.mark.parametrize("name", ["mixed", "plane"])
def test_small_designs_against_a_hat_matrix_by_differences(name: str, tmp_path: Path) -> None:
    text = {"mixed": MIXED, "plane": PLANE}[name]
    design = lay_out(experiment(tmp_path, text))
    result = reliability_of(design)
    jacobian = dense_jacobian(design)
    check(result, orthonormal(jacobian, result.deficiency), np.arange(len(jacobian)), 1e-6)
    if name == "mixed":
        kinds = set(result.patterns.kind.tolist())
        assert {
            "length",
            "prior",
            "coordinate",
            "distance",
            "ball",
            "length value",
            "scale",
        } <= kinds


@pytest.mark.parametrize("make", [quickstart, two_open_directions, certified_coordinates])
def test_plates_against_complex_steps(make: Callable[[], Design]) -> None:
    """The Jacobian is that of the dense reference, which shares no code with the estimator."""
    design = make()
    result = reliability_of(design)
    problem = dense.planned(design, 5, 5)
    jacobian = dense.jacobian(lambda step: dense.residuals(problem, step), problem.parameters)
    places = row_places(design)
    # Distances stand before co-ordinates there.
    readings = np.arange(places["reading"].stop)
    distances = places["reading"].stop + np.arange(len(design.of(CalibratedDistances)))
    coordinates = (
        places["reading"].stop
        + len(design.of(CalibratedDistances))
        + np.arange(len(design.of(CalibratedCoordinates)))
    )
    rows = np.concatenate([readings, coordinates, distances])
    assert result.deficiency == (2 if make is two_open_directions else 0)
    check(result, orthonormal(jacobian, result.deficiency), rows, 1e-9)


def test_repeats_and_lengths_that_share_a_certificate() -> None:
    """Each repeat is a row of its own, and lengths are whitened otherwise, in the dense
    reference.
    """
    design = shared_certificate()
    result = reliability_of(design)
    problem = dense.planned(design, 5, 5)
    jacobian = dense.jacobian(lambda step: dense.residuals(problem, step), problem.parameters)
    basis = orthonormal(jacobian, 0)
    hat = (basis**2).sum(axis=1)
    d, of_plates = design.dimension, design.plate_readings
    count = design.readings.repeats[of_plates]
    reading = np.repeat(np.arange(len(of_plates)), count)
    of_means = np.zeros((len(of_plates), d))
    np.add.at(of_means, reading, hat[: d * len(reading)].reshape(-1, d))
    places = row_places(design)
    np.testing.assert_allclose(
        result.redundancy[places["reading"]], 1.0 - of_means.ravel(), atol=1e-9
    )
    np.testing.assert_allclose(result.redundancy[places["distance"]], 1.0 - hat[-7:-3], atol=1e-9)
    # A bias of one length, and of the certificate that two of them share.
    given = design.of(Lengths)
    noise = (design.machine.repeatability**2 * given.direction**2).sum(axis=1)
    ends = 1.0 / design.readings.repeats[given.first] + 1.0 / design.readings.repeats[given.second]
    same = given.certificate[:, None] == given.certificate
    covariance = (
        np.diag(noise * ends * given.with_repeatability)
        + np.outer(given.uncertainty, given.uncertainty) * same
    )
    np.testing.assert_allclose(
        problem.length_root @ covariance @ problem.length_root.T, np.eye(3), atol=1e-9
    )
    for kind, biases in (
        ("length", np.eye(3)),
        ("length value", np.array([[-1.0], [0.0], [-1.0]])),
    ):
        pattern = np.zeros((len(basis), biases.shape[1]))
        pattern[-3:] = problem.length_root @ biases
        left = ((pattern - basis @ (basis.T @ pattern)) ** 2).sum(axis=0)
        found = result.information[result.patterns.of_kind(kind)]  # type: ignore[arg-type]
        np.testing.assert_allclose(found, left, rtol=1e-7)
    np.testing.assert_allclose(
        result.redundancy.sum() + result.among_repeats, len(hat) - hat.sum(), rtol=1e-9
    )


def changed(design: Design, given: Patterns, k: int, size: float) -> tuple[Design, Real]:
    """The design and its error-free readings with a bias put in."""
    x = expected_readings(design, nominal_state(design), design.readings)
    return biased(design, x, design.readings, given, k, size)


def biased(
    design: Design, x: Real, readings: Readings, given: Patterns, k: int, size: float
) -> tuple[Design, Real]:
    """The design and readings, each repeat one of its own or not, with a bias of a planned pattern
    put in where it belongs, as an observer would see it.
    """
    kind, subject, axis = given.kind[k], int(given.subject[k]), int(given.axis[k])
    planned, x = given.design.readings, x.copy()
    step = size * np.eye(design.dimension)[max(axis, 0) % design.dimension]
    times = planned.repeats if len(readings) > len(planned) else 1
    number = np.repeat(np.arange(len(planned)), times)
    here = readings.position == subject
    places = x + design.probes.offsets[readings.probe]
    away = places - places[here].mean(axis=0) if here.any() else places
    if kind == "reading":
        x[number == subject] += step
    elif kind == "length":
        x[number == design.of(Lengths).first[subject]] += (
            size * design.of(Lengths).direction[subject]
        )
    elif kind == "ball":
        same = readings.ball == planned.ball[subject]
        x[same & (readings.position == planned.position[subject])] += step
    elif kind == "moved":
        # Positions are read one after the other in these designs.
        later = readings.position >= planned.position[subject]
        later &= readings.ball == planned.ball[subject]
        balls = design.balls.places.copy()
        balls[planned.ball[subject]] += step
        displaced = replace(nominal_state(design), balls=balls)
        x[later] = expected_readings(design, displaced, readings)[later]
    elif kind == "shift":
        x[here & (number >= given.start[k])] += step
    elif kind == "turn":
        vector = size * (np.eye(3)[axis] if design.dimension == 3 else np.ones(1))
        late = here & (number >= given.start[k])
        x[late] += (away @ rotation_from_vector(vector[None])[0].T - away)[late]
    elif kind == "expansion":
        x[here] += size * away[here]
    elif kind in ("drift", "scale drift"):
        # From the first reading to the last, all taking as long, repeats as often as there are.
        done = np.cumsum(readings.repeats)
        middle = done - 0.5 * readings.repeats
        share = (middle - np.average(middle, weights=readings.repeats)) / np.ptp(middle)
        x = x + (share[:, None] * step if kind == "drift" else size * share[:, None] * x)
    elif kind == "probe":
        probes = design.probes.offsets.copy()
        probes[subject] += step
        return altered(design, probes={"offsets": probes}), x
    elif kind == "length value":
        lengths = design.of(Lengths)
        same = lengths.certificate == lengths.certificate[subject]
        return design.observed(replace(lengths, value=lengths.value + size * same)), x
    elif kind == "scale":
        assert design.artefacts.names[subject] == "plate"
        larger = [
            one.given(value=one.value * (1.0 + size)) for one in design.observations if one.scales
        ]
        return design.observed(*larger), x
    else:
        (items,) = (one for one in design.observations if one.word == kind)
        value = items.value.copy()
        value[subject] += size
        return design.observed(items.given(value=value)), x
    return design, x


@pytest.mark.parametrize("text", [PLATE, MIXED, PLANE], ids=["plate", "mixed", "plane"])
def test_patterns_are_what_biases_change_in_the_residuals(text: str, tmp_path: Path) -> None:
    design = lay_out(experiment(tmp_path, text))
    state = nominal_state(design)
    given = patterns(design, state, None)
    matrix, seen = given.matrix.toarray(), set()
    # Some of each kind; those of single lengths are compared with the dense reference.
    for k in [
        int(k)
        for kind in set(given.kind.tolist()) - {"length"}
        for k in _some(given.of_kind(kind), 4)
    ]:
        seen.add(given.kind[k])
        sides = []
        for sign in (1.0, -1.0):
            biased, x = changed(design, given, k, 1e-6 * sign)
            sides.append(whitened_residuals(biased, nominal_state(biased), x))
        expected = (sides[0] - sides[1]) / 2e-6
        np.testing.assert_allclose(
            matrix[:, k], expected, atol=2e-5 * np.abs(expected).max(), err_msg=given.kind[k]
        )
    wanted = {"reading", "distance", "moved", "shift", "turn", "probe", "expansion", "scale"}
    wanted |= {"drift", "scale drift"}
    assert wanted <= seen and (
        text is not MIXED or {"ball", "length value", "coordinate", "prior"} <= seen
    )


def _some(indices: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    return indices[:: max(len(indices) // count, 1)]


def distances_of(design: Design, state: State) -> tuple[Real, Real]:
    """Distances between all balls of the plate, and between all corrected evaluation points."""
    balls = state.balls[design.plate_balls]
    offsets = np.broadcast_to(state.probes[design.evaluation.probe], design.evaluation.points.shape)
    points = design.evaluation.points + design.model.error(
        design.evaluation.points, state.a, offsets
    )
    found = []
    for places in (balls, points):
        first, second = np.triu_indices(len(places), 1)
        found.append(np.sqrt(((places[first] - places[second]) ** 2).sum(axis=1)))
    return found[0], found[1]


@pytest.mark.parametrize("text", [PLATE, MIXED], ids=["plate", "mixed"])
def test_effects_are_those_of_an_estimate_with_the_bias_put_in(text: str, tmp_path: Path) -> None:
    design = lay_out(experiment(tmp_path, text))
    result = reliability_of(design)
    start, exact = (
        nominal_state(design),
        expected_readings(design, nominal_state(design), design.readings),
    )
    before = distances_of(design, iterate(design, exact, start).state)
    given, size, tried = result.patterns, 1e-6, set()
    assert result.deficiency == 0
    chosen = [
        k
        for kind in sorted(set(given.kind.tolist()) - {"length"})
        for k in _some(given.of_kind(kind), 2)
    ]
    for k in chosen:
        if given.kind[k] == "scale" and given.design.artefacts.names[given.subject[k]] != "plate":
            continue
        biased, x = changed(design, given, k, size)
        found = iterate(biased, x, nominal_state(biased))
        assert found.status == "converged"
        for symbol, was, now in zip(
            ("U5", "U6"), before, distances_of(biased, found.state), strict=True
        ):
            largest = np.abs(now - was).max() / size
            np.testing.assert_allclose(
                result.effects[symbol].change[k],
                largest,
                rtol=2e-3,
                atol=2e-6,
                err_msg=given.kind[k],
            )
        tried.add(given.kind[k])
    assert len(tried) >= (7 if text is PLATE else 11)
