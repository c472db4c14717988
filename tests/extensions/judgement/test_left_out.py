"""What is left out and predicted, against fits without it and dense linear algebra."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.stats
from ballplate.extensions.judgement.left_out import (
    rest_of,
    validate,
)
from ballplate.simulator.design.arrays import Design, nominal_state
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.readings.generate import noisy_certificate, noisy_readings
from ballplate.simulator.readings.observed_readings import ObservedReadings, observe
from numpy.typing import NDArray

from tests.reference import dense
from tests.reference.small_quickstart import small_quickstart

Real = NDArray[np.float64]


@cache
def small() -> Experiment:
    """Sixteen balls in six positions."""
    plate = {"plate": {"kind": "grid", "balls": [4, 4], "size": ["750 mm", "750 mm"]}}
    points = {"points": {"random": 12, "seed": 3}, "probe": "down"}
    return small_quickstart(artefacts=plate, evaluation=points)


def campaign(design: Design, seed: int, certificate: int | None = None) -> ObservedReadings:
    truth = replace(
        nominal_state(design),
        a=1e-6 * np.random.default_rng(1).standard_normal(len(design.model.parameters)),
    )
    of_values = np.random.default_rng([9, seed if certificate is None else certificate])
    drawn = noisy_certificate(design, truth, of_values)
    return observe(drawn, *noisy_readings(design, truth, np.random.default_rng([8, seed])))


def fitted_without(design: Design, x: Real, position: int) -> tuple[float, int]:
    kept = design.readings.position != position
    rest = replace(design, readings=design.readings.select(kept))
    solution = estimate(rest, x[kept])
    at = linearised_fit(rest, solution)
    freedom = rest.observation_count - rest.parameter_count + at.deficiency
    return solution.factor.sum_of_squares, freedom


@pytest.mark.parametrize("position", [0, 3])
def test_prediction_errors_and_their_variances_are_those_of_dense_algebra(position: int) -> None:
    design = lay_out(small())
    observed = campaign(design, 2)
    x, design = observed.x, observed.design
    functions = dense.error_functions(3, 2)
    problem = dense.Problem(
        design,
        functions,
        x,
        design.positions.rotations,
        design.positions.origins,
        design.balls.places,
        np.zeros(sum(one.free for one in functions)),
    )
    zero = np.zeros(problem.parameters)
    whole = dense.jacobian(lambda step: dense.residuals(problem, step), problem.parameters)
    now = dense.residuals(problem, zero)
    left = np.zeros(len(now), bool)
    left[: x.size] = np.repeat(design.readings.position == position, 3)
    scale = 1.0 / np.sqrt((whole**2).sum(axis=0))
    rest, own = whole[~left] * scale, whole[left] * scale
    # What the rest says nothing of are the pose left out and, of the first, the frame.
    _, values, directions = np.linalg.svd(rest)
    known = np.zeros(len(directions), bool)
    known[: len(values)] = values > 1e-9 * values[0]
    step = directions[known].T @ (directions[known] @ -np.linalg.pinv(rest, 1e-9) @ now[~left])
    errors = now[left] + own @ step
    root = own @ (directions[known] / values[known[: len(values)], None]).T
    free = own @ directions[~known].T
    basis = np.linalg.svd(free, full_matrices=False)
    used = basis[0][:, basis[1] > 1e-9 * basis[1][0]]
    complement = np.eye(len(errors)) - used @ used.T
    covariance = complement @ (np.eye(len(errors)) + root @ root.T) @ complement
    found = rest_of(design, x, position)
    assert found is not None
    np.testing.assert_allclose(found.errors, complement @ errors, atol=2e-3)
    np.testing.assert_allclose(found.variances, np.diagonal(covariance), rtol=1e-3, atol=1e-4)
    # S^2 falls by the errors in their own covariance.
    solution = estimate(design, x)
    fallen = solution.factor.sum_of_squares - found.sum_of_squares
    mine = complement @ errors
    np.testing.assert_allclose(mine @ np.linalg.pinv(covariance, 1e-9) @ mine, fallen, rtol=1e-3)


def test_tests_and_changes_of_lengths_are_as_defined() -> None:
    design = lay_out(small())
    observed = campaign(design, 3)
    found = validate(small(), observed, "estimated")
    assert [one.name for one in found.left_out] == list(design.positions.names)
    whole = fitted_without(observed.design, observed.x, -1)
    for position, one in enumerate(found.left_out):
        square, freedom = fitted_without(observed.design, observed.x, position)
        assert one.predicted == whole[1] - freedom
        ratio = (whole[0] - square) / one.predicted / (square / freedom)
        np.testing.assert_allclose(
            one.chance, scipy.stats.f.sf(ratio, one.predicted, freedom), rtol=1e-3
        )
    assert not found.failed


def test_the_change_of_a_length_scatters_as_it_says() -> None:
    """Over campaigns: the standardised change of the length that changes most, of all campaigns
    together, against the normal distribution of the largest of many.
    """
    design = lay_out(small())
    standardised = []
    for seed in range(6):
        observed = campaign(design, 100 + seed)
        found = validate_one(observed, 1)
        standardised.append(found)
    rms = np.sqrt(np.mean(np.square(standardised)))
    # Changes of different lengths are close to one another in their standard uncertainties.
    assert 0.7 < rms < 2.2


def validate_one(observed: ObservedReadings, position: int) -> float:
    from ballplate.extensions.judgement.left_out import _length_difference

    solution = estimate(observed.design, observed.x)
    at = linearised_fit(observed.design, solution)
    rest = rest_of(observed.design, observed.x, position)
    assert rest is not None
    found = _length_difference(at, rest, 1.0)
    assert found is not None
    return found.change / found.standard_uncertainty


def test_a_shifted_reading_is_found_where_it_is() -> None:
    observed = campaign(lay_out(small()), 4)
    x = observed.x.copy()
    wrong = int(np.flatnonzero(observed.design.readings.position == 2)[5])
    x[wrong, 1] += 5e-6
    found = validate(small(), replace(observed, x=x), "given")
    design = observed.design
    assert design.positions.names[2] in {one.name for one in found.failed}
    one = next(one for one in found.left_out if one.name == design.positions.names[2])
    assert one.worst is not None and one.worst.axis == "y"
    assert one.worst.ball == design.ball_label(int(design.readings.ball[wrong]))
    np.testing.assert_allclose(one.worst.error, 5e-6, atol=1.5e-6)
