"""What makes points of a part uncertain beside the map: probing, tips, the part, short waves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.inputs import Array

from ..machine_files import random_roots
from .part import ShortWaves, Workpiece
from .touched import ProbingMachine, TouchedPoints

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Standard deviations at which a Gaussian spectrum ends, and its correlation lengths after which a
# periodic function is as good as one that is not.
SPECTRUM, APART = 6.0, 7.0


def outside_root(part: Workpiece, points: TouchedPoints, machine: ProbingMachine) -> csr_array:
    """Return a root (n, q) of the covariance of the displacements of touched points along their
    normals, in metres, by sources that a map does not have.

    Each point has its repeatability, and random errors of the machine at each approach; the radius
    of a tip is common to all points of a probe, and its lobing, of uniform distribution, to those
    in the same direction; all points have one strain and the machine's lasting errors.
    """
    from scipy.sparse import csr_array, diags_array, hstack

    single = np.full(len(points.normals), part.probing.point_repeatability)
    columns = np.stack(list(_common(part, points, machine)), axis=1)
    if part.random is not None:
        roots = random_roots(part.random, points.readings, machine.offsets[points.probes])
        anew, lasting = (np.einsum("ni,nik->nk", points.normals, root) for root in roots)
        single = np.hypot(single, np.linalg.norm(anew, axis=1))
        columns = np.concatenate([columns, lasting], axis=1)
    waves = part.short_waves
    if isinstance(waves, ShortWaves):
        columns = np.concatenate([columns, short_waves_root(waves, points)], axis=1)
    return csr_array(hstack([diags_array(single), csr_array(columns)]))


def _common(part: Workpiece, points: TouchedPoints, machine: ProbingMachine) -> Iterator[Array]:
    yield (points.surface * points.of_part).sum(axis=1) * strain_uncertainty(part)
    for probe in np.unique(points.probes).tolist():
        is_of_probe = points.probes == probe
        tip = part.probing.tip(machine.names[probe])
        assert tip is not None
        yield is_of_probe * tip.standard_uncertainty / 2
        if part.probing.lobing:
            directions, index = np.unique(
                points.normals[is_of_probe].round(6), axis=0, return_inverse=True
            )
            for k in range(len(directions)):
                column = np.zeros(len(points.normals))
                column[is_of_probe] = (index.ravel() == k) * part.probing.lobing / np.sqrt(3.0)
                yield column


def strain_uncertainty(part: Workpiece) -> float:
    """Return the standard uncertainty of the part's thermal expansion from 20 degC, a ratio."""
    state = part.expansion
    return float(
        np.hypot(
            state.coefficient * state.temperature_uncertainty,
            (state.temperature - 20.0) * state.coefficient_uncertainty,
        )
    )


def short_waves_root(waves: ShortWaves, points: TouchedPoints) -> Array:
    """Return a root (n, r) of the covariance of displacements along normals by errors of each axis
    in each direction, functions of the axis's position with the standard deviation of `waves` and
    the correlation exp(-(distance / correlation length)² / 2): its Fourier series.
    """
    parts = []
    length = waves.correlation_length
    for axis in range(3):
        x = points.readings[:, axis]
        period = float(np.ptp(x)) + APART * length
        frequencies = (
            2 * np.pi / period * np.arange(int(SPECTRUM * period / (2 * np.pi * length)) + 2)
        )
        variances = (
            np.sqrt(2 * np.pi) * length / period * np.exp(-((frequencies * length) ** 2) / 2)
        )
        variances[1:] *= 2.0
        phases = np.outer(x - x.min(), frequencies)
        series = np.concatenate([np.cos(phases), np.sin(phases)], axis=1)
        series *= waves.amplitude * np.sqrt(np.tile(variances, 2))
        parts += [points.normals[:, [component]] * series for component in range(3)]
    return np.concatenate(parts, axis=1)
