"""Errors of a fitted machine with their uncertainties: at points, and of the lengths between some.

An error is where the tip is, less where the scales say: the correction to be added to a reading,
opposite in sign to the error of indication. The offset of the probe is not part of it.
"""

from __future__ import annotations

import numpy as np
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.machines import Array, Integers

from ..machine_files import FittedMap
from .corrected_points import POINTS_AT_ONCE, corrected, drawn_rows, probe_indices
from .map_places import MapPlaces
from .realisations import Draws, Realisations, drawn_deviations, drawn_offsets
from .volumetric_errors import LengthErrors, VolumetricErrors, length_errors

# Indices (m,) of probes, or of the one of all points.
Probed = Integers | int


def _rows_of_errors(fitted: FittedMap, points: Array, probes: Probed) -> tuple[Array, Array | None]:
    """Derivatives (m, d, b) of errors at points (m, d) with probes of indices (m,), or of one, by
    the contents of a map, and those on a machine without errors, which determine undetermined
    results, None without any.
    """
    columns = fitted.offset_columns[probe_indices(fitted, len(points), probes)]
    indices, axis = np.nonzero(columns >= 0)
    _, rows = corrected(fitted, points, probes)
    drawn = drawn_rows(fitted, points, probes)
    for array in (rows,) if drawn is None else (rows, drawn):
        # The offset itself is no error of the machine; what the rotations make of it is.
        array[indices, axis, columns[indices, axis]] -= 1.0
    return rows, drawn


@single_threaded
def fitted_errors(fitted: FittedMap, points: Array, probes: Probed) -> VolumetricErrors:
    """Errors at points (m, d), in metres, with probes of indices (m,), or of one."""
    uncertainties = np.zeros(points.shape)
    for start in range(0, len(points), POINTS_AT_ONCE):
        some = slice(start, start + POINTS_AT_ONCE)
        rows = _rows_of_errors(fitted, points[some], _part(probes, some))
        uncertainties[some] = fitted.standard_uncertainties(*rows)
    offsets = fitted.probes.offsets[probe_indices(fitted, len(points), probes)]
    errors = fitted.model.error(points, fitted.values, offsets) - offsets
    errors[np.isnan(uncertainties)] = np.nan
    return VolumetricErrors(points, errors, uncertainties)


@single_threaded
def fitted_lengths(fitted: FittedMap, places: MapPlaces, probe: int) -> LengthErrors:
    """Return errors of lengths between scale readings, both ends with one probe."""
    first, last = places.starts, places.ends
    starts, ends = (corrected(fitted, points, probe)[0] for points in (first, last))
    moved = ends - last - (starts - first)
    uncertainties = fitted.standard_uncertainties(*_length_rows(fitted, places, probe))
    errors = np.where(np.isnan(uncertainties), np.nan, length_errors(first, last, moved))
    nominal = np.linalg.norm(last - first, axis=1)
    return LengthErrors(first, last, nominal, errors, uncertainties)


def _length_rows(fitted: FittedMap, places: MapPlaces, probe: int) -> tuple[Array, Array | None]:
    """Derivatives (k, b) of lengths, as of errors."""
    first, last = places.starts, places.ends
    direction = (last - first) / np.linalg.norm(last - first, axis=1)[:, None]

    def along(start: Array, end: Array) -> Array:
        return np.einsum("md,mdb->mb", direction, end - start)

    rows = along(corrected(fitted, first, probe)[1], corrected(fitted, last, probe)[1])
    at_first, at_last = drawn_rows(fitted, first, probe), drawn_rows(fitted, last, probe)
    if at_first is None or at_last is None:
        return rows, None
    return rows, along(at_first, at_last)


def _part(probes: Probed, some: slice) -> Probed:
    return probes if isinstance(probes, int) else probes[some]


@single_threaded
def drawn_errors(
    fitted: FittedMap, places: MapPlaces, draws: Draws, probes: Probed, probe: int
) -> Realisations:
    """Return errors at points and of lengths of machines drawn from the covariance, one draw for
    all points of a machine.
    """
    draws.ensure_possible(places.points)
    deviations = drawn_deviations(fitted, draws)
    points = places.points
    errors = np.zeros((draws.count, *points.shape))
    for start in range(0, len(points), POINTS_AT_ONCE):
        some = slice(start, start + POINTS_AT_ONCE)
        rows, _ = _rows_of_errors(fitted, points[some], _part(probes, some))
        errors[:, some] = np.tensordot(deviations, rows, axes=(1, 2))
    errors += fitted_errors(fitted, points, probes).errors
    lengths = fitted_lengths(fitted, places, probe).errors
    rows, _ = _length_rows(fitted, places, probe)
    offsets = drawn_offsets(fitted, deviations)
    estimated = np.flatnonzero(fitted.probes.free.any(axis=1)).tolist()
    by_probe = {fitted.probes.names[k]: offsets[:, k] for k in estimated}
    return Realisations(draws, errors, lengths + deviations @ rows.T, by_probe)
