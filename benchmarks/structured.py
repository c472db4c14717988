"""The whole way from a design to U1 to U6 in plain structured NumPy, which shares no code.

What someone writes who knows the structure of one plate read ball by ball: derivatives of all
readings by array operations, one batched QR that eliminates the balls, one QR of what is left, and
covariances multiplied out. Chebyshev polynomials of the kinematic model MB2 as they are defined;
all readings count alike, and all balls are read equally often.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.distances import CalibratedDistances
from numpy.polynomial import chebyshev, polynomial

from .linear_problem import Figures, Real, pair_uncertainties, summary

# NDEL and NEPS of the report.
COEFFICIENTS = 5
EXACT = 1e-10


def structured(design: Design) -> tuple[Figures, int]:
    """Maximum and average of U1 to U6, and the rank deficiency, zero or nothing is computed."""
    n, free = len(design.balls.places), 6 * (len(design.positions.origins) - 1)
    order = np.argsort(design.readings.ball, kind="stable")
    position, probe = design.readings.position[order], design.readings.probe[order]
    rotation = design.positions.rotations[position]
    arm = np.einsum("mij,mj->mi", rotation, design.balls.places[design.readings.ball[order]])
    offset = design.probes.offsets[probe]
    by_model = derivatives(design, arm + design.positions.origins[position] - offset, offset)
    s = free + by_model.shape[2]

    # The first pose is held; the others follow one another.
    shared = np.zeros((len(order), 3, s))
    pose = np.concatenate([np.broadcast_to(-np.eye(3), rotation.shape), cross(arm)], axis=2)
    for k in range(1, len(design.positions.origins)):
        shared[position == k, :, 6 * k - 6 : 6 * k] = pose[position == k]
    shared[:, :, free:] = by_model
    weight = 1.0 / design.machine.repeatability[0]
    own = -weight * rotation.reshape(n, -1, 3)
    shared = weight * shared.reshape(n, -1, s)

    q, root = np.linalg.qr(own)
    top = q.transpose(0, 2, 1) @ shared
    rest = (shared - q @ top).reshape(-1, s)

    # Balls with calibrated distances are taken out together: their rows, and those of the
    # distances.
    given = design.of(CalibratedDistances)
    first, second = given.first, given.second
    kept = np.unique(np.concatenate([first, second]))
    k, place = len(kept), np.searchsorted(kept, np.arange(n))
    tied = np.zeros((3 * k + len(first), 3 * k + s))
    for i, ball in enumerate(kept):
        tied[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = root[ball]
        tied[3 * i : 3 * i + 3, 3 * k :] = top[ball]
    between = design.balls.places[first] - design.balls.places[second]
    between /= np.sqrt((between**2).sum(axis=1))[:, None] * given.uncertainty[:, None]
    for i in range(len(first)):
        tied[3 * k + i, 3 * place[first[i]] : 3 * place[first[i]] + 3] = between[i]
        tied[3 * k + i, 3 * place[second[i]] : 3 * place[second[i]] + 3] = -between[i]
    tied = np.linalg.qr(tied, mode="r")
    triangle = np.linalg.qr(np.concatenate([rest, tied[3 * k :, 3 * k :]]), mode="r")

    scale = np.concatenate([pose_scale(design), model_scale(design)])
    values = np.linalg.svd(triangle * scale, compute_uv=False)
    deficiency = int((values <= EXACT * values[0]).sum())
    inverse = np.linalg.inv(triangle)

    # Square roots of covariances: of what is shared, and of the balls, those that are kept last.
    single = np.setdiff1d(np.arange(n), kept)
    common = np.zeros((n, 3, s + 3 * k))
    back = np.linalg.inv(root[single])
    common[single, :, :s] = -back @ (top[single] @ inverse)
    kept_back = np.linalg.inv(tied[: 3 * k, : 3 * k])
    common[kept, :, :s] = (-kept_back @ (tied[: 3 * k, 3 * k :] @ inverse)).reshape(k, 3, s)
    common[kept, :, s:] = kept_back.reshape(k, 3, 3 * k)
    flat = common.reshape(3 * n, -1)
    of_balls = (flat @ flat.T).reshape(n, 3, n, 3)
    of_balls[single, :, single] += back @ back.transpose(0, 2, 1)

    of_model = inverse[free:, free:]
    points = np.broadcast_to(
        design.probes.offsets[design.evaluation.probe], design.evaluation.points.shape
    )
    moved = derivatives(design, design.evaluation.points, points).reshape(-1, s - free) @ of_model
    of_points, count = moved @ moved.T, len(design.evaluation.points)
    return {
        "U1": summary(np.sqrt(np.diag(of_balls.reshape(3 * n, 3 * n)))),
        "U2": summary(np.sqrt((inverse[:free] ** 2).sum(axis=1))),
        "U3": summary(np.sqrt(((monomials() @ of_model) ** 2).sum(axis=1))),
        "U4": summary(np.sqrt(np.diag(of_points))),
        "U5": summary(pair_uncertainties(design.balls.places, of_balls)),
        "U6": summary(
            pair_uncertainties(design.evaluation.points, of_points.reshape(count, 3, count, 3))
        ),
    }, deficiency


def derivatives(design: Design, x: Real, p: Real) -> Real:
    """Derivatives (m, 3, 69) of the corrected point by the coefficients of the 18 functions."""
    t = (x - design.machine.volume.lower) / (
        design.machine.volume.upper - design.machine.volume.lower
    )
    polynomials = chebyshev.chebvander(2.0 * t - 1.0, COEFFICIENTS - 2)
    whole = polynomials * t[:, :, None]
    inner = whole[:, :, : COEFFICIENTS - 2] * (1.0 - t)[:, :, None]
    found = np.zeros((len(x), 3, 69))
    start = 0
    for axis in range(3):
        for component in range(3):
            values = inner[:, axis] if held(axis, component) else whole[:, axis]
            found[:, component, start : start + values.shape[1]] = values
            start += values.shape[1]
    for axis in range(3):
        # An axis carries those after it, and the probe.
        turned = cross(p + (x - design.machine.volume.lower) * (np.arange(3) > axis))
        for component in range(3):
            for row in range(3):
                if row != component:
                    values = -turned[:, row, component, None] * whole[:, axis]
                    found[:, row, start : start + 4] = values
            start += 4
    return found


def held(axis: int, component: int) -> bool:
    """EYX, EZX and EZY are zero at the far end."""
    return (axis, component) in ((0, 1), (0, 2), (1, 2))


def cross(v: Real) -> Real:
    """Matrices (m, 3, 3) whose product with w is v x w."""
    found = np.zeros((len(v), 3, 3))
    found[:, 0, 1], found[:, 0, 2] = -v[:, 2], v[:, 1]
    found[:, 1, 0], found[:, 1, 2] = v[:, 2], -v[:, 0]
    found[:, 2, 0], found[:, 2, 1] = -v[:, 1], v[:, 0]
    return found


@cache
def monomials() -> Real:
    """From all coefficients to those of t, t^2, ... of all functions that are not zero."""
    blocks = []
    for inner in [held(axis, c) for axis in range(3) for c in range(3)] + [False] * 9:
        size = COEFFICIENTS - 1 - int(inner)
        block = np.zeros((COEFFICIENTS - 1, size))
        for k in range(size):
            unit = np.eye(size)[k]
            found = np.zeros(1)
            for power, c in enumerate(chebyshev.cheb2poly(unit)):
                found = polynomial.polyadd(found, c * polynomial.polypow([-1.0, 2.0], power))
            found = polynomial.polymul(found, [1.0, -1.0] if inner else [1.0])
            block[: len(found), k] = found[: COEFFICIENTS - 1]
        blocks.append(block)
    whole = np.zeros((sum(len(b) for b in blocks), sum(b.shape[1] for b in blocks)))
    row = column = 0
    for block in blocks:
        whole[row : row + len(block), column : column + block.shape[1]] = block
        row, column = row + len(block), column + block.shape[1]
    return whole


def pose_scale(design: Design) -> Real:
    """What moves some ball by about a metre: origins, and rotations over the plate's extent."""
    arm = np.ptp(design.balls.places, axis=0).max()
    return np.tile(np.repeat([1.0, 1.0 / arm], 3), len(design.positions.origins) - 1)


def model_scale(design: Design) -> Real:
    """The same of the coefficients."""
    shifts, turns = largest_values()
    return np.asarray(
        1.0
        / np.concatenate(
            [shifts, turns * (design.machine.volume.upper - design.machine.volume.lower).max()]
        )
    )


@cache
def largest_values() -> tuple[Real, Real]:
    """Largest values of the polynomials of displacements and of rotations."""
    t = np.linspace(0.0, 1.0, 65)
    whole = np.abs(chebyshev.chebvander(2.0 * t - 1.0, 3) * t[:, None])
    inner = (whole[:, :3] * (1.0 - t)[:, None]).max(axis=0)
    parts = [inner if held(axis, c) else whole.max(axis=0) for axis in range(3) for c in range(3)]
    return np.concatenate(parts), np.tile(whole.max(axis=0), 9)
