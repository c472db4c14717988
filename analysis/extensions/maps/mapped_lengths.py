"""Lengths between corrected points of a fitted map, with their uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.machines import Array, Integers
from ballplate.simulator.maps import FittedMap

from .corrected_points import corrected, drawn_rows, tips

# Lengths whose derivatives are held at once.
LENGTHS_AT_ONCE = 2000


@dataclass(frozen=True, eq=False)
class MappedLengths:
    """Lengths (m,) between corrected points and between the same points as `read`, with standard
    uncertainties, NaN where undetermined; `root` (m, r) is a square root of their joint covariance.
    All in metres.
    """

    values: Array
    read: Array
    standard_uncertainties: Array
    root: Array


@single_threaded
def mapped_lengths(
    fitted: FittedMap, points: Array, probes: Integers, pairs: Integers, scatter: float = 0.0
) -> MappedLengths:
    """Return lengths between `pairs` (m, 2) of scale readings `points` (n, d) with `probes` (n,),
    in metres.

    Uncertainties include both readings' noise, `scatter` times the stated repeatability.

    :raises ValueError: both points of a pair are at the same place.
    """
    values, readings, uncertainties = (np.zeros(len(pairs)) for _ in range(3))
    root = np.zeros((len(pairs), fitted.root.shape[1]))
    for start in range(0, len(pairs), LENGTHS_AT_ONCE):
        some = slice(start, start + LENGTHS_AT_ONCE)
        used, place = np.unique(pairs[some], return_inverse=True)
        first, second = place.reshape(-1, 2).T
        x, ends = points[used], probes[used]
        places, rows = corrected(fitted, x, ends)
        drawn = drawn_rows(fitted, x, ends)
        apart = places[first] - places[second]
        values[some] = np.linalg.norm(apart, axis=1)
        if not values[some].all():
            raise ValueError("both points of a length coincide")
        unit = apart / values[some][:, None]
        tip = tips(fitted, x, ends)
        readings[some] = np.linalg.norm(tip[first] - tip[second], axis=1)
        of_lengths = np.einsum("md,mds->ms", unit, rows[first] - rows[second])
        as_drawn = (
            None if drawn is None else np.einsum("md,mds->ms", unit, drawn[first] - drawn[second])
        )
        root[some] = fitted.function_root(of_lengths, as_drawn)
        of_readings = 2.0 * (unit**2) @ (scatter * fitted.repeatability) ** 2
        uncertainties[some] = np.sqrt((root[some] ** 2).sum(axis=1) + of_readings)
    return MappedLengths(values, readings, uncertainties, root)
