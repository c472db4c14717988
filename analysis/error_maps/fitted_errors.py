"""Errors of a fitted machine with their uncertainties: at points, and of the lengths between some.

An error is where the tip is, less where the scales say: the correction to be added to a reading,
opposite in sign to the error of indication. The offset of the probe is not part of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.machines.protocol import Array
from ballplate.simulator.maps.corrected_points import POINTS_AT_ONCE, corrected, probe_indices
from ballplate.simulator.maps.fitted_map import FittedMap

from .map_places import MapPlaces
from .realisations import Draws, Realisations, symmetric_root
from .volumetric_errors import length_errors


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


def rows_of_errors(fitted: FittedMap, points: Array, probe: int | None = None) -> Array:
    """Derivatives (m, d, b) of errors at points (m, d) by all that the map holds."""
    _, rows = corrected(fitted, points, probe)
    columns = fitted.offset_columns[probe_indices(fitted, len(points), probe)]
    which, axis = np.nonzero(columns >= 0)
    # The offset itself is no error of the machine; what the rotations make of it is.
    rows[which, axis, columns[which, axis]] -= 1.0
    return rows


def errors_of(fitted: FittedMap, points: Array, probe: int | None = None) -> Array:
    """Estimated errors (m, d) at points (m, d), also of what is undetermined."""
    offsets = fitted.probes.offsets[probe_indices(fitted, len(points), probe)]
    return np.asarray(fitted.model.error(points, fitted.values, offsets) - offsets)


@single_threaded
def fitted_errors(fitted: FittedMap, points: Array, probe: int | None = None) -> FittedErrors:
    """Errors at points (m, d), in metres, with the probe of an index, by default that of the
    map.
    """
    uncertainties = np.zeros(points.shape)
    for start in range(0, len(points), POINTS_AT_ONCE):
        some = slice(start, start + POINTS_AT_ONCE)
        rows = rows_of_errors(fitted, points[some], probe)
        uncertainties[some] = fitted.standard_uncertainties(rows)
    found = np.where(np.isnan(uncertainties), np.nan, errors_of(fitted, points, probe))
    return FittedErrors(points, found, uncertainties)


@single_threaded
def fitted_lengths(
    fitted: FittedMap, starts: Array, ends: Array, probe: int | None = None
) -> FittedLengths:
    """Errors of the distances between points (m, d), whose ends are read with the same probe."""
    uncertainties = fitted.standard_uncertainties(length_rows(fitted, starts, ends, probe))
    moved = errors_of(fitted, ends, probe) - errors_of(fitted, starts, probe)
    found = length_errors(starts, ends, moved)
    nominal = np.linalg.norm(ends - starts, axis=1)
    errors = np.where(np.isnan(uncertainties), np.nan, found)
    return FittedLengths(starts, ends, nominal, errors, uncertainties)


def length_rows(fitted: FittedMap, starts: Array, ends: Array, probe: int | None = None) -> Array:
    """Derivatives (m, b) of the lengths between points (m, d)."""
    direction = (ends - starts) / np.linalg.norm(ends - starts, axis=1)[:, None]
    rows = rows_of_errors(fitted, ends, probe) - rows_of_errors(fitted, starts, probe)
    return np.asarray(np.einsum("md,mdb->mb", direction, rows))


@single_threaded
def drawn_errors(
    fitted: FittedMap, places: MapPlaces, draws: Draws, probe: int | None = None
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
        rows = rows_of_errors(fitted, points[some], probe)
        errors[:, some] = np.tensordot(deviations, rows, axes=(1, 2))
    errors += fitted_errors(fitted, points, probe).errors
    lengths = fitted_lengths(fitted, places.starts, places.ends, probe).errors
    rows = length_rows(fitted, places.starts, places.ends, probe)
    return Realisations(draws, errors, lengths + deviations @ rows.T)
