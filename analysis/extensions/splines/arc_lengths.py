"""Arc length along the profile of a turned part through nominal points.

Between neighbouring points of a feature the profile is an arc with the curvature of circles through
three of them, so that points on a circle or a line give both exactly.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from ballplate.simulator.machines import Array
from numpy.typing import NDArray


def arc_lengths(places: Array, features: Sequence[str]) -> Array:
    """Return arc lengths (m,) from the first of `places` (m, 2), radius and axial co-ordinate in
    metres, in order along the surface.

    A feature is a run of places with the same name in `features`; between features the way is the
    chord.
    """
    points = places[:, 1] + 1j * places[:, 0]
    steps = np.abs(np.diff(points))
    ends = [k for k in range(1, len(points)) if features[k] != features[k - 1]]
    for first, end in zip([0, *ends], [*ends, len(points)], strict=True):
        if end - first > 2:
            curvature = _curvatures(points[first:end])
            own = slice(first, end - 1)
            bend = np.clip(0.25 * steps[own] * (curvature[1:] + curvature[:-1]), -1.0, 1.0)
            bend[bend == 0.0] = 1e-300
            steps[own] *= np.arcsin(bend) / bend
    return np.concatenate([[0.0], np.cumsum(steps)])


def _curvatures(points: NDArray[np.complex128]) -> Array:
    """Signed curvature (m,) of the circle through each point and its neighbours; at the ends, that
    of the next.
    """
    steps, two = np.diff(points)[:-1], np.diff(points)[1:]
    inner = 2.0 * (np.conj(steps) * two).imag / (np.abs(steps) * np.abs(two) * np.abs(steps + two))
    return np.concatenate([inner[:1], inner, inner[-1:]])
