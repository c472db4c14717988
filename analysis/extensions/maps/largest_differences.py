"""Largest differences of the corrections of two maps, searched in the whole volume.

The search climbs from the best points of a grid with corners and edges: no bound, but beyond any
grid.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.design import Flags, Volume
from ballplate.simulator.geometry import even_grid
from ballplate.simulator.machines import Array

# Places along each axis at which points are compared, and ends of lengths, by dimension.
POINTS_ALONG, ENDS_ALONG = {2: 41, 3: 15}, {2: 15, 3: 7}
# Places at random with each probe, for root mean squares.
RANDOM = 400
# Parts of the volume from whose best place a search starts.
STARTS = 10
# Steps of a search are halved so often, and taken at most so often before that.
HALVINGS, STEPS = 12, 20

Differences = Callable[[Array, Array], Array]
"""Differences (n, d) of corrections at scale readings (n, d) with probe offsets (n, d)."""


@dataclass(frozen=True)
class LargestDifference:
    """The largest difference in the search and the root mean square at random locations, both in
    metres, with the number `places` of starting points.
    """

    largest: float
    rms: float
    places: int


def largest_at_points(
    differences: Differences, volume: Volume, offsets: Array
) -> LargestDifference:
    """The largest difference of a corrected point in the volume with a probe of one of the offsets
    (k, d).
    """

    def size(x: Array, p: Array) -> Array:
        return np.linalg.norm(differences(x, p), axis=1)

    d = len(volume.lower)
    x = even_grid(*volume.corners, [POINTS_ALONG[d]] * d)
    at_random = _at_random(volume, RANDOM)
    largest, squares = 0.0, []
    for offset in offsets:
        squares.append(size(at_random, np.broadcast_to(offset, at_random.shape)) ** 2)
        values = size(x, np.broadcast_to(offset, x.shape))
        best = _best_of_parts(values, x > volume.lower + 0.5 * volume.size)
        starts = np.concatenate([x[best], at_random[[int(squares[-1].argmax())]]])

        def size_at(some: Array, offset: Array = offset) -> Array:
            return size(some, np.broadcast_to(offset, some.shape))

        step = volume.size / (POINTS_ALONG[d] - 1)
        largest = max(largest, _climbed(size_at, starts, volume.lower, volume.upper, step))
    rms = float(np.sqrt(np.mean(squares)))
    return LargestDifference(largest, rms, len(offsets) * (len(x) + RANDOM))


def largest_of_lengths(
    old: Differences, new: Differences, volume: Volume, offsets: Array
) -> LargestDifference:
    """The largest difference of lengths between two points of the volume, both corrected with a
    probe of one of the offsets (k, d), by corrected points (n, d) of two maps.
    """

    def apart(ends: Array, p: Array) -> Array:
        first, second = np.split(ends, 2, axis=1)
        lengths = [
            np.linalg.norm(places(first, p) - places(second, p), axis=1) for places in (old, new)
        ]
        return np.abs(lengths[1] - lengths[0])

    d = len(volume.lower)
    x = even_grid(*volume.corners, [ENDS_ALONG[d]] * d)
    i, j = np.triu_indices(len(x), 1)
    at_random = _at_random(volume, 2 * RANDOM).reshape(RANDOM, 2 * d)
    middle = np.tile(volume.lower + 0.5 * volume.size, 2)
    step = np.tile(volume.size / (ENDS_ALONG[d] - 1), 2)
    largest, squares = 0.0, []
    for offset in offsets:

        def apart_at(ends: Array, offset: Array = offset) -> Array:
            return apart(ends, np.broadcast_to(offset, (len(ends), d)))

        squares.append(apart_at(at_random) ** 2)
        p = np.broadcast_to(offset, x.shape)
        lengths = [
            np.linalg.norm(length[i] - length[j], axis=1) for length in (old(x, p), new(x, p))
        ]
        ends = np.concatenate([x[i], x[j]], axis=1)
        best = _best_of_parts(np.abs(lengths[1] - lengths[0]), ends > middle)
        lower, upper = (np.tile(corner, 2) for corner in volume.corners)
        largest = max(largest, _climbed(apart_at, ends[best], lower, upper, step))
    rms = float(np.sqrt(np.mean(squares)))
    return LargestDifference(largest, rms, len(offsets) * (len(i) + RANDOM))


def _at_random(volume: Volume, count: int) -> Array:
    generator = np.random.default_rng(np.random.SeedSequence(2))
    return generator.uniform(volume.lower, volume.upper, (count, len(volume.lower)))


def _best_of_parts(values: Array, halves: Flags) -> Array:
    """Indices of the largest of the values (n,) in the best parts of the volume, by the `halves`
    (n, m) of the axes.
    """
    part = halves @ (1 << np.arange(halves.shape[1]))
    order = np.argsort(-values, kind="stable")
    first = np.sort(np.unique(part[order], return_index=True)[1])
    return np.asarray(order[first[:STARTS]])


def _climbed(
    value: Callable[[Array], Array], starts: Array, lower: Array, upper: Array, step: Array
) -> float:
    """The largest value that steps along single co-ordinates reach from any of the starts (k, m),
    between `lower` and `upper` (m,).
    """
    x, best = starts.copy(), value(starts)
    ways = np.concatenate([np.diag(step), -np.diag(step)])
    for halving in range(HALVINGS):
        for _ in range(STEPS):
            tried = np.clip(x[:, None] + ways / 2**halving, lower, upper)
            values = value(tried.reshape(-1, x.shape[1])).reshape(len(x), -1)
            way = values.argmax(axis=1)
            top = values[np.arange(len(x)), way]
            better = top > best
            if not better.any():
                break
            x[better], best[better] = tried[better, way[better]], top[better]
    return float(best.max())
