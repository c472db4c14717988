"""What is told of the residuals of small designs: sizes of mistakes, scatter beside the model, and
what is harmless.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.diagnosis.cause_search import Search, searched
from ballplate.extensions.diagnosis.hat import whitened_residuals
from ballplate.extensions.diagnosis.hypotheses import MODEL
from ballplate.extensions.diagnosis.wording import findings
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.estimation.gauss_newton import Solution, estimate, linearised_fit
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.machines.truth import true_machine
from ballplate.simulator.readings.observed_readings import ObservedReadings, observe
from ballplate.simulator.readings.reading_files import read_readings
from ballplate.simulator.readings.simulated import exact_readings, on_true_machine
from numpy.typing import NDArray
from scipy.stats import chi2

from tests.extensions.diagnosis.designs import PLATE, experiment
from tests.extensions.diagnosis.test_search import jacobian

Real = NDArray[np.float64]
CERTIFIED = Path("designs/certified")

# The position whose readings scatter more, if any do.
LOUD = 2


def certified(name: str) -> tuple[ObservedReadings, bool]:
    """The readings of a certified problem, and whether sigma is estimated."""
    given = load(CERTIFIED / f"{name}.yaml")[0]
    return read_readings(CERTIFIED / f"{name}.csv", lay_out(given)), given.sigma == "estimated"


def diagnosed(design: Design, x: Real, estimated: bool) -> tuple[Solution, Search]:
    solution = estimate(design, x)
    search = searched(linearised_fit(design, solution), x, estimated)
    assert search is not None
    return solution, search


def with_one_wrong(x: Real, reading: int, axis: int) -> Real:
    wrong = x.copy()
    wrong[reading, axis] += 20e-6
    return wrong


@pytest.mark.parametrize("every", [5, pytest.param(1, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", ["ball-bar", "two-dimensions", "bryan-gauge"])
def test_sizes_are_finite_whatever_reading_is_wrong(name: str, every: int) -> None:
    observed, estimated = certified(name)
    found = []
    for reading, axis in islice(np.ndindex(observed.x.shape), 0, None, every):
        search = diagnosed(observed.design, with_one_wrong(observed.x, reading, axis), estimated)[1]
        for values, u in search.sizes():
            assert np.isfinite(values).all() and (abs(values) < 1.0).all(), (reading, axis)
            assert np.isfinite(u).all()
        assert "nan" not in " ".join(one.words for one in findings(search, ()))
        found += search.found
    assert len(found) > 10 // every


@pytest.mark.parametrize(("reading", "axis"), [(0, 0), (1, 0), (10, 0), (10, 1), (12, 0), (13, 1)])
def test_sizes_are_those_of_least_squares_with_the_mistakes_as_parameters(
    reading: int, axis: int
) -> None:
    """Of a bar, most directions of a reading are taken up by the pose."""
    observed, estimated = certified("ball-bar")
    x = with_one_wrong(observed.x, reading, axis)
    solution, found = diagnosed(observed.design, x, estimated)
    assert found.found
    taken = jacobian(observed.design, solution.state, x)
    residual = whitened_residuals(observed.design, solution.state, x)
    matrix = np.concatenate([one.biases for one in found.found], axis=1)
    size = np.sqrt((matrix**2).sum(axis=0))
    both = np.column_stack([taken, matrix / size])
    inverse = np.linalg.pinv(both, rcond=1e-7)[taken.shape[1] :] / size[:, None]
    sizes = list(found.sizes())
    values, u = (np.concatenate([each[k] for each in sizes]) for k in (0, 1))
    np.testing.assert_allclose(values, inverse @ residual, rtol=1e-4, atol=1e-9)
    sigma = np.sqrt(found.left.sum_of_squares / found.left.freedom) if estimated else 1.0
    expected = sigma * np.sqrt((inverse**2).sum(axis=1))
    np.testing.assert_allclose(u, expected, rtol=1e-4, atol=1e-12)


def drawn(
    folder: Path,
    share: float,
    waves: float = 0.0,
    loud: float = 1.0,
    text: str = PLATE,
    seed: int = 8,
) -> tuple[Design, Real]:
    """A small design with readings of a true machine: noise of a share of what is stated, more
    `loud` in one position, and an error of the x scale of `waves` standard uncertainties, of that
    share too.
    """
    given = experiment(folder, text)
    design = lay_out(given)
    corners = design.machine.volume.corners
    on_truth, truth = on_true_machine(
        design, true_machine(given.true_machine, design.model, *corners)
    )
    readings, x = exact_readings(on_truth, truth)
    noise = np.random.default_rng(seed).standard_normal(x.shape)
    noise[readings.position == LOUD] *= loud
    noise[:, 0] += waves * np.sin(x[:, 0] / 0.04)
    observed = observe(design, readings, x + share * design.machine.repeatability * noise)
    return observed.design, observed.x


def certified_wrongly(design: Design, ball: int, share: float) -> tuple[Design, list[int]]:
    """The design with all certified distances of a ball too long by a share, and which these
    are.
    """
    given = design.of(CalibratedDistances)
    mine = (given.first == ball) | (given.second == ball)
    value = given.value * np.where(mine, 1.0 + share, 1.0)
    return design.observed(replace(given, value=value)), np.flatnonzero(mine).tolist()


@pytest.mark.parametrize("ball", [0, 2, 6, 8])
def test_wrong_distances_of_one_ball_are_one_mistake(ball: int, tmp_path: Path) -> None:
    right, x = drawn(tmp_path, 1.0)
    design, mine = certified_wrongly(right, ball, 5e-6)
    search = diagnosed(design, x, True)[1]
    (one,), ((values, u),) = search.found, search.sizes()
    subject = search.patterns.subject[one.columns]
    assert (search.patterns.kind[one.columns] == "distance").all()
    assert sorted(subject.tolist()) == mine and len(mine) == 2
    true = 5e-6 / (1.0 + 5e-6) * design.of(CalibratedDistances).value[subject]
    assert (abs(values - true) < 4.0 * u).all()
    (said,) = findings(search, ())
    assert said.cause == f"all certified distances of ball {design.ball_label(ball)}"


@pytest.mark.parametrize("wrong", range(4))
def test_one_wrong_distance_is_not_laid_to_all_of_a_ball(wrong: int, tmp_path: Path) -> None:
    for seed in range(4):
        right, x = drawn(tmp_path, 1.0, seed=seed)
        value = right.of(CalibratedDistances).value.copy()
        value[wrong] += 10e-6
        design = right.observed(replace(right.of(CalibratedDistances), value=value))
        search = diagnosed(design, x, True)[1]
        ((column,),) = (one.columns for one in search.found)
        assert search.patterns.kind[column] == "distance"
        assert search.patterns.subject[column] == wrong


@pytest.mark.parametrize("ball", [0, 2, 6, 8])
def test_wrong_distances_of_the_opposite_ball_are_named_where_only_these_tell_the_scale(
    ball: int, tmp_path: Path
) -> None:
    """Two sides too long, or the other two too short by the same ratio, and the scale another."""
    right, x = drawn(tmp_path, 1.0, text=PLATE.replace("[right, left]", "[right]"))
    (said,) = findings(diagnosed(certified_wrongly(right, ball, 5e-6)[0], x, True)[1], ())
    for either in (ball, 8 - ball):
        assert f"distances of ball {right.ball_label(either)}" in said.verdict


def is_explained(design: Design, solution: Solution) -> bool:
    """Whether the stated uncertainties explain the sum of squares."""
    freedom = design.observation_count - design.parameter_count
    return bool(chi2.sf(solution.factor.sum_of_squares, freedom) > 0.01)


@pytest.mark.parametrize("estimated", [True, False])
def test_scatter_is_told_beside_the_model(estimated: bool, tmp_path: Path) -> None:
    found = diagnosed(*drawn(tmp_path, 1.0, waves=8.0, loud=60.0), estimated)[1]
    assert found.scatter and found.scatter[0].position == LOUD and found.model and not found.found
    assert [one.kind for one in findings(found, ())] == ["scatter", MODEL]


def test_a_wave_is_laid_to_the_model_unless_it_is_harmless(tmp_path: Path) -> None:
    for share, told in ((1.0, {True, False}), (0.01, set())):
        design, x = drawn(tmp_path, share, waves=4.0)
        for estimated in (True, False):
            found = diagnosed(design, x, estimated)[1]
            assert bool(found.model) == (estimated in told), (share, estimated)
            assert not found.found


def test_scatter_below_what_is_stated_is_told_only_where_sigma_is_estimated(tmp_path: Path) -> None:
    for loud, told in ((50.0, {True, False}), (8.0, {True})):
        design, x = drawn(tmp_path, 0.1, loud=loud)
        for estimated in (True, False):
            solution, found = diagnosed(design, x, estimated)
            assert is_explained(design, solution) == (loud == 8.0)
            assert bool(found.scatter) == (estimated in told), (loud, estimated)
            assert not (found.found or found.model)
    harmless = diagnosed(*drawn(tmp_path, 0.001, loud=8.0), True)[1]
    assert not (harmless.found or harmless.scatter or harmless.model)


@pytest.mark.parametrize("estimated", [True, False])
def test_a_mistake_is_named_however_little_else_is_left(estimated: bool, tmp_path: Path) -> None:
    design, x = drawn(tmp_path, 0.01, waves=4.0)
    x[40, 1] += 20e-6
    search = diagnosed(design, x, estimated)[1]
    (one,), ((values, _),) = search.found, search.sizes()
    k = int(np.abs(values).argmax())
    assert search.patterns.kind[one.columns[k]] == "reading"
    assert search.patterns.subject[one.columns[k]] == 40
    assert values[k] == pytest.approx(20e-6, rel=0.05)
