"""Standard uncertainties of measuring tasks: lengths between two points that the corrected machine
is to measure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.estimation.functions import Distances

from .pairs import PairTile

# Coverage factor of expanded uncertainties.
COVERAGE = 2.0


@dataclass(frozen=True)
class TaskUncertainty:
    """A measuring task: its length, standard uncertainty and the one to be reached, in metres.

    The standard uncertainty is NaN where observations leave it open; `target` is None where nothing
    is to be reached, and otherwise compared with `coverage_factor` times the standard uncertainty.
    """

    name: str
    length: float
    standard_uncertainty: float
    target: float | None
    coverage_factor: float = 1.0

    @property
    def expanded_uncertainty(self) -> float:
        """With the coverage factor of the target, or 2 where that is 1."""
        return self.expansion * self.standard_uncertainty

    @property
    def expansion(self) -> float:
        """The coverage factor of the expanded uncertainty."""
        return expansion(self.coverage_factor)

    @property
    def is_within(self) -> bool | None:
        """Whether the uncertainty is within its target; None where there is none."""
        return (
            None
            if self.target is None
            else self.coverage_factor * self.standard_uncertainty <= self.target
        )


def expansion(coverage_factor: float) -> float:
    """The coverage factor of an expanded uncertainty that is shown: that of the target, or 2 where
    that is 1.
    """
    return coverage_factor if coverage_factor > 1.0 else COVERAGE


def task_uncertainties(
    given: Distances, tile: PairTile, sigma: float = 1.0
) -> tuple[TaskUncertainty, ...]:
    """Standard uncertainties of distances that have names, which are the pairs of a tile.

    `sigma` multiplies all stated uncertainties.
    """
    values = sigma * np.where(tile.is_open, np.nan, tile.uncertainties)
    told = zip(given.names, tile.lengths.tolist(), values.tolist(), given.targets, strict=True)
    return tuple(
        (
            TaskUncertainty(name, length, value, None)
            if target is None
            else TaskUncertainty(
                name, length, value, float(target.stated.at(length)), target.coverage_factor
            )
        )
        for name, length, value, target in told
    )


def is_determined(task: TaskUncertainty) -> bool:
    """Whether the observations determine the task's length."""
    return not math.isnan(task.standard_uncertainty)
