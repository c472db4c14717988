"""The gate of causes that are named: what fits with them leave, compared with the fit without them
and with each other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

from .tails import log_chance

Explanation = TypeVar("Explanation")

# Odds by which one explanation must be more probable than another to be clearly better.
LOG_ODDS_LIMIT = math.log(1000.0)

# Stated uncertainties are accepted if the residuals without a suspect have at least this p-value.
BELIEVED = math.log(1e-2)


def log_p(square: float, dimensions: float, total: float, freedom: int, estimated: bool) -> float:
    """Return the logarithm of the p-value of a sum of squares in some `dimensions` of residuals
    with a `total`, in their `freedom`.
    """
    log_p_of_rest = log_chance(total - square, total, freedom - dimensions, freedom, True)
    by_size = not estimated and float(log_p_of_rest) > BELIEVED
    return float(log_chance(square, total, dimensions, freedom, by_size))


def variance(least: float, freedom: int, sigma_is_estimated: bool) -> float:
    """Return the variance of residuals of which `least` remains, relative to the stated one."""
    return max(least / freedom, 1.0) if sigma_is_estimated else 1.0


def clear_odds(least: float, freedom: int, sigma_is_estimated: bool) -> float:
    """Return the difference of sums of squares that makes one explanation clearly better."""
    return 2.0 * LOG_ODDS_LIMIT * variance(least, freedom, sigma_is_estimated)


def standing(
    rivals: Sequence[tuple[float, int, Explanation]],
    total: float,
    freedom: int,
    limit: float,
    sigma_is_estimated: bool,
) -> list[Explanation]:
    """Return the explanations that may be named, the best first.

    Each is given with what a fit with it leaves of the sum of squares `total`, and the number of
    its parameters beyond those of the file. It must leave significantly less than the file, at the
    `limit`, and no rival may be clearly better by Akaike's criterion.
    """
    if not rivals:
        return []
    least = min(remaining for remaining, _, _ in rivals)
    unit = 2.0 * variance(least, freedom, sigma_is_estimated)
    criteria = [remaining + unit * dimensions for remaining, dimensions, _ in rivals]
    most = min(criteria) + clear_odds(least, freedom, sigma_is_estimated)
    return [
        explanation
        for criterion, (remaining, dimensions, explanation) in sorted(
            zip(criteria, rivals, strict=True), key=lambda each: each[0]
        )
        if criterion <= most
        and remaining < total
        and log_p(total - remaining, dimensions, total, freedom, sigma_is_estimated) < limit
    ]
