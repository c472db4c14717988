"""Data sets that the shared factor does not bring to their estimate are estimated by themselves, so
that no figure is that of a selection.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.sweeps.task import trial_figures
from ballplate.montecarlo import _replicates
from ballplate.montecarlo._reference import Reference, reference, replicate_data
from ballplate.montecarlo._replicates import BATCH, _gradient, _refined, _step, draw, estimate_batch
from ballplate.montecarlo._targets import targets
from ballplate.montecarlo.accumulator import accumulate
from ballplate.montecarlo.comparison_tables import trials_data, trials_lines
from ballplate.montecarlo.experiments import Trials, true_experiment
from ballplate.montecarlo.figures import MonteCarloOutcome, outcome
from ballplate.presentation.formatting import as_data
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.gauss_newton import estimate
from ballplate.simulator.geometry.motions import rotation_from_vector

from tests.reference.small_quickstart import small_sections

from .test_replicates import assert_agree, small, truth, with_unknown_probes


@cache
def weak() -> Reference:
    """The quickstart read a thousand times less well: of full rank, and far from linear."""
    changes = {"machine.repeatability": "200 um", "evaluation.points": {"random": 10, "seed": 1}}
    return reference(*true_experiment(bp.quickstart().with_(changes)))


def test_no_data_set_of_a_weak_design_is_left_out() -> None:
    """Half of these had no estimate where all were refined with the shared factor alone."""
    shared, aims, count = weak(), targets(weak()), 12
    found = estimate_batch(shared, 1, 0, count)
    assert found.converged.all()
    drawn = draw(shared, 1, 0)
    for k in (0, 7):
        solution = estimate(*replicate_data(shared, *drawn.replicate(k)))
        state, own = solution.state, found.found
        spread = own.balls.std(axis=0).max()
        assert np.abs(shared.start.balls + own.balls[k].T - state.balls).max() < 1e-3 * spread
        turned = rotation_from_vector(own.rotations[k]) @ shared.start.rotations
        assert np.abs(turned - state.rotations).max() < 1e-3 * own.rotations.std(axis=0).max()
        assert found.sum_of_squares[k] == pytest.approx(solution.factor.sum_of_squares, rel=1e-4)
    told = outcome(shared, aims, accumulate(shared, aims, found, count))
    assert told.comparisons["U6"].count == 45 and not told.failed
    freedom = told.misfit.degrees_of_freedom
    assert abs(told.misfit.mean.value - freedom) < 4 * told.misfit.mean.error


@cache
def hole_plates(points: int = 10) -> Reference:
    """Two hole plates in five positions that leave errors across z weakly determined: data sets
    from ones that two passes bring to their estimate to ones that need a separate one.
    """
    sections = small_sections(points, kept=True)
    plate = {"kind": "grid", "balls": [4, 4], "reads": "in plane", "flatness": "5 um"}
    sections["artefacts"] = {
        name: {**plate, "size": [size, size]}
        for name, size in (("plate", "200 mm"), ("other", "300 mm"))
    }
    for k, position in enumerate(sections["positions"]):
        position["artefact"] = "other" if k in (1, 2) else "plate"
    del sections["positions"][2]
    sections["calibration"][0]["artefact"] = "plate"
    sections["error_model"] |= {"position_coefficients": 3, "rotation_coefficients": 5}
    sections["true_machine"] = {
        "kind": "random",
        "position": "2 um",
        "rotation": "4 urad",
        "seed": 7,
    }
    return reference(*true_experiment(bp.experiment(sections)))


@pytest.mark.long
def test_every_data_set_ends_where_a_fit_does() -> None:
    """Ones left to a separate estimate counted as converged if others made a further pass: spread
    / U of 1.6, where fits had 1.0.
    """
    shared, count = hole_plates(), 80
    found, drawn = estimate_batch(shared, 1, 0, count), draw(shared, 1, 0)
    spread = np.sqrt(((found.found.a / found.found.a.std(axis=0)) ** 2).mean(axis=1))
    for k in range(count):
        solution = estimate(*replicate_data(shared, *drawn.replicate(k)))
        assert found.converged[k] == (solution.status == "converged")
        assert found.sum_of_squares[k] == pytest.approx(solution.factor.sum_of_squares, rel=1e-4)
        off = found.found.a[k] - (solution.state.a - shared.start.a)
        assert (np.abs(off) < 1e-2 * found.found.a.std(axis=0)).all(), k
    told = outcome(shared, targets(shared), accumulate(shared, targets(shared), found, count))
    for comparison in told.comparisons.values():
        assert abs(comparison.spread.value - 1.0) < 4.0 * comparison.spread.error
    assert spread.max() < 4.0


def test_what_is_left_to_a_separate_estimate_has_not_converged() -> None:
    """No replicate of the passes has a step left, whichever others are refined with it."""
    shared = weak()
    drawn = draw(shared, 1, 0).select(np.arange(16))
    found = _refined(shared, drawn, np.arange(16))
    kept = np.flatnonzero(found.converged)
    assert 0 < len(kept) < 16
    before, by_ball, by_shared = _gradient(shared, drawn.select(kept), found.found.select(kept))
    balls, common = _step(shared, by_ball, by_shared)
    decrease = -((by_ball * balls).sum(axis=(1, 2)) + (by_shared * common).sum(axis=1))
    assert (decrease < 1e-4).all()
    np.testing.assert_allclose(found.sum_of_squares[kept], before, rtol=0.0, atol=1e-4)


@pytest.mark.parametrize(
    "design", [small(), with_unknown_probes()], ids=["distances", "probes and length"]
)
def test_an_estimate_by_itself_is_that_of_the_passes(
    design: Design, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared = reference(design, truth(design))
    passes = estimate_batch(shared, 5, 0, 3)
    monkeypatch.setattr(_replicates, "SMALLEST_STEP", -1.0)
    alone = estimate_batch(shared, 5, 0, 3)
    assert alone.converged.all() and not (alone.found.a == passes.found.a).any()
    own = alone.found
    for k in range(3):
        start = shared.start
        turned = rotation_from_vector(own.rotations[k]) @ start.rotations
        state = replace(
            start,
            balls=start.balls + own.balls[k].T,
            rotations=turned,
            origins=start.origins + own.origins[k],
            a=start.a + own.a[k],
            probes=start.probes + own.offsets[k],
        )
        assert_agree(shared, passes, state, float(alone.sum_of_squares[k]), k)
    for name in ("balls", "shared"):
        values, others = vars(alone.found)[name], vars(passes.found)[name]
        assert np.abs(values - others).max() < 1e-5 * np.abs(others).max(), name


def test_the_time_of_a_data_set_is_bounded() -> None:
    """As many iterations as `fit` makes, however hopeless the readings."""
    shared = replace(weak(), noise=100.0 * weak().noise)
    found = estimate_batch(shared, 1, 0, 3)
    assert found.passes.max() <= 20


def without(failing: int, trials: int = BATCH) -> MonteCarloOutcome:
    """A run of which the last data sets have no estimate."""
    shared = reference(*true_experiment(bp.quickstart()))
    aims = targets(shared)
    found = estimate_batch(shared, 1, 0, trials)
    kept = np.arange(trials) < trials - failing
    return outcome(shared, aims, accumulate(shared, aims, replace(found, converged=kept), trials))


@pytest.mark.parametrize(("failing", "shown"), [(0, True), (2, True), (3, False), (BATCH, False)])
def test_where_too_many_fail_no_figure_is_shown(failing: int, shown: bool) -> None:
    told = without(failing)
    lines = "\n".join(trials_lines(Trials(1, told)))
    assert (told.comparisons != {}) == shown == ("spread / U" in lines) == (not told.reason)
    assert (f"{failing} data sets did not converge" in lines) == (failing > 0)
    data = as_data(trials_data(Trials(1, told)))
    assert (data["quantities"] != {}) == shown and len(data["not_converged"]) == failing
    figures = trial_figures(told, ("U6",))
    assert ("U6_spread_ratio" in figures) == shown == ("sum_of_squares" in figures)
    if not shown:
        assert "S^2" not in lines and "covered" not in lines
        assert f"{failing} of {BATCH} data sets have no estimate that converged" in lines
        assert data["reason"] == told.reason and data["sum_of_squares"]["value"] is None


def test_one_in_a_hundred_may_fail() -> None:
    """More than two, and more than 1 %: both."""
    shared = reference(*true_experiment(bp.quickstart()))
    aims = targets(shared)
    total = accumulate(shared, aims, estimate_batch(shared, 1, 0), BATCH)
    for failing, trials, shown in ((10, 1000, True), (11, 1000, False), (3, 300, True)):
        some = replace(total, count=trials - failing, failed=tuple(range(failing)))
        assert (outcome(shared, aims, some).reason == "") == shown
