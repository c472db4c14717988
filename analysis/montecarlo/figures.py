"""Results of replicates: bias, spread and coverage beside the linearised uncertainties, with
standard errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.montecarlo.reference import Reference

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
from .targets import MonteCarloQuantity

# Standard errors beyond which a difference is no accident; false in one of some hundred runs with
# thirty figures each.
BEYOND = 4.0

# Data sets below which standard errors are themselves too uncertain for flags.
REPLICATES_LIMIT = 100

# Data sets without an estimate, in number and as a share of all, beyond both of which the others
# are a selection: it is the widest errors that fail.
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
    """A quantity's replicates beside its linearised uncertainties.

    `linear_...` are the linearised standard uncertainties, `actual_...` the root mean squares of
    the errors, over `count` members, a `sampled` selection of all pairs. `spread` is the ratio of
    the errors' scatter to the linearised uncertainty, root mean square over the members. `actual`
    is the root mean square of the errors themselves, what noise-free readings leave included, over
    that of the linearised uncertainties (of members in the same unit); `bias` the mean error, a
    root mean square in standard uncertainties like `spread`, and `largest_bias` the largest, in the
    member's unit. `known` and `estimated` are the shares of true values within the expanded
    uncertainty for 95 %, with sigma given and with sigma estimated by each replicate. `flags` names
    the figures that linear theory gets wrong.
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
    """What S^2 tells: its mean over replicates, its expectation, and the share of replicates beyond
    its 95 % quantile.

    `noise_free` is S^2 of readings without noise, zero if the fitted model holds the true machine.
    """

    mean: MonteCarloEstimate
    degrees_of_freedom: int
    noise_free: float
    rejected: MonteCarloEstimate


@dataclass(frozen=True)
class MonteCarloOutcome:
    """All comparisons, how many replicates they rest on and which failed; no comparison, and no
    figures of the misfit, where so many failed that the others are a selection.
    """

    trials: int
    failed: tuple[int, ...]
    passes: int
    comparisons: dict[str, MonteCarloComparison]
    misfit: Misfit
    interrupted: bool = False

    @property
    def reason(self) -> str:
        """Why there are no comparisons; empty where there are."""
        if self.comparisons:
            return ""
        return (
            f"{len(self.failed)} of {self.trials} data sets have no estimate that converged;"
            " neither ratios nor coverage are shown, since the others are a selection"
        )


def outcome(
    shared: Reference, aims: tuple[MonteCarloQuantity, ...], total: Accumulator
) -> MonteCarloOutcome:
    """Figures from sums."""
    comparisons: dict[str, MonteCarloComparison] = {}
    failed, trials = len(total.failed), total.count + len(total.failed)
    n = 0 if failed > max(FAILED_LIMIT, FAILED_SHARE * trials) else total.count
    for aim, sums in zip(aims, total.quantities, strict=True):
        if not n:
            break
        # Of several artefacts each has its own distances.
        name = aim.symbol
        while name in comparisons:
            name += "'"
        comparisons[name] = _comparison(aim, sums, n)
    mean, share = (float(one) / n if n else np.nan for one in (total.residual[0], total.rejected))
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
        _error_of_mean(one, two, n)
        for one, two in zip(sums.numbers, sums.numbers_squared, strict=True)
    ]

    def root(which: int) -> MonteCarloEstimate:
        value = float(np.sqrt(means[which]))
        return MonteCarloEstimate(value, errors[which] / (2.0 * value) if value else 0.0)

    spread, actual = root(SPREAD), root(ACTUAL)
    known, estimated = (
        MonteCarloEstimate(float(means[KNOWN]), errors[KNOWN]),
        MonteCarloEstimate(float(means[ESTIMATED]), errors[ESTIMATED]),
    )
    mean_error = sums.errors / count
    # Scatter alone makes means differ from zero; what it makes of their square is taken away.
    by_chance = float(means[SPREAD] / count)
    square = float(((mean_error / aim.uncertainty) ** 2).mean()) - by_chance
    bias = _root_of_bias(square, by_chance, errors[SPREAD] / np.sqrt(count), errors[SYSTEMATIC])
    flags = []
    if spread.differs_from(1.0):
        flags.append("spread")
    if bias.differs_from(0.0):
        flags.append("bias")
    if known.differs_from(COVERAGE):
        flags.append("coverage")
    if not np.isnan(estimated.value) and estimated.differs_from(COVERAGE):
        flags.append("coverage with sigma estimated")
    rms = np.sqrt(sums.squares / count)
    present = [unit for unit in ("m", "rad", "1") if unit in aim.units]
    if n < REPLICATES_LIMIT:
        flags = []
    return MonteCarloComparison(
        aim.symbol,
        ", ".join(present),
        len(aim.base),
        aim.sampled,
        float(aim.uncertainty.max()),
        float(aim.uncertainty.mean()),
        float(rms.max()),
        float(rms.mean()),
        spread,
        actual,
        bias,
        float(np.abs(mean_error).max()),
        known,
        estimated,
        tuple(flags),
    )


def _root_of_bias(
    square: float, by_chance: float, scatter: float, systematic: float
) -> MonteCarloEstimate:
    """Bias from its `square`, of which what chance contributes is taken away, with a standard error
    that tells how improbable the bias is without one.

    Without a bias the mean square is `by_chance` and scatters by `scatter`, about as chi-squared
    with the degrees of freedom that these two have. To first order its root would have half the
    relative standard error of the square, and two standard errors of the square, which chance
    passes in one of thirty figures, would be four of the bias. The standard error is therefore that
    of a normal variable which would be as improbable, unless what is `systematic`, the bias of
    readings without noise, is known less well.
    """
    from scipy.special import chdtrc, ndtri

    error = float(np.hypot(scatter, systematic))
    if not (0.0 < scatter < np.inf and square > error):
        return MonteCarloEstimate(float(np.sqrt(max(square, 0.0))), float(np.sqrt(error)))
    value, freedom = float(np.sqrt(square)), 2.0 * (by_chance / scatter) ** 2
    chi_squared = freedom * (1.0 + square / by_chance)
    # Far out the probability is zero in floating point, and the two are the same.
    improbable = min(-ndtri(0.5 * chdtrc(freedom, chi_squared)), np.sqrt(chi_squared))
    return MonteCarloEstimate(value, max(value / improbable, error / (2.0 * value)))


def power_of_difference(more: int, gain: float) -> float:
    """Probability that `more` parameters, which take `gain` from S^2 without noise, lower it
    significantly, at 95 %.
    """
    return power_of_misfit(more, gain)


def power_of_misfit(freedom: int, noise_free: float) -> float:
    """Probability that S^2 exceeds its 95 % quantile when readings without noise leave `noise_free`
    of it.

    >>> round(power_of_misfit(100, 0.0), 3)
    0.05
    """
    from scipy.special import chndtr

    return float(1.0 - chndtr(factors(freedom).limit, freedom, noise_free))
