"""Least squares under constraints by orthogonal factorisation.

The constraints C c = f are met by c = c0 + Z z, where C' P = Q R gives the particular solution c0
and the columns Z of Q that C does not see; then || A Z z - (y - A c0) || is made small by a
second factorisation. NISTIR 6517, equation (25), is the same solution by pseudo-inverses; Lawson
and Hanson, Solving Least Squares Problems, chapter 20, has this.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import comb

import numpy as np
from ballplate.simulator.computing.numerics import svd
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.settings import number_of

from .space import SplineError, SplineProblem, SplineSpace

NAMES = ("value", "slope", "second derivative", "third derivative")


@dataclass(frozen=True)
class Constraint:
    """A value (derivative 0), slope (1) or higher derivative at a point, in metres or radians (of
    y) per metre or radian (of x) to some power. A derivative that jumps is that of the piece above.
    """

    at: float
    derivative: int
    value: float = 0.0

    @property
    def name(self) -> str:
        """The quantity that is prescribed.

        >>> Constraint(0.5, 1).name
        'slope'
        """
        known = self.derivative < len(NAMES)
        return NAMES[self.derivative] if known else f"derivative {self.derivative}"


def rows(space: SplineSpace, constraints: tuple[Constraint, ...]) -> tuple[Array, Array]:
    """Return the matrix (m, count) and right-hand side (m,), each row scaled to length 1.

    Zero rows, of derivatives that no spline of this order has, are unchanged.

    :raises SplineError: a point beyond the ends.
    """
    matrix, values = np.zeros((len(constraints), space.count)), np.zeros(len(constraints))
    for k, constraint in enumerate(constraints):
        matrix[k] = space.rows(np.array([constraint.at]), constraint.derivative)[0]
        # Whatever the unit of x, a slope's row then counts as much as a value's.
        size = float(np.linalg.norm(matrix[k])) or 1.0
        matrix[k] /= size
        values[k] = constraint.value / size
    return matrix, values


# Rows of length 1, and columns of functions of size 1: what is smaller is rounding.
NOTHING = 1e-10
# Singular values of the points' rows below this part of the largest are rounding.
UNDETERMINED = 1e-9


@dataclass(frozen=True)
class SplineFit:
    """A fitted spline.

    `coefficients` (count,) are those of the B-splines of `space`; with `root` (count, free) their
    covariance is sigma² root root'. x, y (m,) are the points, `sigma` the standard uncertainty of
    one.
    """

    space: SplineSpace
    coefficients: Array = field(repr=False)
    root: Array = field(repr=False)
    x: Array = field(repr=False)
    y: Array = field(repr=False)

    @property
    def free(self) -> int:
        """Number of coefficients that the points determine."""
        return self.root.shape[1]

    @property
    def degrees_of_freedom(self) -> int:
        """Points more than free coefficients."""
        return len(self.x) - self.free

    def values(self, x: Array, derivative: int = 0) -> Array:
        """The curve or a derivative at x (m,).

        :raises SplineError: an x beyond the ends.
        """
        return self.space.rows(x, derivative) @ self.coefficients

    def spread(self, x: Array, derivative: int = 0) -> Array:
        """Standard uncertainty of the curve or a derivative at x (m,) for sigma 1.

        :raises SplineError: an x beyond the ends.
        """
        return np.linalg.norm(self.space.rows(x, derivative) @ self.root, axis=1)

    @cached_property
    def residuals(self) -> Array:
        """Points less curve (m,)."""
        return self.y - self.values(self.x)

    @cached_property
    def sum_of_squares(self) -> float:
        """Of the residuals."""
        return float((self.residuals**2).sum())

    @property
    def sigma(self) -> float:
        """Estimate from the residuals; NaN without degrees of freedom."""
        if self.degrees_of_freedom < 1:
            return float("nan")
        return float(np.sqrt(self.sum_of_squares / self.degrees_of_freedom))


def fit(
    space: SplineSpace,
    x: Array,
    y: Array,
    constraints: tuple[Constraint, ...] = (),
) -> SplineFit:
    """Return the spline that fits points x, y (m,) best among those that meet the constraints.

    :raises SplineError: contradictory constraints, points that do not determine the curve, or
        points beyond its ends; all faults of one sort at once.
    """
    from scipy.linalg import solve_triangular

    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    particular, null = _constrained(space, constraints)
    design = space.rows(x)
    _refuse_undetermined(space, x, design @ null, null)
    q, r = np.linalg.qr(design @ null)
    free = solve_triangular(r, q.T @ (y - design @ particular))
    # The inverse triangle is a root of the covariance of the free part, of which the constraints
    # make that of all coefficients.
    root = null @ solve_triangular(r, np.eye(len(r)))
    return SplineFit(space, particular + null @ free, root, x, y)


def _constrained(space: SplineSpace, constraints: tuple[Constraint, ...]) -> tuple[Array, Array]:
    """Return a solution (count,) of the constraints, and the free directions (count, free).

    :raises SplineError: constraints that contradict others.
    """
    from scipy.linalg import qr, solve_triangular

    matrix, values = rows(space, constraints)
    if not constraints:
        return np.zeros(space.count), np.eye(space.count)
    # Pivoting takes independent conditions first. These determine the particular solution, and the
    # remaining columns of Q are the directions that no condition sees. A condition that depends on
    # those taken is met by this solution already, or contradicts them.
    q, r, order = qr(matrix.T, pivoting=True)
    rank = int((np.abs(np.diag(r)) > NOTHING).sum())
    determined_columns, free_columns = order[:rank], sorted(order[rank:].tolist())
    particular = q[:, :rank] @ solve_triangular(
        r[:rank, :rank], values[determined_columns], trans="T"
    )
    # What is left of a value that is met up to rounding, beside the values that it is made of.
    size = NOTHING * max(float(np.abs(values).max()), float(np.abs(particular).max(initial=0.0)))
    contradictory = [k for k in free_columns if abs(matrix[k] @ particular - values[k]) > size]
    if contradictory:
        raise SplineError(
            SplineProblem(
                f"the {constraints[k].name} at {{0}} contradicts what else is prescribed; leave it"
                " out, or add a knot",
                (constraints[k].at,),
            )
            for k in contradictory
        )
    return particular, q[:, rank:]


def _refuse_undetermined(space: SplineSpace, x: Array, design: Array, null: Array) -> None:
    """Name the undetermined parts of the curve.

    :raises SplineError: there are such parts.
    """
    if null.shape[1] == 0:
        return
    # The triangle has the singular values of all points' rows. Its null directions, as curves, are
    # zero in the pieces that the points determine, and so name the others.
    _, values, directions = svd(np.linalg.qr(design, mode="r"), full_matrices=True)
    rank_known = int(
        (values > UNDETERMINED * max(float(values.max(initial=0.0)), UNDETERMINED)).sum()
    )
    if rank_known == null.shape[1]:
        return
    open_ = null @ directions[rank_known:].T
    size = np.abs(space.pieces @ open_).max(axis=(1, 2))
    touched = size > 1e-6 * size.max()
    problems = []
    for first, last in _runs(touched):
        lower, upper = float(space.breaks[first]), float(space.breaks[last + 1])
        inside = int(((x >= lower) & (x <= upper)).sum())
        within = open_ * (np.abs(space.pieces[first : last + 1]).max(axis=(0, 1)) > 0)[:, None]
        missing = int((svd(within, compute_uv=False) > 1e-6).sum())
        lacks = number_of(missing, "point")
        where = f"between {{0}} and {{1}}, where it has {inside}"
        text = f"the curve lacks {lacks} {where}; leave out knots or prescribe more"
        problems.append(SplineProblem(text, (lower, upper)))
    raise SplineError(problems)


def _runs(chosen: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of every run of true entries.

    >>> _runs(np.array([True, True, False, True]))
    [(0, 1), (3, 3)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(int), [0]])))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def pieces(fitted: SplineFit, local: bool = True) -> Array:
    """Return the coefficients (pieces, order) of 1, u, u², … between neighbouring `breaks` of the
    fitted curve's space, in metres and radians: u is x less the start of the piece, or x.
    """
    space = fitted.space
    coefficients = (space.pieces @ fitted.coefficients) * space.length ** -np.arange(space.order)
    if local:
        return coefficients
    shifted = np.zeros_like(coefficients)
    start = space.breaks[:-1]
    for k in range(space.order):
        for j in range(k + 1):
            shifted[:, j] += coefficients[:, k] * comb(k, j) * (-start) ** (k - j)
    return shifted
