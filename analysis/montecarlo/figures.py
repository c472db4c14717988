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
    """All comparisons, how many replicates they rest on and which failed; no comparison where all
    did.
    """

    trials: int
    failed: tuple[int, ...]
    passes: int
    comparisons: dict[str, MonteCarloComparison]
    misfit: Misfit
    interrupted: bool = False


def outcome(
    shared: Reference, aims: tuple[MonteCarloQuantity, ...], total: Accumulator
) -> MonteCarloOutcome:
    """Figures from sums."""
    comparisons: dict[str, MonteCarloComparison] = {}
    for aim, sums in zip(aims, total.quantities, strict=True):
        if not total.count:
            break
        # Of several artefacts each has its own distances.
        name = aim.symbol
        while name in comparisons:
            name += "'"
        comparisons[name] = _comparison(aim, sums, total.count)
    freedom, n = shared.degrees_of_freedom, max(total.count, 1)
    mean = float(total.residual[0] / n)
    share = total.rejected / n
    return MonteCarloOutcome(
        total.count + len(total.failed),
        total.failed,
        total.passes,
        comparisons,
        Misfit(
            MonteCarloEstimate(mean, _error_of_mean(total.residual[0], total.residual[1], n)),
            freedom,
            shared.sum_of_squares,
            MonteCarloEstimate(share, float(np.sqrt(share * (1.0 - share) / n))),
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
    square = float(((mean_error / aim.uncertainty) ** 2).mean() - means[SPREAD] / count)
    # Without a bias the square of a mean scatters as a replicate's mean square does, divided by
    # their number once more.
    error = (
        float(np.hypot(errors[SPREAD] / np.sqrt(count), errors[SYSTEMATIC]))
        if n > 1
        else float("inf")
    )
    value = float(np.sqrt(max(square, 0.0)))
    bias = MonteCarloEstimate(
        value, error / (2.0 * value) if square > error else float(np.sqrt(error))
    )
    flags = []
    if spread.differs_from(1.0):
        flags.append("spread")
    if square > BEYOND * error:
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
