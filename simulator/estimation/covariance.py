"""Uncertainty of any linear function of the parameters, from a factor, without a large matrix.

The covariance of the parameters is G G' with a square root G that has one block for each ball: what its own
rows leave open, and what it shares with all others through poses and machine errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..design import Design
from ..machines.protocol import Array
from ..threads import scipy_linalg, single_threaded
from .elimination import Factor
from .parameters import SharedLayout

# Below this fraction of the largest singular value a direction is undetermined: rounding leaves about 1e-14,
# and the weakest determined direction of a usable design is many orders of magnitude above.
EXACT = 1e-10

# The size of change that a singular value is quoted for.
MICROMETRE = 1e-6

# A function counts as undetermined when a null direction changes it by this fraction of what any direction could.
TOUCHED = 1e-7


@dataclass(frozen=True)
class Spectrum:
    """Singular values of the shared parameters' factor, in engineering units.

    Columns are scaled so that a unit step moves some point in the volume by up to a micrometre; a singular value
    is then the number of standard deviations by which the observations show such a change. `directions` (s, s)
    holds the right singular vectors as columns, in the parameters' own units, in the order of `values` (s,),
    largest first; `deficiency` counts those that the observations leave wholly open.
    """

    values: Array
    directions: Array
    scale: Array
    deficiency: int

    @property
    def rank(self) -> int:
        return len(self.values) - self.deficiency

    @property
    def gap(self) -> float:
        """Ratio of the smallest value counted as determined to the largest counted as undetermined."""
        if not 0 < self.deficiency < len(self.values):
            return float("inf")
        return float(self.values[self.rank - 1] / max(self.values[self.rank], np.finfo(float).tiny))

    @property
    def null(self) -> Array:
        """Undetermined directions (s, deficiency)."""
        return self.directions[:, self.rank :]

    @property
    def root(self) -> Array:
        """Square root (s, rank) of the shared parameters' covariance, what is undetermined left out."""
        return np.asarray(self.directions[:, : self.rank] / self.values[: self.rank])


@single_threaded
def spectrum(factor: Factor, exact: float = EXACT, held: Array | None = None) -> Spectrum:
    """Singular value decomposition of the shared parameters' factor.

    What observations tell of the directions `held` (s, k), null directions of another spectrum, is left out, so that
    these are null directions here, too.
    """
    scale = factor.layout.scale * MICROMETRE
    root = factor.root * scale
    if held is not None:
        open_ = held / scale[:, None]
        root = root - (root @ open_) @ open_.T
    _, values, right = np.linalg.svd(root)
    # Where nothing shared is determined, all values are rounding, of what the balls' rows have carried away.
    largest = max(
        float(values.max(initial=0.0)),
        *(float(np.abs(rows * scale).max(initial=0.0)) for rows in (factor.ball_shared, factor.kept_shared)),
    )
    deficiency = int((values <= exact * largest).sum())
    return Spectrum(values, scale[:, None] * right.T, scale, deficiency)


def no_spectrum(layout: SharedLayout) -> Spectrum:
    """What stands for a spectrum where the factor is not finite: no value is known, none counts as open."""
    size = len(layout)
    return Spectrum(np.full(size, np.nan), np.full((size, size), np.nan), layout.scale * MICROMETRE, 0)


@dataclass(frozen=True)
class Covariance:
    """Square root of the covariance, in units of the standard deviation of a unit-weight observation.

    `shared` (s, r) for the shared parameters. For the balls: `ball` (n, d, r + kept) is the part common to all,
    `ball_own` (n, d, d) the part each has alone; rows of balls that are no parameters are zero. The `..._null`
    arrays say how the undetermined directions move the same parameters, (s, deficiency), (n, d, deficiency).
    """

    shared: Array
    ball: Array
    ball_own: Array
    shared_null: Array
    ball_null: Array
    scale: Array
    ball_scale: float = MICROMETRE

    def of_shared(self, linear: Array) -> Array:
        """Standard deviations (m,) of `linear` (m, s) applied to the shared parameters; NaN where open."""
        result = np.sqrt(((linear @ self.shared) ** 2).sum(axis=1))
        return blank(result, linear @ self.shared_null, np.sqrt(((linear * self.scale) ** 2).sum(axis=1)))

    def of_balls(self) -> Array:
        """Standard deviations (n, d) of the ball co-ordinates; NaN where open."""
        result = np.sqrt((self.ball**2).sum(axis=2) + (self.ball_own**2).sum(axis=2))
        return blank(result, self.ball_null, np.full(result.shape, self.ball_scale))


def blank(values: Array, change: Array, size: Array) -> Array:
    """`values` with NaN where a null direction's `change` (..., deficiency) is no mere rounding of `size`."""
    if change.shape[-1] == 0:
        return values
    open_ = np.sqrt((change**2).sum(axis=-1)) > TOUCHED * np.maximum(size, np.finfo(float).tiny)
    return np.where(open_, np.nan, values)


@single_threaded
def covariance(design: Design, factor: Factor, found: Spectrum) -> Covariance:
    """Square root of the covariance of all parameters."""
    n, d = len(design.ball_names), design.dimension
    shared, null = found.root, found.null
    rank, nulls, k = shared.shape[1], null.shape[1], d * len(factor.kept)
    ball = np.zeros((n, d, rank + k))
    own = np.zeros((n, d, d))
    ball_null = np.zeros((n, d, nulls))
    carried = _solve_balls(factor.ball_root, factor.ball_shared)
    ball[factor.eliminated, :, :rank] = -(carried @ shared)
    ball_null[factor.eliminated] = -(carried @ null)
    own[factor.eliminated] = _solve_balls(factor.ball_root, np.broadcast_to(np.eye(d), factor.ball_root.shape))
    if k:
        solve_triangular = scipy_linalg().solve_triangular
        sides = np.concatenate([factor.kept_shared @ shared, factor.kept_shared @ null, -np.eye(k)], axis=1)
        solved = -solve_triangular(factor.kept_root, sides, check_finite=False)
        ball[factor.kept, :, :rank] = solved[:, :rank].reshape(len(factor.kept), d, rank)
        ball_null[factor.kept] = solved[:, rank : rank + nulls].reshape(len(factor.kept), d, nulls)
        ball[factor.kept, :, rank:] = solved[:, rank + nulls :].reshape(len(factor.kept), d, k)
    return Covariance(shared, ball, own, null, ball_null, found.scale)


def _solve_balls(root: Array, side: Array) -> Array:
    """Solve upper triangular systems (n, d, d) for sides (n, d, m) by substitution, all balls at once."""
    d = root.shape[1]
    solution = np.array(side, dtype=float)
    for row in reversed(range(d)):
        for later in range(row + 1, d):
            solution[:, row] -= root[:, row, later, None] * solution[:, later]
        solution[:, row] /= root[:, row, row, None]
    return solution
