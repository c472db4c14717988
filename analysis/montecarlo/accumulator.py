"""Running sums over replicates, and the resulting figures, each with its standard error.

A replicate's errors in one quantity, say all distances of U5, are far from independent of one
another; replicates are. Each figure is therefore a mean over replicates of one number for each, and
its standard error that of the mean.
"""

from __future__ import annotations

from dataclasses import dataclass
from operator import add

import numpy as np
from ballplate.montecarlo.reference import Reference
from ballplate.montecarlo.replicates import Estimates
from ballplate.simulator.machines.protocol import Array

from .targets import MonteCarloQuantity

# Share of true values that an expanded uncertainty is to cover.
COVERAGE = 0.95

# Names of the numbers that each replicate gives for a quantity.
SPREAD, ACTUAL, SYSTEMATIC, KNOWN, ESTIMATED = range(5)


@dataclass(frozen=True)
class Factors:
    """Coverage factors, normal and Student's, and the largest S^2 that is no sign of misfit."""

    known: float
    estimated: float
    limit: float
    freedom: int


def factors(freedom: int) -> Factors:
    """Factors for 95 % coverage, and S^2's 95 % quantile; NaN without degrees of freedom."""
    from scipy.special import chdtri, ndtri, stdtrit

    tail = 0.5 * (1.0 + COVERAGE)
    if freedom <= 0:
        return Factors(float(ndtri(tail)), np.nan, np.nan, freedom)
    limit = float(chdtri(freedom, 1.0 - COVERAGE))
    return Factors(float(ndtri(tail)), float(stdtrit(freedom, tail)), limit, freedom)


@dataclass(frozen=True)
class QuantityAccumulator:
    """Sums over replicates of a quantity: errors (q,), their squares (q,), and of (5,) numbers and
    their squares.

    The five: mean square of the errors' scatter in standard uncertainties; mean square of the
    errors over that of the uncertainties; how much larger than the first the errors' mean square in
    standard uncertainties is; share of errors within the expanded uncertainty with sigma known, and
    with sigma estimated from the replicate's residuals.
    """

    errors: Array
    squares: Array
    numbers: Array
    numbers_squared: Array

    def __add__(self, other: QuantityAccumulator) -> QuantityAccumulator:
        return QuantityAccumulator(*map(add, vars(self).values(), vars(other).values()))


@dataclass(frozen=True)
class Accumulator:
    """Sums over `count` replicates that converged; `failed` holds the numbers of the others.

    `residual` (2,) sums S^2 and its square, `rejected` counts S^2 beyond its limit, `passes` is the
    most that any took.
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
            tuple(one + two for one, two in zip(self.quantities, other.quantities, strict=True)),
        )


def accumulate(
    shared: Reference, aims: tuple[MonteCarloQuantity, ...], estimates: Estimates, count: int
) -> Accumulator:
    """Sums over the first `count` replicates of a batch."""
    limits = factors(shared.degrees_of_freedom)
    used = estimates.converged & (np.arange(len(estimates.index)) < count)
    failed = estimates.index[:count][~estimates.converged[:count]]
    squares = estimates.sum_of_squares[used]
    sigma = np.sqrt(np.maximum(squares, 0.0) / max(limits.freedom, 1))
    quantities = []
    # Memory of the largest vectors, once for all: they are far larger than what stays in cache.
    work = np.empty((2, len(squares) * max((len(aim.base) for aim in aims), default=0)))
    for aim in aims:
        change = aim.change(estimates.found)
        change = change if used.all() else change[used]
        count_of = change.shape[1]
        error, absolute = work[:, : change.size].reshape(2, *change.shape)
        np.multiply(change, 1.0 / aim.uncertainty, out=error)
        of_scatter = np.einsum("bq,bq->b", error, error) / count_of
        error += aim.base / aim.uncertainty
        of_error = np.einsum("bq,bq->b", error, error) / count_of
        size = np.abs(error, out=error)
        is_known = size <= limits.known
        is_estimated = size <= limits.estimated * sigma[:, None]
        # Over the mean square uncertainty of those in the same unit: in units of their own
        # uncertainties they would be ruled by the few that have almost none.
        np.add(change, aim.base, out=absolute)
        against_typical = np.square(absolute, out=error)
        against_typical /= aim.typical
        numbers = np.stack(
            [
                of_scatter,
                against_typical.mean(axis=1),
                of_error - of_scatter,
                np.count_nonzero(is_known, axis=1) / count_of,
                np.count_nonzero(is_estimated, axis=1) / count_of,
            ]
        )
        quantities.append(
            QuantityAccumulator(
                absolute.sum(axis=0),
                np.einsum("bq,bq->q", absolute, absolute),
                numbers.sum(axis=1),
                (numbers**2).sum(axis=1),
            )
        )
    return Accumulator(
        int(used.sum()),
        tuple(int(k) for k in failed),
        int(estimates.passes[:count].max(initial=0)),
        np.array([squares.sum(), (squares**2).sum()]),
        int((squares > limits.limit).sum()),
        tuple(quantities),
    )
