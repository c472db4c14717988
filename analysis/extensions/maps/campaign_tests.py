"""Tests of the difference of two campaigns, each of which may estimate its sigma.

Welch's effective degrees of freedom use estimated shares of both campaigns. A campaign with too
small a sigma gets too small a share, which invalidates tests with few degrees of freedom. Here they
only weight differences of unequal shares. If stated uncertainties of both campaigns are wrong by
the same factor, the sum of their residual sums of squares is chi-squared and independent of the
ratio of both sigmas, over which the p-value is integrated.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from ballplate.simulator.computing import eigh, scipy_linalg, single_threaded
from ballplate.simulator.machines import Array

# Differences that are so small by no larger chance than this are doubted.
TOO_RARE = 1e-3
TOO_ALIKE = (
    "two independent campaigns are as alike as these are less than once in"
    f" {round(1.0 / TOO_RARE)}: readings or a certificate may be the same in both, or uncertainties"
    " are stated too large"
)

# Standard uncertainties below this part of the largest of a group are rounding: the frame, or the
# plate's axes, hold the figure.
HELD = 1e-9
# Parts of the largest column below which what is left of another is rounding.
NO_DIRECTION = 1e-9
# Standard deviation of a direction, in that which it would have with nothing in common, below which
# what both campaigns have in common fixes it: estimates are linear to that at best.
FIXED = 1e-3
# Degrees of freedom that are as good as any number.
MANY = 1e6
# The level at which statistics of scatters of all shares are made alike, and at how many shares.
LEVEL, SHARES = 0.05, 129
# Nodes of the integral over the ratio of both sigmas.
NODES = 100


@dataclass(frozen=True)
class EstimatedSigma:
    """Factor `sigma` of a campaign's stated uncertainties and its degrees of freedom, infinite if
    stated.
    """

    sigma: float
    degrees_of_freedom: float


SigmaPair = tuple[EstimatedSigma, EstimatedSigma]
Roots = tuple[Array, Array]


@dataclass(frozen=True)
class JointDifference:
    """Joint test of differences, `what` they are of: `statistic` is their sum of squares, weighted
    with their covariance, of `dimensions` independent ones.

    `degrees_of_freedom` are Welch's for the mean share of both campaigns; `p` is the p-value.
    Common errors fix `fixed` directions, which are not tested; `held` is the largest difference
    along them.
    """

    statistic: float
    dimensions: int
    degrees_of_freedom: float
    p: float
    fixed: int = 0
    held: float = 0.0
    what: str = ""


def with_common(roots: Roots, common: Array, scatters: SigmaPair) -> Roots:
    """Square roots (m, r) of both campaigns' parts of a covariance, with errors that both share:
    `common` (m, q) is the effect of one standard deviation, as stated, on the difference.

    Both sigmas estimate by how much such errors are stated too small, so that half of their
    variance belongs to either campaign.
    """
    first, second = (
        np.hstack([root, scatter.sigma * np.sqrt(0.5) * common])
        for root, scatter in zip(roots, scatters, strict=True)
    )
    return first, second


@single_threaded
def joint_difference(
    values: Array, roots: Roots, scatters: SigmaPair, alone: Array | None = None
) -> JointDifference | None:
    """Test differences (m,) with square roots (m, r) of both campaigns' parts of the covariance;
    None without variance.

    `alone` (m, k) is a square root of the covariance without common errors.
    """
    alone = np.hstack(roots) if alone is None else alone
    size = np.linalg.norm(alone, axis=1)
    is_uncertain = size > HELD * size.max(initial=0.0)
    size = size[is_uncertain]
    scaled, *parts = (array[is_uncertain] / size[:, None] for array in (alone, *roots))
    basis = orthonormal(scaled)
    if not basis.shape[1]:
        return None
    linalg = scipy_linalg()
    triangle = linalg.qr((basis.T @ scaled).T, mode="r")[0][: basis.shape[1]]

    def whitened(some: Array) -> Array:
        return linalg.solve_triangular(triangle, basis.T @ some, trans="T")

    difference, first, second = map(whitened, (values[is_uncertain] / size, *parts))
    spread, directions = eigh(first @ first.T + second @ second.T)
    is_fixed = spread <= FIXED**2
    fixed = directions[:, is_fixed]
    fixed_differences = size * (basis @ (triangle.T @ (fixed @ (fixed.T @ difference))))
    to_unit = (directions[:, ~is_fixed] / np.sqrt(spread[~is_fixed])).T
    if not len(to_unit):
        return None
    shares, directions = eigh(to_unit @ first @ (to_unit @ first).T)
    shares, squares = np.clip(shares, 0.0, 1.0), (directions.T @ to_unit @ difference) ** 2
    return JointDifference(
        float(squares.sum()),
        len(squares),
        float(welch(shares.mean(), scatters)),
        joint_chance(squares, shares, scatters),
        int(is_fixed.sum()),
        float(np.abs(fixed_differences).max()),
    )


def joint_chance(squares: Array, shares: Array, scatters: SigmaPair) -> float:
    """Return the joint p-value of `squares` (n,) of independent differences over their variances,
    to which the first campaign contributes the estimated `shares` (n,).

    >>> known, few = EstimatedSigma(1.0, np.inf), EstimatedSigma(1.0, 4)
    >>> round(joint_chance(np.array([3.841459]), np.ones(1), (known, few)), 6)
    0.05
    >>> round(joint_chance(np.array([7.708647]), np.zeros(1), (known, few)), 5)
    0.05
    """
    from scipy.special import chdtrc, fdtrc

    count = len(squares)
    if all(np.isinf(scatter.degrees_of_freedom) for scatter in scatters):
        return float(chdtrc(count, squares.sum()))
    grid, quantiles = _quantiles(count, *_freedom(scatters))
    of_first, deviations, weights, total = _ratios(shares, scatters)
    deviations = deviations / np.interp(of_first, grid, quantiles)
    statistic = float((squares / np.interp(shares, grid, quantiles)).sum())
    # A sum of squares of unequal variances, as one of equal variances with the same two moments.
    first, second = deviations.sum(axis=1), (deviations**2).sum(axis=1)
    return float(weights @ fdtrc(first**2 / second, total, statistic / first))


def single_chances(limit: float, shares: Array, scatters: SigmaPair) -> Array:
    """Return probabilities (m,) of single differences beyond `limit` standard uncertainties; the
    first campaign contributes the estimated `shares` (m,) of the variances.

    >>> both = EstimatedSigma(1.0, 5), EstimatedSigma(2.0, 5)
    >>> single_chances(2.228, np.array([0.2]), both).round(3)
    array([0.05])
    """
    from scipy.special import fdtrc

    _, deviations, weights, total = _ratios(shares, scatters)
    return np.asarray(weights @ fdtrc(1.0, total, limit**2 / deviations))


def welch(share: Array | float, scatters: SigmaPair) -> Array:
    """Return effective degrees of freedom of a variance, given the first campaign's share."""
    first, second = (scatter.degrees_of_freedom for scatter in scatters)
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / (np.square(share) / first + np.square(1.0 - share) / second))


def _ratios(shares: Array, scatters: SigmaPair) -> tuple[Array, Array, Array, float]:
    """Return, at nodes (k,) of the ratio of estimated sigmas with equal true ones: shares of the
    first campaign (k, n), ratios of true to estimated variances (k, n), weights (k,) of the nodes,
    and total degrees of freedom.
    """
    first, second = _freedom(scatters)
    part, weights = _nodes(first, second)
    total = first + second
    sigma = total * part / first, total * (1.0 - part) / second
    parts = shares / scatters[0].sigma ** 2, (1.0 - shares) / scatters[1].sigma ** 2
    true = parts[0] / (parts[0] + parts[1])
    estimated = sigma[0] * true + sigma[1] * (1.0 - true)
    return sigma[0] * true / estimated, 1.0 / estimated, weights, total


def _freedom(scatters: SigmaPair) -> tuple[float, float]:
    first, second = (min(scatter.degrees_of_freedom, MANY) for scatter in scatters)
    return first, second


@lru_cache(maxsize=16)
def _nodes(first: float, second: float) -> tuple[Array, Array]:
    """Parts (k, 1) of the first campaign in the residual sum of squares of both, and weights."""
    from scipy.special import betaincinv

    places, weights = np.polynomial.legendre.leggauss(NODES)
    return betaincinv(0.5 * first, 0.5 * second, 0.5 * (1.0 + places))[:, None], 0.5 * weights


@lru_cache(maxsize=256)
def _quantiles(count: int, first: float, second: float) -> tuple[Array, Array]:
    """Return shares of the first campaign and, at each, Fisher's quantile of `count` differences,
    which few degrees of freedom enlarge.
    """
    from scipy.special import betaincinv

    shares = np.linspace(0.0, 1.0, SHARES)
    freedom = 0.5 * welch(shares, (EstimatedSigma(1.0, first), EstimatedSigma(1.0, second)))
    return shares, freedom * (1.0 / betaincinv(freedom, 0.5 * count, LEVEL) - 1.0)


def orthonormal(columns: Array, least: float = NO_DIRECTION, largest: float | None = None) -> Array:
    """Return an orthonormal basis (m, r) of the space of columns (m, n); residuals below `least`
    times `largest`, by default that of the columns, are rounding.
    """
    if not columns.size:
        return np.zeros((len(columns), 0))
    # With pivots: singular values would say the same, but are not always found.
    basis, triangle, _ = scipy_linalg().qr(columns, mode="economic", pivoting=True)
    sizes = np.abs(np.diagonal(triangle))
    limit = least * (float(sizes.max()) if largest is None else largest)
    return basis[:, sizes > limit]
