"""Corrected points of a fitted map, with derivatives by its parameters and offsets."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import offset_sensitivity
from ballplate.simulator.machines import Array, Integers

from ..machine_files import FittedMap

# Points of which derivatives are held at once.
POINTS_AT_ONCE = 1000


def corrected(
    fitted: FittedMap, points: Array, probes: Integers | int | None = None
) -> tuple[Array, Array]:
    """Return corrected points x + e(x, a, p) (n, d) for scale readings `points` (n, d), in metres,
    and derivatives (n, d, m) by the contents of the map.

    `probes` are indices (n,) or one for all; default: the probe of the map. The correction e is tip
    less scale reading.
    """
    offsets = fitted.probes.offsets[probe_indices(fitted, len(points), probes)]
    places = points + fitted.model.error(points, fitted.values, offsets)
    return places, _rows(fitted, points, probes, fitted.values, fitted.probes.offsets)


def drawn_rows(
    fitted: FittedMap, points: Array, probes: Integers | int | None = None
) -> Array | None:
    """Return derivatives of `corrected` on a machine without errors, which determine the
    undetermined results; None without any.
    """
    if not fitted.undetermined.size:
        return None
    return _rows(fitted, points, probes, np.zeros(len(fitted.values)), fitted.drawn_offsets)


def _rows(
    fitted: FittedMap, points: Array, probes: Integers | int | None, a: Array, by_probe: Array
) -> Array:
    """Derivatives (n, d, m) of corrected points at parameters `a` and offsets (l, d) of probes."""
    indices = probe_indices(fitted, len(points), probes)
    offsets = by_probe[indices]
    rows = np.zeros((*points.shape, len(fitted.scale)))
    rows[:, :, : len(a)] = fitted.model.jacobian(points, a, offsets)
    if fitted.probes.free[indices].any():
        by_offset = offset_sensitivity(fitted.model, points, a, offsets)
        columns = fitted.offset_columns[indices]
        for axis in range(fitted.dimension):
            free = np.flatnonzero(columns[:, axis] >= 0)
            rows[free, :, columns[free, axis]] = by_offset[free, :, axis]
    return rows


def tips(fitted: FittedMap, points: Array, probes: Integers | int | None = None) -> Array:
    """Where the tips (n, d) are by the scales: scale readings `points` (n, d) with the offsets that
    were stated of the probes, in metres.
    """
    return points + fitted.drawn_offsets[probe_indices(fitted, len(points), probes)]


def probe_indices(fitted: FittedMap, count: int, probes: Integers | int | None = None) -> Integers:
    """Return indices (count,) of probes; default: the probe of the map."""
    indices = fitted.probes.names.index(fitted.probe) if probes is None else probes
    return np.broadcast_to(np.asarray(indices, np.int64), count)


@single_threaded
def corrected_with_root(
    fitted: FittedMap, points: Array, probes: Integers | int | None = None
) -> tuple[Array, Array]:
    """Corrected points (n, d) and a square root (n, d, r) of their joint covariance, in metres; NaN
    where a co-ordinate is undetermined.
    """
    parts = list(_in_parts(fitted, points, probe_indices(fitted, len(points), probes)))
    if not parts:
        return np.zeros(points.shape), np.zeros((*points.shape, fitted.root.shape[1]))
    places, roots = zip(*parts, strict=True)
    return np.concatenate(places), np.concatenate(roots)


@single_threaded
def corrected_with_blocks(
    fitted: FittedMap, points: Array, probes: Integers | int | None = None
) -> tuple[Array, Array]:
    """Return corrected points (n, d) and the covariance of each (n, d, d); metres, NaN where
    undetermined.
    """
    d = fitted.dimension
    places, blocks = np.zeros(points.shape), np.zeros((len(points), d, d))
    start = 0
    for some, root in _in_parts(fitted, points, probe_indices(fitted, len(points), probes)):
        part = slice(start, start + len(some))
        places[part], blocks[part] = some, root @ root.transpose(0, 2, 1)
        start += len(some)
    return places, blocks


def _in_parts(fitted: FittedMap, points: Array, indices: Integers) -> Iterator[tuple[Array, Array]]:
    """Corrected points and roots as above, some points at a time."""
    for start in range(0, len(points), POINTS_AT_ONCE):
        some = slice(start, start + POINTS_AT_ONCE)
        places, rows = corrected(fitted, points[some], indices[some])
        drawn = drawn_rows(fitted, points[some], indices[some])
        yield places, fitted.function_root(rows, drawn)
