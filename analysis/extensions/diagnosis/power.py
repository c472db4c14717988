"""Size of a bias, in standard deviations, that a two-sided test detects with a stated power."""

from __future__ import annotations

import math

import numpy as np

POINTS = 20001

# Larger non-centralities have no practical test.
LARGEST = 1e4

# Limits of significance levels and powers, which rounding keeps apart from 0 and 1.
LEAST_CHANCE, MOST_CHANCE = 1e-12, 0.999999


def alarm_limit(false_alarm: float, freedom: float = math.inf) -> float:
    """Return the absolute value that a statistic without bias exceeds with probability
    `false_alarm`.

    Normal if sigma is known; Student's with sigma from other observations of `freedom` degrees of
    freedom.

    >>> round(alarm_limit(0.001), 4), round(alarm_limit(0.001, 10), 4)
    (3.2905, 4.5869)
    """
    from scipy.special import ndtri, stdtrit

    if math.isinf(freedom):
        return float(-ndtri(false_alarm / 2.0))
    return float(-stdtrit(freedom, false_alarm / 2.0))


def chance_of_alarm(noncentrality: float, limit: float, freedom: float = math.inf) -> float:
    """Return the probability that a statistic with mean `noncentrality` exceeds `limit` in absolute
    value.

    >>> round(chance_of_alarm(0.0, alarm_limit(0.05, 4), 4), 9)
    0.05
    """
    from scipy.special import ndtr

    if math.isinf(freedom):
        return float(ndtr(noncentrality - limit) + ndtr(-noncentrality - limit))
    # The trapezoidal rule over the logarithm of the estimated sigma: SciPy's non-central t is NaN
    # for some biases at few degrees of freedom.
    width = 10.0 / math.sqrt(freedom)
    y = np.linspace(-40.0 / freedom - width, min(width, 3.0), POINTS)
    weight = np.exp(freedom * (y - 0.5 * np.expm1(2.0 * y)))
    sigma = np.exp(y)
    chance = ndtr(noncentrality - limit * sigma) + ndtr(-noncentrality - limit * sigma)
    return float(weight @ chance / weight.sum())


def noncentrality(false_alarm: float, power: float, freedom: float = math.inf) -> float:
    """Return the bias, in standard deviations of its estimate, that a two-sided test detects with
    `power`.

    Both tails count; without a degree of freedom it is infinite.

    >>> round(noncentrality(0.001, 0.8), 3), noncentrality(0.001, 0.8, 0)
    (4.132, inf)
    """
    from scipy.optimize import brentq

    if freedom < 1:
        return math.inf
    limit = alarm_limit(false_alarm, freedom)
    upper = 2.0 * limit + 5.0
    while chance_of_alarm(upper, limit, freedom) < power:
        upper *= 2.0
        if upper > LARGEST:
            return math.inf
    return float(
        brentq(lambda value: chance_of_alarm(value, limit, freedom) - power, 0.0, upper, xtol=1e-10)
    )
