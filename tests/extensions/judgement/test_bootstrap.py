"""Data sets of a fit's own parameters: bits, statistics by hand, and linear theory where it holds."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.judgement import bootstrap as of_bootstrap
from ballplate.extensions.judgement.bootstrap import Replicate, bootstrap
from ballplate.results.fits import Fit
from ballplate.simulator.experiment.model import Experiment

from tests.extensions.judgement import wording


@cache
def small(deficient: bool = False) -> Experiment:
    """Nine balls in six positions, without a certificate if its scale is to be open."""
    plate = {"plate": {"kind": "grid", "balls": [3, 3], "size": ["750 mm", "750 mm"]}}
    model = {"kind": "kinematic", "position_coefficients": 2, "rotation_coefficients": 1}
    points = {"points": {"random": 4, "seed": 3}, "probe": "down"}
    changes: dict[str, object] = {"artefacts": plate, "error_model": model, "evaluation": points}
    if deficient:
        probes = {"probes": {"down": ["0 mm", "0 mm", "0 mm"]}}
        positions = [
            {"name": "z low", "plane": "z", "level": "250 mm", "corner": {"x": "0 mm", "y": "0 mm"}}
            | {"probes": ["down"]},
            {"name": "x low", "plane": "x", "level": "250 mm", "corner": {"y": "0 mm", "z": "0 mm"}}
            | {"probes": ["down"], "quarter_turns": 1},
            {"name": "y low", "plane": "y", "level": "250 mm", "corner": {"x": "0 mm", "z": "0 mm"}}
            | {"probes": ["down"], "quarter_turns": 1},
        ]
        changes |= {"calibration": [], "positions": positions, **probes}
        changes |= {"expected_rank_deficiency": 1}
    return bp.quickstart().with_(changes)


@cache
def fitted(deficient: bool = False) -> Fit:
    experiment = small(deficient)
    return bp.fit(experiment, bp.simulate(experiment))


def test_a_data_set_is_the_same_whatever_else_is_computed() -> None:
    few, more = (fitted().with_trials(trials, 3).bootstrap for trials in (2, 5))
    assert few is not None and more is not None
    np.testing.assert_array_equal(few.deviations, more.deviations[:2])
    other = fitted().with_trials(2, 4).bootstrap
    assert other is not None and not np.array_equal(few.deviations, other.deviations)


@pytest.mark.long
def test_workers_do_not_change_a_bit() -> None:
    one, two = (fitted().with_trials(40, 3, workers).bootstrap for workers in (1, 2))
    assert one is not None and two is not None
    np.testing.assert_array_equal(one.deviations, two.deviations)
    np.testing.assert_array_equal(one.sigmas, two.sigmas)


def within_linear_theory(fit: Fit, trials: int) -> None:
    found = fit.with_trials(trials, 5).bootstrap
    assert found is not None and not found.failed
    known = np.isfinite(found.uncertainties) & (found.uncertainties > 0.0)
    assert known.any()
    ratio = found.standard_deviations[known] / found.uncertainties[known]
    assert np.abs(ratio - 1.0).max() < 5.0 / np.sqrt(2.0 * (trials - 1))
    bias = found.biases[known] / found.uncertainties[known]
    assert np.abs(bias).max() < 5.0 / np.sqrt(trials)
    assert abs((found.sigmas**2).mean() - 1.0) < 5.0 * np.sqrt(
        2.0 / fit.degrees_of_freedom / trials
    )
    assert found.differing == ()


@pytest.mark.parametrize("deficient", [False, True])
def test_standard_deviations_are_the_linear_ones(deficient: bool) -> None:
    """The errors are a millionth of the lengths, so that linear theory holds; of a design that
    leaves the scale open, what is determined.
    """
    fit = fitted(deficient)
    assert bool(fit.verdict.deficiency) == deficient
    within_linear_theory(fit, 24)
    if deficient:
        found = fit.with_trials(2, 5).bootstrap
        assert found is not None and np.isnan(found.standard_deviations).any()
        assert wording.UNDETERMINED_AND_ARE_LEFT_OUT in "\n".join(found.lines())


@pytest.mark.long
@pytest.mark.parametrize("deficient", [False, True])
def test_standard_deviations_are_the_linear_ones_in_many_data_sets(deficient: bool) -> None:
    within_linear_theory(fitted(deficient), 2000)


def test_statistics_are_those_written_down(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of data sets that are made up: means, deviations, quantiles over their own sigma, failures."""
    functions = fitted().functions
    generator = np.random.default_rng(1)
    drawn = generator.standard_normal((50, len(functions.functions)))
    sigmas = generator.uniform(0.5, 1.5, 50)

    def made_up(*given: object) -> Replicate:
        trial = int(given[-1])  # type: ignore[call-overload]
        if trial in (7, 30):
            return Replicate("diverged", np.zeros(0), float("nan"))
        return Replicate("converged", functions.values + drawn[trial], sigmas[trial])

    monkeypatch.setattr(of_bootstrap, "replicated", made_up)
    found = bootstrap("a", "b", functions, 1.0, True, 50, 1)
    kept = np.delete(np.arange(50), [7, 30])
    assert found.failed == ((7, "diverged"), (30, "diverged"))
    assert wording.DID_NOT_CONVERGE in found.lines()[1] and "7 (diverged)" in found.lines()[1]
    np.testing.assert_allclose(found.standard_deviations, drawn[kept].std(axis=0, ddof=1))
    np.testing.assert_allclose(found.biases, drawn[kept].mean(axis=0), atol=1e-12)
    studentised = np.sort(drawn[kept] / sigmas[kept, None], axis=0)
    place = 0.975 * (len(kept) - 1)
    low, part = int(place), place % 1
    upper = (1 - part) * studentised[low] + part * studentised[low + 1]
    np.testing.assert_allclose(found.intervals[:, 0], functions.values - upper, atol=1e-12)


def test_monomials_and_names() -> None:
    fit = bp.fit(small(), bp.simulate(small()), monomials=True, trials=2, seed=1)
    assert fit.bootstrap is not None
    names = [row["parameter"] for row in fit.bootstrap.rows()]
    assert "EXX t^1" in names
    assert fit.to_dict()["bootstrap"]["trials"] == 2
    assert fit.lines()[-1] == fit.bootstrap.lines()[-1]


def test_what_goes_with_trials_only_is_refused() -> None:
    with pytest.raises(ValueError, match=wording.APPLY_TO_TRIALS_ONLY):
        bp.fit(small(), bp.simulate(small()), seed=3)
    with pytest.raises(ValueError, match=wording.TRIALS_APPLIES_TO_THE_ESTIMATOR_FULL):
        bp.fit(small(), bp.simulate(small()), estimator="distances", trials=3)  # type: ignore[call-overload]
    with pytest.raises(ValueError, match="has not converged|unknown"):
        replace(fitted(), estimated=None).with_trials(2, 1)
