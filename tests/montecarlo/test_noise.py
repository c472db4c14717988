"""Noise that is not normal, against moments and tails that are known, and the same noise for the
same seed.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.montecarlo._reference import reference
from ballplate.montecarlo._replicates import BATCH, draw
from ballplate.montecarlo.experiments import trials, true_experiment
from ballplate.simulator.design.objects import Noise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.readings.simulated import (
    exact_readings,
    noisy_readings,
    simulated_readings,
)
from numpy.typing import NDArray
from scipy import stats

from tests.montecarlo import wording
from tests.reference import dense
from tests.reference.small_quickstart import OF_ENTRIES

Real = NDArray[np.float64]

KINDS = {
    "normal": (Noise(), stats.norm()),
    "uniform": (Noise("uniform"), stats.uniform(-np.sqrt(3.0), 2.0 * np.sqrt(3.0))),
    "student t": (Noise("student t", 5.0), stats.t(5.0, scale=np.sqrt(0.6))),
}


@pytest.fixture(scope="module")
def small() -> bp.Experiment:
    return bp.quickstart().with_(OF_ENTRIES)


def generator() -> np.random.Generator:
    return np.random.default_rng(20261122)


@pytest.mark.parametrize("kind", KINDS)
def test_noise_has_its_distribution_and_unit_variance(kind: str) -> None:
    noise, expected = KINDS[kind]
    found = noise.draw(generator(), (20_000, 3), np.zeros(20_000, np.int64), 0)
    assert expected.std() == pytest.approx(1.0)
    assert stats.kstest(found.ravel(), expected.cdf).pvalue > 1e-3


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("axis", [0, 2])
def test_readings_of_a_position_are_correlated_as_stated(kind: str, axis: int) -> None:
    noise = replace(KINDS[kind][0], correlation=0.4)
    position = np.array([0, 0, 1, 1, 0])
    count = 40_000 if axis == 2 else 10_000
    if axis == 2:
        found = noise.draw(generator(), (count, 2, 5), position, 2)
    else:
        own = generator()
        found = np.array([noise.draw(own, (5, 2), position, 0).T for _ in range(count)])
    same = position[:, None] == position
    expected = np.where(same, 0.4, 0.0) + np.diag(np.full(5, 0.6))
    for k in range(2):
        np.testing.assert_allclose(np.cov(found[:, k].T), expected, atol=0.06)
    # Along different axes nothing is shared.
    across = np.cov(found[:, 0].T, found[:, 1].T)[:5, 5:]
    np.testing.assert_allclose(across, 0.0, atol=0.06)


def test_normal_noise_is_what_it_has_been() -> None:
    """Bits of the generator itself, in the order of the readings."""
    experiment = bp.quickstart()
    design = lay_out(experiment)
    simulated = simulated_readings(experiment)
    again = generator()
    _, x = noisy_readings(design, simulated.truth, again)
    _, exact = exact_readings(design, simulated.truth)
    expected = exact + generator().standard_normal(x.shape) * design.machine.repeatability
    np.testing.assert_array_equal(x, expected)
    shared = reference(*true_experiment(experiment))
    own = np.random.default_rng(np.random.SeedSequence(4, spawn_key=(2,)))
    drawn = own.standard_normal((BATCH, *shared.noise.shape))
    drawn *= shared.noise
    np.testing.assert_array_equal(draw(shared, 4, 2).moved, drawn)


def test_any_number_of_workers_draws_the_same(small: bp.Experiment) -> None:
    noise = {"distribution": "student t", "degrees_of_freedom": 4, "correlation": 0.3}
    one, two = (trials(small.with_(noise=noise), 600, 5, workers=count) for count in (1, 2))
    assert one.outcome is not None
    assert one.outcome == two.outcome != trials(small, 600, 5).outcome


def test_monte_carlo_and_simulated_readings_have_the_stated_noise(small: bp.Experiment) -> None:
    """Of uniform noise no reading is off by more than the root of 3 of its uncertainty."""
    uniform, normal = small.with_(noise="uniform"), small
    most = {}
    for name, experiment in (("uniform", uniform), ("normal", normal)):
        shared = reference(*true_experiment(experiment))
        moved = draw(shared, 1, 0).moved / shared.noise
        simulated = simulated_readings(experiment)
        exact = exact_readings(simulated.design, simulated.truth)[1]
        off = (simulated.x - exact) / simulated.design.machine.repeatability
        most[name] = float(np.abs(moved).max()), float(np.abs(off).max())
        assert moved.std() == pytest.approx(1.0, abs=0.02)
    assert max(most["uniform"]) < np.sqrt(3.0) + 1e-6
    assert most["normal"][0] > 3.0


def test_correlated_noise_has_the_spread_of_a_dense_computation(small: bp.Experiment) -> None:
    """The estimate does not know of the correlation; its covariance is that of the errors behind a
    fixed linear estimate.
    """
    found = trials(small.with_(noise={"correlation": 0.6}), 2000, 3).outcome
    assert found is not None
    problem = dense.planned(lay_out(small), 3, 3)
    whole = dense.jacobian(lambda step: dense.residuals(problem, step), problem.parameters)
    readings = problem.design.readings
    member = (3 * readings.position[:, None] + np.arange(3)).ravel()
    errors = np.eye(len(whole))
    m = len(member)
    errors[:m, :m] += 0.6 * ((member[:, None] == member) - np.eye(m))
    scale = np.sqrt((whole**2).sum(axis=0))
    gain = np.linalg.pinv(whole / scale) / scale[:, None]
    for symbol in ("U5", "U6"):
        rows = dense.jacobian(dense.quantities(problem)[symbol], problem.parameters) @ gain
        expected = np.sqrt(np.einsum("ij,jk,ik->i", rows, errors, rows)).mean()
        one = found.comparisons[symbol]
        off = 5.0 * one.actual.error * one.linear_average
        assert one.actual_average == pytest.approx(expected, abs=off)
        # Most of it goes into the poses.
        assert expected < 0.8 * one.linear_average


ON_THE_PAGE: dict[str, Any] = {
    "normal": "normal",
    "uniform": "uniform",
    "student t, 5 degrees of freedom": {"distribution": "student t", "degrees_of_freedom": 5},
    "student t, 3 degrees of freedom": {"distribution": "student t", "degrees_of_freedom": 3},
    "normal, correlation 0.2": {"correlation": 0.2},
}


@pytest.mark.long
@pytest.mark.parametrize("name", ON_THE_PAGE)
def test_the_page_states_what_monte_carlo_gives(name: str) -> None:
    page = Path("docs/reference/validation.md").read_text(encoding="utf-8")
    (line,) = [one for one in page.splitlines() if one.startswith(f"| {name} |")]
    told = [float(cell.split()[0]) for cell in line.split("|")[2:-1]]
    found = trials(bp.quickstart().with_(noise=ON_THE_PAGE[name]), 2000).outcome
    assert found is not None
    one = found.comparisons["U6"]
    expected = [one.spread.value, *(100 * share.value for share in (one.known, one.estimated))]
    assert told == pytest.approx([*expected, 100 * found.misfit.rejected.value], abs=0.051)


@pytest.mark.parametrize(
    ("noise", "text"),
    [
        ("student t", "noise: student t has no degrees of freedom; write"),
        (
            {"distribution": "uniform", "degrees_of_freedom": 4},
            "noise.degrees_of_freedom: uniform noise has no degrees of freedom; remove the key,"
            " or write student t",
        ),
        ({"distribution": "student t", "degrees_of_freedom": 2}, "noise.degrees_of_freedom"),
        ({"correlation": 1.0}, "noise.correlation"),
        ("gaussian", 'noise: unknown value "gaussian"; allowed: normal, uniform, student t'),
    ],
)
def test_wrong_noise_is_refused(noise: Any, text: str, small: bp.Experiment) -> None:
    with pytest.raises(ExperimentError, match=text):
        small.with_(noise=noise)


def test_correlation_is_told_not_to_be_in_uncertainties(small: bp.Experiment) -> None:
    (doubt,) = small.with_(noise={"correlation": 0.2}).doubts
    assert wording.TO_TAKE_THE_NOISE_OF_ALL in doubt
    assert not small.with_(noise="uniform").doubts
