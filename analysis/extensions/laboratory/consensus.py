"""The rigid motion that most points of a set agree on, robust against the others."""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations

import numpy as np
from ballplate.simulator.computing import comparable, svd
from ballplate.simulator.design import Flags
from ballplate.simulator.geometry import fit_motion
from ballplate.simulator.machines import Array, Integers

# Subsets tried, and the points that each is judged by. With a third of the points wrong, three
# right ones are drawn together more than once in four draws.
SUBSETS = 200
JUDGES = 400


def consensus_motion(source: Array, target: Array, reach: Array) -> tuple[Array, Array, Flags]:
    """Return rotation (d, d), origin (d,) and a mask (m,) of the points that agree with them.

    The motion brings as many points `source` (m, d) as possible within `reach` (m,) of `target`
    (m, d). Motions of small, widely spread subsets are tried; the best is refined by all points
    that agree with it. The same points give the same result: subsets are drawn from a fixed seed.
    """
    judges = np.unique(np.linspace(0, len(source) - 1, min(len(source), JUDGES)).astype(np.int64))
    subsets = _subsets(source)
    rotations, origins = _motions(source[subsets], target[subsets])
    everything = fit_motion(source, target)
    rotations = np.concatenate([everything[0][None], rotations])
    origins = np.concatenate([everything[1][None], origins])
    moved = np.einsum("cij,mj->cmi", rotations, source[judges]) + origins[:, None]
    apart = np.sqrt(((moved - target[judges]) ** 2).sum(axis=2)) / reach[judges]
    # Of motions that as many points agree with, the one they agree with best.
    best = int(np.argmin(comparable(np.minimum(apart, 1.0).sum(axis=1))))
    rotation, origin = rotations[best], origins[best]
    agreeing = distances(source, target, rotation, origin) < reach
    for _ in range(20):
        if not agreeing.any():
            break
        rotation, origin = fit_motion(source[agreeing], target[agreeing])
        now = distances(source, target, rotation, origin) < reach
        if (now == agreeing).all():
            break
        agreeing = now
    return rotation, origin, agreeing


def distances(source: Array, target: Array, rotation: Array, origin: Array) -> Array:
    """Return distances (m,) of moved points `source` (m, d) from `target` (m, d)."""
    return np.sqrt(((source @ rotation.T + origin - target) ** 2).sum(axis=1))


def _subsets(source: Array) -> Integers:
    """Return indices (c, d) of subsets that fix a motion, the most widely spread of the drawn
    ones.
    """
    return _widest(source.tobytes(), source.shape[1])


@lru_cache(maxsize=64)
def _widest(content: bytes, d: int) -> Integers:
    """Those of the points in `content`; a position is compared several times in each evaluation."""
    source = np.frombuffer(content).reshape(-1, d)
    m, size = len(source), min(d, len(source))
    if m <= 10:
        drawn = np.array(list(combinations(range(m), size)), np.int64)
    else:
        drawn = np.random.default_rng(0).integers(0, m, (4 * SUBSETS, size))
    points = source[drawn] - source[drawn].mean(axis=1, keepdims=True)
    extent = svd(points, compute_uv=False)
    # Across its main line where it has one, so that three points of a row are drawn last.
    spread = extent[:, max(d - 2, 0)] + 1e-3 * extent[:, 0]
    return drawn[np.argsort(-spread, kind="stable")[:SUBSETS]]


def _motions(source: Array, target: Array) -> tuple[Array, Array]:
    """Rotations (c, d, d) and origins (c, d) that fit c pairs of point sets (c, k, d), all at
    once.
    """
    centre_source, centre_target = source.mean(axis=1), target.mean(axis=1)
    spread = (target - centre_target[:, None]).transpose(0, 2, 1) @ (
        source - centre_source[:, None]
    )
    u, _, vh = svd(spread)
    u[:, :, -1] *= np.sign(np.linalg.det(u @ vh))[:, None]
    rotations = u @ vh
    return rotations, centre_target - np.einsum("cij,cj->ci", rotations, centre_source)
