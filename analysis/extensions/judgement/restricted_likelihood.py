"""Restricted maximum likelihood (REML) of the variances of groups of observations.

Whitened observations y = J x + e have errors whose variance is r_g in group g. The restricted
likelihood is that of what of y does not depend on x (Patterson and Thompson, Biometrika 58, 1971).
With the columns of Q an orthonormal basis of those of J, it depends on y and J through the sums of
squares of the residuals of the groups, their products with Q and the groups' parts of Q'Q alone:
one linearisation serves all ratios. Matrices are Q' W Q, whose condition is no worse than the ratio
of the largest weight to the smallest, unlike that of the normal equations J' W J. Where the
derivative is zero, squares of residuals equal their redundancy, group by group: the same as what
iterating Helmert's estimate leads to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from ballplate.extensions.reliability.remainders import Leftover
from ballplate.simulator.computing import eigh, lstsq, scipy_linalg
from ballplate.simulator.machines import Array, Integers

from .observation_groups import ObservationGroup

# Ratios of variances that are looked at; outside these, a group has no scatter or no weight.
SMALLEST, LARGEST = 1e-4, 1e6

# Iteration of the logarithms of ratios: the longest step, the largest that counts as none, and how
# often.
LONGEST_STEP, LAST_STEP, STEPS = 1.5, 1e-9, 200

# Ends of intervals are found to this fraction of a ratio.
OF_ENDS = 1e-7


@dataclass(frozen=True)
class GroupSums:
    """What the restricted likelihood depends on: of each group the number of rows (g,), the sum of
    squares of residuals (g,), their products with Q (g, p), and its part of Q'Q (g, p, p).
    """

    counts: Array
    squares: Array
    sides: Array
    grams: Array


@dataclass(frozen=True)
class AtRatios:
    """The restricted likelihood at some ratios: whitened by these, the groups' `squares` (g,) of
    residuals, their `redundancies` (g,), `information` (g, g), twice that about the logarithms of
    ratios, and minus twice its logarithm, `deviance`.
    """

    squares: Array
    redundancies: Array
    information: Array
    deviance: float


def group_sums(leftover: Leftover, groups: Sequence[ObservationGroup]) -> GroupSums:
    """Sums of groups of rows."""
    # Columns have length 1, or 0 where a ball is kept or a direction open.
    used = np.asarray(leftover.own_columns.power(2).sum(axis=0)).ravel() > 0.5
    shared = (leftover.common**2).sum(axis=0) > 0.5
    grams, sides, squares = [], [], []
    for group in groups:
        common, residual = leftover.common[group.rows][:, shared], leftover.residual[group.rows]
        own_columns = leftover.own_columns[group.rows][:, np.flatnonzero(used)]
        mixed = own_columns.T @ common
        grams.append(
            np.block(
                [[common.T @ common, mixed.T], [mixed, (own_columns.T @ own_columns).toarray()]]
            )
        )
        sides.append(np.concatenate([common.T @ residual, own_columns.T @ residual]))
        squares.append(float(residual @ residual))
    counts = np.array([len(group.rows) for group in groups], float)
    return GroupSums(counts, np.array(squares), np.array(sides), np.array(grams))


def at_ratios(sums: GroupSums, ratios: Array) -> AtRatios:
    """The restricted likelihood where variances are `ratios` (g,) of the stated ones."""
    linalg, weights = scipy_linalg(), 1.0 / ratios
    root = np.asarray(np.linalg.cholesky(np.tensordot(weights, sums.grams, 1)))
    solution = linalg.cho_solve((root, True), weights @ sums.sides)
    quadratic = sums.grams @ solution
    squares = weights * (sums.squares - 2.0 * sums.sides @ solution + quadratic @ solution)
    absorbed = np.array([_whitened(root, gram) for gram in sums.grams])
    absorbed *= weights[:, None, None]
    traces = np.trace(absorbed, axis1=1, axis2=2)
    flat = absorbed.reshape(len(absorbed), -1)
    information = flat @ flat.T + np.diag(sums.counts - 2.0 * traces)
    determinant = 2.0 * float(np.log(np.diagonal(root)).sum())
    deviance = float(sums.counts @ np.log(ratios)) + determinant + float(squares.sum())
    return AtRatios(squares, sums.counts - traces, information, deviance)


def _whitened(root: Array, gram: Array) -> Array:
    """root^-1 gram root^-T."""
    half = scipy_linalg().solve_triangular(root, gram, lower=True)
    return scipy_linalg().solve_triangular(root, half.T, lower=True)


def estimated_ratios(sums: GroupSums, free: Integers) -> Array:
    """Ratios (g,) of variances to stated ones; those of groups that are not `free` stay 1, and none
    is below the smallest that is looked at.

    By scoring: Newton's method with the expected second derivatives.
    """
    ratios = np.ones(len(sums.counts))
    if not len(free):
        return ratios
    now = at_ratios(sums, ratios)
    for _ in range(STEPS):
        slope = now.squares[free] - now.redundancies[free]
        # What is at the bound and would go beyond it stays there.
        inside = (ratios[free] > SMALLEST) | (slope > 0.0)
        moving = free[inside]
        if not len(moving):
            break
        step = lstsq(now.information[np.ix_(moving, moving)], slope[inside])[0]
        step *= min(1.0, LONGEST_STEP / max(float(np.abs(step).max()), LAST_STEP))
        for _ in range(30):
            tried = ratios.copy()
            tried[moving] = np.clip(ratios[moving] * np.exp(step), SMALLEST, LARGEST)
            then = at_ratios(sums, tried)
            if then.deviance <= now.deviance + 1e-9:
                break
            step *= 0.5
        change = float(np.abs(np.log(tried / ratios)).max())
        ratios, now = tried, then
        if change <= LAST_STEP:
            break
    return ratios


def degrees_of_freedom(information: Array) -> Array:
    """Degrees of freedom (g,) of chi-squared variables, divided by these, that vary as estimated
    ratios do; zero where groups cannot be told apart.

    Their relative variance is 2 over these, as that of the estimates is to first order
    (Satterthwaite, Biometrics 2, 1946).
    """
    values, vectors = eigh(information)
    is_positive = values > 1e-10 * max(float(values.max(initial=0.0)), 1e-300)
    unknown = (vectors[:, ~is_positive] ** 2).sum(axis=1) > 1e-12
    variance = (vectors[:, is_positive] ** 2 / values[is_positive]).sum(axis=1)
    return np.where(unknown, 0.0, 1.0 / np.where(unknown, 1.0, variance))


@dataclass(frozen=True)
class RatioTest:
    """Tests of one group's ratio, `group` by its place among those `free`, others as estimated.

    In a basis in which the matrix is diagonal whatever that ratio: `values` (p,), with `absorbed`
    (f, p, p) of the free groups, `side` (p,) and those of each group (f, p), all at the `ratios`
    (f,) that are estimated.
    """

    group: int
    counts: Array
    squares: Array
    ratio: float
    values: Array
    absorbed: Array
    sides: Array
    other_side: Array

    def chance(self, ratio: float) -> float:
        """Chance that residuals are as large as they are, or larger, where the ratio is `ratio`.

        The square of the residuals, with the score of the others taken into account (Neyman's
        C(alpha), 1959), is taken for a multiple of a chi-squared variable of its mean and variance
        (Satterthwaite): exact where there is one group.
        """
        from scipy.special import chdtrc

        times = self.ratio / ratio
        scale = 1.0 + (times - 1.0) * self.values
        weight = np.ones(len(self.counts))
        weight[self.group] = times
        side = self.other_side + weight @ self.sides
        point = side / scale
        squares = weight * (
            self.squares
            - 2.0 * self.sides @ point
            + np.einsum("i,gij,j->g", point, self.absorbed, point)
        )
        inner = self.absorbed / np.sqrt(scale[:, None] * scale)
        inner *= weight[:, None, None]
        traces = np.trace(inner, axis1=1, axis2=2)
        flat = inner.reshape(len(inner), -1)
        information = flat @ flat.T + np.diag(self.counts - 2.0 * traces)
        redundancies = self.counts - traces
        slope = squares - redundancies
        other_groups = np.delete(np.arange(len(weight)), self.group)
        mixed = information[self.group, other_groups]
        share = lstsq(information[np.ix_(other_groups, other_groups)], mixed)[0]
        freedom = float(information[self.group, self.group] - share @ mixed)
        score = float(slope[self.group] - share @ slope[other_groups])
        redundancy = float(redundancies[self.group])
        if not freedom > 0.0 or not redundancy > 0.0:
            return 1.0
        # Of the mean and the variance of the square of its residuals, less what the others know.
        times = redundancy / freedom
        return float(chdtrc(redundancy * times, max(score + redundancy, 0.0) * times))

    def end(self, chance: float) -> float:
        """The ratio at which residuals so large have some chance; 0 or infinite where there is
        none.
        """
        from scipy.optimize import brentq

        def off(log_ratio: float) -> float:
            return self.chance(float(np.exp(log_ratio))) - chance

        lower, upper = np.log(SMALLEST), np.log(LARGEST)
        start = float(np.clip(np.log(self.ratio), lower, upper))
        up = off(start) < 0.0
        bound, step = start, 0.1
        while up == (off(bound) < 0.0):
            if bound == (upper if up else lower):
                return np.inf if up else 0.0
            start, bound = bound, float(np.clip(bound + (step if up else -step), lower, upper))
            step *= 1.5
        return float(np.exp(brentq(off, *sorted((start, bound)), xtol=OF_ENDS)))


@dataclass(frozen=True)
class Whitened:
    """Sums of the free groups where all are whitened by estimated `ratios` (g,)."""

    sums: GroupSums
    ratios: Array
    free: Integers

    @cached_property
    def root(self) -> Array:
        return np.asarray(np.linalg.cholesky(np.tensordot(1.0 / self.ratios, self.sums.grams, 1)))

    @cached_property
    def absorbed(self) -> Array:
        return np.array(
            [_whitened(self.root, self.sums.grams[k]) / self.ratios[k] for k in self.free]
        )

    def test_of(self, place: int) -> RatioTest:
        """Tests of the ratio of the free group at a place among these."""
        sums, ratios, free = self.sums, self.ratios, self.free
        values, vectors = eigh(self.absorbed[place])
        basis = scipy_linalg().solve_triangular(self.root, vectors, lower=True, trans="T")
        fixed = np.setdiff1d(np.arange(len(ratios)), free)
        return RatioTest(
            place,
            sums.counts[free],
            sums.squares[free] / ratios[free],
            float(ratios[free[place]]),
            np.clip(values, 0.0, 1.0),
            vectors.T @ self.absorbed @ vectors,
            (sums.sides[free] / ratios[free, None]) @ basis,
            (1.0 / ratios[fixed]) @ sums.sides[fixed] @ basis,
        )
