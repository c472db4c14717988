"""The linearised problem that every rival is given, and U1 to U6 from a covariance matrix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.observations.readings import reading_blocks
from ballplate.simulator.design.parameters import SharedLayout, shared_layout
from ballplate.simulator.machines.protocol import Integers
from numpy.typing import NDArray

Real = NDArray[np.float64]


@dataclass(frozen=True)
class LinearProblem:
    """Whitened rows of one plate: constant factors, ready made from the estimator's own blocks.

    For each of m readings the derivatives `by_ball` (m, 3, 3), `by_pose` (m, 3, 6) and `by_model`
    (m, 3, a); for each of k distances `along` (k, 3), the derivative by the first ball.
    """

    design: Design
    layout: SharedLayout
    ball: Integers
    position: Integers
    by_ball: Real
    by_pose: Real
    by_model: Real
    first: Integers
    second: Integers
    along: Real

    @property
    def balls(self) -> int:
        return len(self.design.balls.places)

    @property
    def shared(self) -> int:
        return len(self.layout)

    def shared_rows(self) -> Real:
        """Derivatives (m, 3, s) by all shared parameters."""
        rows = np.zeros((len(self.ball), 3, self.shared))
        columns = self.layout.pose_columns[self.position]
        reading, place = np.nonzero(columns >= 0)
        rows[reading, :, columns[reading, place]] = self.by_pose[reading, :, place]
        rows[:, :, self.layout.model] = self.by_model
        return rows


def linear_problem(design: Design) -> LinearProblem:
    """Linearise a design of one plate, read ball by ball."""
    readings = design.readings.select(np.argsort(design.readings.ball, kind="stable"))
    state = nominal_state(design)
    blocks = reading_blocks(design, state, readings, None)
    return LinearProblem(
        design=design,
        layout=shared_layout(design),
        ball=readings.ball,
        position=readings.position,
        by_ball=blocks.by_ball,
        by_pose=blocks.by_pose,
        by_model=blocks.by_model,
        first=design.of(CalibratedDistances).first,
        second=design.of(CalibratedDistances).second,
        along=design.of(CalibratedDistances).rows(design, state, None).by_ball[:, 0],
    )


@dataclass(frozen=True)
class Estimate:
    """What a rival delivers: covariances of the shared parameters (s, s) and of the balls, and the
    rank.

    `balls` is (3 n, 3 n) with all pairs of balls, or (n, 3, 3) with each ball's own block where the
    pairs could not be had.
    """

    shared: Real
    balls: Real
    deficiency: int


Figures = dict[str, tuple[float, float]]


def figures(problem: LinearProblem, found: Estimate) -> Figures:
    """Maximum and average of each of U1 to U6; without U5 where there are no pairs."""
    design, layout, n = problem.design, problem.layout, problem.balls
    has_pairs = found.balls.ndim == 2
    own = np.diag(found.balls) if has_pairs else np.diagonal(found.balls, axis1=1, axis2=2)
    reported = design.model.reported().matrix
    of_model = found.shared[layout.model, layout.model]
    offsets = np.broadcast_to(
        design.probes.offsets[design.evaluation.probe], design.evaluation.points.shape
    )
    jacobian = design.model.jacobian(design.evaluation.points, np.zeros(len(of_model)), offsets)
    flat = jacobian.reshape(-1, len(of_model))
    of_points = flat @ of_model @ flat.T
    result = {
        "U1": summary(np.sqrt(own)),
        "U2": summary(np.sqrt(np.diag(found.shared)[layout.poses])),
        "U3": summary(
            np.sqrt(np.einsum("ij,jk,ik->i", reported, of_model, reported, optimize=True))
        ),
        "U4": summary(np.sqrt(np.diag(of_points))),
    }
    if has_pairs:
        result["U5"] = summary(
            pair_uncertainties(design.balls.places, found.balls.reshape(n, 3, n, 3))
        )
    # The corrected points of a machine without errors are the points, moved by the same probe
    # offset.
    count = len(design.evaluation.points)
    result["U6"] = summary(
        pair_uncertainties(design.evaluation.points, of_points.reshape(count, 3, count, 3))
    )
    return result


def summary(values: Real) -> tuple[float, float]:
    """Maximum and average."""
    return float(values.max()), float(values.mean())


def pair_uncertainties(places: Real, covariance: Real, tile: int = 256) -> Real:
    """Standard uncertainties of the distances between all pairs of places (n, 3), covariance (n, 3,
    n, 3).
    """
    n = len(places)
    own = np.diagonal(covariance, axis1=0, axis2=2)
    used = [axis for axis in range(3) if np.ptp(places[:, axis]) > 0]
    found = []
    for start in range(0, n, tile):
        for other in range(start, n, tile):
            rows, columns = slice(start, start + tile), slice(other, other + tile)
            between = places[rows, None, :] - places[None, columns, :]
            squared = (between**2).sum(axis=2)
            variance = np.zeros(squared.shape)
            for i in used:
                for j in used:
                    block = own[i, j, rows, None] + own[i, j, None, columns]
                    block = (
                        block - covariance[rows, i, columns, j] - covariance[columns, i, rows, j].T
                    )
                    variance += block * between[:, :, i] * between[:, :, j]
            chosen = np.triu(squared > 0, 1) if start == other else squared > 0
            found.append(np.sqrt(variance[chosen] / squared[chosen]))
    return np.concatenate(found)
