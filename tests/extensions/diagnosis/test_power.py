"""Rates of detection and of false alarms: of the linear model with thousands of draws, and of real
fits.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.diagnosis.bias_patterns import Patterns, patterns
from ballplate.extensions.diagnosis.cause_search import searched
from ballplate.extensions.diagnosis.hat import hat_rows, row_count
from ballplate.extensions.diagnosis.power import alarm_limit, chance_of_alarm, noncentrality
from ballplate.extensions.diagnosis.redundancy import reliability_of
from ballplate.extensions.diagnosis.reliability_result import Reliability
from ballplate.extensions.diagnosis.remainders import Columns, leftover
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.gauss_newton import Solution, estimate, linearised_fit
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.machines.truth import true_machine
from ballplate.simulator.readings.observed_readings import ObservedReadings, observe
from ballplate.simulator.readings.simulated import noisy_readings, on_true_machine
from ballplate.simulator.readings.true_artefacts import noisy_certificate
from numpy.typing import NDArray
from scipy.special import nctdtr
from scipy.stats import binom

from tests.extensions.diagnosis.designs import MIXED, PLANE, PLATE, experiment
from tests.extensions.diagnosis.test_against_dense import biased

Real = NDArray[np.float64]
FALSE_ALARM, POWER = 0.001, 0.8
KINDS = [
    "reading",
    "length",
    "prior",
    "distance",
    "ball",
    "shift",
    "turn",
    "probe",
    "length value",
    "scale",
    "expansion",
]


def within_chance(hits: int, trials: int, share: float) -> bool:
    """Whether a number of hits is no stranger than four standard deviations."""
    return min(binom.cdf(hits, trials, share), binom.sf(hits - 1, trials, share)) > 6e-5


@pytest.mark.parametrize("freedom", [2, 5, 30, 1000])
def test_power_of_students_test_against_scipy(freedom: int) -> None:
    limit = alarm_limit(0.01, freedom)
    for bias in (0.5, 2.0, 4.0):
        expected = 1.0 - nctdtr(freedom, bias, limit) + nctdtr(freedom, bias, -limit)
        np.testing.assert_allclose(chance_of_alarm(bias, limit, freedom), expected, rtol=1e-9)
    generator = np.random.default_rng(3)
    bias = noncentrality(0.01, 0.8, freedom)
    drawn = generator.standard_normal(200_000) + bias
    drawn /= np.sqrt(generator.chisquare(freedom, 200_000) / freedom)
    assert within_chance(int((np.abs(drawn) > limit).sum()), 200_000, 0.8)


def test_both_tails_count() -> None:
    """At a large false alarm the other tail is no longer negligible: z + z would be 0.085 too
    large.
    """
    bias = noncentrality(0.5, 0.6)
    np.testing.assert_allclose(chance_of_alarm(bias, alarm_limit(0.5)), 0.6, rtol=1e-9)
    assert abs(bias - (0.674490 + 0.253347)) > 0.05


def basis_of(design: Design) -> Real:
    """The columns Q (rows, rank) of the hat matrix's root, dense."""
    linear = linearise(design)
    width, d = linear.balls.common.shape[2], design.dimension
    basis = np.zeros((row_count(design), width + d * len(design.balls.places)))
    for some in hat_rows(linear, None):
        basis[some.rows, :width] = some.common
        at = np.flatnonzero(some.ball >= 0)
        columns = width + d * some.ball[at][:, None] + np.arange(d)
        basis[some.rows[at][:, None], columns] = some.own[at]
    return basis


@pytest.mark.parametrize("text", [MIXED, PLANE], ids=["mixed", "plane"])
def test_rates_of_the_linear_model(text: str, tmp_path: Path) -> None:
    design = lay_out(experiment(tmp_path, text))
    result = reliability_of(design, FALSE_ALARM, POWER, sigma_is_estimated=False)
    basis = basis_of(design)
    # Repeats among themselves are no rows here.
    freedom = result.degrees_of_freedom - result.among_repeats
    generator, draws = np.random.default_rng(11), 4000
    noise = generator.standard_normal((len(basis), draws))
    noise -= basis @ (basis.T @ noise)
    squares = (noise**2).sum(axis=0)
    matrix, information = result.patterns.matrix.toarray(), result.information
    tested = np.flatnonzero(information > 0.0)
    own = matrix[:, tested].T @ noise / np.sqrt(information[tested])[:, None]
    for statistic, limit in (
        (own, alarm_limit(FALSE_ALARM)),
        (studentised(own, squares, freedom), alarm_limit(FALSE_ALARM, freedom - 1)),
    ):
        alarms = (np.abs(statistic) > limit).sum(axis=0)
        spread = alarms.std(ddof=1) / np.sqrt(draws)
        assert abs(alarms.mean() - FALSE_ALARM * len(tested)) < 4.0 * spread
    for kind in (
        KINDS if text is MIXED else ["reading", "distance", "shift", "turn", "expansion", "scale"]
    ):
        for k in result.patterns.of_kind(kind)[::8]:  # type: ignore[call-overload]
            if information[k] <= 0.0:
                continue
            left = matrix[:, k] - basis @ (basis.T @ matrix[:, k])
            for estimated in (False, True):
                bias = noncentrality(
                    FALSE_ALARM, POWER, freedom - 1 if estimated else np.inf
                ) / np.sqrt(information[k])
                # The residuals of a biased draw are those without the bias and what is left of its
                # pattern.
                product = matrix[:, k] @ noise + bias * (matrix[:, k] @ left)
                square = squares + 2.0 * bias * (left @ noise) + bias**2 * (left @ left)
                statistic, limit = product / np.sqrt(information[k]), alarm_limit(FALSE_ALARM)
                if estimated:
                    statistic = studentised(statistic, square, freedom)
                    limit = alarm_limit(FALSE_ALARM, freedom - 1)
                hits = int((np.abs(statistic) > limit).sum())
                assert within_chance(hits, draws, POWER), (kind, k, estimated, hits / draws)


class Fits:
    """Real fits of simulated readings."""

    def __init__(self, folder: Path, text: str) -> None:
        self.experiment = experiment(folder, text)
        self.design = lay_out(self.experiment)
        corners = self.design.machine.volume.corners
        machine = true_machine(self.experiment.true_machine, self.design.model, *corners)
        self.on_truth, self.truth = on_true_machine(self.design, machine)

    def fitted(
        self, seed: int, planned: Reliability | None = None, k: int = -1, size: float = 0.0
    ) -> tuple[ObservedReadings, Solution]:
        """One fit, of readings with a bias of the pattern `k`."""
        generator = np.random.default_rng(seed)
        drawn = noisy_certificate(self.design, self.truth, generator)
        readings, x = noisy_readings(self.on_truth, self.truth, generator)
        if planned is not None:
            drawn, x = biased(drawn, x, readings, planned.patterns, k, size)
        observed = observe(drawn, readings, x)
        solution = estimate(observed.design, observed.x)
        assert solution.status == "converged"
        return observed, solution


def freedom_of(design: Design) -> int:
    return design.observation_count - design.parameter_count


def studentised(statistic: Real, sum_of_squares: Real | float, freedom: int) -> Real:
    """Statistics in terms of the sigma that the other observations show."""
    return statistic / np.sqrt((sum_of_squares - statistic**2) / (freedom - 1))


def matching(found: Patterns, planned: Reliability, k: int) -> int:
    """The pattern of a fit that is the planned one, whose readings are rows of their own for each
    repeat.
    """
    names = planned.patterns
    kind, subject = names.kind[k], names.subject[k]
    same = found.of_kind(kind)
    place = int(np.flatnonzero(names.of_kind(kind) == k)[0])
    if kind in ("reading", "ball"):
        was, now = planned.design.readings, found.design.readings
        row = int(subject)
        for other in same.tolist():
            i = int(found.subject[other])
            at = (now.ball[i], now.position[i], now.probe[i])
            if (
                at == (was.ball[row], was.position[row], was.probe[row])
                and found.axis[other] == names.axis[k]
            ):
                return other
        raise AssertionError(kind)
    assert len(same) == len(names.of_kind(kind))
    return int(same[place])


def rates(folder: Path, text: str, kinds: list[str], fits: int) -> dict[tuple[str, bool], int]:
    """How often biases of the stated minimal detectable size are found, by kind and whether sigma
    is estimated.
    """
    world = Fits(folder, text)
    hits: dict[tuple[str, bool], int] = {}
    for number, kind in enumerate(kinds):
        for estimated in (False, True):
            planned = reliability_of(world.design, FALSE_ALARM, POWER, estimated)
            every = planned.patterns.of_kind(kind)  # type: ignore[arg-type]
            every = every[planned.information[every] > 0.0]
            if kind == "scale":
                every = every[:1]
            if kind in ("reading", "ball"):
                # Of a mean of repeats, only all of them together are one reading.
                every = every[planned.design.readings.repeats[planned.patterns.subject[every]] == 1]
            count = 0
            for r in range(fits):
                k = int(every[r % len(every)])
                seed = 100_000 * number + 1000 * int(estimated) + r
                observed, solution = world.fitted(
                    seed, planned, k, float(planned.minimal_detectable[k])
                )
                freedom = freedom_of(observed.design)
                found = patterns(observed.design, solution.state, observed.x)
                left = leftover(linearised_fit(observed.design, solution), observed.x, freedom)
                statistic = Columns(found.matrix, [], left).statistics()[
                    matching(found, planned, k)
                ]
                limit = alarm_limit(FALSE_ALARM)
                if estimated:
                    statistic = studentised(statistic, solution.factor.sum_of_squares, freedom)
                    limit = alarm_limit(FALSE_ALARM, freedom - 1)
                count += int(abs(statistic) > limit)
            hits[kind, estimated] = count
    return hits


def check_rates(hits: dict[tuple[str, bool], int], fits: int) -> None:
    for key, count in hits.items():
        assert within_chance(count, fits, POWER), (key, count / fits)
    assert within_chance(sum(hits.values()), fits * len(hits), POWER), sum(hits.values()) / (
        fits * len(hits)
    )


def test_rates_of_real_fits_in_the_plane(tmp_path: Path) -> None:
    check_rates(
        rates(tmp_path, PLANE, ["reading", "distance", "shift", "turn", "expansion", "scale"], 8), 8
    )


@pytest.mark.long
def test_rates_of_real_fits(tmp_path: Path) -> None:
    check_rates(rates(tmp_path, MIXED, KINDS, 40), 40)


def alarms(folder: Path, text: str, fits: int) -> dict[bool, int]:
    """Fits of readings without any bias in which something is suspected, by whether sigma is
    estimated.
    """
    world, found = Fits(folder, text), {False: 0, True: 0}
    for r in range(fits):
        observed, solution = world.fitted(r)
        for estimated in found:
            fitted = linearised_fit(observed.design, solution)
            search = searched(fitted, observed.x, estimated)
            told = search and (search.found or search.scatter or search.model)
            found[estimated] += bool(told)
    return found


def test_clean_readings_in_the_plane_are_hardly_ever_suspected(tmp_path: Path) -> None:
    for count in alarms(tmp_path, PLANE, 40).values():
        assert binom.sf(count - 1, 40, 0.01) > 1e-4


@pytest.mark.long
def test_clean_readings_are_suspected_in_one_fit_of_a_hundred(tmp_path: Path) -> None:
    """Bonferroni's limit is a bound; tests that resemble one another make alarms somewhat rarer."""
    for text, fits in ((PLANE, 1000), (PLATE, 400)):
        for count in alarms(tmp_path, text, fits).values():
            assert binom.sf(count - 1, fits, 0.01) > 1e-3 and binom.cdf(count, fits, 0.005) > 1e-3
