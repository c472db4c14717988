"""Standard deviation of repeated readings, and the test of lack of fit against it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.design import (
    Design,
    State,
    measured,
    reading_blocks,
    reading_uncertainties,
)
from ballplate.simulator.machines import Array


@dataclass(frozen=True)
class PureError:
    """Sum of squares of repeated readings about their own means, in units of the stated variances,
    and its degrees of freedom; no error model takes part in it.
    """

    sum_of_squares: float
    degrees_of_freedom: int

    @property
    def sigma(self) -> float:
        """Standard deviation of a reading in units of that stated; NaN without repeats."""
        if not self.degrees_of_freedom:
            return float("nan")
        return float(np.sqrt(self.sum_of_squares / self.degrees_of_freedom))


def pure_error(design: Design, state: State, x: Array) -> PureError:
    """Return the variation of the readings of one ball in one position with one probe, x
    (readings, d), about their weighted mean; differences of influence quantities among these are
    subtracted.
    """
    chosen = design.plate_readings
    readings = design.readings.select(chosen)
    if not len(readings):
        return PureError(0.0, 0)
    u = reading_uncertainties(design, readings)
    blocks = reading_blocks(design, state, readings, x[chosen])
    is_read = measured(design, readings)
    weight = np.where(is_read, readings.repeats[:, None] / u**2, 0.0)
    off = blocks.residual * u / np.sqrt(readings.repeats)[:, None]
    table = np.stack([readings.position, readings.probe, readings.ball], axis=1)
    _, group, times = np.unique(table, axis=0, return_inverse=True, return_counts=True)
    group = group.ravel()
    total = np.zeros((len(times), design.dimension))
    mean = np.zeros_like(total)
    np.add.at(total, group, weight)
    np.add.at(mean, group, weight * off)
    mean /= np.where(total > 0.0, total, 1.0)
    freedom = int(is_read.sum()) - int((total > 0.0).sum())
    return PureError(float((weight * (off - mean[group]) ** 2).sum()), freedom)


def chance_of(
    square: float, dimensions: int, sum_of_rest: float, freedom: int, is_given: bool
) -> float:
    """Return the p-value of a sum of squares in a number of dimensions, relative to a
    `sum_of_rest` with its degrees of freedom: of chi-squared for a sigma that `is_given`,
    otherwise of Fisher's F.

    >>> round(chance_of(3.841459, 1, 90.0, 90, True), 6)
    0.05
    >>> round(chance_of(4.0, 1, 90.0, 90, False), 4)
    0.0485
    """
    from scipy.special import chdtrc, fdtrc

    square = max(square, 0.0)
    if dimensions <= 0 or (not is_given and freedom <= 0):
        return 1.0
    if is_given:
        return float(chdtrc(dimensions, square))
    if sum_of_rest <= 0.0:
        return 1.0 if square == 0.0 else 0.0
    return float(fdtrc(dimensions, freedom, square / dimensions / (sum_of_rest / freedom)))
