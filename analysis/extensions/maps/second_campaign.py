"""What a second campaign says of a prediction: normalised errors of single figures, and a joint
test.

Where a campaign estimates its sigma, its variance is widened by what Student's or Fisher's
quantile, of its own degrees of freedom, has over that of known variances. With one figure this is
the interval of S. K. Banerjee, Sankhya 22 (1960), 357, for means of populations whose variances are
not equal: no chance is larger than stated, whatever the true shares of both campaigns. With several
it holds in simulations. Effective degrees of freedom from the estimated shares (Welch and
Satterthwaite) do not keep it: a campaign of few whose sigma came out too small has too small a
share as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing import scipy_linalg, single_threaded
from ballplate.simulator.machines import Array
from numpy.typing import NDArray

# Directions of a covariance below this part of the largest, as correlations, are those of figures
# that say the same.
SAME = 1e-6
# By how many of the largest standard uncertainties that such a direction may have figures differ
# along it beyond doubt.
BEYOND_DOUBT = 10.0
# Chances with which nothing but chance makes the overall figure larger than 1, and any of the
# figures compared as large as `largest_by_chance`.
ALL_TOGETHER = 0.05
ANY_FIGURE = 0.01
# Figures below this, in metres and radians, are rounding.
ROUNDING = 1e-13


@dataclass(frozen=True, eq=False)
class CampaignFigures:
    """Figures (m,) by one campaign with a square root (m, r) of their covariance, NaN where
    undetermined, and the degrees of freedom of its sigma, infinite where it is stated.
    """

    values: Array
    root: Array
    degrees_of_freedom: float


@dataclass(frozen=True, eq=False)
class CampaignComparison:
    """E_n (m,) of figures, NaN where one is undetermined and where both are exactly known and the
    same; how many were `compared`; the |E_n| that any of these exceeds at most once in a hundred,
    infinite without degrees of freedom; and `overall`, which is above 1 at most once in twenty,
    where nothing has changed.
    """

    normalised_errors: Array
    compared: int
    largest_by_chance: float
    overall: float


def compared_campaigns(
    predicted: CampaignFigures,
    found: CampaignFigures,
    together: NDArray[np.bool_],
    coverage_factor: float,
) -> CampaignComparison:
    """Single figures of two independent campaigns, and those that are compared `together` (m,).

    >>> known = CampaignFigures(np.zeros(2), np.eye(2), np.inf)
    >>> other = CampaignFigures(np.array([2.0, -1.0]), np.eye(2), np.inf)
    >>> compared_campaigns(known, other, np.array([True, True]), 2.0).overall.__round__(3)
    0.646
    """
    both = predicted, found
    apart = found.values - predicted.values
    sizes = [np.linalg.norm(one.root, axis=1) for one in both]
    size = np.hypot(*sizes)
    # Exactly known in both: the same, or different beyond doubt.
    exact = size <= ROUNDING
    apart = np.where(np.abs(apart) <= ROUNDING, np.where(exact, np.nan, 0.0), apart)
    whole = coverage_factor * np.where(exact, 1.0, size)
    errors = np.where(exact, np.copysign(np.inf, apart), apart / whole)
    errors[np.isnan(apart)] = np.nan
    count = int((~np.isnan(errors)).sum())
    largest = float("inf")
    if all(one.degrees_of_freedom > 0.0 for one in both):
        factors = [_student(one.degrees_of_freedom, ANY_FIGURE / max(count, 1)) for one in both]
        widened = np.hypot(*(factor * u for factor, u in zip(factors, sizes, strict=True)))
        largest = float((widened / whole)[np.isfinite(errors)].max(initial=1.0))
    return CampaignComparison(errors, count, largest, _overall(both, errors, size, together))


@single_threaded
def _overall(
    both: tuple[CampaignFigures, CampaignFigures],
    errors: Array,
    size: Array,
    together: NDArray[np.bool_],
) -> float:
    """The root of the weighted sum of squares of differences over its quantile; infinite where
    figures that are exactly known or wholly correlated contradict each other, NaN where there are
    none, or a scatter without degrees of freedom.
    """
    if np.isinf(errors[together]).any():
        return float("inf")
    some = np.flatnonzero(together & np.isfinite(errors))
    if not len(some):
        return float("nan")
    size = size[some]
    apart = (both[1].values - both[0].values)[some] / size
    roots = [one.root[some] / size[:, None] for one in both]
    values, vectors = np.linalg.eigh(sum((root @ root.T for root in roots), np.zeros((1, 1))))
    kept = values > SAME * values[-1]
    # Figures are what they are to second order of the errors.
    slack = ROUNDING + max(float(np.square(one.values[some]).max()) for one in both)
    dropped = vectors[:, ~kept]
    doubt = BEYOND_DOUBT * np.sqrt(SAME * values[-1]) + np.abs(dropped.T) @ (slack / size)
    if (np.abs(dropped.T @ apart) > doubt).any():
        return float("inf")
    if not all(one.degrees_of_freedom > 0.0 for one in both):
        return float("nan")
    whitening = (vectors[:, kept] / np.sqrt(values[kept])).T
    limits = [_fisher(int(kept.sum()), one.degrees_of_freedom) for one in both]
    columns = [
        np.sqrt(limit) * (whitening @ root) for limit, root in zip(limits, roots, strict=True)
    ]
    linalg = scipy_linalg()
    (triangle,) = linalg.qr(np.concatenate(columns, axis=1).T, mode="r")
    scores = linalg.solve_triangular(
        triangle[: len(whitening)], whitening @ apart, trans="T", check_finite=False
    )
    return float(np.linalg.norm(scores))


def _student(degrees_of_freedom: float, chance: float) -> float:
    """What a figure over its standard uncertainty exceeds by chance, upwards or downwards."""
    from scipy.special import ndtri, stdtrit

    if np.isinf(degrees_of_freedom):
        return float(-ndtri(0.5 * chance))
    return float(-stdtrit(degrees_of_freedom, 0.5 * chance))


def _fisher(dimensions: int, degrees_of_freedom: float) -> float:
    """What the sum of squares of so many independent figures exceeds once in twenty."""
    from scipy.special import chdtri, fdtri

    if np.isinf(degrees_of_freedom):
        return float(chdtri(dimensions, ALL_TOGETHER))
    return float(dimensions * fdtri(dimensions, degrees_of_freedom, 1.0 - ALL_TOGETHER))
