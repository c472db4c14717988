"""Rank and null space from the singular values of a factor, and from it the uncertainty of any
linear function of the parameters, without a large matrix.

The covariance of the parameters is G G' with a square root G that has one block per ball: the part
that its own rows leave, and the part shared with all others through poses and machine errors.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from ballplate.simulator.computing.numerics import svd
from ballplate.simulator.computing.processes import scipy_linalg, single_threaded
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.inputs.number_arrays import Array, Integers

from .elimination import Factor


def solve_balls(factor: Factor, side: Array, transposed: bool = False) -> Array:
    """Solve the systems (e, d, d) of the balls eliminated singly for sides (e, d, m), all balls at
    once.
    """
    root = factor.ball_root
    order = None if factor.orders is None else factor.orders.ball[:, :, None]
    if not transposed:
        return _put(_by_substitution(root, side), order)
    if order is not None:
        side = np.take_along_axis(side, order, 1)
    return _by_substitution_transposed(root, side)


def solve_kept(factor: Factor, side: Array, transposed: bool = False) -> Array:
    """Solve the system of the balls that distances tie together for sides (d k, ...)."""
    return _solve(
        factor.kept_root, None if factor.orders is None else factor.orders.kept, side, transposed
    )


def solve_shared(factor: Factor, side: Array, transposed: bool = False) -> Array:
    """Solve the system of the shared parameters for sides (s, ...); of a design of full rank
    only.
    """
    return _solve(
        factor.root, None if factor.orders is None else factor.orders.shared, side, transposed
    )


def in_order(factor: Factor) -> Array:
    """The shared parameters' root (s, s) with its columns in the order of the parameters."""
    if factor.orders is None:
        return factor.root
    root = np.empty_like(factor.root)
    root[:, factor.orders.shared] = factor.root
    return root


def _solve(root: Array, order: Integers | None, side: Array, transposed: bool) -> Array:
    solve_triangular = scipy_linalg().solve_triangular
    if transposed:
        return solve_triangular(
            root, side if order is None else side[order], trans="T", check_finite=False
        )
    solution = solve_triangular(root, side, check_finite=False)
    if order is None:
        return solution
    result = np.empty_like(solution)
    result[order] = solution
    return result


def _put(solution: Array, order: Integers | None) -> Array:
    if order is None:
        return solution
    result = np.empty_like(solution)
    np.put_along_axis(result, order, solution, 1)
    return result


# Written out, since a loop over two or three rows with all balls in one array is faster than a call
# of LAPACK for each ball.
def _by_substitution(root: Array, side: Array) -> Array:
    """Solve upper triangular systems (n, d, d) for sides (n, d, m)."""
    d = root.shape[1]
    solution = np.array(side, dtype=float)
    for row in reversed(range(d)):
        for later in range(row + 1, d):
            solution[:, row] -= root[:, row, later, None] * solution[:, later]
        solution[:, row] /= root[:, row, row, None]
    return solution


def _by_substitution_transposed(root: Array, side: Array) -> Array:
    """Solve R' z = side for upper triangular R (n, d, d) and sides (n, d, m)."""
    solution = np.array(side, dtype=float)
    for row in range(root.shape[1]):
        for earlier in range(row):
            solution[:, row] -= root[:, earlier, row, None] * solution[:, earlier]
        solution[:, row] /= root[:, row, row, None]
    return solution


# Below this fraction of the largest value (see `spectrum`) a direction is undetermined: rounding
# leaves about 1e-14, and the weakest determined direction of a usable design is many orders of
# magnitude above.
RANK_TOLERANCE = 1e-10

# The size of change that a singular value is quoted for.
MICROMETRE = 1e-6


@dataclass(frozen=True)
class Spectrum:
    """Singular values of the shared parameters' factor, in engineering units.

    Columns are scaled so that a unit step moves some point in the volume by up to a micrometre; a
    singular value is then the number of standard deviations by which the observations show such a
    change. `values` (s,) are sorted, largest first; `deficiency` counts the undetermined ones, and
    `gap` is the ratio of the smallest determined value to the largest undetermined one, if both
    exist. With full rank and weights alike the values are those of the scaled `triangle` (s, s),
    whose singular vectors are computed on request; otherwise `known` (s, s) has the directions.
    """

    values: Array
    scale: Array
    deficiency: int
    gap: float
    triangle: Array | None = None
    known: Array | None = None

    @property
    def rank(self) -> int:
        return len(self.values) - self.deficiency

    @property
    def null(self) -> Array:
        """Undetermined directions (s, deficiency)."""
        if self.deficiency == 0:
            return np.zeros((len(self.values), 0))
        return self.directions[:, self.rank :]

    @cached_property
    def directions(self) -> Array:
        """Right singular vectors as columns (s, s), in the parameters' own units, in the order of
        `values`.
        """
        if self.triangle is None:
            assert self.known is not None
            return self.known
        return self.scale[:, None] * svd(self.triangle)[2].T

    @property
    def principal_root(self) -> Array:
        """Square root (s, rank) of the shared parameters' covariance, a column for each determined
        direction.
        """
        return self.directions[:, : self.rank] / self.values[: self.rank]

    @cached_property
    def root(self) -> Array:
        """Square root (s, rank) of the shared parameters' covariance, without undetermined
        directions.
        """
        if self.triangle is None:
            return self.principal_root
        # Any root of the covariance gives the same uncertainties. This one needs no singular
        # vectors.
        return self.scale[:, None] * np.linalg.inv(self.triangle)


@single_threaded
def spectrum(factor: Factor, drawn: Spectrum | None = None) -> Spectrum:
    """Return the singular value decomposition of the shared parameters' factor.

    Rank and null space do not depend on the weights of rows. If the weights differ so much that
    rounding of the heaviest hides the lightest, both come from the rows with equal weights. A
    given `drawn` spectrum supplies rank and null space: information on its null directions is
    omitted, and no other direction is one.
    """
    # Singular values of columns in metres, radians and ratios would change with the units, and so
    # would the count of small ones. In their effect on points the columns compare, and a threshold
    # relative to the largest value has one meaning for all designs.
    scale = factor.layout.scale * MICROMETRE
    if drawn is None:
        judged = factor if factor.alike is None else factor.alike
        scaled = judged.root * scale
        # Values first: at full rank, the usual case, the vectors are computed only if something
        # asks for them.
        values = np.asarray(svd(scaled, compute_uv=False), float)
        # The threshold is relative to the largest singular value or, if it is larger, the largest
        # element of what the balls' rows have carried away: where nothing shared is determined, all
        # values are rounding of that.
        largest = max(
            float(values.max(initial=0.0)),
            *(
                float(np.abs(rows * scale).max(initial=0.0))
                for rows in (judged.ball_shared, judged.kept_shared)
            ),
        )
        deficiency = int((values <= RANK_TOLERANCE * largest).sum())
        rank = len(values) - deficiency
        gap = float("inf")
        if 0 < deficiency < len(values):
            gap = float(values[rank - 1]) / max(float(values[rank]), float(np.finfo(float).tiny))
        if judged is factor and deficiency == 0:
            return Spectrum(values, scale, 0, gap, triangle=scaled)
        right = svd(scaled)[2]
        if judged is factor:
            return Spectrum(values, scale, deficiency, gap, known=scale[:, None] * right.T)
        # The rows of about equal weights decide which directions are open. The true weights are
        # applied below, within the rest of the space only.
        null = right[rank:].T
    else:
        null, deficiency, gap = drawn.null / scale[:, None], drawn.deficiency, drawn.gap
    # An orthonormal basis of all directions across the open ones, in scaled parameters.
    spanned = np.linalg.qr(null, mode="complete")[0][:, deficiency:]
    values, directions = _determined(factor, scale, spanned)
    # Weighted values of null directions would be rounding, and mislead. They are reported with the
    # gap that comparable weights show.
    below = values[-1] / gap if len(values) else 0.0
    return Spectrum(
        np.append(values, np.full(deficiency, below)),
        scale,
        deficiency,
        gap,
        known=scale[:, None] * np.concatenate([directions, null], axis=1),
    )


def _determined(factor: Factor, scale: Array, spanned: Array) -> tuple[Array, Array]:
    """Singular values (r,) and directions (s, r) of a scaled factor within what `spanned` (s, r)
    spans.
    """
    from .graded import triangle

    if factor.orders is None:
        _, values, right = svd((factor.root * scale) @ spanned, full_matrices=False)
        return values, spanned @ right.T
    # The heaviest rows would take all digits of the smallest singular values, but the inverse has
    # these first.
    # With the triangle T, whose columns are permuted, the matrix sought is Q T P'. The left
    # singular vectors of P T^-1 are its right ones, and singular values are reciprocal, so that
    # their order turns round.
    determined = triangle(in_order(factor) * scale @ spanned, np.zeros((len(scale), 0)))
    inverse = scipy_linalg().solve_triangular(
        determined.root, np.eye(len(determined.root)), check_finite=False
    )
    directions, values, _ = svd(spanned[:, determined.order] @ inverse, full_matrices=False)
    return 1.0 / values[::-1], directions[:, ::-1]


def no_spectrum(layout: SharedLayout) -> Spectrum:
    """Return the substitute for the spectrum of a factor that is not finite: no value is known, no
    direction undetermined.
    """
    size = len(layout)
    return Spectrum(
        np.full(size, np.nan),
        layout.scale * MICROMETRE,
        0,
        float("inf"),
        known=np.full((size, size), np.nan),
    )


@dataclass(frozen=True)
class BallCovariance:
    """Square root of the covariance of the balls, in units of the standard deviation of a
    unit-weight observation.

    `common` (n, d, r + kept) is the part in common with all other parameters, its first r columns
    those of the shared parameters, and `own` (n, d, d) the part of each ball alone; rows of balls
    that are not parameters are zero. `null` (n, d, deficiency) are the motions of balls along
    undetermined directions.
    """

    common: Array
    own: Array
    null: Array


@single_threaded
def ball_covariance(design: Design, factor: Factor, spectrum: Spectrum) -> BallCovariance:
    """Square root of the covariance of all balls."""
    n, d = len(design.balls.names), design.dimension
    shared, null = spectrum.root, spectrum.null
    rank, nulls, k = shared.shape[1], null.shape[1], d * len(factor.kept)
    ball = np.zeros((n, d, rank + k))
    roots = np.zeros((n, d, d))
    ball_null = np.zeros((n, d, nulls))
    # The d rows of a ball are R y + S t = e - z, with the shared parameters t and noise e of unit
    # variance, which no other row has: y = R^-1 (e - z - S t). The covariance of the ball is
    # the sum of two independent parts: R^-1 S G of the shared root G, which correlates balls with
    # one another, and R^-1 of its own rows. Undetermined directions move the ball by -R^-1 S as
    # well.
    carried = -solve_balls(factor, factor.ball_shared)
    rows = carried.reshape(d * len(carried), carried.shape[2])
    ball[factor.eliminated, :, :rank] = (rows @ shared).reshape(len(carried), d, rank)
    ball_null[factor.eliminated] = (rows @ null).reshape(len(carried), d, nulls)
    roots[factor.eliminated] = solve_balls(
        factor, np.broadcast_to(np.eye(d), factor.ball_root.shape)
    )
    if k:
        # Kept balls share one triangle, and the part of their own rows correlates them too: it gets
        # columns in `common`. The minus before the identity meets that before the solution.
        sides = np.concatenate(
            [factor.kept_shared @ shared, factor.kept_shared @ null, -np.eye(k)], axis=1
        )
        solved = -solve_kept(factor, sides)
        ball[factor.kept, :, :rank] = solved[:, :rank].reshape(len(factor.kept), d, rank)
        ball_null[factor.kept] = solved[:, rank : rank + nulls].reshape(len(factor.kept), d, nulls)
        ball[factor.kept, :, rank:] = solved[:, rank + nulls :].reshape(len(factor.kept), d, k)
    return BallCovariance(ball, roots, ball_null)
