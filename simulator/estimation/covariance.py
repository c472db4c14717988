"""Uncertainty of any linear function of the parameters, from a factor, without a large matrix.

The covariance of the parameters is G G' with a square root G that has one block for each ball: what
its own rows leave open, and what it shares with all others through poses and machine errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..computing.threads import scipy_linalg, single_threaded
from ..design.arrays import Design
from ..machines.protocol import Array
from .elimination import Factor
from .graded import triangle
from .parameters import SharedLayout
from .substitution import in_order, solve_balls, solve_kept

# Below this fraction of the largest singular value a direction is undetermined: rounding leaves
# about 1e-14, and the weakest determined direction of a usable design is many orders of magnitude
# above.
EXACT = 1e-10

# The size of change that a singular value is quoted for.
MICROMETRE = 1e-6

# A function counts as undetermined when a null direction changes it by this fraction of what any
# direction could.
TOUCHED = 1e-7


@dataclass(frozen=True)
class Spectrum:
    """Singular values of the shared parameters' factor, in engineering units.

    Columns are scaled so that a unit step moves some point in the volume by up to a micrometre; a
    singular value is then the number of standard deviations by which the observations show such a
    change. `directions` (s, s) holds the right singular vectors as columns, in the parameters' own
    units, in the order of `values` (s,), largest first; `deficiency` counts those that the
    observations leave wholly open, and `gap` is the ratio of the smallest value counted as
    determined to the largest counted as undetermined, where these were told apart.
    """

    values: Array
    directions: Array
    scale: Array
    deficiency: int
    gap: float

    @property
    def rank(self) -> int:
        return len(self.values) - self.deficiency

    @property
    def null(self) -> Array:
        """Undetermined directions (s, deficiency)."""
        return self.directions[:, self.rank :]

    @property
    def root(self) -> Array:
        """Square root (s, rank) of the shared parameters' covariance, what is undetermined left
        out.
        """
        return np.asarray(self.directions[:, : self.rank] / self.values[: self.rank])


@single_threaded
def spectrum(factor: Factor, drawn: Spectrum | None = None) -> Spectrum:
    """Singular value decomposition of the shared parameters' factor.

    Rank and null space do not depend on the weights of rows. Where these differ much, so that
    rounding of the heaviest hides what the lightest tell, both are those of the rows with equal
    weights. They are those of `drawn` where that is given: what observations tell of its null
    directions is left out, and no other direction counts as one.
    """
    scale = factor.layout.scale * MICROMETRE
    if drawn is None:
        judged = factor if factor.alike is None else factor.alike
        _, values, right = np.linalg.svd(judged.root * scale)
        # Where nothing shared is determined, all values are rounding, of what the balls' rows have
        # carried away.
        largest = max(
            float(values.max(initial=0.0)),
            *(
                float(np.abs(rows * scale).max(initial=0.0))
                for rows in (judged.ball_shared, judged.kept_shared)
            ),
        )
        deficiency = int((values <= EXACT * largest).sum())
        rank = len(values) - deficiency
        gap = float("inf")
        if 0 < deficiency < len(values):
            gap = float(values[rank - 1] / max(values[rank], np.finfo(float).tiny))
        if judged is factor:
            return Spectrum(values, scale[:, None] * right.T, scale, deficiency, gap)
        null = right[rank:].T
    else:
        null, deficiency, gap = drawn.null / scale[:, None], drawn.deficiency, drawn.gap
    spanned = np.linalg.qr(null, mode="complete")[0][:, deficiency:]
    values, directions = _determined(factor, scale, spanned)
    # Rounding alone is left of what counts as zero.
    below = values[-1] / gap if len(values) else 0.0
    return Spectrum(
        np.append(values, np.full(deficiency, below)),
        scale[:, None] * np.concatenate([directions, null], axis=1),
        scale,
        deficiency,
        gap,
    )


def _determined(factor: Factor, scale: Array, spanned: Array) -> tuple[Array, Array]:
    """Singular values (r,) and directions (s, r) of a scaled factor within what `spanned` (s, r)
    spans.
    """
    if factor.orders is None:
        _, values, right = np.linalg.svd((factor.root * scale) @ spanned, full_matrices=False)
        return values, spanned @ right.T
    # The heaviest rows would take all digits of the smallest singular values, but the inverse has
    # these first.
    found = triangle(in_order(factor) * scale @ spanned, np.zeros((len(scale), 0)))
    inverse = scipy_linalg().solve_triangular(
        found.root, np.eye(len(found.root)), check_finite=False
    )
    directions, values, _ = np.linalg.svd(spanned[:, found.order] @ inverse, full_matrices=False)
    return 1.0 / values[::-1], directions[:, ::-1]


def no_spectrum(layout: SharedLayout) -> Spectrum:
    """What stands for a spectrum where the factor is not finite: no value is known, none counts as
    open.
    """
    size = len(layout)
    return Spectrum(
        np.full(size, np.nan),
        np.full((size, size), np.nan),
        layout.scale * MICROMETRE,
        0,
        float("inf"),
    )


@dataclass(frozen=True)
class BallCovariance:
    """Square root of the covariance of the balls, in units of the standard deviation of a
    unit-weight observation.

    `common` (n, d, r + kept) is the part that they have in common with all else, of which the first
    r columns are those of the shared parameters, and `own` (n, d, d) the part that each has alone;
    rows of balls that are no parameters are zero. `null` (n, d, deficiency) says how the
    undetermined directions move the balls.
    """

    common: Array
    own: Array
    null: Array


def blank(values: Array, change: Array, size: Array) -> Array:
    """`values` with NaN where a null direction's `change` (..., deficiency) is no mere rounding of
    `size`.
    """
    if change.shape[-1] == 0:
        return values
    open_ = np.sqrt((change**2).sum(axis=-1)) > TOUCHED * np.maximum(size, np.finfo(float).tiny)
    return np.where(open_, np.nan, values)


@single_threaded
def ball_covariance(design: Design, factor: Factor, spectrum: Spectrum) -> BallCovariance:
    """Square root of the covariance of all balls."""
    n, d = len(design.balls.names), design.dimension
    shared, null = spectrum.root, spectrum.null
    rank, nulls, k = shared.shape[1], null.shape[1], d * len(factor.kept)
    ball = np.zeros((n, d, rank + k))
    own = np.zeros((n, d, d))
    ball_null = np.zeros((n, d, nulls))
    carried = solve_balls(factor, factor.ball_shared)
    ball[factor.eliminated, :, :rank] = -(carried @ shared)
    ball_null[factor.eliminated] = -(carried @ null)
    own[factor.eliminated] = solve_balls(factor, np.broadcast_to(np.eye(d), factor.ball_root.shape))
    if k:
        sides = np.concatenate(
            [factor.kept_shared @ shared, factor.kept_shared @ null, -np.eye(k)], axis=1
        )
        solved = -solve_kept(factor, sides)
        ball[factor.kept, :, :rank] = solved[:, :rank].reshape(len(factor.kept), d, rank)
        ball_null[factor.kept] = solved[:, rank : rank + nulls].reshape(len(factor.kept), d, nulls)
        ball[factor.kept, :, rank:] = solved[:, rank + nulls :].reshape(len(factor.kept), d, k)
    return BallCovariance(ball, own, ball_null)
