"""Outliers and events among the residuals of a fit: tests of single observations and of patterns, one by one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from simulator.design import Design
from simulator.estimation.covariance import covariance
from simulator.estimation.gauss_newton import Solution
from simulator.estimation.hat import hat_rows, whitened_residuals
from simulator.estimation.parameters import SharedLayout, shared_layout
from simulator.machines.protocol import Array, Unit
from simulator.threads import single_threaded

from .names import name
from .patterns import Patterns, patterns
from .power import alarm_limit
from .response import responses

# Chance that anything at all is suspected where nothing is wrong.
FAMILY = 0.01

# How many are told at the most.
MOST = 10

# A pattern of which no more than this share is left in the residuals is not tested.
HIDDEN = 1e-8

# Residuals of this many standard uncertainties are rounding, of readings without noise.
ROUNDING = 1e-6

# Share of a sum of squares that rounding leaves.
LEFT = 1e-12

# Two patterns whose estimates are correlated more than this cannot be told apart.
ALIKE = 0.9999


@dataclass(frozen=True)
class Suspect:
    """A bias that the residuals show: the `pattern` among `patterns`, its size and standard uncertainty.

    `value` (m, rad or ratio) is estimated together with the other suspects'. `statistic` exceeded `limit` when it was
    found, in standard uncertainties. `alternatives` names what the readings cannot tell from it.
    """

    patterns: Patterns
    pattern: int
    value: float
    standard_uncertainty: float
    statistic: float
    limit: float
    alternatives: tuple[str, ...] = ()

    @property
    def unit(self) -> Unit:
        return self.patterns.unit(self.pattern)


@single_threaded
def suspects(design: Design, solution: Solution, x: Array, freedom: int, sigma_is_estimated: bool) -> list[Suspect]:
    """What is suspected of the observations that a solution was found from; the estimate itself stays what it is.

    Each test is that of one bias: normal where sigma is given, otherwise with sigma from what is left without the
    suspect, of Student's distribution. The most significant bias is taken out of the residuals to first order, and the
    tests are made anew, until none exceeds its limit, Bonferroni's for `FAMILY` and the number of tests.
    """
    sum_of_squares = solution.factor.sum_of_squares
    if freedom < 3 or sum_of_squares <= ROUNDING**2 * freedom:
        return []
    layout = shared_layout(design)
    found = Search(design, layout, solution, x)
    chosen: list[tuple[int, float, float]] = []
    while len(chosen) < MOST and freedom >= 3:
        limit = alarm_limit(FAMILY / found.tests, freedom - 1 if sigma_is_estimated else math.inf)
        statistic = found.statistics()
        ratio = np.abs(studentised(statistic, sum_of_squares, freedom) if sigma_is_estimated else statistic)
        # Of patterns that are the same, the first: single observations stand before events.
        k = int(np.flatnonzero(ratio >= (1.0 - 1e-9) * ratio.max())[0])
        if ratio[k] <= limit:
            break
        chosen.append((k, float(ratio[k]), limit))
        # What one bias explains wholly leaves rounding, of either sign.
        least = LEFT * solution.factor.sum_of_squares
        sum_of_squares = max(sum_of_squares - float(statistic[k]) ** 2, least)
        freedom -= 1
        found.take_out(k)
    scale = math.sqrt(sum_of_squares / freedom) if sigma_is_estimated else 1.0
    return found.told(chosen, scale)


def studentised(statistic: Array, sum_of_squares: Array | float, freedom: int) -> Array:
    """Statistics (...) in terms of the sigma that the other observations show, of `freedom` - 1 degrees of freedom.

    >>> studentised(np.array([3.0]), 19.0, 11)
    array([3.])
    """
    others = np.maximum(sum_of_squares - statistic**2, ROUNDING**2) / (freedom - 1)
    return np.asarray(statistic / np.sqrt(others))


class Search:
    """Statistics of all patterns, less what the suspects found so far explain."""

    def __init__(self, design: Design, layout: SharedLayout, solution: Solution, x: Array) -> None:
        self.design, self.layout, self.state, self.x = design, layout, solution.state, x
        self.spread = covariance(design, solution.factor, solution.spectrum)
        self.patterns = patterns(design, solution.state, x)
        self.square, self.information = np.zeros((2, len(self.patterns)))
        for one in responses(design, layout, solution.state, x, self.spread, self.patterns):
            self.square[one.index], self.information[one.index] = one.square, one.information
        self.residual = whitened_residuals(design, layout, solution.state, x)
        self.product = self.patterns.matrix.T @ self.residual
        self.tests = max(int((self.information > HIDDEN * self.square).sum()), 1)
        self.basis: list[Array] = []
        self.left: list[Array] = []
        self.alike: list[tuple[str, ...]] = []

    def statistics(self) -> Array:
        """Estimated biases (k,) in their standard uncertainties, 0 for what cannot be tested."""
        can = self.information > HIDDEN * self.square
        return np.asarray(np.where(can, self.product / np.sqrt(np.where(can, self.information, 1.0)), 0.0))

    def take_out(self, k: int) -> None:
        """Let a bias be a parameter of its own, to first order."""
        pattern = self.patterns.matrix[:, [k]].toarray()[:, 0]
        left = pattern - self._estimated(pattern)
        self.left.append(left)
        unit = left
        for earlier in self.basis:
            unit = unit - earlier * (earlier @ unit)
        unit = unit / np.sqrt(unit @ unit)
        correlation = self.patterns.matrix.T @ unit
        can = self.information > HIDDEN * self.square
        same = np.flatnonzero(can & (np.abs(correlation) > ALIKE * np.sqrt(np.where(can, self.information, 1.0))))
        self.alike.append(tuple(name(self.patterns, other) for other in same[same != k].tolist()))
        self.product = self.product - correlation * (unit @ self.residual)
        self.information = self.information - correlation**2
        self.basis.append(unit)

    def _estimated(self, pattern: Array) -> Array:
        """What of a pattern (rows,) the estimate takes up."""
        d, balls = self.design.dimension, len(self.design.balls)
        common, own = np.zeros(self.spread.ball.shape[2]), np.zeros((balls, d))
        for some in hat_rows(self.design, self.layout, self.state, self.x, self.spread):
            common += pattern[some.rows] @ some.common
            at = some.ball >= 0
            np.add.at(own, some.ball[at], some.own[at] * pattern[some.rows[at], None])
        result = np.zeros_like(pattern)
        for some in hat_rows(self.design, self.layout, self.state, self.x, self.spread):
            private = np.where(some.ball[:, None] >= 0, some.own * own[some.ball], 0.0)
            result[some.rows] = some.common @ common + private.sum(axis=1)
        return result

    def told(self, chosen: list[tuple[int, float, float]], sigma: float) -> list[Suspect]:
        """The suspects with their sizes, estimated together."""
        if not chosen:
            return []
        together = np.stack(self.left, axis=1)
        scale = np.sqrt((together**2).sum(axis=0))
        q, r = np.linalg.qr(together / scale)
        inverse = np.linalg.inv(r)
        values = inverse @ (q.T @ self.residual) / scale
        uncertainties = sigma * np.sqrt((inverse**2).sum(axis=1)) / scale
        return [
            Suspect(self.patterns, k, float(value), float(u), statistic, limit, alike)
            for (k, statistic, limit), value, u, alike in zip(chosen, values, uncertainties, self.alike, strict=True)
        ]
