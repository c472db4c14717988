"""Standard uncertainties of measuring tasks: lengths between two points."""

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
    """A measuring task: its length, standard uncertainty and target, in metres.

    The standard uncertainty is NaN if undetermined; `target`, if any, is compared with
    `coverage_factor` times the standard uncertainty.
    """

    name: str
    length: float
    standard_uncertainty: float
    target: float | None
    coverage_factor: float = 1.0

    @property
    def expanded_uncertainty(self) -> float:
        """Expanded uncertainty with the target's coverage factor, or 2 if that is 1."""
        return self.expansion * self.standard_uncertainty

    @property
    def expansion(self) -> float:
        """Coverage factor of the expanded uncertainty."""
        return expansion(self.coverage_factor)

    @property
    def is_within(self) -> bool | None:
        """Whether the uncertainty is within its target; None without target."""
        return (
            None
            if self.target is None
            else self.coverage_factor * self.standard_uncertainty <= self.target
        )


def expansion(coverage_factor: float) -> float:
    """Return the coverage factor of printed expanded uncertainties: the target's, or 2 if that is
    1.
    """
    return coverage_factor if coverage_factor > 1.0 else COVERAGE


def task_uncertainties(
    distances: Distances, tile: PairTile, sigma: float = 1.0
) -> tuple[TaskUncertainty, ...]:
    """Return standard uncertainties of named distances, which are the pairs of a tile.

    `sigma` multiplies all stated uncertainties.
    """
    values = sigma * np.where(tile.is_open, np.nan, tile.uncertainties)
    targets = distances.targets or (None,) * len(distances.names)
    rows = zip(distances.names, tile.lengths.tolist(), values.tolist(), targets, strict=True)
    return tuple(
        (
            TaskUncertainty(name, length, value, None)
            if target is None
            else TaskUncertainty(
                name, length, value, float(target.stated.at(length)), target.coverage_factor
            )
        )
        for name, length, value, target in rows
    )


def is_determined(task: TaskUncertainty) -> bool:
    """Return whether the observations determine the task's length."""
    return not math.isnan(task.standard_uncertainty)
