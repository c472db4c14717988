"""Largest differences of the corrections of two maps, searched in the whole volume.

The search climbs from the best points of a grid with corners and edges: no bound, but beyond any
grid.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

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

    def size(x: Array, offset: Array) -> Array:
        return np.linalg.norm(differences(x, np.broadcast_to(offset, x.shape)), axis=1)

    along = POINTS_ALONG[len(volume.lower)]
    x = _grid(volume, along)
    return _searched(size, x, partial(size, x), volume, offsets, along)


def largest_of_lengths(
    old: Differences, new: Differences, volume: Volume, offsets: Array
) -> LargestDifference:
    """The largest difference of lengths between two points of the volume, both corrected with a
    probe of one of the offsets (k, d), by corrected points (n, d) of two maps.
    """

    def apart(ends: Array, offset: Array) -> Array:
        first, second = np.split(ends, 2, axis=1)
        p = np.broadcast_to(offset, first.shape)
        lengths = [
            np.linalg.norm(places(first, p) - places(second, p), axis=1) for places in (old, new)
        ]
        return np.abs(lengths[1] - lengths[0])

    along = ENDS_ALONG[len(volume.lower)]
    x = _grid(volume, along)
    i, j = np.triu_indices(len(x), 1)

    def apart_on_grid(offset: Array) -> Array:
        # Each point is corrected once.
        p = np.broadcast_to(offset, x.shape)
        lengths = [np.linalg.norm(y[i] - y[j], axis=1) for y in (old(x, p), new(x, p))]
        return np.abs(lengths[1] - lengths[0])

    ends = np.concatenate([x[i], x[j]], axis=1)
    return _searched(apart, ends, apart_on_grid, volume, offsets, along)


def _grid(volume: Volume, along: int) -> Array:
    return even_grid(*volume.corners, [along] * len(volume.lower))


def _searched(
    value: Callable[[Array, Array], Array],
    places: Array,
    on_grid: Callable[[Array], Array],
    volume: Volume,
    offsets: Array,
    along: int,
) -> LargestDifference:
    """The largest value (n,) at places (n, m) of one or more points each with a probe offset; a
    search starts from the best of `places`, whose values `on_grid` gives for an offset.
    """
    points = places.shape[1] // len(volume.lower)
    lower, upper = (np.tile(corner, points) for corner in volume.corners)
    step = np.tile(volume.size / (along - 1), points)
    generator = np.random.default_rng(np.random.SeedSequence(2))
    at_random = generator.uniform(lower, upper, (RANDOM, len(lower)))
    largest, squares = 0.0, []
    for offset in offsets:

        def value_at(x: Array, offset: Array = offset) -> Array:
            return value(x, offset)

        random_values = value_at(at_random)
        squares.append(random_values**2)
        best = _best_of_parts(on_grid(offset), places > lower + 0.5 * (upper - lower))
        starts = np.concatenate([places[best], at_random[[int(random_values.argmax())]]])
        largest = max(largest, _climbed(value_at, starts, lower, upper, step))
    rms = float(np.sqrt(np.mean(squares)))
    return LargestDifference(largest, rms, len(offsets) * (len(places) + RANDOM))


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
