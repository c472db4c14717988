"""What is left out and predicted, against fits without it and dense linear algebra."""

from __future__ import annotations

import csv
from dataclasses import replace
from functools import cache
from typing import Literal

import ballplate as bp
import numpy as np
import pytest
import scipy.stats
from ballplate.extensions.judgement.left_out import rest_of, validate
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state, reading_uncertainties
from ballplate.simulator.estimation import (
    Distances,
    Linearisation,
    MeasuredPoints,
    corrected_points,
    linear_functions,
)
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines import Integers
from ballplate.simulator.readings.observed_readings import ObservedReadings, observe
from ballplate.simulator.readings.simulated import noisy_readings
from ballplate.simulator.readings.true_artefacts import noisy_certificate
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


def fitted_without(
    design: Design, x: Real, position: int
) -> tuple[float, int, Linearisation, Integers, Real]:
    """S^2, degrees of freedom and linearisation of a fit without the readings of a position, and
    the pairs of evaluation points with their distances.
    """
    kept = design.readings.position != position
    rest = replace(design, readings=design.readings.select(kept))
    solution = estimate(rest, x[kept])
    at = linearised_fit(rest, solution)
    freedom = rest.observation_count - rest.parameter_count + at.deficiency
    points = design.evaluation.points
    probes = np.full(len(points), design.evaluation.probe)
    corrected = corrected_points(rest, solution.state, points, probes)
    pairs = np.stack(np.triu_indices(len(points), 1), axis=1)
    lengths = np.linalg.norm(corrected[pairs[:, 0]] - corrected[pairs[:, 1]], axis=1)
    return solution.factor.sum_of_squares, freedom, at, pairs, lengths


@pytest.mark.parametrize("position", [0, 3])
def test_prediction_errors_and_their_variances_are_those_of_dense_algebra(position: int) -> None:
    design = lay_out(small())
    observed = campaign(design, 2)
    x, design = observed.x, observed.design
    problem = replace(dense.planned(design, 3, 2), scales=x)
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
    # The worst reading is that of the largest error over its uncertainty.
    deviation = np.sqrt(np.diagonal(covariance))
    standardised = np.where(deviation > 0.03, mine / np.maximum(deviation, 0.03), 0.0)
    k = int(np.abs(standardised).argmax())
    row = int(np.flatnonzero(left)[k])
    u = float(reading_uncertainties(design, design.readings)[row // 3, row % 3])
    worst = validate(small(), observed, "given").to_dict()["left_out"][position]["worst_reading"]
    assert worst == {
        "ball": design.ball_label(int(design.readings.ball[row // 3])),
        "probe": design.probes.names[design.readings.probe[row // 3]],
        "axis": "xyz"[row % 3],
        "error": pytest.approx(mine[k] * u, rel=1e-2),
        "standard_uncertainty": pytest.approx(deviation[k] * u, rel=1e-3),
        "standardised": pytest.approx(standardised[k], rel=1e-2),
    }


@pytest.mark.parametrize("sigma", ["estimated", "given"])
def test_tests_and_changes_of_lengths_are_as_defined(sigma: Literal["estimated", "given"]) -> None:
    observed = campaign(lay_out(small()), 3)
    design = observed.design
    found = validate(small(), observed, sigma)
    assert [one.name for one in found.left_out] == list(design.positions.names)
    whole, full_freedom, full, pairs, lengths = fitted_without(design, observed.x, -1)
    told = found.to_dict()["left_out"]
    rows = list(csv.DictReader(found.to_csv().splitlines()))
    text = [line for line in found.lines() if line.startswith(tuple(design.positions.names))]
    for position, one in enumerate(told):
        square, freedom, at, _, of_rest = fitted_without(design, observed.x, position)
        assert one["predicted"] == full_freedom - freedom
        if sigma == "estimated":
            assert one["sigma"] ** 2 * freedom == pytest.approx(square, rel=1e-8)
        mean = (whole - square) / one["predicted"]
        scale = 1.0 if sigma == "given" else np.sqrt(square / freedom)
        chance = scipy.stats.f.sf(mean / (square / freedom), one["predicted"], freedom)
        if sigma == "given":
            chance = scipy.stats.chi2.sf(whole - square, one["predicted"])
        change = of_rest - lengths
        k = int(np.abs(change).argmax())
        places = MeasuredPoints(design.evaluation.points, np.full(12, design.evaluation.probe))
        distance = Distances(places, pairs[[k]], ("",))
        after, before = (
            float(one.uncertainty(linear_functions(one, distance))[0]) for one in (at, full)
        )
        u = scale * np.sqrt(after**2 - before**2)
        assert one["largest_length_difference"] == {
            "change": pytest.approx(change[k], rel=1e-3),
            "standard_uncertainty": pytest.approx(u, rel=1e-3),
            "undetermined": 0,
            "between": [f"point {end + 1}" for end in pairs[k]],
            "unit": "m",
        }
        expected = [one["predicted"], mean, scale, chance]
        names = ("predicted", "mean_square_error", "sigma", "chance")
        assert [one[name] for name in names] == pytest.approx(expected, rel=1e-3)
        expected += [one["worst_reading"]["standardised"], change[k], u]
        assert [float(each) for each in list(rows[position].values())[1:-1]] == pytest.approx(
            expected, rel=1e-3
        )
        shown = text[position].removeprefix(one["name"]).split()
        expected = [one["predicted"], np.sqrt(mean) / scale, chance]
        assert list(map(float, shown[:3])) == pytest.approx(expected, rel=0.05)
        expected = [one["worst_reading"]["standardised"], 1e6 * change[k], 2e6 * u]
        assert list(map(float, shown[6:])) == pytest.approx(expected, rel=0.01)
        names = ("ball", "probe", "axis")
        assert shown[3:6] == [one["worst_reading"][name] for name in names]
    assert not found.failed and not found.complaint
    assert found.lines()[-1].endswith(f" {min(one['chance'] for one in told):.2g}")


def test_a_shifted_reading_is_found_where_it_is() -> None:
    observed = campaign(lay_out(small()), 4)
    x = observed.x.copy()
    wrong = int(np.flatnonzero(observed.design.readings.position == 2)[5])
    x[wrong, 1] += 5e-6
    found = validate(small(), replace(observed, x=x), "given")
    design = observed.design
    # With a chance of one percent for all positions together.
    failed = [one.name for one in found.left_out if 6.0 * one.chance < 0.01]
    assert design.positions.names[2] in failed and len(failed) < 6
    assert [one.name for one in found.failed] == found.to_dict()["failed"] == failed
    marked = [line for line in found.lines() if line.endswith("<- failed")]
    assert [line[: line.index("  ")] for line in marked] == failed
    assert f"{', '.join(failed)};" in found.lines()[-1] and failed[0] in found.complaint
    assert found.headline() == f"6 left out in turn, {len(failed)} predicted wrongly"
    one = next(one for one in found.left_out if one.name == design.positions.names[2])
    assert one.worst is not None and one.worst.axis == "y"
    assert one.worst.ball == design.ball_label(int(design.readings.ball[wrong]))
    np.testing.assert_allclose(one.worst.error, 5e-6, atol=1.5e-6)


def test_what_is_unknown_without_a_position_has_no_number() -> None:
    """One of two positions leaves the scale of an axis open, and a single one has no others."""
    found, alone = (
        bp.validate(experiment, bp.simulate(experiment, seed=1))
        for name in ("two-dimensions", "bryan-gauge")
        for experiment in bp.load_all(f"designs/certified/{name}.yaml")
    )
    told = found.to_dict()["left_out"]
    assert [one["largest_length_difference"] for one in told] == [None, None]
    assert found.headline() == "2 left out in turn, 0 predicted wrongly" and not found.complaint
    assert [line.split()[1] + line.split()[-1] for line in found.lines()[4:6]] == ["11-", "11-"]
    assert alone.to_dict()["left_out"] == [] and "no test is possible" in alone.complaint
    assert alone.lines()[-1] == alone.headline() == "no position is predicted by the others"
