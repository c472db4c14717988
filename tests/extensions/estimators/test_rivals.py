"""Alternative estimators against their objectives written out, and on exact data."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, product
from typing import get_args

import numpy as np
import pytest
from ballplate.extensions.estimators.alternative_estimators import (
    AlternativeName,
    alternative_estimate,
)
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.distances import CalibratedDistances, no_distances
from ballplate.simulator.geometry.ball_layouts import pairs
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.machines.kinematic import kinematic_model
from ballplate.simulator.readings.simulated import exact_readings, noisy_readings

from tests.estimation.test_gauss_newton import exactly_calibrated, truth_of
from tests.reference.designs import (
    altered,
    corner_sides,
    grid,
    neighbours,
    plate_design,
    six_positions,
)

ALL = np.array(list(combinations(range(16), 2)))


def small() -> Design:
    balls = grid(4)
    design = plate_design(
        balls, six_positions(), corner_sides(balls), repeatability=(2e-7, 3e-7, 4e-7)
    )
    return replace(design, model=kinematic_model(ARRANGEMENTS["MB2"], 3, 3, (0, 0, 0), (1, 1, 1)))


def observed(design: Design, exact: bool = False) -> tuple[Design, np.ndarray]:
    truth = truth_of(design, errors=3e-6)
    design = exactly_calibrated(design, truth)
    draw = np.random.default_rng(2)
    readings, x = exact_readings(design, truth) if exact else noisy_readings(design, truth, draw)
    return replace(design, readings=readings), x


@pytest.mark.parametrize("across", [False, True])
@pytest.mark.parametrize("estimator", get_args(AlternativeName))
def test_exact_readings_give_the_truth_back(estimator: AlternativeName, across: bool) -> None:
    design, x = observed(small(), exact=True)
    truth = truth_of(small(), errors=3e-6)
    found = alternative_estimate(design, x, ALL, estimator, across)
    assert found.status == "converged" and found.deficiency == 0 and len(found.iterations) <= 6
    np.testing.assert_allclose(found.a, truth.a, rtol=0, atol=1e-12)


def objective(
    design: Design, x: np.ndarray, estimator: str, a: np.ndarray, chosen: np.ndarray, across: bool
) -> float:
    """What the estimator minimises, term by term."""
    readings = design.readings
    corrected = x + design.model.error(x, a, design.probes.offsets[readings.probe])
    rough = x + design.probes.offsets[readings.probe]
    places = sorted(
        {(int(k), int(p)) for k, p in zip(readings.position, readings.probe, strict=True)}
    )
    row = {
        (int(b), int(k), int(p)): i
        for i, (b, k, p) in enumerate(
            zip(readings.ball, readings.position, readings.probe, strict=True)
        )
    }
    known = {
        tuple(sorted((int(i), int(j)))): (value, u)
        for i, j, value, u in zip(
            design.of(CalibratedDistances).first,
            design.of(CalibratedDistances).second,
            design.of(CalibratedDistances).value,
            design.of(CalibratedDistances).uncertainty,
            strict=True,
        )
    }
    total = 0.0
    for i, j in sorted({tuple(sorted(map(int, pair))) for pair in chosen} | set(known)):
        lengths, variances = [], []
        for one, other in product(places, places):
            if one[0] != other[0] or (one != other and not across):
                continue
            first, second = row.get((i, *one)), row.get((j, *other))
            if first is None or second is None:
                continue
            along = rough[first] - rough[second]
            along = along / np.linalg.norm(along)
            lengths.append(float(np.linalg.norm(corrected[first] - corrected[second])))
            variances.append(float(2 * (along**2 @ design.machine.repeatability**2)))
        certified = known.get((i, j))
        if estimator == "distances":
            values, spread = list(lengths), list(variances)
            if certified:
                values, spread = [*values, certified[0]], [*spread, certified[1] ** 2]
            weights = 1 / np.array(spread)
            mean = float(weights @ values / weights.sum())
            total += float(weights @ (np.array(values) - mean) ** 2)
        elif estimator == "cresto":
            for k in range(len(lengths)):
                for m in range(k + 1, len(lengths)):
                    total += (lengths[k] - lengths[m]) ** 2 / (variances[k] + variances[m])
                if certified:
                    total += (lengths[k] - certified[0]) ** 2 / (variances[k] + certified[1] ** 2)
        elif lengths:
            for k in range(1, len(lengths)):
                total += (lengths[k] - lengths[0]) ** 2 / (variances[k] + variances[0])
            if certified:
                total += (lengths[0] - certified[0]) ** 2 / (variances[0] + certified[1] ** 2)
    return total


@pytest.mark.parametrize("across", [False, True])
@pytest.mark.parametrize("estimator", get_args(AlternativeName))
def test_the_objective_is_the_one_stated_and_at_its_minimum(
    estimator: AlternativeName, across: bool
) -> None:
    design, x = observed(small())
    seen = design.readings.ball % 7 != design.readings.position
    design, x = replace(design, readings=design.readings.select(seen)), x[seen]
    chosen = np.array(neighbours(grid(4)))
    found = alternative_estimate(design, x, chosen, estimator, across)
    least = objective(design, x, estimator, found.a, chosen, across)
    assert found.iterations[-1].sum_of_squares == pytest.approx(least, rel=1e-7)
    for k in range(0, len(found.a), 4):
        step = np.zeros(len(found.a))
        step[k] = 1e-7
        above, below = (
            objective(design, x, estimator, found.a + s, chosen, across) - least
            for s in (step, -step)
        )
        assert above > 0 and below > 0 and above == pytest.approx(below, rel=0.02)


@pytest.mark.parametrize("estimator", get_args(AlternativeName))
def test_without_a_calibrated_distance_the_scale_is_open(estimator: AlternativeName) -> None:
    design = small()
    design = design.observed(
        type(design.of(CalibratedDistances))(
            *(v[:0] for v in vars(design.of(CalibratedDistances)).values())
        )
    )
    truth = replace(
        truth_of(design), a=np.zeros(len(design.model.parameters)), balls=design.balls.places
    )
    readings, x = exact_readings(design, truth)
    found = alternative_estimate(replace(design, readings=readings), x, ALL, estimator)
    assert found.deficiency == 1
    largest = np.argsort(-np.abs(found.null[:, 0]))[:3]
    assert {design.model.parameters[k].function for k in largest} == {"EXX", "EYY", "EZZ"}


def test_a_machine_that_shrinks_everything_to_a_point_is_no_estimate() -> None:
    """Without any known length the sum of squares of all distances is least where all are zero."""
    design, x = observed(small())
    design = design.observed(no_distances())
    count = len(design.model.parameters)
    parameters = [one.name for one in design.model.parameters]
    point = np.zeros(count)
    for name in ("EXX", "EYY", "EZZ"):
        point[next(k for k, one in enumerate(parameters) if one.startswith(name))] = -0.999
    found = alternative_estimate(design, x, ALL, start=point)
    assert found.status == "diverged"


def test_repeated_readings_are_combined() -> None:
    design, x = observed(small())
    twice = replace(design, readings=design.readings.select(np.repeat(np.arange(len(x)), 2)))
    smaller = altered(design, machine={"repeatability": design.machine.repeatability / np.sqrt(2)})
    a, b = (
        alternative_estimate(twice, np.repeat(x, 2, axis=0), ALL),
        alternative_estimate(smaller, x, ALL),
    )
    np.testing.assert_allclose(a.a, b.a, rtol=0, atol=1e-14)
    assert a.iterations[-1].sum_of_squares == pytest.approx(
        b.iterations[-1].sum_of_squares, rel=1e-9
    )


def test_braced_pairs() -> None:
    from ballplate.simulator.geometry.artefacts import GridSettings, SquareSettings

    layout = GridSettings.model_construct(kind="grid", balls=(5, 5), size=(0.75, 0.75)).layout()
    found = {tuple(pair) for pair in pairs(layout, "braced").tolist()}
    assert len(found) == 20 + 20 + 16 + 6
    names = {frozenset((layout.names[i], layout.names[j])) for i, j in found}
    assert frozenset(("r2c1", "r1c2")) in names and frozenset(("r1c1", "r2c2")) not in names
    assert (
        "braced"
        not in SquareSettings.model_construct(kind="square", balls=5, size=0.75).layout().pair_sets
    )
