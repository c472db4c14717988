"""How often tests of two campaigns find a change where there is none: estimates and sigmas are drawn
from their own distributions, by the factors of the estimates.
"""

from __future__ import annotations

from dataclasses import replace

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.maps.campaign_tests import (
    EstimatedSigma,
    joint_chance,
    joint_difference,
    orthonormal,
    single_chances,
)
from ballplate.extensions.maps.compared_maps import MappedValues, motions
from ballplate.extensions.maps.comparison import compared
from ballplate.extensions.maps.normalised_errors import ValueDifference
from ballplate.extensions.maps.shared_certificates import with_shared_certificates
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.geometry.ball_layouts import even_grid
from ballplate.simulator.machines.protocol import Array
from scipy.stats import beta, norm, t as student

from tests.extensions.maps.campaigns import simulated_map

FREEDOMS = [(2, 2), (2, 10), (2, 50), (10, 10), (12, 184)]
LEVEL = 0.05


def small(repeatability: str = "0.2 um") -> Experiment:
    """A plate of four balls, of which all six distances are certified, in six positions."""
    given = {"kind": "distances", "pairs": "all", "standard_uncertainty": "0.2 um"}
    return bp.quickstart().with_(
        {
            "machine.repeatability": repeatability,
            "error_model.position_coefficients": 2,
            "error_model.rotation_coefficients": 1,
            "artefacts.plate": {"kind": "grid", "balls": [2, 2], "size": ["0.5 m", "0.5 m"]},
            "calibration": [given],
            # One tip in each plane, so that the machine's scale rests on the certificate.
            **{f"positions[x {one}].probes": ["right"] for one in ("low", "high")},
            **{f"positions[y {one}].probes": ["back"] for one in ("low", "high")},
        }
    )


def limits(count: int, of: int) -> tuple[float, float]:
    """Those of a rate, by Clopper and Pearson, of 95 %."""
    return float(beta.ppf(0.025, count, of - count + 1)), float(
        beta.ppf(0.975, count + 1, of - count)
    )


@pytest.mark.parametrize("shares", [[0.5], [0.5] * 6, [0.02, 0.2, 0.4, 0.6, 0.8, 0.98]])
def test_few_degrees_of_freedom_keep_the_level(shares: list[float]) -> None:
    """Beyond what chance does to 800 pairs once in a thousand."""
    of_first, count = np.array(shares), 800
    rng = np.random.default_rng(len(shares))
    for freedom in ((2, 2), (2, 50)):
        above = 0
        for _ in range(count):
            both = [
                EstimatedSigma(float(np.sqrt(rng.chisquare(one) / one)), one) for one in freedom
            ]
            parts = both[0].sigma ** 2 * of_first, both[1].sigma ** 2 * (1.0 - of_first)
            total = parts[0] + parts[1]
            squares = rng.normal(size=len(of_first)) ** 2 / total
            above += joint_chance(squares, parts[0] / total, (both[0], both[1])) < LEVEL
        assert abs(above / count - LEVEL) < 3.3 * np.sqrt(LEVEL * (1 - LEVEL) / count)


def test_single_figures_follow_student() -> None:
    """Where both have the same degrees of freedom and shares, or one has everything."""
    two = EstimatedSigma(0.7, 2), EstimatedSigma(1.6, 2)
    share = 0.7**2 / (0.7**2 + 1.6**2)
    assert single_chances(2.0, np.array([share]), two) == pytest.approx(
        2 * student.sf(2, 4), rel=1e-4
    )
    unequal = EstimatedSigma(0.7, 2), EstimatedSigma(1.6, 50)
    of_one = single_chances(2.0, np.array([1.0, 0.0]), unequal)
    assert of_one == pytest.approx([2 * student.sf(2, 2), 2 * student.sf(2, 50)], rel=1e-4)
    known = EstimatedSigma(1.0, np.inf), EstimatedSigma(1.0, np.inf)
    assert single_chances(2.0, np.array([0.3]), known) == pytest.approx(2 * norm.sf(2), rel=1e-4)


def test_what_a_shared_certificate_fixes_is_not_counted() -> None:
    """The machine's scale is free, so that the plate's size rests on the certificate alone."""
    maps = [simulated_map(small(), 100 + k, 7) for k in range(2)]
    shared = with_shared_certificates(maps[0], maps[1])[:2]
    apart, together = (compared(one, other, grid=2).plates[0].test for one, other in (maps, shared))
    assert apart is not None and (apart.dimensions, apart.fixed) == (6, 0)
    assert together is not None and (together.dimensions, together.fixed) == (5, 1)
    assert together.held < 1e-12


class Pairs:
    """Linear campaigns by the factors of two designs' estimates: errors at corners of the volume."""

    def __init__(self, is_shared: bool) -> None:
        maps = [simulated_map(small(u), 100 + k, 7) for k, u in enumerate(("0.2 um", "0.4 um"))]
        if is_shared:
            maps = list(with_shared_certificates(maps[0], maps[1])[:2])
        self.generator = np.random.default_rng(11)
        points = even_grid(maps[0].volume.lower, maps[0].volume.upper, [2] * 3)
        free = motions(points - points.mean(axis=0)).reshape(points.size, -1)
        self.stated = [
            replace(one, root=one.root / one.sigma, shared=one.shared / one.sigma)
            .displacements(points, one.offsets["down"])
            .without(orthonormal(free))
            for one in maps
        ]

    def drawn(self, one: MappedValues, errors: Array, sigma: float) -> MappedValues:
        """A campaign that estimates such a sigma."""
        values = one.root @ self.generator.normal(size=one.root.shape[1]) + one.shared @ errors
        return replace(one, values=values, root=sigma * one.root, shared=sigma * one.shared)

    def p(self, freedom: tuple[int, int]) -> float:
        """That of the joint test of a pair."""
        rng = self.generator
        errors = rng.normal(size=(self.stated[0].shared.shape[1],))
        both = [EstimatedSigma(float(np.sqrt(rng.chisquare(one) / one)), one) for one in freedom]
        first, second = (
            self.drawn(one, errors, own.sigma) for one, own in zip(self.stated, both, strict=True)
        )
        test = ValueDifference(first, second, (both[0], both[1])).joint_test("errors")
        assert test is not None
        return test.p


@pytest.mark.long
@pytest.mark.parametrize("is_shared", [False, True])
@pytest.mark.parametrize("freedom", FREEDOMS)
def test_one_pair_in_twenty_is_changed_by_chance(
    freedom: tuple[int, int], is_shared: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    pairs, count = Pairs(is_shared), 4000
    above = sum(pairs.p(freedom) < LEVEL for _ in range(count))
    low, high = limits(above, count)
    with capsys.disabled():
        print(
            f"\n{freedom[0]} : {freedom[1]}, {'shared' if is_shared else 'apart'}: {above} of"
            f" {count}, {above / count:.2%} ({low:.2%} to {high:.2%})"
        )
    assert 0.04 <= above / count <= 0.06


def test_a_difference_whose_uncertainty_is_rounding_is_not_tested():
    known = EstimatedSigma(1.0, np.inf)
    roots = np.diag([1.0, 1e-12]), np.zeros((2, 1))
    test = joint_difference(np.array([2.0, 1e-6]), roots, (known, known))
    assert test is not None
    # That of the other alone: the square of two standard deviations.
    assert (test.dimensions, test.statistic) == (1, pytest.approx(4.0))
    assert test.p == pytest.approx(2.0 * norm.sf(2.0))
