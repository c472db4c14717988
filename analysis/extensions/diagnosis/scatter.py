"""Readings with more noise than the others: those of one position, or with one probe."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.design import Design, measured, reading_uncertainties
from ballplate.simulator.machines import Array, Integers

from .remainders import Leftover


@dataclass(frozen=True)
class Scatter:
    """Readings (m,) of one position or probe, whichever is not -1, and their rows (k,) of the
    residuals.
    """

    position: int
    probe: int
    readings: Integers
    rows: Integers


def scatters(design: Design) -> list[Scatter]:
    """Return all positions, and all probes that share positions with others, with readings of
    plates.
    """
    chosen = design.plate_readings
    readings = design.readings.select(chosen)
    d, is_read = design.dimension, measured(design, readings)

    def group(position: int, probe: int, which: Array) -> Scatter:
        rows = np.flatnonzero(which)
        among = (d * rows[:, None] + np.arange(d))[is_read[rows]]
        return Scatter(position, probe, chosen[rows], among)

    groups = [group(int(k), -1, readings.position == k) for k in np.unique(readings.position)]
    groups += [group(-1, int(k), readings.probe == k) for k in np.unique(readings.probe)]
    return [candidate for candidate in groups if len(candidate.readings) < len(chosen)]


def log_chances(groups: list[Scatter], remainder: Leftover, sigma_is_estimated: bool) -> Array:
    """Return logarithms (s,) of the p-values of some readings' noise against all other
    observations.

    By Fisher's F with the redundancies as degrees of freedom. This is conservative: residuals with
    a redundancy below 1 vary less than independent ones. If sigma is given, the noise must exceed
    the stated one, too: the larger of that p-value and of chi-squared's.
    """
    from scipy.special import chdtrc, fdtrc

    total = remainder.sum_of_squares
    logarithms = np.zeros(len(groups))
    for k, group in enumerate(groups):
        square = float((remainder.residual[group.rows] ** 2).sum())
        freedom = redundancy(remainder, group.rows)
        other_freedom = remainder.freedom - freedom
        if freedom < 2.0 or other_freedom < 2.0:
            continue
        chance = float(
            fdtrc(
                freedom,
                other_freedom,
                square / freedom / max((total - square) / other_freedom, 1e-30),
            )
        )
        if not sigma_is_estimated:
            chance = max(chance, float(chdtrc(freedom, square)))
        logarithms[k] = np.log(max(chance, 1e-300))
    return logarithms


def redundancy(remainder: Leftover, rows: Integers) -> float:
    """Return the sum of the redundancy numbers of some rows."""
    hat = (remainder.common[rows] ** 2).sum() + (remainder.own[rows] ** 2).sum()
    return float(len(rows) - hat)


def ratio(remainder: Leftover, rows: Integers) -> float:
    """Return the ratio of some rows' noise to that of the others."""
    square, freedom = float((remainder.residual[rows] ** 2).sum()), redundancy(remainder, rows)
    variance_of_others = (remainder.sum_of_squares - square) / max(remainder.freedom - freedom, 1.0)
    return float(np.sqrt(square / freedom / variance_of_others))


def with_scatter(design: Design, scatter: Scatter, times: float) -> Design:
    """Return the design with the uncertainty of some readings multiplied."""
    uncertainty = reading_uncertainties(design, design.readings).copy()
    uncertainty[scatter.readings] *= times
    return replace(design, readings=replace(design.readings, uncertainty=uncertainty))
