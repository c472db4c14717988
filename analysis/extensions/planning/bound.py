"""Bound of all selections: the convex relaxation in which candidates may count in part.

The reciprocal square of the criterion is a concave function of the information, which is linear in
the weights of candidates. Its tangent at any weights is a linear function that no selection
exceeds; the largest value of the tangent within the limits, a linear programme, bounds all
selections. The weights are improved until bound and criterion of the relaxation meet: each solution
of the linear programme is a vertex, and the best mixture of the vertices met so far gives the next
tangent. The last bound is made sharper by asking for whole candidates in the linear programme.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from ballplate.simulator.computing import InternalError, comparable, single_threaded
from ballplate.simulator.machines import Array

from .search import Losses, SelectionProblem, fill, full_root

# Relative distance of bound and relaxation at which the weights are good enough, and steps at most.
CLOSE = 1e-3
MOST_STEPS = 200

# Powers of the means that stand for largest values, one after the other.
POWERS = (8.0, 24.0, 72.0)

# Vertices to start with, and at most until one of their mixtures determines everything.
FEWEST_STARTS, MOST_STARTS = 4, 64

# Steps of the inner solver, and the share of the largest below which a vertex is dropped from the
# mixture.
MOST_INNER = 12
DROPPED = 1e-7

# Branches of the search for whole candidates.
MOST_NODES = 2000

Limits = tuple[Any, Array, Array, Array]

# What a selection may be below its bound by, relatively.
ROUNDING = 1e-9
# Binary digits of slopes in linear programmes, where of equal vertices one is taken.
COMPARED = 36

# What solvers of linear programmes leave, relatively.
TOLERANCE = 1e-7


@dataclass(frozen=True)
class Bound:
    """A `value` that the criterion of no selection falls below, and the weights (n,) of the
    relaxation that gave it.
    """

    value: float
    weights: Array

    def check(self, name: str, reached: float) -> None:
        """Make sure that the criterion `name` of a selection is not better than the bound.

        :raises InternalError: it is, by more than rounding.
        """
        if reached < self.value * (1 - ROUNDING):
            text = (
                f"{name} of the choice, {reached:.10g}, is below {self.value:.10g}, the bound of"
                " any choice"
            )
            raise InternalError(f"{text}; neither is to be trusted")


@dataclass(frozen=True)
class _Tangent:
    """Tangent of the reciprocal square at some weights: `constant` + `slope` (n,) v.

    `value` is the mean that it touches.
    """

    constant: float
    slope: Array
    value: float

    def at(self, weights: Array) -> float:
        """The bound of the criterion that the tangent gives at other weights."""
        return float((self.constant + self.slope @ weights) ** -0.5)


@single_threaded
def bound(problem: SelectionProblem) -> Bound | None:
    """Return a lower bound of the criterion over all selections within the limits.

    The bound is missing if the criterion has no relaxation, or if no mixture of selections
    determines its functions.
    """
    if not problem.criterion.is_bounded:
        return None
    mixture = _first(problem)
    if mixture is None:
        return None
    limits = problem.limits.linear()
    powers = list(POWERS if problem.criterion.is_sharp else POWERS[-1:])
    best = Bound(0.0, mixture.weights)
    for _ in range(MOST_STEPS):
        tangent = _tangent(problem, mixture.weights, powers[0])
        if tangent is None:
            break
        # A concave function is below its tangent everywhere, and limits are linear in the weights.
        # So the largest value of the tangent within the limits, at a vertex, bounds every
        # selection, for tangents at any weights; better weights only make it sharper.
        vertex = _largest(limits, tangent.slope, problem.constraints.count)
        if vertex is None:
            break
        reached = tangent.at(vertex)
        if reached > best.value:
            best = Bound(reached, mixture.weights)
        if reached > tangent.value * (1 - CLOSE):
            powers = powers[1:]
            if not powers:
                break
        mixture = _improved(problem, mixture.with_vertex(vertex), powers[0])
    if best.value == 0.0:
        return None
    tangent = _tangent(problem, best.weights, POWERS[-1])
    if tangent is not None:
        best = replace(best, value=max(best.value, _whole(limits, tangent)))
    return replace(best, value=best.value * (1 - TOLERANCE))


@dataclass(frozen=True)
class _Mixture:
    """Vertices (k, n) and the share (k,) of each."""

    vertices: Array
    shares: Array

    @property
    def weights(self) -> Array:
        return self.shares @ self.vertices

    def with_vertex(self, vertex: Array) -> _Mixture:
        share = 1.0 / (len(self.shares) + 2)
        shares = np.append(self.shares * (1 - share), share)
        return _Mixture(np.concatenate([self.vertices, vertex[None]]), shares)


def _first(problem: SelectionProblem) -> _Mixture | None:
    """Return a mixture of vertices that determines every function, if the search finds one."""
    n = problem.constraints.count
    limits = problem.limits.linear()
    generator = np.random.default_rng(np.random.SeedSequence(0))
    selection = fill(problem, problem.constraints.must, Losses(problem))
    vertices = [np.isin(np.arange(n), list(selection)).astype(float)]
    for _ in range(MOST_STARTS):
        # Random slopes lead to different vertices within the limits. A mixture of enough of them
        # has some of most candidates, and so determines what the pool does.
        point = _largest(limits, generator.random(n), n)
        if point is None:
            return None
        vertices.append(point)
        mixture = _Mixture(np.array(vertices), np.full(len(vertices), 1.0 / len(vertices)))
        if (
            len(vertices) >= FEWEST_STARTS
            and _tangent(problem, mixture.weights, POWERS[0]) is not None
        ):
            return mixture
    return None


def _tangent(problem: SelectionProblem, weights: Array, power: float) -> _Tangent | None:
    """Return the tangent at weights (n,), if these determine every function."""
    information = problem.information
    root = full_root(information.weighted(weights))
    if root is None:
        return None
    _, value, weight = problem.tangent(root, power)
    if value <= 0.0:
        return None
    half = root @ (root[problem.counted].T @ weight)
    # By the covariance C the derivative is W, and by the information -C W C.
    squared = 2.0 * value**-3 * (half @ half.T)
    slope = np.tensordot(information.matrices, squared, axes=2)
    return _Tangent(float((information.base * squared).sum()), slope, value)


def _improved(problem: SelectionProblem, mixture: _Mixture, power: float) -> _Mixture:
    """The mixture of the same vertices that makes the criterion smallest, without those that have
    no share in it.
    """
    from scipy.optimize import minimize

    information = problem.information
    used = np.flatnonzero(mixture.vertices.any(axis=0))
    matrices = np.tensordot(mixture.vertices[:, used], information.matrices[used], axes=1)
    frame_rows = information.frames.held(used.tolist())

    def logarithm(shares: Array) -> tuple[float, Array]:
        root = full_root(information.base + frame_rows + np.tensordot(shares, matrices, axes=1))
        if root is None:
            return 1e3, np.zeros(len(shares))
        smooth, value, weight = problem.tangent(root, power)
        half = root @ (root[problem.counted].T @ weight)
        return float(np.log(smooth)), -np.tensordot(matrices, half @ half.T, axes=2) / value

    solution = minimize(
        logarithm,
        mixture.shares,
        jac=True,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * len(mixture.shares),
        constraints={"type": "eq", "fun": lambda s: s.sum() - 1.0, "jac": np.ones_like},
        options={"maxiter": MOST_INNER, "ftol": 1e-7},
    )
    shares = np.maximum(solution.x, 0.0)
    if (
        not np.isfinite(shares).all()
        or logarithm(shares / shares.sum())[0] > logarithm(mixture.shares)[0]
    ):
        shares = mixture.shares
    is_kept = shares > DROPPED * shares.max()
    return _Mixture(mixture.vertices[is_kept], shares[is_kept] / shares[is_kept].sum())


def _largest(limits: Limits, slope: Array, count: int) -> Array | None:
    """Return the weights (count,) within the limits that maximise slope (count,) . weights, if any
    exist.
    """
    from scipy.optimize import linprog

    matrix, most, low, high = limits
    cost = np.zeros(matrix.shape[1])
    # Rounded, so that of vertices that are equal by symmetry every computer takes the same.
    cost[:count] = -comparable(slope / np.abs(slope).max(), COMPARED)
    solution = linprog(
        cost, A_ub=matrix, b_ub=most, bounds=np.stack([low, high], axis=1), method="highs"
    )
    if solution.status != 0:
        return None
    return np.clip(np.asarray(solution.x[:count], float), 0.0, 1.0)


def _whole(limits: Limits, tangent: _Tangent) -> float:
    """The bound of a tangent where candidates count wholly or not at all; 0 if it was not found."""
    from scipy.optimize import Bounds, LinearConstraint, milp

    matrix, most, low, high = limits
    count = len(tangent.slope)
    scale = np.abs(tangent.slope).max()
    cost = np.zeros(matrix.shape[1])
    cost[:count] = -comparable(tangent.slope / scale, COMPARED)
    solution = milp(
        cost,
        integrality=np.ones(len(cost)),
        bounds=Bounds(low, high),
        constraints=LinearConstraint(matrix, -np.inf, most),
        options={"node_limit": MOST_NODES},
    )
    # The solver's own bound holds also if it has not finished.
    if solution.mip_dual_bound is None or not np.isfinite(solution.mip_dual_bound):
        return 0.0
    return float((tangent.constant - solution.mip_dual_bound * scale) ** -0.5)
