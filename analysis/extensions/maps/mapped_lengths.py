"""Lengths between corrected points of a fitted map, with their uncertainty."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.design import Tasks
from ballplate.simulator.inputs import Target
from ballplate.simulator.machines import Array

from ..machine_files import FittedMap
from .corrected_points import corrected, drawn_rows, tips

# Lengths whose derivatives are held at once.
LENGTHS_AT_ONCE = 2000


@dataclass(frozen=True)
class CorrectedLength:
    """A length on the corrected machine, with `read`, the length by scales and stated probe
    offsets, and its `target`, if any; metres. The value and its standard uncertainty are NaN if
    undetermined.
    """

    name: str
    read: float
    value: float
    standard_uncertainty: float
    target: Target | None = None

    @property
    def is_met(self) -> bool | None:
        """True if the uncertainty is within the target; None without a target."""
        if self.target is None:
            return None
        return bool(self.standard_uncertainty <= self.target.at(self.value))


def mapped_lengths(
    fitted: FittedMap, lengths: Tasks, scatter: float = 0.0
) -> Iterator[CorrectedLength]:
    """Yield corrected lengths between scale readings.

    Uncertainties include both readings' noise, `scatter` times the stated repeatability.

    :raises ValueError: both ends of a length are at the same place.
    """
    for start in range(0, len(lengths.names), LENGTHS_AT_ONCE):
        some = slice(start, start + LENGTHS_AT_ONCE)
        ends, probes = lengths.points[some], lengths.probes[some]
        x, by_end = ends.reshape(-1, fitted.dimension), probes.ravel()
        places, rows = corrected(fitted, x, by_end)
        drawn = drawn_rows(fitted, x, by_end)
        apart = places[::2] - places[1::2]
        values = np.linalg.norm(apart, axis=1)
        if not values.all():
            raise ValueError("both points of a length coincide")
        unit = apart / values[:, None]
        tip = tips(fitted, x, by_end)
        read = np.linalg.norm(tip[::2] - tip[1::2], axis=1)
        root = fitted.function_root(
            _along(unit, rows), None if drawn is None else _along(unit, drawn)
        )
        of_readings = 2.0 * (unit**2) @ (scatter * fitted.repeatability) ** 2
        uncertainties = np.sqrt((root**2).sum(axis=1) + of_readings)
        values[np.isnan(uncertainties)] = np.nan
        for name, length_read, value, u, target in zip(
            lengths.names[some],
            *(array.tolist() for array in (read, values, uncertainties)),
            lengths.targets[some],
            strict=True,
        ):
            yield CorrectedLength(name, length_read, value, u, target)


def _along(unit: Array, of_ends: Array) -> Array:
    """Derivatives (m, s) of lengths along unit vectors (m, d), from those of both ends (2 m, d, s)
    in turn.
    """
    return np.asarray(np.einsum("md,mds->ms", unit, of_ends[::2] - of_ends[1::2]))
