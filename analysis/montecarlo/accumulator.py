"""Running sums over replicates, and the resulting values with standard errors.

Errors of one replicate in a quantity, such as all distances of U5, are strongly correlated;
replicates are independent. Each value is therefore a mean over replicates of one number, with the
standard error of the mean.
"""

from __future__ import annotations

from dataclasses import dataclass
from operator import add

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array

from ._reference import Reference
from ._replicates import Estimates
from ._targets import MonteCarloQuantity

# Coverage probability of expanded uncertainties.
COVERAGE = 0.95

# Indices of a replicate's numbers for a quantity, see `QuantityAccumulator`.
SPREAD, ACTUAL, SYSTEMATIC, KNOWN, ESTIMATED = range(5)


def factors(freedom: int) -> tuple[float, float, float]:
    """Return the normal and Student's factor for 95 % coverage, and S^2's 95 % quantile; the latter
    two are NaN without degrees of freedom.
    """
    from scipy.special import chdtri, ndtri, stdtrit

    tail = 0.5 * (1.0 + COVERAGE)
    if freedom <= 0:
        return float(ndtri(tail)), np.nan, np.nan
    limit = float(chdtri(freedom, 1.0 - COVERAGE))
    return float(ndtri(tail)), float(stdtrit(freedom, tail)), limit


@dataclass(frozen=True)
class QuantityAccumulator:
    """Sums over replicates of a quantity: errors (q,), their squares (q,), and of (5,) numbers and
    their squares.

    The five: mean square of the errors' deviations in standard uncertainties; mean square of the
    errors over that of the uncertainties; excess of the errors' mean square in standard
    uncertainties over the first; share of errors within the expanded uncertainty with sigma known,
    and with sigma estimated from the replicate's residuals.
    """

    errors: Array
    squares: Array
    numbers: Array
    numbers_squared: Array

    def __add__(self, other: QuantityAccumulator) -> QuantityAccumulator:
        return QuantityAccumulator(*map(add, vars(self).values(), vars(other).values()))


@dataclass(frozen=True)
class Accumulator:
    """Sums over `count` converged replicates; `failed` holds the numbers of the others.

    `residual` (2,) sums S^2 and its square, `rejected` counts S^2 beyond its limit, `passes` is the
    maximum.
    """

    count: int
    failed: tuple[int, ...]
    passes: int
    residual: Array
    rejected: int
    quantities: tuple[QuantityAccumulator, ...]

    def __add__(self, other: Accumulator) -> Accumulator:
        return Accumulator(
            self.count + other.count,
            self.failed + other.failed,
            max(self.passes, other.passes),
            self.residual + other.residual,
            self.rejected + other.rejected,
            tuple(map(add, self.quantities, other.quantities)),
        )


def accumulate(
    shared: Reference, aims: tuple[MonteCarloQuantity, ...], estimates: Estimates, count: int
) -> Accumulator:
    """Return sums over the first `count` replicates of a batch."""
    known, estimated, limit = factors(shared.degrees_of_freedom)
    used = estimates.converged & (np.arange(len(estimates.index)) < count)
    failed = estimates.index[:count][~estimates.converged[:count]]
    squares = estimates.sum_of_squares[used]
    sigma = np.sqrt(np.maximum(squares, 0.0) / max(shared.degrees_of_freedom, 1))
    quantities = []
    for aim in aims:
        change = aim.change(estimates.found)
        change = change if used.all() else change[used]
        # Sums over the quantity's members are products with vectors of weights: one pass each.
        weight = aim.uncertainty**-2.0
        of_scatter = change**2 @ weight
        # Excess of the errors' squares over those of their deviations, without subtracting two sums
        # that may be far larger.
        systematic = change @ (2.0 * aim.base * weight) + aim.base**2 @ weight
        error = change + aim.base
        squared = error**2
        errors, squares_of_errors = error.sum(axis=0), squared.sum(axis=0)
        # Relative to the mean square uncertainty in the same unit: relative to each uncertainty,
        # the few members that have almost none would dominate.
        against_typical = squared @ (1.0 / aim.typical)
        squared *= weight
        within_known = squared <= known**2
        within_estimated = squared <= (estimated * sigma[:, None]) ** 2
        numbers = np.stack(
            [
                of_scatter,
                against_typical,
                systematic,
                np.count_nonzero(within_known, axis=1),
                np.count_nonzero(within_estimated, axis=1),
            ]
        )
        numbers /= change.shape[1]
        quantities.append(
            QuantityAccumulator(
                errors,
                squares_of_errors,
                numbers.sum(axis=1),
                (numbers**2).sum(axis=1),
            )
        )
    return Accumulator(
        int(used.sum()),
        tuple(int(k) for k in failed),
        int(estimates.passes[:count].max(initial=0)),
        np.array([squares.sum(), (squares**2).sum()]),
        int((squares > limit).sum()),
        tuple(quantities),
    )
