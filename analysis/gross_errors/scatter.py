"""Readings that scatter more than the others: those of one position, or with one probe."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.design.arrays import Design, measured, reading_uncertainties
from ballplate.simulator.machines.protocol import Array, Integers

from .remainders import Leftover


@dataclass(frozen=True)
class Scatter:
    """Readings (m,) of one position or probe, whichever is not -1, and their rows (k,) among the
    residuals.
    """

    position: int
    probe: int
    readings: Integers
    rows: Integers


def scatters(design: Design) -> list[Scatter]:
    """All positions, and all probes that share positions with others, with readings of plates."""
    chosen = design.plate_readings
    readings = design.readings.select(chosen)
    d, is_read = design.dimension, measured(design, readings)

    def of(position: int, probe: int, which: Array) -> Scatter:
        rows = np.flatnonzero(which)
        among = (d * rows[:, None] + np.arange(d))[is_read[rows]]
        return Scatter(position, probe, chosen[rows], among)

    found = [of(int(k), -1, readings.position == k) for k in np.unique(readings.position)]
    found += [of(-1, int(k), readings.probe == k) for k in np.unique(readings.probe)]
    return [one for one in found if len(one.readings) < len(chosen)]


def log_chances(every: list[Scatter], left: Leftover, sigma_is_estimated: bool) -> Array:
    """Logarithms (s,) of the chance that some readings scatter so much more than all other
    observations.

    By Fisher's F with the redundancies as degrees of freedom, which errs on the safe side, as
    residuals of redundancy below 1 scatter less than so many independent ones. Where sigma is given
    they must scatter more than stated as well: the larger of that chance and that of chi-squared.
    """
    from scipy.special import chdtrc, fdtrc

    total = left.sum_of_squares
    found = np.zeros(len(every))
    for place, one in enumerate(every):
        mine = float((left.residual[one.rows] ** 2).sum())
        freedom = redundancy(left, one.rows)
        others = left.freedom - freedom
        if freedom < 2.0 or others < 2.0:
            continue
        chance = float(fdtrc(freedom, others, mine / freedom / max((total - mine) / others, 1e-30)))
        if not sigma_is_estimated:
            chance = max(chance, float(chdtrc(freedom, mine)))
        found[place] = np.log(max(chance, 1e-300))
    return found


def redundancy(left: Leftover, rows: Integers) -> float:
    """Sum of the redundancy numbers of some rows."""
    hat = (left.common[rows] ** 2).sum() + (left.own[rows] ** 2).sum()
    return float(len(rows) - hat)


def ratio(left: Leftover, rows: Integers) -> float:
    """How many times as much as the others some rows scatter."""
    mine, freedom = float((left.residual[rows] ** 2).sum()), redundancy(left, rows)
    others = (left.sum_of_squares - mine) / max(left.freedom - freedom, 1.0)
    return float(np.sqrt(mine / freedom / others))


def with_scatter(design: Design, scatter: Scatter, times: float) -> Design:
    """The design with some readings so many times as uncertain."""
    uncertainty = reading_uncertainties(design, design.readings).copy()
    uncertainty[scatter.readings] *= times
    return replace(design, readings=replace(design.readings, uncertainty=uncertainty))
