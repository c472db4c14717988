"""Bias, spread and coverage of replicates relative to linearised uncertainties."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ._reference import Reference
from ._targets import MonteCarloQuantity
from .accumulator import (
    ACTUAL,
    COVERAGE,
    ESTIMATED,
    KNOWN,
    SPREAD,
    SYSTEMATIC,
    Accumulator,
    QuantityAccumulator,
    factors,
)

# Standard errors beyond which a difference is significant; false in one of some hundred runs with
# thirty values each.
BEYOND = 4.0

# Data sets below which standard errors are too uncertain for flags.
REPLICATES_LIMIT = 100

# Number and share of failed data sets; beyond both, the others are a biased selection, since the
# largest errors fail.
FAILED_LIMIT = 2
FAILED_SHARE = 0.01


@dataclass(frozen=True)
class MonteCarloEstimate:
    """A value and its Monte Carlo standard error."""

    value: float
    error: float

    def differs_from(self, expected: float) -> bool:
        return abs(self.value - expected) > BEYOND * self.error


@dataclass(frozen=True)
class MonteCarloComparison:
    """A quantity's replicates compared with its linearised uncertainties.

    `linear_...` are the linearised standard uncertainties, `actual_...` the root mean squares of
    the errors, over `count` members, a `sampled` selection of all pairs; NaN if others are
    undetermined. `spread` is the ratio of
    the errors' standard deviation to the linearised uncertainty, root mean square over the members.
    `actual` is the root mean square of the errors, with those of noise-free readings, over that of
    the linearised uncertainties (of members in the same unit); `bias` the mean error, a root mean
    square in standard uncertainties like `spread`, and `largest_bias` the largest, in the member's
    unit. `known` and `estimated` are the empirical coverage of expanded uncertainties for 95 %,
    with sigma given and with sigma estimated by each replicate. `flags` names values that differ
    from linear theory.
    """

    symbol: str
    unit: str
    count: int
    sampled: bool
    linear_maximum: float
    linear_average: float
    actual_maximum: float
    actual_average: float
    spread: MonteCarloEstimate
    actual: MonteCarloEstimate
    bias: MonteCarloEstimate
    largest_bias: float
    known: MonteCarloEstimate
    estimated: MonteCarloEstimate
    flags: tuple[str, ...]


@dataclass(frozen=True)
class Misfit:
    """Statistics of S^2: its mean over replicates, its expectation, and the share of replicates
    beyond its 95 % quantile.

    `noise_free` is S^2 of readings without noise, zero if the fitted model contains the true
    machine.
    """

    mean: MonteCarloEstimate
    degrees_of_freedom: int
    noise_free: float
    rejected: MonteCarloEstimate


@dataclass(frozen=True)
class MonteCarloOutcome:
    """All comparisons with the number of replicates and the failed ones.

    If so many failed that the others are a selection, comparisons and statistics of S^2 are
    missing.
    """

    trials: int
    failed: tuple[int, ...]
    passes: int
    comparisons: dict[str, MonteCarloComparison]
    misfit: Misfit
    interrupted: bool = False

    @property
    def reason(self) -> str:
        """Why comparisons are missing, or empty."""
        if self.comparisons:
            return ""
        return (
            f"{len(self.failed)} of {self.trials} data sets have no estimate that converged;"
            " neither ratios nor coverage are shown, since the others are a selection"
        )


def outcome(
    shared: Reference, aims: tuple[MonteCarloQuantity, ...], total: Accumulator
) -> MonteCarloOutcome:
    """Return the outcome of sums."""
    comparisons = {}
    failed, trials = len(total.failed), total.count + len(total.failed)
    n = 0 if failed > max(FAILED_LIMIT, FAILED_SHARE * trials) else total.count
    for aim, sums in zip(aims, total.quantities, strict=True):
        if not n:
            break
        # Each artefact has separate distances.
        name = aim.symbol
        while name in comparisons:
            name += "'"
        comparisons[name] = _comparison(aim, sums, n)
    mean, share = (float(sum_) / n if n else np.nan for sum_ in (total.residual[0], total.rejected))
    return MonteCarloOutcome(
        trials,
        total.failed,
        total.passes,
        comparisons,
        Misfit(
            MonteCarloEstimate(mean, _error_of_mean(total.residual[0], total.residual[1], n)),
            shared.degrees_of_freedom,
            shared.sum_of_squares,
            MonteCarloEstimate(share, float(np.sqrt(share * (1.0 - share) / max(n, 1)))),
        ),
    )


def _error_of_mean(total: float, squares: float, n: int) -> float:
    if n < 2:
        return float("inf")
    variance = max(squares / n - (total / n) ** 2, 0.0) * n / (n - 1)
    return float(np.sqrt(variance / n))


def _comparison(aim: MonteCarloQuantity, sums: QuantityAccumulator, n: int) -> MonteCarloComparison:
    count = max(n, 1)
    means = sums.numbers / count
    errors = [
        _error_of_mean(total, squares, n)
        for total, squares in zip(sums.numbers, sums.numbers_squared, strict=True)
    ]

    def root(index: int) -> MonteCarloEstimate:
        # To first order a root has half the relative standard error of its square.
        value = float(np.sqrt(means[index]))
        return MonteCarloEstimate(value, errors[index] / (2.0 * value) if value else 0.0)

    spread, actual = root(SPREAD), root(ACTUAL)
    coverage_known, coverage_estimated = (
        MonteCarloEstimate(float(means[KNOWN]), errors[KNOWN]),
        MonteCarloEstimate(float(means[ESTIMATED]), errors[ESTIMATED]),
    )
    mean_error = sums.errors / count
    # Noise alone makes means differ from zero: its share of their square is subtracted.
    by_chance = float(means[SPREAD] / count)
    square = float(((mean_error / aim.uncertainty) ** 2).mean()) - by_chance
    bias = _root_of_bias(square, by_chance, errors[SPREAD] / np.sqrt(count), errors[SYSTEMATIC])
    flags = []
    if spread.differs_from(1.0):
        flags.append("spread")
    if bias.differs_from(0.0):
        flags.append("bias")
    if coverage_known.differs_from(COVERAGE):
        flags.append("coverage")
    if not np.isnan(coverage_estimated.value) and coverage_estimated.differs_from(COVERAGE):
        flags.append("coverage with sigma estimated")
    # A maximum or an average over what is determined alone is none.
    whole = np.nan if aim.is_partial else 1.0
    rms, uncertainty = whole * np.sqrt(sums.squares / count), whole * aim.uncertainty
    present = [unit for unit in ("m", "rad", "1") if unit in aim.units]
    return MonteCarloComparison(
        aim.symbol,
        ", ".join(present),
        len(aim.base),
        aim.sampled,
        float(uncertainty.max()),
        float(uncertainty.mean()),
        float(rms.max()),
        float(rms.mean()),
        spread,
        actual,
        bias,
        float(np.abs(mean_error).max()),
        coverage_known,
        coverage_estimated,
        tuple(flags) if n >= REPLICATES_LIMIT else (),
    )


def _root_of_bias(
    square: float, by_chance: float, scatter: float, systematic: float
) -> MonteCarloEstimate:
    """Return the bias from its `square`, less the contribution of chance, with a standard error
    that expresses its improbability without bias.

    Without a bias the mean square is `by_chance` with standard deviation `scatter`, about as
    chi-squared with the degrees of freedom of these two. To first order its root would have half
    the relative standard error of the square, and two standard errors of the square, which chance
    exceeds in one of thirty values, would be four of the bias. The standard error is therefore that
    of an equally improbable normal variable, unless the `systematic` bias of readings without noise
    is less certain.
    """
    from scipy.special import chdtrc, ndtri

    error = float(np.hypot(scatter, systematic))
    if not (0.0 < scatter < np.inf and square > error):
        return MonteCarloEstimate(float(np.sqrt(max(square, 0.0))), float(np.sqrt(error)))
    value, freedom = float(np.sqrt(square)), 2.0 * (by_chance / scatter) ** 2
    chi_squared = freedom * (1.0 + square / by_chance)
    # In the far tail the probability underflows, and both agree.
    improbable = min(-ndtri(0.5 * chdtrc(freedom, chi_squared)), np.sqrt(chi_squared))
    return MonteCarloEstimate(value, max(value / improbable, error / (2.0 * value)))


def power_of_misfit(freedom: int, noise_free: float) -> float:
    """Return the probability that S^2 exceeds its 95 % quantile if readings without noise leave
    `noise_free`; or that more parameters, as many as `freedom`, lower it significantly.

    >>> round(power_of_misfit(100, 0.0), 3)
    0.05
    """
    from scipy.special import chndtr

    return float(1.0 - chndtr(factors(freedom)[2], freedom, noise_free))
