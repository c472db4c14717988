"""What causes explain of residuals, against least squares with the causes as parameters, and draws
of noise.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.diagnosis.cause_search import FoundCause, Search
from ballplate.extensions.diagnosis.hat import whitened_residuals
from ballplate.extensions.diagnosis.remainders import leftover
from ballplate.extensions.diagnosis.scatter import log_chances, ratio, scatters, with_scatter
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.parameters import shared_layout
from ballplate.simulator.design.state import State
from ballplate.simulator.estimation.gauss_newton import estimate, moved
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.machines.truth import true_machine
from ballplate.simulator.readings.observed_readings import observe
from ballplate.simulator.readings.simulated import noisy_readings, on_true_machine
from ballplate.simulator.readings.true_artefacts import noisy_certificate
from numpy.typing import NDArray

from tests.extensions.diagnosis.designs import MIXED, PLANE, experiment
from tests.extensions.diagnosis.test_against_dense import numeric

Real = NDArray[np.float64]


def fitted(text: str, folder: Path) -> tuple[Design, State, Real]:
    """A design with noisy readings, and the estimate from them."""
    given = experiment(folder, text)
    design = lay_out(given)
    corners = design.machine.volume.corners
    on_truth, truth = on_true_machine(
        design, true_machine(given.true_machine, design.model, *corners)
    )
    generator = np.random.default_rng(5)
    certificate = noisy_certificate(design, truth, generator)
    observed = observe(certificate, *noisy_readings(on_truth, truth, generator))
    return observed.design, estimate(observed.design, observed.x).state, observed.x


def jacobian(design: Design, state: State, x: Real) -> Real:
    """Derivative of the whitened residuals by all parameters, by central differences, with columns
    of length one.
    """
    layout, balls = shared_layout(design), design.plate_balls
    s = len(layout)

    def residuals(step: Real) -> Real:
        shift = np.zeros_like(design.balls.places)
        shift[balls] = step[s:].reshape(-1, design.dimension)
        there = moved(state, layout, step[:s], shift)
        return whitened_residuals(design, there, x)

    scale = np.concatenate([layout.scale, np.ones(len(balls) * design.dimension)])
    found = numeric(residuals, len(scale), scale, 1e-4) * scale
    return np.asarray(found / np.sqrt((found**2).sum(axis=0)))


def left_by(columns: Real, residual: Real) -> float:
    """The least sum of squares that some columns leave."""
    scaled = columns / np.maximum(np.sqrt((columns**2).sum(axis=0)), 1e-300)
    rest = residual - scaled @ np.linalg.lstsq(scaled, residual, rcond=1e-7)[0]
    return float(rest @ rest)


def smallest_left(columns: Real, own: Real) -> float:
    """The least share of a direction of some biases that columns do not take up."""
    basis = np.linalg.svd(columns / np.sqrt((columns**2).sum(axis=0)), full_matrices=False)
    basis = basis[0][:, basis[1] > 1e-7 * basis[1][0]]
    scaled = own / np.sqrt((own**2).sum(axis=0))
    return float(np.linalg.svd(scaled - basis @ (basis.T @ scaled), compute_uv=False)[-1])


@pytest.mark.parametrize("text", [MIXED, PLANE], ids=["mixed", "plane"])
def test_what_causes_explain_is_what_they_take_away_as_parameters(
    text: str, tmp_path: Path
) -> None:
    design, state, x = fitted(text, tmp_path)
    search = Search(linearise(design, state, x), x, True)
    matrix = search.patterns.matrix.toarray()
    residual, taken = (whitened_residuals(design, state, x), jacobian(design, state, x))
    assert search.left.sum_of_squares == pytest.approx(left_by(taken, residual), rel=1e-7)
    generator, widths = np.random.default_rng(1), set()
    for step in range(2):
        before = left_by(taken, residual)
        for number, group in enumerate(search.groups):
            explained = search.columns.explained(number)
            for place in generator.choice(len(group), min(3, len(group)), replace=False):
                own = matrix[:, group[place]]
                if explained.dimensions[place] < own.shape[1]:
                    # Some direction is hidden, but for the rounding of differences.
                    assert smallest_left(taken, own) < 1e-4
                    continue
                expected = before - left_by(np.column_stack([taken, own]), residual)
                assert explained.square[place] == pytest.approx(
                    expected, rel=1e-4, abs=1e-6 * before
                )
                widths.add(len(group[place]))
        # A cause that has been taken out explains nothing more, and others less.
        columns = search.groups[-2][len(search.groups[-2]) // 2]
        search._remove(FoundCause(matrix[:, columns], 0.0, 0.0, columns))
        taken = np.column_stack([taken, matrix[:, columns]])
        assert search.left.sum_of_squares == pytest.approx(left_by(taken, residual), rel=1e-6), step
    assert widths == ({1, 2, 3, 6} if text is MIXED else {1, 2, 3})


def test_smooth_errors_explain_what_they_take_away_as_parameters(tmp_path: Path) -> None:
    design, state, x = fitted(PLANE, tmp_path)
    search = Search(linearise(design, state, x), x, True)
    residual, taken = (whitened_residuals(design, state, x), jacobian(design, state, x))
    before, seen = left_by(taken, residual), set()
    # An error in one axis along another has one value for each place on the latter's scale.
    for axis, component in ((0, 0), (0, 1), (1, 0), (1, 1)):
        places = np.unique(np.round(x[:, axis], 4), return_inverse=True)[1]
        columns = np.zeros((len(residual), places.max() + 1))
        for row, place in enumerate(places):
            columns[2 * row + component, place] = 1.0
        words = f"an error in {'xy'[component]} that depends on {'xy'[axis]}"
        every = zip(search.hypotheses, search.bases, strict=True)
        (basis,) = (basis for one, basis in every if one.words == words)
        np.testing.assert_allclose(taken.T @ basis, 0.0, atol=1e-6)
        explained = float(((basis.T @ search.left.residual) ** 2).sum())
        assert explained == pytest.approx(
            before - left_by(np.column_stack([taken, columns]), residual), rel=1e-4
        )
        seen.add(basis.shape[1])
    assert min(seen) > 2


def test_scatter_is_hardly_ever_suspected_of_noise(tmp_path: Path) -> None:
    design, state, x = fitted(MIXED, tmp_path)
    left = leftover(
        linearise(design, state, x), x, design.observation_count - design.parameter_count
    )
    every, generator, draws, level = scatters(design), np.random.default_rng(2), 2000, 0.01
    alarms = np.zeros(len(every))
    for _ in range(draws):
        drawn = left.of(generator.standard_normal((len(left.residual), 1)))[:, 0]
        alarms += log_chances(every, replace(left, residual=drawn), True) < np.log(level)
    assert {one.position >= 0 for one in every} == {True, False}
    assert (alarms <= draws * level + 4.0 * np.sqrt(draws * level)).all() and alarms.sum() > 0


def test_weights_that_are_right_leave_no_scatter_over(tmp_path: Path) -> None:
    design, state, x = fitted(MIXED, tmp_path)
    freedom = design.observation_count - design.parameter_count
    one = next(one for one in scatters(design) if one.position == 2)
    generator, found = np.random.default_rng(3), []
    for stated in (1.0, 3.0):
        left = leftover(linearise(with_scatter(design, one, stated), state, x), x, freedom)
        noise = generator.standard_normal((len(left.residual), 400))
        noise[one.rows] *= 3.0 / stated
        drawn = left.of(noise)
        ratios = [ratio(replace(left, residual=each), one.rows) for each in drawn.T]
        found.append((np.mean(ratios), np.std(ratios) / np.sqrt(len(ratios)) + np.var(ratios)))
    assert abs(found[1][0] - 1.0) < 4.0 * found[1][1]
    assert 2.0 < found[0][0] < 3.0
