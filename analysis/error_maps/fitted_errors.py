"""Errors of a fitted machine with their uncertainties: at points, and of the lengths between some.

An error is where the tip is, less where the scales say: the correction to be added to a reading,
opposite in sign to the error of indication. The offset of the probe is not part of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.machines.protocol import Array, Integers
from ballplate.simulator.maps.corrected_points import (
    POINTS_AT_ONCE,
    corrected,
    drawn_rows,
    probe_indices,
)
from ballplate.simulator.maps.fitted_map import FittedMap

from .map_places import MapPlaces
from .realisations import Draws, Realisations, symmetric_root
from .volumetric_errors import length_errors

# Indices (m,) of probes, or of the one of all points.
Probed = Integers | int


@dataclass(frozen=True, eq=False)
class FittedErrors:
    """Estimated errors (m, d) where the axes stand at `points` (m, d), with standard
    `uncertainties` (m, d), in metres; both are NaN where undetermined.
    """

    points: Array
    errors: Array
    uncertainties: Array

    @property
    def resultant(self) -> Array:
        """Length (m,) of the error, NaN where some co-ordinate is undetermined."""
        return np.asarray(np.linalg.norm(self.errors, axis=1))


@dataclass(frozen=True, eq=False)
class FittedLengths:
    """Errors (m,) of distances from `starts` to `ends` (m, d): true distances less those that the
    scales say, in metres, with standard `uncertainties` (m,); both are NaN where undetermined.
    """

    starts: Array
    ends: Array
    nominal: Array
    errors: Array
    uncertainties: Array


@dataclass(frozen=True, eq=False)
class ErrorRows:
    """Derivatives (..., b) of functions by all that a map holds; `drawn`, those on a machine
    without errors, tell what is undetermined, None where nothing is.
    """

    rows: Array
    drawn: Array | None

    def uncertainties(self, fitted: FittedMap) -> Array:
        """Standard uncertainties (...), NaN where undetermined."""
        return fitted.standard_uncertainties(self.rows, self.drawn)


def rows_of_errors(fitted: FittedMap, points: Array, probes: Probed) -> ErrorRows:
    """Derivatives (m, d, b) of errors at points (m, d) with probes of indices (m,), or of one."""
    columns = fitted.offset_columns[probe_indices(fitted, len(points), probes)]
    which, axis = np.nonzero(columns >= 0)
    _, rows = corrected(fitted, points, probes)
    drawn = drawn_rows(fitted, points, probes)
    for one in (rows,) if drawn is None else (rows, drawn):
        # The offset itself is no error of the machine; what the rotations make of it is.
        one[which, axis, columns[which, axis]] -= 1.0
    return ErrorRows(rows, drawn)


def errors_of(fitted: FittedMap, points: Array, probes: Probed) -> Array:
    """Estimated errors (m, d) at points (m, d), also of what is undetermined."""
    offsets = fitted.probes.offsets[probe_indices(fitted, len(points), probes)]
    return np.asarray(fitted.model.error(points, fitted.values, offsets) - offsets)


@single_threaded
def fitted_errors(fitted: FittedMap, points: Array, probes: Probed) -> FittedErrors:
    """Errors at points (m, d), in metres, with probes of indices (m,), or of one."""
    uncertainties = np.zeros(points.shape)
    for start in range(0, len(points), POINTS_AT_ONCE):
        some = slice(start, start + POINTS_AT_ONCE)
        found = rows_of_errors(fitted, points[some], _part(probes, some))
        uncertainties[some] = found.uncertainties(fitted)
    errors = np.where(np.isnan(uncertainties), np.nan, errors_of(fitted, points, probes))
    return FittedErrors(points, errors, uncertainties)


@single_threaded
def fitted_lengths(fitted: FittedMap, starts: Array, ends: Array, probe: int) -> FittedLengths:
    """Errors of the distances between points (m, d), whose ends are read with the same probe."""
    uncertainties = length_rows(fitted, starts, ends, probe).uncertainties(fitted)
    moved = errors_of(fitted, ends, probe) - errors_of(fitted, starts, probe)
    found = length_errors(starts, ends, moved)
    nominal = np.linalg.norm(ends - starts, axis=1)
    errors = np.where(np.isnan(uncertainties), np.nan, found)
    return FittedLengths(starts, ends, nominal, errors, uncertainties)


def length_rows(fitted: FittedMap, starts: Array, ends: Array, probe: int) -> ErrorRows:
    """Derivatives (m, b) of the lengths between points (m, d)."""
    direction = (ends - starts) / np.linalg.norm(ends - starts, axis=1)[:, None]
    first, last = (rows_of_errors(fitted, one, probe) for one in (starts, ends))

    def along(start: Array, end: Array) -> Array:
        return np.asarray(np.einsum("md,mdb->mb", direction, end - start))

    if first.drawn is None or last.drawn is None:
        return ErrorRows(along(first.rows, last.rows), None)
    return ErrorRows(along(first.rows, last.rows), along(first.drawn, last.drawn))


def _part(probes: Probed, some: slice) -> Probed:
    return probes if isinstance(probes, int) else probes[some]


@single_threaded
def drawn_errors(
    fitted: FittedMap, places: MapPlaces, draws: Draws, probes: Probed, probe: int
) -> Realisations:
    """Errors at points and of lengths of machines that the readings may come from: what the
    covariance leaves open is drawn, once for all points of a machine.
    """
    draws.ensure_possible(places.points)
    (normal,) = draws.normal((len(fitted.scale),))
    deviations = normal @ symmetric_root(fitted.covariance, fitted.scale).T
    points = places.points
    errors = np.zeros((draws.count, *points.shape))
    for start in range(0, len(points), POINTS_AT_ONCE):
        some = slice(start, start + POINTS_AT_ONCE)
        found = rows_of_errors(fitted, points[some], _part(probes, some))
        errors[:, some] = np.tensordot(deviations, found.rows, axes=(1, 2))
    errors += fitted_errors(fitted, points, probes).errors
    lengths = fitted_lengths(fitted, places.starts, places.ends, probe).errors
    rows = length_rows(fitted, places.starts, places.ends, probe).rows
    return Realisations(draws, errors, lengths + deviations @ rows.T)
