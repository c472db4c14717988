"""Statistics of replicates: coverage, bias, their standard errors, and the same bits however the
work is shared.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.stats
from ballplate.montecarlo._reference import Reference, reference
from ballplate.montecarlo._replicates import BATCH, Estimates, estimate_batch
from ballplate.montecarlo._targets import MonteCarloQuantity, sample_of_pairs, targets
from ballplate.montecarlo.accumulator import accumulate
from ballplate.montecarlo.comparison_tables import trials_data, trials_lines, with_error
from ballplate.montecarlo.experiments import run_trials, trials, true_experiment
from ballplate.montecarlo.figures import (
    MonteCarloComparison,
    MonteCarloEstimate,
    MonteCarloOutcome,
    outcome,
)
from ballplate.results.prediction import predict
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.observations.readings import expected_readings, reading_blocks
from ballplate.simulator.design.parameters import shared_layout
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.uncertainty.summaries import uncertainties

from tests.montecarlo import wording
from tests.reference.small_quickstart import small_quickstart


def shipped(path: str, name: str | None = None) -> Experiment:
    return next(one for one in load(Path("designs") / path) if one.name == name)


@cache
def quickstart() -> Reference:
    return reference(*true_experiment(small_quickstart()))


@cache
def two_thousand() -> MonteCarloOutcome:
    """On a machine with errors."""
    return run_trials(quickstart(), 1, 2048)


def test_intervals_cover_what_they_say() -> None:
    """Over 2048 data sets, with sigma known and with sigma estimated."""
    found = two_thousand()
    assert found.trials == 2048 and not found.failed
    for symbol in ("U1", "U2", "U3", "U4", "U5", "U6"):
        one = found.comparisons[symbol]
        for share in (one.known, one.estimated):
            assert 0.0 < share.error < 0.003
            assert abs(share.value - 0.95) < 4 * share.error, symbol
        assert abs(one.spread.value - 1.0) < 4 * one.spread.error, symbol
        assert one.bias.value < 0.1 and one.flags == (), symbol


def test_residuals_are_those_of_a_right_model() -> None:
    misfit = two_thousand().misfit
    assert abs(misfit.mean.value - misfit.degrees_of_freedom) < 4 * misfit.mean.error
    # The variance of chi-square is twice its degrees of freedom.
    assert misfit.mean.error == pytest.approx(
        np.sqrt(2 * misfit.degrees_of_freedom / 2048), rel=0.1
    )
    assert abs(misfit.rejected.value - 0.05) < 4 * misfit.rejected.error


def test_linearised_uncertainties_are_those_of_the_plan() -> None:
    planned = predict(small_quickstart()).quantities
    found = two_thousand().comparisons
    for symbol in ("U1", "U2", "U4", "U5"):
        assert found[symbol].linear_average == pytest.approx(planned[symbol].average, rel=1e-3), (
            symbol
        )
        assert found[symbol].linear_maximum == pytest.approx(planned[symbol].maximum, rel=1e-3), (
            symbol
        )
    # A sample of the pairs of points.
    assert found["U6"].sampled and found["U6"].linear_average == pytest.approx(
        planned["U6"].average, rel=0.02
    )


def test_standard_errors_are_the_scatter_of_repeated_runs() -> None:
    """Over 32 runs of 64 data sets each, every figure scatters as it says."""
    shared = quickstart()
    # On a machine with a bias, which has a scatter of its own.
    aims = tuple(replace(aim, base=aim.base + 0.7 * aim.uncertainty) for aim in targets(shared))
    runs = [
        outcome(shared, aims, accumulate(shared, aims, estimate_batch(shared, 7, k), BATCH))
        for k in range(32)
    ]
    for symbol in ("U1", "U4", "U6"):
        for name in ("spread", "actual", "bias", "known", "estimated"):
            figures: list[MonteCarloEstimate] = [
                getattr(run.comparisons[symbol], name) for run in runs
            ]
            scatter = float(np.std([figure.value for figure in figures], ddof=1))
            stated = float(np.sqrt(np.mean([figure.error**2 for figure in figures])))
            # The scatter of 32 is itself known to 13 %.
            assert 0.6 < scatter / stated < 1.5, (symbol, name)


def comparison(errors: np.ndarray) -> MonteCarloComparison:
    """What errors (b, q), in their standard uncertainties, come to."""
    n, q = errors.shape
    shared: Any = SimpleNamespace(degrees_of_freedom=1, sum_of_squares=0.0)
    aim = MonteCarloQuantity("U4", np.zeros(q), np.ones(q), ("1",) * q, lambda _: errors)
    found: Any = None
    converged = np.ones(n, bool)
    many = Estimates(np.arange(n), found, np.ones(n), np.ones(n, np.int64), converged)
    return outcome(shared, (aim,), accumulate(shared, (aim,), many, n)).comparisons["U4"]


@pytest.mark.parametrize("standard_errors", [3.95, 4.05])
def test_a_bias_is_flagged_at_four_standard_errors(standard_errors: float) -> None:
    """A single value, whose mean has a standard error that needs no theory."""
    n = 4096
    normal = scipy.stats.norm.ppf((np.arange(n) + 0.5) / n)
    found = comparison(normal[:, None] + standard_errors * normal.std() / np.sqrt(n))
    assert ("bias" in found.flags) == (standard_errors > 4)
    assert found.bias.error == pytest.approx(1 / np.sqrt(n), rel=0.05)


@pytest.mark.parametrize("workers", [1, 2])
def test_the_same_bits_however_the_work_is_shared(workers: int) -> None:
    """700 data sets are a whole task and a part of another."""
    expected = run_trials(quickstart(), 3, 700)
    assert run_trials(quickstart(), 3, 700, workers=workers) == expected
    assert run_trials(quickstart(), 4, 700) != expected
    assert expected.trials == 700


def test_a_run_ends_when_it_is_accurate_enough() -> None:
    found = run_trials(quickstart(), 1, 100_000, until=0.02, workers=2)
    worst = max(one.spread.error / one.spread.value for one in found.comparisons.values())
    assert found.trials == 512 and worst <= 0.02


def test_an_interruption_keeps_what_is_done() -> None:
    def interrupt(progress: object) -> None:
        raise KeyboardInterrupt

    found = run_trials(quickstart(), 1, 5000, report=interrupt)
    assert found.interrupted and found.trials == 512
    assert replace(found, interrupted=False) == run_trials(quickstart(), 1, 512)


def test_too_poor_a_model_is_too_optimistic() -> None:
    """NPL Report CISE 15/98, section 5.3: an empirical machine, a kinematic fit."""
    done = trials(shipped("npl/5.3.yaml", "kinematic fit"), 128)
    assert done.outcome is not None and done.power is not None
    for symbol in ("U4", "U5", "U6"):
        one = done.outcome.comparisons[symbol]
        assert one.actual.value > 5 and abs(one.spread.value - 1.0) < 4 * one.spread.error + 0.05
        assert {"bias", "coverage"} <= set(one.flags)
    assert "U3" not in done.outcome.comparisons
    assert done.power > 0.999
    lines = "\n".join(trials_lines(done))
    assert wording.TOO_OPTIMISTIC_THE_FITTED_MODEL_CANNOT in lines
    assert trials_data(done)["too_optimistic"]["misfit_noticed"] == done.power
    # A misfit that does no harm.
    for ratio, harm in (
        (MonteCarloEstimate(1.03, 0.01), False),
        (MonteCarloEstimate(1.05, 0.01), True),
        (MonteCarloEstimate(0.9, 0.01), False),
    ):
        one = replace(done.outcome.comparisons["U4"], actual=ratio)
        harmless = replace(done, outcome=replace(done.outcome, comparisons={"U4": one}))
        lines = "\n".join(trials_lines(harmless))
        assert wording.THE_FITTED_MODEL_CANNOT_FOLLOW in lines
        assert ("Too optimistic?" in lines) is harm
        assert (wording.NONE_IS_ABOVE_BY_MORE in lines) is not harm


@pytest.mark.parametrize("variant", ["kinematic fit", "empirical fit"])
def test_a_second_fit_with_the_true_functions(variant: str) -> None:
    """Neither model of section 5.3 contains the other; only the kinematic one cannot follow the
    machine.
    """
    experiment = shipped("npl/5.3.yaml", variant)
    done = trials(experiment, 16)
    assert done.outcome is not None
    if variant == "empirical fit":
        assert done.power is not None and done.own_model is None
        return
    assert done.power is not None and done.own_model is not None
    own = done.own_model
    # The rank that the true machine's functions add, by a singular value decomposition of both
    # models' derivatives.
    design, truth = true_experiment(experiment)
    columns = []
    for model in (design.model, truth.model):
        both = replace(design, model=model)
        columns.append(dense_columns(both))
    ranks = [
        np.linalg.matrix_rank(one, tol=1e-9 * np.linalg.norm(one, 2))
        for one in (columns[0], np.hstack(columns))
    ]
    assert own.more == ranks[1] - ranks[0]
    assert own.gain == done.outcome.misfit.noise_free
    expected = scipy.stats.ncx2.sf(scipy.stats.chi2.isf(0.05, own.more), own.more, own.gain)
    assert own.power == pytest.approx(expected, abs=1e-9)
    assert f"functions added, {own.more} parameters more" in "\n".join(trials_lines(done))


def dense_columns(design: Design) -> np.ndarray:
    """Derivatives of all readings and distances by balls, poses and the model, scaled to unit
    columns.
    """
    state = nominal_state(design)
    x = expected_readings(design, state, design.readings)
    blocks = reading_blocks(design, state, design.readings, x)
    m, d = blocks.residual.shape
    layout = shared_layout(design)
    rows = np.zeros((m, d, design.balls.places.size + len(layout)))
    for i in range(m):
        ball, place = design.readings.ball[i], layout.pose_columns[design.readings.position[i]]
        rows[i, :, d * ball : d * ball + d] = blocks.by_ball[i]
        rows[i][:, design.balls.places.size + place[place >= 0]] = blocks.by_pose[i][:, place >= 0]
        rows[i, :, design.balls.places.size + layout.model.start :] = blocks.by_model[i]
    tied = design.of(CalibratedDistances).rows(design, state, None)
    below = np.zeros((len(tied.residual), rows.shape[2]))
    for row, (one, other, along) in enumerate(
        zip(
            design.of(CalibratedDistances).first,
            design.of(CalibratedDistances).second,
            tied.by_ball[:, 0],
            strict=True,
        )
    ):
        below[row, d * one : d * one + d] = along
        below[row, d * other : d * other + d] = -along
    whole = np.concatenate([rows.reshape(m * d, -1), below])
    return np.asarray(whole / np.maximum(np.linalg.norm(whole, axis=0), 1e-30))


def test_a_model_that_holds_the_true_one_is_not_blamed() -> None:
    done = trials(shipped("npl/5.2.yaml", "kinematic fit"), 64)
    assert wording.THE_FITTED_ONE_FOLLOWS_EXACTLY in "\n".join(trials_lines(done))
    assert done.outcome is not None and done.outcome.comparisons["U6"].flags == ()


@pytest.mark.parametrize(
    ("file", "variant"), [("npl/6.1.1.yaml", "B"), ("hurt_foss/bryan-gauge.yaml", "one height")]
)
def test_of_a_deficient_design_what_is_determined_is_replicated(file: str, variant: str) -> None:
    """S^2 has the degrees of freedom of the rank, and nothing undetermined is among the figures."""
    experiment = shipped(file, variant)
    done = trials(experiment, 256)
    assert done.outcome is not None and not done.outcome.failed
    at = linearise(lay_out(experiment))
    assert at.deficiency > 0
    rank = at.design.parameter_count - at.deficiency
    misfit = done.outcome.misfit
    assert misfit.degrees_of_freedom == at.design.observation_count - rank
    assert not misfit.mean.differs_from(misfit.degrees_of_freedom)
    quantities = uncertainties(at)
    for symbol, one in done.outcome.comparisons.items():
        assert not one.spread.differs_from(1.0) and not one.flags
        if not one.sampled and ", " not in one.unit and symbol in quantities:
            known = quantities[symbol].count - quantities[symbol].undetermined
            assert one.count <= known
    if variant == "one height":
        # Scales of x and y are known together only: but for the squareness of both all is open.
        assert set(done.outcome.comparisons) == {"U3"}


def test_what_cannot_be_wrong_is_not_counted() -> None:
    """The metric without a scale has no error in y at the evaluation points."""
    done = trials(shipped("hocken_borchardt/dummy.yaml", "without scale"), 256)
    assert done.outcome is not None
    for one in done.outcome.comparisons.values():
        assert np.isfinite([one.spread.value, one.bias.value]).all() and one.flags == ()


def test_distances_that_the_model_leaves_alone_are_not_counted() -> None:
    """In this plane the model changes no distance along y: nine of 36, whose uncertainties are
    rounding.
    """
    done = trials(shipped("certified/two-dimensions.yaml"), 256)
    assert done.outcome is not None
    counted = done.outcome.comparisons["U6"]
    assert counted.count == 27
    assert abs(counted.spread.value - 1.0) < 4.0 * counted.spread.error


def test_a_sample_of_pairs_has_each_pair_once() -> None:
    first, second, sampled = sample_of_pairs(40, 500)
    assert sampled and len(first) == 500
    assert (first < second).all() and second.max() < 40 and first.min() >= 0
    assert len({*zip(first.tolist(), second.tolist(), strict=True)}) == 500
    whole = sample_of_pairs(40, 779)
    assert len({*zip(whole[0].tolist(), whole[1].tolist(), strict=True)}) == 779


@pytest.mark.parametrize(
    ("figure", "text"),
    [
        (MonteCarloEstimate(0.95, 0.0), "0.95"),
        (MonteCarloEstimate(1.0, 0.0996), "1.0(1)"),
        (MonteCarloEstimate(1234.0, 56.0), "1234(56)"),
        (MonteCarloEstimate(float("nan"), 1.0), "-"),
    ],
)
def test_figures_with_their_error(figure: MonteCarloEstimate, text: str) -> None:
    assert with_error(figure) == text
