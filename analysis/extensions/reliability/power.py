"""Size of a bias, in standard deviations, that a two-sided test finds with a stated power."""

from __future__ import annotations

import math

import numpy as np

POINTS = 20001

# Non-centralities beyond this are none of a test that anybody makes.
LARGEST = 1e4

# Chances of a test that can be told from never and always.
LEAST_CHANCE, MOST_CHANCE = 1e-12, 0.999999


def alarm_limit(false_alarm: float, freedom: float = math.inf) -> float:
    """What a statistic exceeds in absolute value with the probability `false_alarm` if there is no
    bias.

    Normal where sigma is known; with sigma from other observations of `freedom` degrees of freedom
    Student's.

    >>> round(alarm_limit(0.001), 4), round(alarm_limit(0.001, 10), 4)
    (3.2905, 4.5869)
    """
    from scipy.special import ndtri, stdtrit

    if math.isinf(freedom):
        return float(-ndtri(false_alarm / 2.0))
    return float(-stdtrit(freedom, false_alarm / 2.0))


def chance_of_alarm(noncentrality: float, limit: float, freedom: float = math.inf) -> float:
    """Probability that a statistic whose mean is off by `noncentrality` exceeds `limit` in absolute
    value.

    Of Student's non-central distribution by the trapezoidal rule over the logarithm of the
    estimated sigma: SciPy's is not a number for some biases at few degrees of freedom.

    >>> round(chance_of_alarm(0.0, alarm_limit(0.05, 4), 4), 9)
    0.05
    """
    from scipy.special import ndtr

    if math.isinf(freedom):
        return float(ndtr(noncentrality - limit) + ndtr(-noncentrality - limit))
    width = 10.0 / math.sqrt(freedom)
    y = np.linspace(-40.0 / freedom - width, min(width, 3.0), POINTS)
    weight = np.exp(freedom * (y - 0.5 * np.expm1(2.0 * y)))
    sigma = np.exp(y)
    chance = ndtr(noncentrality - limit * sigma) + ndtr(-noncentrality - limit * sigma)
    return float(weight @ chance / weight.sum())


def noncentrality(false_alarm: float, power: float, freedom: float = math.inf) -> float:
    """The bias, in standard deviations of its estimate, that a two-sided test finds with the stated
    power.

    It solves the test's power exactly, with both tails; infinite without a degree of freedom.

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
