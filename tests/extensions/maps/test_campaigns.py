"""How often differences are found: where nothing has changed, and where something has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from ballplate.extensions.maps.campaign_tests import EstimatedSigma, with_common
from ballplate.extensions.maps.compared_maps import MappedValues, map_of_fit
from ballplate.extensions.maps.comparison import MapComparison, compared
from ballplate.extensions.maps.normalised_errors import ValueDifference
from ballplate.extensions.maps.shared_certificates import (
    NotComparableError,
    with_shared_certificates,
)
from ballplate.results.fitting import fit as fit_observed
from ballplate.simulator.design.observations.joint_values import JointValues
from scipy.stats import chi2

from tests.extensions.maps import wording
from tests.extensions.maps.campaigns import simulated_fit, simulated_map
from tests.observations.test_joint_values import PAIRS, covariance_file, random_covariance, written
from tests.reference.small_quickstart import small_quickstart


def pairs_of_campaigns(count: int, is_shared: bool = False) -> list[MapComparison]:
    """Comparisons of a machine with itself, each of two campaigns with one plate."""
    experiment, found = small_quickstart(), []
    for k in range(count):
        certificate = 10**5 + k if is_shared else None
        maps = [simulated_map(experiment, 100 + 2 * k + i, certificate) for i in (0, 1)]
        if is_shared:
            maps = list(with_shared_certificates(maps[0], maps[1])[:2])
        found.append(compared(maps[0], maps[1]))
    return found


def shares(comparisons: Sequence[MapComparison]) -> tuple[float, float]:
    """Mean share of |E_n| > 1 over all figures of a pair, and the standard deviation of the mean:
    figures of a pair are correlated, pairs are not.
    """
    each = [
        sum(group.exceeding for group in one.groups) / sum(group.count for group in one.groups)
        for one in comparisons
    ]
    return float(np.mean(each)), float(np.std(each, ddof=1) / np.sqrt(len(each)))


def assert_joint_tests_are_right(comparisons: Sequence[MapComparison]) -> None:
    """Sums of independent chi-squared are chi-squared, whatever the number of pairs."""
    for number, tests in (
        (24, [one.test for one in comparisons]),
        (3 * 9 - 6, [one.plates[0].test for one in comparisons]),
    ):
        total = sum(test.statistic for test in tests if test is not None)
        dimensions = sum(test.dimensions for test in tests if test is not None)
        assert dimensions == number * len(comparisons)
        assert 1e-4 < chi2.cdf(total, dimensions) < 1.0 - 1e-4


def test_either_campaign_has_half_of_the_variance_in_common() -> None:
    common, none = np.array([[1.0], [2.0]]), np.zeros((2, 1))
    scatters: Any = [SimpleNamespace(sigma=sigma) for sigma in (1.0, 3.0)]
    for root, scatter in zip(with_common((none, none), common, scatters), scatters, strict=True):
        variance = (root**2).sum(axis=1)
        assert variance == pytest.approx(0.5 * scatter.sigma**2 * common[:, 0] ** 2)


def test_a_machine_does_not_differ_from_itself() -> None:
    assert_joint_tests_are_right(pairs_of_campaigns(2))


@pytest.mark.long
@pytest.mark.parametrize("is_shared", [False, True])
def test_one_figure_in_twenty_exceeds_by_chance(is_shared: bool) -> None:
    found = pairs_of_campaigns(200, is_shared)
    assert_joint_tests_are_right(found)
    share, spread = shares(found)
    by_chance = found[0].groups[0].by_chance
    assert by_chance == pytest.approx(0.0455, abs=5e-4)
    assert abs(share - by_chance) < 3.0 * spread
    p = np.array([one.test.p for one in found if one.test is not None])
    assert abs(np.mean(p < 0.05) - 0.05) < 3.0 * np.sqrt(0.05 * 0.95 / len(p))


def test_what_a_certificate_does_is_what_another_value_of_it_would() -> None:
    experiment = small_quickstart()
    fits = [simulated_fit(experiment, seed, 7) for seed in (1, 2)]
    maps = [simulated_map(experiment, seed, 7) for seed in (1, 2)]
    first, second, count = with_shared_certificates(maps[0], maps[1])
    assert count == 4
    certified = next(
        one for one in fits[0].design.observations if len(one) == 4 and one.word == "distance"
    )
    for k in range(2):
        value = certified.value.copy()
        value[k] += certified.uncertainty[k]
        design = fits[0].design.observed(certified.given(value=value))
        moved = fit_observed(experiment, replace(fits[0].observed, design=design))
        change = moved.functions.at.state.a - fits[0].functions.at.state.a
        assert first.shared[:, k] == pytest.approx(fits[0].sigma * change, rel=1e-3, abs=1e-12)
    # Scale rests on the certificate alone: what is common to both cancels.
    apart = compared(maps[0], maps[1]).lengths[0].standard_uncertainties
    together = compared(first, second).lengths[0].standard_uncertainties
    assert (together < apart).all()
    for before, one in zip(maps, (first, second), strict=True):
        covariance = one.root @ one.root.T + one.shared @ one.shared.T
        assert covariance == pytest.approx(before.root @ before.root.T, rel=1e-9, abs=1e-24)


def test_correlated_values_do_what_other_values_of_them_would(tmp_path: Path) -> None:
    """Two certificates with covariances of their own: the covariance that each campaign has from
    them, by the derivatives of its estimates, one value after the other.
    """
    items, covariance = [], np.zeros((4, 4))
    for k, part in enumerate((slice(0, 2), slice(2, 4))):
        own = random_covariance(2, 5 + k)
        pairs = PAIRS[part]
        file = covariance_file(
            tmp_path / f"{k}.csv", [f"{a} {b}" for a, b in pairs], own, "covariance_um2"
        )
        items.append(
            {"kind": "distances", "pairs": [list(one) for one in pairs], "covariance": file}
        )
        covariance[part, part] = 1e-12 * own
    experiment = written(tmp_path, *items)
    fits = [simulated_fit(experiment, seed, 7) for seed in (1, 2)]
    maps = [map_of_fit(one, "campaign") for one in fits]
    first, second, count = with_shared_certificates(maps[0], maps[1])
    assert count == 4
    certified = next(one for one in fits[0].design.observations if isinstance(one, JointValues))
    columns = []
    for k in range(4):
        value = certified.value.copy()
        value[k] += 1e-6
        design = fits[0].design.observed(certified.given(value=value))
        moved = fit_observed(experiment, replace(fits[0].observed, design=design))
        columns.append(1e6 * (moved.functions.at.state.a - fits[0].functions.at.state.a))
    wanted = fits[0].sigma ** 2 * np.stack(columns, 1) @ covariance @ np.stack(columns)
    size = np.abs(wanted).max()
    assert first.shared @ first.shared.T == pytest.approx(wanted, abs=1e-3 * size)
    for before, one in zip(maps, (first, second), strict=True):
        whole = one.root @ one.root.T + one.shared @ one.shared.T
        assert whole == pytest.approx(before.root @ before.root.T, rel=1e-9, abs=1e-24)


def test_only_what_undetermined_directions_change_is_left_out_of_a_test() -> None:
    """Against the sum of squares of the others; what rounding leaves of a direction, beside what
    such directions may change at all, is none.
    """
    rng = np.random.default_rng(3)
    values, sizes = rng.normal(size=5), np.array([0.3, 0.5, 0.7, 0.9, 1.1])
    for null, kept in (
        (np.zeros((5, 0)), range(5)),
        (np.eye(5)[:, :1], range(1, 5)),
        (1e-13 * rng.normal(size=(5, 2)), range(5)),
        (np.eye(5)[:, :1] + 1e-13 * rng.normal(size=(5, 1)), range(1, 5)),
    ):
        size, none = np.ones(5), np.zeros((5, 0))
        first = MappedValues(np.zeros(5), np.diag(sizes), null, size, none)
        second = MappedValues(values, np.diag(sizes), np.zeros((5, 0)), size, none)
        known = EstimatedSigma(1.0, np.inf)
        test = ValueDifference(first, second, (known, known)).joint_test("errors")
        assert test is not None and test.dimensions == len(kept)
        squares = sum(values[k] ** 2 / (2.0 * sizes[k] ** 2) for k in kept)
        assert test.statistic == pytest.approx(squares, rel=1e-9)


def test_other_certificates_are_not_shared() -> None:
    experiment = small_quickstart()
    maps = [simulated_map(experiment, seed) for seed in (1, 2)]
    with pytest.raises(NotComparableError, match=wording.NO_CERTIFIED_VALUE_IN_COMMON):
        with_shared_certificates(maps[0], maps[1])
    with pytest.raises(NotComparableError, match=wording.DOES_NOT_HOLD_WHAT_CERTIFICATES_DO):
        with_shared_certificates(replace(maps[0], fit=None), maps[1])
