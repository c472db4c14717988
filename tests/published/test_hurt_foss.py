"""US 4,437,151 (Hurt and Foss): length equations, and the two steps for the Bryan gauge, over
simulated campaigns.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations_with_replacement
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.estimators.length_equations import LengthEstimator, length_estimate
from ballplate.montecarlo._reference import Truth, reference
from ballplate.montecarlo._replicates import BATCH, estimate_batch
from ballplate.montecarlo.experiments import true_experiment
from ballplate.results.fitting import fit
from ballplate.results.prediction import predict
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.geometry.artefacts import directions
from ballplate.simulator.machines.metric import SpatialMetricModel, parameters_of_metric
from ballplate.simulator.readings.reading_files import read_readings
from ballplate.simulator.readings.simulated import exact_readings, noisy_readings
from ballplate.simulator.readings.true_artefacts import noisy_certificate

FOLDER = Path("designs/hurt_foss")
NAMES = ("scale x", "scale y", "scale z", "C0Y", "B0Z", "A0Z")
CAMPAIGNS = [
    ("bar-bell", "length known"),
    ("bryan-gauge", "radius known"),
    ("bryan-gauge", "two pivots"),
]
COUNT = 1000


def shipped(file: str, variant: str) -> Experiment:
    return {one.name: one for one in load(FOLDER / f"{file}.yaml")}[variant]


def campaigns(
    design: Design, truth: Truth, estimator: LengthEstimator, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Errors (count, 6) of the parameters in simulated campaigns, and their stated
    uncertainties.
    """
    on_truth = replace(design, model=truth.model)
    errors, stated = [], []
    for trial in range(count):
        generator = np.random.default_rng([151, trial])
        drawn = noisy_certificate(design, truth.state, generator)
        _, x = noisy_readings(on_truth, truth.state, generator)
        found = length_estimate(drawn, x, estimator)
        assert found.converged
        errors.append(found.parameters - truth.state.a)
        stated.append(np.sqrt((found.spread**2).sum(axis=1)))
    return np.array(errors), np.array(stated)


def test_equations_102_to_107_turn_the_metric_into_scales_and_angles() -> None:
    model = SpatialMetricModel(True, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    a = np.array([2e-3, -3e-3, 1e-3, 4e-3, -5e-3, 6e-3])
    metric = model.axes(a).T @ model.axes(a)
    e1, e2, e3, e4, e5, e6 = (metric - np.eye(3))[np.triu_indices(3)]
    x, y, z = np.sqrt(1 + e1), np.sqrt(1 + e4), np.sqrt(1 + e6)
    np.testing.assert_allclose([x - 1, y - 1, z - 1], a[:3], rtol=0, atol=1e-15)
    angles = np.arccos([e2 / (x * y), e3 / (x * z), e5 / (y * z)])
    np.testing.assert_allclose(angles, np.pi / 2 + a[3:] * [1, -1, 1], rtol=0, atol=1e-15)
    np.testing.assert_allclose(parameters_of_metric(metric), a, rtol=0, atol=1e-15)
    # A true length is D' G D of the readings, whatever the axes.
    difference = np.array([[0.3, -0.2, 0.6]])
    zero = np.zeros((1, 3))
    true = difference + model.error(difference, a, zero) - model.error(zero, a, zero)
    assert true[0] @ true[0] == pytest.approx(difference[0] @ metric @ difference[0], rel=1e-14)


@pytest.mark.parametrize("estimator", ["length-equations", "sphere-then-metric"])
def test_equation_100_is_solved_exactly_by_bars(estimator: LengthEstimator) -> None:
    design, truth = true_experiment(shipped("bar-bell", "length known"))
    _, x = exact_readings(replace(design, model=truth.model), truth.state)
    found = length_estimate(design, x, estimator)
    np.testing.assert_allclose(found.parameters, truth.state.a, rtol=0, atol=1e-14)
    # Two passes: linear equations are solved by the first.
    assert found.iterations == 2 and found.deficiency == 0


@pytest.mark.parametrize("variant", ["radius known", "two pivots", "radius unknown"])
def test_equations_110_with_the_centre_are_exact_for_gauges(variant: str) -> None:
    design, truth = true_experiment(shipped("bryan-gauge", variant))
    _, x = exact_readings(replace(design, model=truth.model), truth.state)
    found = length_estimate(design, x)
    mean = truth.state.a[:3].mean() if variant == "radius unknown" else 0.0
    expected = np.append((truth.state.a[:3] - mean) / (1 + mean), truth.state.a[3:])
    np.testing.assert_allclose(found.parameters, expected, rtol=0, atol=1e-13)
    assert found.deficiency == (1 if variant == "radius unknown" else 0)


@pytest.mark.parametrize(("file", "variant"), CAMPAIGNS)
def test_the_general_estimator_is_unbiased_over_a_thousand_campaigns(
    file: str, variant: str
) -> None:
    experiment = shipped(file, variant)
    shared = reference(*true_experiment(experiment))
    start = shared.start.a - shared.truth.state.a
    batches = [estimate_batch(shared, 151, k) for k in range(-(-COUNT // BATCH))]
    errors = np.concatenate([start + one.found.a for one in batches])
    assert len(errors) >= COUNT and all(one.converged.all() for one in batches)
    stated = np.sqrt((shared.spectrum.root[shared.factor.layout.model] ** 2).sum(axis=1))
    assert_unbiased(errors / stated)
    assert stated.max() == pytest.approx(predict(experiment).quantities["U3"].maximum, rel=1e-3)


def assert_unbiased(z: np.ndarray) -> None:
    """z-scores (n, 6) with mean 0 and deviation 1, as far as n of them can tell: six tests at 4
    sigma each.
    """
    n = len(z)
    assert np.abs(z.mean(axis=0)).max() < 4.0 / np.sqrt(n)
    assert np.abs(z.std(axis=0, ddof=1) - 1.0).max() < 4.0 / np.sqrt(2 * n)


@pytest.mark.long
@pytest.mark.parametrize(("file", "variant"), CAMPAIGNS[:2])
def test_the_joint_length_equations_are_unbiased_over_a_thousand_campaigns(
    file: str, variant: str
) -> None:
    """Against their own scatter; the uncertainties that they state leave the certificate out."""
    experiment = shipped(file, variant)
    design, truth = true_experiment(experiment)
    errors, stated = campaigns(design, truth, "length-equations", COUNT)
    assert np.abs(errors.mean(axis=0) / (errors.std(axis=0, ddof=1) / np.sqrt(COUNT))).max() < 4.0
    # With weights that are all the same, equal lengths and equal noise, they lose nothing against
    # the general one.
    found = predict(experiment)
    assert errors.std(axis=0, ddof=1)[3:].max() == pytest.approx(
        found.quantities["U3 angles"].maximum, rel=0.1
    )
    # Student's distribution for the few degrees of freedom that the scatter is estimated with;
    # squareness only, as the certificate's error is one of scale.
    freedom = len(design.of(Lengths)) - 6 - 3 * len(design.gauge_positions)
    z = (errors / stated)[:, 3:]
    student = np.sqrt(freedom / (freedom - 2))
    assert np.abs(z.std(axis=0, ddof=1) / student - 1.0).max() < (0.2 if freedom < 10 else 0.1)


def kept_by_two_steps(units: np.ndarray) -> np.ndarray:
    """What two steps keep (6, 6) of e1 to e6, to first order, for a gauge in directions (m, 3).

    The sphere's centre takes from the products of direction cosines what looks like a shift of it.
    """
    pairs = list(combinations_with_replacement(range(3), 2))
    products = np.column_stack([(1 if i == j else 2) * units[:, i] * units[:, j] for i, j in pairs])
    shifts = np.linalg.lstsq(units, products, rcond=None)[0]
    return np.asarray(np.linalg.lstsq(products, products - units @ shifts, rcond=None)[0])


def as_parameters(of_factors: np.ndarray) -> np.ndarray:
    """The same matrix for scale and squareness errors, to first order."""
    order = [0, 3, 5, 1, 2, 4]
    size = np.array([0.5, 0.5, 0.5, -1.0, 1.0, -1.0])
    return np.asarray(size[:, None] * of_factors[np.ix_(order, order)] / size)


def test_the_bias_of_two_steps_is_what_the_centre_takes_up() -> None:
    """The measured bias is the one foretold, and far from none."""
    design, truth = true_experiment(shipped("bryan-gauge", "radius known"))
    errors, _ = campaigns(design, truth, "sphere-then-metric", COUNT)
    scatter = errors.std(axis=0, ddof=1) / np.sqrt(COUNT)
    kept = as_parameters(kept_by_two_steps(design.of(Lengths).direction))
    foretold = kept @ truth.state.a - truth.state.a
    assert np.abs((errors.mean(axis=0) - foretold) / scatter).max() < 4.0
    # Of the squareness of Z less than a third is left with elevations of 5 to 65 deg; C0Y is not
    # touched.
    assert np.abs(kept[[4, 5], [4, 5]]).max() < 1 / 3
    assert kept[3, 3] == pytest.approx(1.0, abs=1e-12)
    bias = dict(zip(NAMES, errors.mean(axis=0) / scatter, strict=True))
    assert min(abs(bias["B0Z"]), abs(bias["A0Z"])) > 100.0 and abs(bias["C0Y"]) < 4.0


def test_two_steps_are_right_where_every_direction_has_its_opposite() -> None:
    """What is even in the direction cannot look like a shift, which is odd; no gauge on a table
    reaches that.
    """
    half = directions(
        tuple((azimuth, elevation) for azimuth in range(6) for elevation in (-1.0, -0.3, 0.2, 0.9))
    )
    np.testing.assert_allclose(
        kept_by_two_steps(np.concatenate([half, -half])), np.eye(6), rtol=0, atol=1e-12
    )


def test_shipped_readings_give_the_true_errors() -> None:
    truth = {
        "scale x": 20e-6,
        "scale y": -30e-6,
        "scale z": 15e-6,
        "C0Y": 60e-6,
        "B0Z": -40e-6,
        "A0Z": 80e-6,
    }
    for file, variant in CAMPAIGNS[:2]:
        experiment = shipped(file, variant)
        found = fit(
            experiment, read_readings(FOLDER / f"{file}-readings.csv", lay_out(experiment)), "given"
        )
        for estimate in found.estimates:
            if estimate.name in truth:
                assert (
                    abs(estimate.value - truth[estimate.name]) < 3.0 * estimate.standard_uncertainty
                )
