"""The same estimate by other means: dense NumPy, SciPy's sparse matrices, Ceres and GTSAM.

Each rival has two stages, timed apart: `construct` makes its own objects from the ready-made rows,
`solve` factorises them and returns covariances. Libraries that are not installed are a reason for
skipping, not an error.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.csgraph
import scipy.sparse.linalg
from ballplate.simulator.design.arrays import Design

from .linear_problem import Estimate, Figures, LinearProblem, Real
from .structured import structured

# Relative to the largest, on columns in engineering units, as the estimator counts.
EXACT = 1e-10


@dataclass(frozen=True)
class Rival:
    """A way to the same result; `module` is the library that must be there.

    Either `construct` and `solve` take the rows ready made, or `whole` takes the design itself.
    """

    name: str
    module: str
    construct: Callable[[LinearProblem], Any] = lambda problem: None
    solve: Callable[[LinearProblem, Any], Estimate] = lambda problem, given: given
    whole: Callable[[Design], tuple[Figures, int]] | None = None

    @property
    def is_installed(self) -> bool:
        return importlib.util.find_spec(self.module) is not None


def deficiency_of(problem: LinearProblem, root: Real) -> int:
    """Rank deficiency from a square root (s, s) of the shared parameters' information."""
    values = np.linalg.svd(root * problem.layout.scale, compute_uv=False)
    return int((values <= EXACT * values[0]).sum())


def inverse_of_information(root: Real) -> Real:
    """(R'R)^-1 of an upper triangle, by LAPACK's routine for just that."""
    upper, status = scipy.linalg.lapack.dpotri(root)
    if status:
        raise np.linalg.LinAlgError("the factor is singular")
    return np.asarray(np.triu(upper) + np.triu(upper, 1).T)


def split(problem: LinearProblem, covariance: Real, root: Real) -> Estimate:
    """An estimate from the covariance of balls and then shared parameters, and the shared part of
    its factor.
    """
    at = 3 * problem.balls
    return Estimate(covariance[at:, at:], covariance[:at, :at], deficiency_of(problem, root))


# Dense NumPy: one orthogonal factorisation of the whole Jacobian.


def dense_construct(problem: LinearProblem) -> Real:
    m, at = len(problem.ball), 3 * problem.balls
    whole = np.zeros((3 * m + len(problem.first), at + problem.shared))
    rows = whole[: 3 * m].reshape(m, 3, -1)
    for axis in range(3):
        rows[np.arange(m), :, 3 * problem.ball + axis] = problem.by_ball[:, :, axis]
        below = np.arange(3 * m, len(whole))
        whole[below, 3 * problem.first + axis] = problem.along[:, axis]
        whole[below, 3 * problem.second + axis] = -problem.along[:, axis]
    rows[:, :, at:] = problem.shared_rows()
    return whole


def dense_solve(problem: LinearProblem, whole: Real) -> Estimate:
    root = np.asarray(np.linalg.qr(whole, mode="r"))
    at = 3 * problem.balls
    return split(problem, inverse_of_information(root), root[at:, at:])


# SciPy: the whole of the normal equations as one sparse matrix.


def whole_construct(problem: LinearProblem) -> Any:
    by_ball, by_shared = partitioned_construct(problem)
    return scipy.sparse.hstack([by_ball, scipy.sparse.csr_array(by_shared)], format="csr")


def whole_solve(problem: LinearProblem, rows: Any) -> Estimate:
    information = (rows.T @ rows).tocsc()
    # Balls first is the order with the least fill, and the columns stand in it already.
    factor = scipy.sparse.linalg.splu(
        information, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    size, at = information.shape[0], 3 * problem.balls
    covariance = np.empty((size, size))
    for start in range(0, size, 512):
        width = min(512, size - start)
        unit = np.zeros((size, width))
        unit[start + np.arange(width), np.arange(width)] = 1.0
        covariance[:, start : start + width] = factor.solve(unit)
    return split(problem, covariance, scipy.linalg.cholesky(np.linalg.inv(covariance[at:, at:])))


# SciPy: normal equations partitioned as bundle adjustment does, sparse for the balls, dense for the
# shared columns.


def partitioned_construct(problem: LinearProblem) -> tuple[Any, Real]:
    m, k = len(problem.ball), len(problem.first)
    columns = 3 * problem.ball[:, None, None] + np.arange(3)[None, None, :]
    rows = 3 * np.arange(m)[:, None, None] + np.arange(3)[None, :, None]
    rows, columns = np.broadcast_arrays(rows, columns)
    ends = np.stack([problem.first, problem.second], axis=1)
    below = np.broadcast_to(3 * m + np.arange(k)[:, None, None], (k, 2, 3))
    distance_columns = 3 * ends[:, :, None] + np.arange(3)
    values = np.stack([problem.along, -problem.along], axis=1)
    by_ball = scipy.sparse.csr_array(
        (
            np.concatenate([problem.by_ball.ravel(), values.ravel()]),
            (
                np.concatenate([rows.ravel(), below.ravel()]),
                np.concatenate([columns.ravel(), distance_columns.ravel()]),
            ),
        ),
        shape=(3 * m + k, 3 * problem.balls),
    )
    by_shared = np.zeros((3 * m + k, problem.shared))
    by_shared[: 3 * m] = problem.shared_rows().reshape(3 * m, -1)
    return by_ball, by_shared


def add_inverse(target: Real, matrix: Any) -> None:
    """Add the inverse of a sparse matrix that falls apart into small blocks, all blocks of a size
    at once.
    """
    count, label = scipy.sparse.csgraph.connected_components(matrix, directed=False)
    size = np.bincount(label, minlength=count)
    order = np.argsort(label, kind="stable")
    start = np.cumsum(size) - size
    within = np.empty(len(label), np.int64)
    within[order] = np.arange(len(label)) - np.repeat(start, size)
    entries = matrix.tocoo()
    for width in np.unique(size):
        blocks = np.flatnonzero(size == width)
        place = np.full(count, -1)
        place[blocks] = np.arange(len(blocks))
        dense = np.zeros((len(blocks), width, width))
        chosen = place[label[entries.row]] >= 0
        row, column = entries.row[chosen], entries.col[chosen]
        dense[place[label[row]], within[row], within[column]] = entries.data[chosen]
        members = order[start[blocks][:, None] + np.arange(width)]
        target[members[:, :, None], members[:, None, :]] += np.linalg.inv(dense)


def partitioned_solve(problem: LinearProblem, rows: tuple[Any, Real]) -> Estimate:
    by_ball, by_shared = rows
    balls = (by_ball.T @ by_ball).tocsc()
    mixed = by_ball.T @ by_shared
    factor = scipy.sparse.linalg.splu(
        balls, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    carried = factor.solve(mixed)
    schur = by_shared.T @ by_shared - mixed.T @ carried
    root = scipy.linalg.cholesky(schur)
    shared = inverse_of_information(root)
    half = scipy.linalg.solve_triangular(root, carried.T, trans="T")
    of_balls = half.T @ half
    add_inverse(of_balls, balls)
    return Estimate(shared, of_balls, deficiency_of(problem, root))


# Ceres: one cost function for each ball, so that Python is called as seldom as can be.


@dataclass
class CeresProblem:
    """Everything that must stay alive while Ceres holds pointers to it."""

    problem: Any
    costs: list[Any]
    balls: list[Real]
    shared: list[Real]


def ceres_construct(problem: LinearProblem) -> CeresProblem:
    import pyceres

    class Linear(pyceres.CostFunction):  # type: ignore[misc]
        """Constant derivatives, copied into Ceres' own memory; the residuals are one and linear."""

        def __init__(self, factors: list[Real], parameters: list[Real]) -> None:
            super().__init__()
            self.factors = [np.ascontiguousarray(factor).ravel() for factor in factors]
            self.matrices = factors
            self.set_num_residuals(len(factors[0]))
            self.set_parameter_block_sizes([len(parameter) for parameter in parameters])

        def Evaluate(self, parameters: Any, residuals: Any, jacobians: Any) -> bool:
            residuals[:] = 1.0
            for matrix, parameter in zip(self.matrices, parameters, strict=True):
                residuals += matrix @ parameter
            if jacobians is not None:
                for target, factor in zip(jacobians, self.factors, strict=True):
                    if target is not None:
                        target[:] = factor
            return True

    balls = [np.zeros(3) for _ in range(problem.balls)]
    is_free = problem.layout.pose_columns[:, 0] >= 0
    poses = {k: np.zeros(6) for k in np.flatnonzero(is_free).tolist()}
    model = np.zeros(problem.by_model.shape[2])
    found = CeresProblem(pyceres.Problem(), [], balls, [*poses.values(), model])

    def add(factors: list[Real], parameters: list[Real]) -> None:
        found.costs.append(Linear(factors, parameters))
        found.problem.add_residual_block(found.costs[-1], None, parameters)

    ends = np.searchsorted(problem.ball, np.arange(problem.balls + 1))
    for ball in range(problem.balls):
        chosen = slice(ends[ball], ends[ball + 1])
        rows, position = 3 * int(ends[ball + 1] - ends[ball]), problem.position[chosen]
        factors, parameters = [problem.by_ball[chosen].reshape(rows, 3)], [balls[ball]]
        for k in np.unique(position).tolist():
            if k in poses:
                own = problem.by_pose[chosen] * (position == k)[:, None, None]
                factors.append(own.reshape(rows, 6))
                parameters.append(poses[k])
        add([*factors, problem.by_model[chosen].reshape(rows, -1)], [*parameters, model])
    for first, second, along in zip(problem.first, problem.second, problem.along, strict=True):
        add([along[None], -along[None]], [balls[first], balls[second]])
    return found


def ceres_solve(problem: LinearProblem, given: CeresProblem) -> Estimate:
    import pyceres

    options = pyceres.SolverOptions()
    options.linear_solver_type = pyceres.LinearSolverType.SPARSE_SCHUR
    options.max_num_iterations = 1
    options.num_threads = 2
    pyceres.solve(options, given.problem, pyceres.SolverSummary())

    balls, shared = given.balls, given.shared
    pairs = [(block, other) for i, block in enumerate(balls) for other in balls[i:]]
    pairs += [(block, other) for i, block in enumerate(shared) for other in shared[i:]]
    settings = pyceres.CovarianceOptions()
    settings.num_threads = 2
    covariance = pyceres.Covariance(settings)
    # Ceres says whether the rank is full, not by how much it is not.
    if not covariance.compute(pairs, given.problem):
        raise np.linalg.LinAlgError("Ceres finds the Jacobian deficient")
    block_of = covariance.get_covariance_block
    of_shared = np.block([[block_of(block, other) for other in shared] for block in shared])
    upper = np.zeros((len(balls), 3, len(balls), 3))
    for i, block in enumerate(balls):
        for j in range(i, len(balls)):
            upper[i, :, j] = block_of(block, balls[j])
    flat = upper.reshape(3 * len(balls), -1)
    return Estimate(of_shared, np.triu(flat) + np.triu(flat, 1).T, 0)


# GTSAM: one Jacobian factor for each ball, eliminated by QR, balls first.


@dataclass
class GtsamProblem:
    """A graph and the order of elimination: the balls, those with distances last, then the shared
    key.
    """

    graph: Any
    ordering: Any
    order: list[int]


def gtsam_construct(problem: LinearProblem) -> GtsamProblem:
    import gtsam

    graph = gtsam.GaussianFactorGraph()
    shared_rows, key = problem.shared_rows(), problem.balls
    ends = np.searchsorted(problem.ball, np.arange(problem.balls + 1))
    for ball in range(problem.balls):
        chosen = slice(ends[ball], ends[ball + 1])
        rows = 3 * int(ends[ball + 1] - ends[ball])
        by_ball, by_shared = (
            problem.by_ball[chosen].reshape(rows, 3),
            shared_rows[chosen].reshape(rows, -1),
        )
        unit = gtsam.noiseModel.Unit.Create(rows)
        graph.add(gtsam.JacobianFactor(ball, by_ball, key, by_shared, np.ones(rows), unit))
    unit = gtsam.noiseModel.Unit.Create(1)
    for first, second, along in zip(
        problem.first.tolist(), problem.second.tolist(), problem.along, strict=True
    ):
        graph.add(gtsam.JacobianFactor(first, along[None], second, -along[None], np.ones(1), unit))
    kept = sorted({*problem.first.tolist(), *problem.second.tolist()})
    order = [*np.setdiff1d(np.arange(problem.balls), kept).tolist(), *kept, key]
    ordering = gtsam.Ordering()
    for entry in order:
        ordering.push_back(entry)
    return GtsamProblem(graph, ordering, order)


def gtsam_marginals(problem: LinearProblem, given: GtsamProblem) -> Estimate:
    """Covariances as GTSAM offers them: the joint marginal of all balls and the shared key."""
    import gtsam

    tree = given.graph.eliminateMultifrontal(given.ordering, gtsam.EliminateQR)
    whole = tree.jointMarginalCovariance(sorted(given.order)).fullMatrix()
    root = next(iter(tree.roots())).conditional().R()
    return split(problem, whole, root[-problem.shared :, -problem.shared :])


def gtsam_triangle(problem: LinearProblem, given: GtsamProblem) -> Estimate:
    """GTSAM's elimination; its triangle is written out densely and inverted by LAPACK."""
    import gtsam

    net = given.graph.eliminateSequential(given.ordering, gtsam.EliminateQR)
    root = net.matrix()[0]
    covariance = inverse_of_information(root)
    # The triangle comes in the order of the Bayes net, which is that of its elimination tree.
    balls = np.array([net.at(place).firstFrontalKey() for place in range(problem.balls)])
    back = np.argsort(balls)
    columns = (3 * back[:, None] + np.arange(3)).ravel()
    at = 3 * problem.balls
    return Estimate(
        covariance[at:, at:],
        covariance[np.ix_(columns, columns)],
        deficiency_of(problem, root[at:, at:]),
    )


RIVALS = (
    Rival("NumPy, structured by hand", "numpy", whole=structured),
    Rival("NumPy, dense QR", "numpy", dense_construct, dense_solve),
    Rival("SciPy, sparse normal equations", "scipy", whole_construct, whole_solve),
    Rival("SciPy, partitioned normal equations", "scipy", partitioned_construct, partitioned_solve),
    Rival("Ceres, covariance blocks", "pyceres", ceres_construct, ceres_solve),
    Rival("GTSAM, QR, joint marginals", "gtsam", gtsam_construct, gtsam_marginals),
    Rival("GTSAM, QR, triangle inverted by LAPACK", "gtsam", gtsam_construct, gtsam_triangle),
)
