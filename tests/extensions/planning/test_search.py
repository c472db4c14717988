"""Selections against the best of all that there are, and bounds that none of them breaks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import chain, combinations
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from ballplate.extensions.planning.bound import _Tangent, _whole, bound
from ballplate.extensions.planning.campaign_choice import Request, _budgets, campaign
from ballplate.extensions.planning.constraints import HOUR, Budget, Constraints, constraints
from ballplate.extensions.planning.criteria import CriterionName, criterion, is_about_balls
from ballplate.extensions.planning.information import pool_information
from ballplate.extensions.planning.search import Losses, SelectionProblem, improve, starts, value
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import AtMost, Experiment
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.machines.protocol import Array
from hypothesis import HealthCheck, Phase, given, settings, strategies as st

from tests.extensions.planning import wording

from .small_pool import TEXT

CRITERIA: tuple[CriterionName, ...] = (
    "U6",
    "U6-maximum",
    "U5",
    "tasks",
    "A",
    "D",
    "E",
    "condition",
)
SIZE = 13


@cache
def small() -> Experiment:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "small.yaml"
        path.write_text(TEXT)
        return load(path, planning=True)[0]


@cache
def problem_of(name: CriterionName) -> SelectionProblem:
    pool = small().pool
    assert pool is not None and len(pool.candidates) == SIZE
    information = pool_information(small(), pool.candidates, is_about_balls(name))
    limits = constraints(pool.candidates, pool.changes, Budget())
    return SelectionProblem(information, criterion(information, small(), name), limits)


@cache
def every() -> tuple[tuple[int, ...], ...]:
    """All selections but the empty one."""
    return tuple(chain.from_iterable(combinations(range(SIZE), k) for k in range(1, SIZE + 1)))


@cache
def values(name: CriterionName) -> Array:
    return np.array([value(problem_of(name), chosen) for chosen in every()])


@st.composite
def limits(draw: Callable[[st.SearchStrategy], object]) -> Constraints:  # type: ignore[type-arg]
    """Budgets and limits of all kinds, some of which no selection keeps to."""
    base = problem_of("U6").constraints
    members = st.lists(st.integers(0, SIZE - 1), min_size=2, max_size=6, unique=True)
    budget = draw(
        st.builds(
            Budget,
            st.one_of(st.none(), st.floats(1.5, 9.0).map(lambda hours: hours * HOUR)),
            st.one_of(st.none(), st.integers(30, 160)),
            st.one_of(st.none(), st.integers(2, 9)),
        )
    )
    at_most = draw(
        st.lists(
            st.builds(lambda m, k: AtMost(tuple(m), k), members, st.integers(1, 3)), max_size=2
        )
    )
    must = draw(st.frozensets(st.integers(0, SIZE - 1), max_size=2))
    return replace(base, budget=budget, at_most=tuple(at_most), must=must)  # type: ignore[arg-type]


def near_the_best_and_above_the_bound(name: CriterionName, limited: Constraints) -> None:
    problem = replace(problem_of(name), constraints=limited)
    allowed = np.array([limited.allows(chosen) for chosen in every()])
    if not allowed.any():
        return
    best = values(name)[allowed].min()
    losses = Losses(problem)
    begun = [start for start in starts(problem, (), 8, 1) if limited.allows(start)]
    found = [improve(problem, start, losses, 2, thorough=True) for start in begun]
    if np.isfinite(best):
        assert min(one.value for one in found) <= 1.01 * best
        below = bound(problem)
        if below is not None:
            assert 0.0 < below.value <= best


def tried(examples: int) -> settings:
    return settings(
        max_examples=examples,
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow],
        derandomize=True,
        phases=[Phase.explicit, Phase.generate],
    )


@pytest.mark.parametrize("name", ["U6", pytest.param("E", marks=pytest.mark.long)])
@tried(2)
@given(limited=limits())
def test_the_best_or_near_it_and_never_below_the_bound(
    name: CriterionName, limited: Constraints
) -> None:
    near_the_best_and_above_the_bound(name, limited)


@pytest.mark.long
@pytest.mark.parametrize("name", [*CRITERIA, "U5-maximum", "tasks-maximum"])
@tried(25)
@given(limited=limits())
def test_the_best_or_near_it_under_many_limits(name: CriterionName, limited: Constraints) -> None:
    near_the_best_and_above_the_bound(name, limited)


@pytest.mark.parametrize("name", ["U6", "U6-maximum", "E"])
def test_the_bound_is_near_for_some_positions(name: CriterionName) -> None:
    limited = replace(problem_of(name).constraints, budget=Budget(positions=4))
    found = bound(replace(problem_of(name), constraints=limited))
    best = min(value(problem_of(name), chosen) for chosen in every() if limited.allows(chosen))
    assert found is not None
    assert 0.9 * best < found.value <= best


@pytest.mark.parametrize("name", ["U6", "U6-maximum"])
def test_the_bound_is_tight_where_everything_may_be_chosen(name: CriterionName) -> None:
    problem = problem_of(name)
    found = bound(problem)
    assert found is not None
    best = value(problem, range(SIZE))
    assert found.value == pytest.approx(best, rel=0.03 if problem.criterion.is_sharp else 2e-3)
    assert found.value <= best


# The condition has a bound of its own, and no tangent.
@pytest.mark.parametrize("name", [name for name in CRITERIA if name != "condition"])
def test_derivatives_are_those_of_finite_differences(name: CriterionName) -> None:
    problem = problem_of(name)
    information = problem.information.of(range(SIZE))
    own = slice(None) if problem.criterion.about_balls else problem.information.shared
    generator = np.random.default_rng(5)
    covariance = np.linalg.inv(information)[own, own]
    half = generator.normal(size=covariance.shape)
    change = half @ half.T

    def smooth(step: float) -> float:
        return problem.criterion.tangent(np.linalg.cholesky(covariance + step * change), 8.0)[0]

    now, mean, weight = problem.criterion.tangent(np.linalg.cholesky(covariance), 8.0)
    assert mean <= problem.criterion.value(np.linalg.cholesky(covariance)) * (1 + 1e-12)
    step = 1e-6 * np.trace(covariance) / np.trace(change)
    numeric = (np.log(smooth(step)) - np.log(smooth(-step))) / (2 * step)
    assert (weight * change).sum() / mean == pytest.approx(numeric, rel=1e-5)
    assert now > 0


def test_the_number_of_workers_changes_nothing() -> None:
    """And gains are what a selection is without and with."""
    request = Request("U6", Budget(positions=3))
    one, two = (campaign(small(), request, workers=workers) for workers in (1, 2))
    assert [c.name for c in one.chosen] == [c.name for c in two.chosen]
    assert (one.value, one.bound) == (two.value, two.bound)
    assert one.prediction.quantities["U6"].average == pytest.approx(one.value, rel=1e-9)
    assert one.bound <= one.value
    assert all(gain.without >= gain.with_ == one.value for gain in one.gains)
    after = [gain.with_ for gain in one.left_out]
    assert after == sorted(after)
    assert all(gain.without == one.value >= gain.with_ for gain in one.left_out)


def test_where_nothing_keeps_to_the_limits_nothing_is_known_of_the_best() -> None:
    """One of each of three pairs takes two positions, beside which both certificates are free; each
    candidate has the slope 1.
    """
    base = problem_of("U6").constraints
    for count, wanted in ((1, 0.0), (2, (1.0 + 2 + 2) ** -0.5), (5, (1.0 + 5 + 2) ** -0.5)):
        limits = replace(base, budget=Budget(positions=count), at_least=((0, 1), (1, 2), (0, 2)))
        found = _whole(limits.linear(), _Tangent(1.0, np.ones(SIZE), 1.0))
        assert found == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize(
    "budget",
    [
        Budget(3.0 * HOUR, None, None),
        Budget(None, 100, None),
        Budget(None, 4, 12),
        Budget(2.0, 3, 9),
        # Rounding leaves several of as many readings.
        Budget(None, 3, 20),
        Budget(None, None, 4),
    ],
)
def test_budgets_of_a_curve_grow_in_everything(budget: Budget) -> None:
    problem = problem_of("U6")
    problem = replace(problem, constraints=replace(problem.constraints, budget=budget))
    found = _budgets(problem)
    assert budget in found and len(set(found)) == len(found) > 4
    for name in ("seconds", "readings", "positions"):
        asked, every = getattr(budget, name), [getattr(one, name) for one in found]
        if asked is None:
            assert every == [None] * len(found)
        else:
            assert every == sorted(every)
            assert every[0] < asked < every[-1]


def test_limits_that_nothing_keeps_to_are_told() -> None:
    pool = small().pool
    assert pool is not None
    kept = replace(small(), pool=replace(pool, must=(0, 1, 2)))
    with pytest.raises(ExperimentError, match=wording.WHAT_HAS_TO_BE_CHOSEN_TAKES):
        campaign(kept, Request("U6", Budget(positions=1)))
    both = replace(small(), pool=replace(pool, must=(0, 1), at_most=(AtMost((0, 1), 1),)))
    with pytest.raises(ExperimentError, match=wording.NO_MORE_THAN_OF_THEM):
        campaign(both, Request("U6", Budget(positions=3)))
    with pytest.raises(ExperimentError, match="--hours"):
        campaign(small(), Request("U6"))
    with pytest.raises(ExperimentError, match="missing"):
        campaign(replace(small(), pool=None), Request("U6"))
