"""Every figure of Monte Carlo from its definition, replicate by replicate; what is followed, against
estimates by themselves; and when a run is over.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.montecarlo._reference import Reference, Truth, complete_fit, reference
from ballplate.montecarlo._replicates import Estimates, draw, estimate_batch
from ballplate.montecarlo._targets import MonteCarloQuantity, targets
from ballplate.montecarlo.accumulator import Accumulator, accumulate
from ballplate.montecarlo.experiments import TASK, accuracy_of, run_trials, true_experiment
from ballplate.montecarlo.figures import outcome
from ballplate.simulator.computing.steps import ProgressStep
from ballplate.simulator.design.observations.coordinates import CalibratedCoordinates
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.estimation.functions import Parameters
from ballplate.simulator.geometry.motions import vector_from_rotation
from ballplate.uncertainty.quantities import QUANTITIES, QuantityKind
from numpy.typing import NDArray
from scipy import stats

from .test_replicates import small, truth

Real = NDArray[np.float64]
FREEDOM = 12


class Replicates:
    """Errors of a quantity in lengths and angles, drawn at random, in some hundred replicates."""

    def __init__(self, n: int = 300, seed: int = 3) -> None:
        generator = np.random.default_rng(seed)
        self.units = ("m", "rad", "m", "m", "rad")
        self.uncertainty = np.array([1e-6, 3e-5, 4e-6, 1e-8, 1e-5])
        self.base = 0.4 * self.uncertainty * [1.0, -1.0, 0.0, 2.0, 1.0]
        own = generator.standard_normal((n, 5)) + 0.5 * generator.standard_normal((n, 1))
        self.change = own * self.uncertainty
        self.squares = generator.chisquare(FREEDOM, n) * 1.1
        self.passes = generator.integers(2, 9, n)
        self.converged = ~np.isin(np.arange(n), [17, 200])
        self.aim = MonteCarloQuantity(
            "U4", self.base, self.uncertainty, self.units, lambda found: self.change[found]
        )

    def sums(self, part: slice) -> Accumulator:
        shared: Any = SimpleNamespace(degrees_of_freedom=FREEDOM)
        index = np.arange(len(self.squares))[part]
        found: Any = index
        many = Estimates(index, found, self.squares[part], self.passes[part], self.converged[part])
        return accumulate(shared, (self.aim,), many, len(index))


def mean(numbers: Real) -> tuple[Any, Any]:
    """A mean over replicates, and its standard error."""
    return (
        pytest.approx(numbers.mean(), rel=1e-9),
        pytest.approx(numbers.std(ddof=1) / np.sqrt(len(numbers)), rel=1e-6),
    )


@pytest.mark.parametrize("cut", [0, 1, 128, 300])
def test_figures_are_means_over_replicates(cut: int) -> None:
    """However the replicates are shared out among sums."""
    given = Replicates()
    total = given.sums(slice(0, cut)) + given.sums(slice(cut, None))
    shared: Any = SimpleNamespace(degrees_of_freedom=FREEDOM, sum_of_squares=0.25)
    found = outcome(shared, (given.aim,), total)
    kept = given.converged
    assert found.failed == (17, 200)
    assert (found.trials, found.passes) == (300, given.passes.max())
    one, change, n = found.comparisons["U4"], given.change[kept], kept.sum()
    error, squares = change + given.base, given.squares[kept]
    in_units, whole = change / given.uncertainty, error / given.uncertainty
    for figure, numbers in (
        (one.spread, (in_units**2).mean(axis=1)),
        (one.actual, against_typical(error, given)),
    ):
        value, own = numbers.mean(), numbers.std(ddof=1) / np.sqrt(n)
        assert figure.value == pytest.approx(np.sqrt(value), rel=1e-9)
        assert figure.error == pytest.approx(own / (2.0 * np.sqrt(value)), rel=1e-6)
    sigma = np.sqrt(squares / FREEDOM)
    known = (np.abs(whole) <= stats.norm.ppf(0.975)).mean(axis=1)
    estimated = (np.abs(whole) <= stats.t.ppf(0.975, FREEDOM) * sigma[:, None]).mean(axis=1)
    assert (one.known.value, one.known.error) == mean(known)
    assert (one.estimated.value, one.estimated.error) == mean(estimated)
    of_mean = error.mean(axis=0)
    by_chance = (in_units**2).mean() / n
    square = ((of_mean / given.uncertainty) ** 2).mean() - by_chance
    assert one.bias.value == pytest.approx(np.sqrt(square), rel=1e-9)
    assert one.largest_bias == pytest.approx(np.abs(of_mean).max(), rel=1e-9)
    rms = np.sqrt((error**2).mean(axis=0))
    assert (one.actual_maximum, one.actual_average) == pytest.approx((rms.max(), rms.mean()))
    assert (one.linear_maximum, one.linear_average) == pytest.approx(
        (given.uncertainty.max(), given.uncertainty.mean())
    )
    assert (one.unit, one.count, one.sampled) == ("m, rad", 5, False)
    misfit = found.misfit
    assert (misfit.mean.value, misfit.mean.error) == mean(squares)
    assert (misfit.degrees_of_freedom, misfit.noise_free) == (FREEDOM, 0.25)
    share = (squares > stats.chi2.ppf(0.95, FREEDOM)).mean()
    assert 0.0 < share < 0.3 and misfit.rejected.value == pytest.approx(share)
    assert misfit.rejected.error == pytest.approx(np.sqrt(share * (1.0 - share) / n))
    assert accuracy_of(total) == pytest.approx(one.spread.error / one.spread.value, rel=1e-6)


def against_typical(error: Real, given: Replicates) -> Real:
    """Squares of errors over the mean square uncertainty in their unit, a mean for each replicate."""
    typical = np.empty(len(given.units))
    for unit in ("m", "rad"):
        own = np.array(given.units) == unit
        typical[own] = (given.uncertainty[own] ** 2).mean()
    return np.asarray((error**2 / typical).mean(axis=1))


def test_one_replicate_has_no_accuracy() -> None:
    given = Replicates(1)
    total = given.sums(slice(None))
    shared: Any = SimpleNamespace(degrees_of_freedom=FREEDOM, sum_of_squares=0.0)
    found = outcome(shared, (given.aim,), total)
    assert accuracy_of(total) == np.inf == found.misfit.mean.error
    assert found.comparisons["U4"].spread.error == np.inf
    assert found.comparisons["U4"].flags == ()


def test_quantities_of_a_name_are_told_apart() -> None:
    given = Replicates()
    shared: Any = SimpleNamespace(degrees_of_freedom=FREEDOM, sum_of_squares=0.0)
    one = given.sums(slice(None))
    total = replace(one, quantities=3 * one.quantities)
    found = outcome(shared, 3 * (given.aim,), total).comparisons
    assert list(found) == ["U4", "U4'", "U4''"]
    assert found["U4"] == found["U4'"] == found["U4''"]


def small_file() -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load(Path("designs/quickstart.yaml").read_text("utf-8"))
    content["artefacts"]["plate"]["balls"] = [3, 3]
    content["error_model"] |= {"position_coefficients": 2, "rotation_coefficients": 2}
    content["evaluation"]["points"] = {"random": 12, "seed": 1}
    return content


def with_bar() -> Reference:
    """A plate beside a bar of unknown length."""
    content = small_file()
    bar = {"kind": "two_spheres", "length": "500 mm", "role": "length_standard"}
    content["artefacts"]["bar"] = bar
    content["positions"] = [one | {"artefact": "plate"} for one in content["positions"]] + [
        {
            "name": f"bar {k}",
            "artefact": "bar",
            "probes": ["down"],
            "pose": {"origin": ["200 mm", f"{300 * k} mm", "300 mm"]},
        }
        for k in (1, 2)
    ]
    content["calibration"] = [one | {"artefact": "plate"} for one in content["calibration"]]
    design, real = true_experiment(bp.experiment(content))
    assert len(design.unknown_lengths.names) == 1
    return reference(design, real)


def with_drift() -> Reference:
    """Scales that drift."""
    drift = {"kind": "drift", "axes": {"standard_uncertainty": "1 um/h"}}
    content = small_file() | {"influences": [drift | {"times": {"reading": "20 s"}}]}
    design, real = true_experiment(bp.experiment(content))
    assert len(design.influence_parameters) == 3
    rates = 1e-6 * np.array([1.0, -2.0, 0.5])
    return reference(design, Truth(replace(real.state, influences=rates), real.model))


def followed(shared: Reference, monkeypatch: pytest.MonkeyPatch) -> MonteCarloQuantity:
    """All shared parameters as one quantity."""

    def every(design: object, layout: Any) -> tuple[Parameters, ...]:
        own = layout.parameters
        return (
            Parameters(np.eye(len(own)), tuple(p.name for p in own), tuple(p.unit for p in own)),
        )

    monkeypatch.setitem(QUANTITIES, "all", QuantityKind("all shared parameters", every))
    (found,) = [one for one in targets(shared) if one.symbol == "all"]
    assert len(found.base) == len(shared.factor.layout)
    return found


def own_changes(shared: Reference, k: int, seed: int) -> Real:
    """What the shared parameters of a replicate's own estimate differ by from the reference."""
    solution, layout = (
        complete_fit(shared, *draw(shared, seed, 0).replicate(k)),
        shared.factor.layout,
    )
    state, start = solution.state, shared.start
    turns = vector_from_rotation(state.rotations @ start.rotations.transpose(0, 2, 1))
    found = np.full(len(layout), np.nan)
    poses = np.concatenate([state.origins - start.origins, turns], axis=1)
    found[layout.pose_columns[layout.pose_columns >= 0]] = poses[layout.pose_columns >= 0]
    found[layout.model] = state.a - start.a
    free = layout.offset_columns >= 0
    found[layout.offset_columns[free]] = (state.probes - start.probes)[free]
    found[layout.lengths] = state.lengths - start.lengths
    found[layout.influences] = state.influences - start.influences
    assert np.isfinite(found).all()
    return found


@pytest.mark.parametrize("make", [with_bar, with_drift])
def test_all_shared_parameters_are_followed(
    make: Callable[[], Reference], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without noise none of them is off where the model holds the truth; with it, each as in an
    estimate by itself.
    """
    shared = make()
    aim = followed(shared, monkeypatch)
    assert (np.abs(aim.base) < 1e-4 * aim.uncertainty).all()
    changes = aim.change(estimate_batch(shared, 2, 0, 3).found)
    for k in (0, 2):
        off = np.abs(changes[k] - own_changes(shared, k, 2)) / aim.uncertainty
        assert off.max() < 1e-3
        assert np.abs(changes[k] / aim.uncertainty).max() > 1.0


@pytest.mark.parametrize(("until", "trials"), [(0.03, 5000), (0.001, 700)])
def test_progress_tells_how_many_are_needed(until: float, trials: int) -> None:
    """Accuracy improves as the root of the number of data sets."""
    shared = reference(small(), truth(small()))
    steps: list[ProgressStep] = []
    found = run_trials(shared, 1, trials, until, report=steps.append)
    counts = [min(TASK * (k + 1), trials) for k in range(len(steps))]
    assert [one.done for one in steps] == counts and found.trials == counts[-1]
    first = run_trials(shared, 1, TASK).comparisons.values()
    accuracy = max(one.spread.error / one.spread.value for one in first)
    needed = TASK * max(accuracy / until, 1.0) ** 2
    assert steps[0].wanted == pytest.approx(min(needed, trials), abs=1.0)
    assert steps[0].remark == f"accurate to {100 * accuracy:.2g} %"
    assert all(one.wanted <= trials for one in steps)
    worst = max(one.spread.error / one.spread.value for one in found.comparisons.values())
    assert (worst <= until) == (found.trials < trials)
    assert (len(steps) == 1) == (accuracy <= until)


@pytest.mark.parametrize("share", [0.5, 2.0, 1e6])
def test_what_is_almost_certain_is_as_certain_as_a_share_of_the_best_axis(share: float) -> None:
    """A ten thousandth of the smallest of the repeatabilities, and no certificate less."""
    design = small(pairs=False)
    least = 1e-4 * float(design.machine.repeatability.min())
    assert design.machine.repeatability.max() == pytest.approx(3e4 * least)
    given = design.of(CalibratedCoordinates)
    tight = replace(given, uncertainty=np.full(len(given), share * least))
    shared = reference(design.observed(tight), truth(design))
    own = shared.design.of(CalibratedCoordinates).uncertainty
    np.testing.assert_allclose(own, max(share, 1.0) * least)
    assert len(shared.design.of(CalibratedDistances)) == 0
