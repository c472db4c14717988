"""Two campaigns compared: chances against simulation, Student's and Fisher's closed forms, and
figures that contradict each other.
"""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.extensions.maps.second_campaign import (
    CampaignComparison,
    CampaignFigures,
    compared_campaigns,
)
from numpy.typing import NDArray
from scipy.stats import binom, norm
from scipy.stats import f as fisher
from scipy.stats import t as student

Real = NDArray[np.float64]
MICRO = 1e-6
# Six figures that are compared together and four more that follow from them.
TOGETHER = np.arange(10) < 6
FURTHER = np.random.default_rng(3).normal(size=(4, 6))
# Shares of the first campaign in the variance of six independent directions.
SHARES = {
    "equal": np.full(6, 0.5),
    "a third": np.full(6, 0.3),
    "mixed": np.array([0.02, 0.1, 0.3, 0.5, 0.8, 0.98]),
    "apart": np.array([0.01, 0.01, 0.01, 0.99, 0.99, 0.99]),
}


def pair(
    root: tuple[Real, Real], freedom: tuple[float, float], seed: list[int]
) -> tuple[Real, ...]:
    """Figures of two campaigns of the same machine, and what each estimates its sigma as."""
    rng = np.random.default_rng(seed)
    values = [one @ rng.normal(size=one.shape[1]) for one in root]
    sigma = [1.0 if np.isinf(nu) else np.sqrt(rng.chisquare(nu) / nu) for nu in freedom]
    return (*values, np.array(sigma))


def trials_of(share: str, freedom: tuple[float, float], count: int) -> tuple[int, int]:
    """Of so many pairs, how many are above 1 overall, and have any figure above the largest."""
    weights = SHARES[share]
    mixing = np.concatenate([np.eye(6), FURTHER]) * MICRO
    root = mixing * np.sqrt(weights), mixing * np.sqrt(1.0 - weights)
    above = any_ = 0
    for seed in range(count):
        first, second, sigma = pair(root, freedom, [seed, 29])
        found = compared_campaigns(
            CampaignFigures(first, sigma[0] * root[0], freedom[0]),
            CampaignFigures(second, sigma[1] * root[1], freedom[1]),
            TOGETHER,
            2.0,
        )
        above += found.overall > 1.0
        any_ += bool((np.abs(found.normalised_errors) > found.largest_by_chance).any())
    return above, any_


def check(share: str, freedom: tuple[float, float], count: int) -> None:
    above, any_ = trials_of(share, freedom, count)
    assert above <= binom.ppf(1 - 1e-5, count, 0.05), (share, freedom, above)
    assert any_ <= binom.ppf(1 - 1e-5, count, 0.01), (share, freedom, any_)
    if min(freedom) >= 50:
        # Not so seldom as to say nothing.
        assert above >= binom.ppf(1e-5, count, 0.035), (share, freedom, above)


FREEDOM = [(2, 2), (3, 3), (5, 5), (10, 10), (50, 50), (2, 50), (50, 2), (2, np.inf), (3, 10)]
# Where the freedom is least, a share that is taken for known is wrong by most.
FEW = [("mixed", one) for one in FREEDOM]
FEW += [(share, one) for share in SHARES if share != "mixed" for one in ((2, 2), (50, 2))]


@pytest.mark.parametrize(("share", "freedom"), FEW)
def test_chances_are_no_larger_than_stated(share: str, freedom: tuple[float, float]) -> None:
    check(share, freedom, 800)


@pytest.mark.long
@pytest.mark.parametrize("share", list(SHARES))
@pytest.mark.parametrize("freedom", FREEDOM)
def test_chances_of_many_are_no_larger_than_stated(
    share: str, freedom: tuple[float, float]
) -> None:
    check(share, freedom, 3000)


@pytest.mark.parametrize("freedom", [2.0, 7.0])
def test_a_campaign_alone_follows_fisher_and_student(freedom: float) -> None:
    """Where the second adds next to nothing, quantiles are those of the first."""
    rng = np.random.default_rng(8)
    root, values = rng.normal(size=(3, 3)) * MICRO, rng.normal(size=3) * MICRO
    first = CampaignFigures(np.zeros(3), root, freedom)
    second = CampaignFigures(values, 1e-9 * root, np.inf)
    found = compared_campaigns(first, second, np.ones(3, bool), 2.0)
    square = values @ np.linalg.solve(root @ root.T, values)
    limit = 3.0 * fisher.ppf(0.95, 3, freedom)
    assert found.overall == pytest.approx(np.sqrt(square / limit), rel=1e-9)
    by_chance = student.ppf(1.0 - 0.005 / 3, freedom) / 2.0
    assert found.largest_by_chance == pytest.approx(by_chance, rel=1e-9)


def of_differences(apart: list[float], root: Real) -> CampaignComparison:
    """What is said of differences between campaigns whose figures have this root each."""
    values = np.array(apart)
    one, other = (CampaignFigures(some, root, np.inf) for some in (0.0 * values, values))
    return compared_campaigns(one, other, np.ones(len(values), bool), 2.0)


def test_wholly_correlated_figures_that_contradict_each_other_are_told() -> None:
    root = np.full((2, 1), MICRO)
    u = np.sqrt(2.0) * MICRO
    assert np.isinf(of_differences([1.06 * u, -1.06 * u], root).overall)
    assert np.isinf(of_differences([1.06 * u, 0.9 * u], root).overall)
    # The same figure twice is one figure.
    one, two = of_differences([1.06 * u], root[:1]), of_differences([1.06 * u, 1.06 * u], root)
    assert one.overall == pytest.approx(1.06 / norm.ppf(0.975), rel=1e-9)
    assert two.overall == pytest.approx(one.overall, rel=1e-9)


def test_figures_to_second_order_are_no_contradiction() -> None:
    """Errors of 1 mm/m leave 1 um/m to what is linear in them."""
    root = np.full((2, 1), MICRO)
    for size, is_contradiction in ((1e-3, False), (1e-5, True)):
        one = CampaignFigures(np.array([size, size]), root, np.inf)
        other = CampaignFigures(np.array([size, size + 0.5e-6]), root, np.inf)
        found = compared_campaigns(one, other, np.ones(2, bool), 2.0)
        assert np.isinf(found.overall) == is_contradiction


def test_exactly_known_figures_are_compared() -> None:
    root = np.array([[MICRO, 0.0], [0.0, 0.0]])
    found = of_differences([0.0, 1e-9], root)
    assert found.compared == 2 and np.isinf(found.overall)
    assert np.isinf(found.normalised_errors[1])
    same = of_differences([MICRO, 0.0], root)
    assert same.compared == 1 and np.isfinite(same.overall)
    assert np.isnan(same.normalised_errors[1])


def test_a_scatter_without_degrees_of_freedom_has_no_limits() -> None:
    root = np.eye(2) * MICRO
    one = CampaignFigures(np.zeros(2), root, 0.0)
    other = CampaignFigures(np.full(2, MICRO), root, np.inf)
    found = compared_campaigns(one, other, np.ones(2, bool), 2.0)
    assert np.isnan(found.overall) and np.isinf(found.largest_by_chance)
