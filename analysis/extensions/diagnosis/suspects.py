"""Causes of a fit's residuals: observations, events, noise of some readings, or the model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.design import Design
from ballplate.simulator.machines import Array, Integers, Unit

from .bias_patterns import Patterns
from .scatter import Scatter


@dataclass(frozen=True)
class Suspect:
    """A cause that the residuals show: its `columns` (q,) among `patterns`, with sizes and
    uncertainties.

    `values` (q,), in metres, radians or ratios, are estimated together with those of other
    suspects. `statistic` is that of a normal variable of the same p-value, which exceeded `limit`.
    `alternatives` are patterns of indistinguishable causes, and `of_model` indistinguishable errors
    of the model. A slip came between the readings `first` and `last`, -1 of other causes.
    `of_exact`: the values are stated as exact.
    """

    patterns: Patterns
    columns: Integers
    values: Array
    standard_uncertainties: Array
    statistic: float
    limit: float
    alternatives: tuple[tuple[int, ...], ...] = ()
    of_model: tuple[str, ...] = ()
    first: int = -1
    last: int = -1
    of_exact: bool = False

    @property
    def largest(self) -> int:
        """Index of the most significant direction."""
        return int(np.argmax(np.abs(self.values) / self.standard_uncertainties))

    @property
    def pattern(self) -> int:
        """Pattern of the most significant direction."""
        return int(self.columns[self.largest])

    @property
    def value(self) -> float:
        return float(self.values[self.largest])

    @property
    def standard_uncertainty(self) -> float:
        return float(self.standard_uncertainties[self.largest])

    @property
    def unit(self) -> Unit:
        return self.patterns.unit(self.pattern)


@dataclass(frozen=True)
class MoreScatter:
    """Readings of one position or with one probe with `times` the noise of the others."""

    design: Design
    of: Scatter
    times: float
    statistic: float
    limit: float


@dataclass(frozen=True)
class Unexplained:
    """Residuals that no gross error explains; `words` name the best smooth error, empty without
    one.

    They are `times` as large as stated, which is `too_large` if significant.
    """

    words: str
    times: float
    too_large: bool
    statistic: float
    limit: float


@dataclass(frozen=True)
class Refit:
    """An error in the experiment file that a fit without it reveals: one of indistinguishable
    `causes`.

    Residuals are `times` as large as stated without it, `before` with it.
    """

    causes: tuple[str, ...]
    cure: str
    before: float
    times: float
    statistic: float
    limit: float


@dataclass(frozen=True)
class Diagnosis:
    """Causes of the residuals: gross errors, readings with more noise, or an unexplained remainder.

    With a `refit`, the other causes are those of the residuals without it.
    """

    suspects: tuple[Suspect, ...] = ()
    scatter: MoreScatter | None = None
    unexplained: Unexplained | None = None
    refit: Refit | None = None

    def __bool__(self) -> bool:
        return bool(self.suspects or self.scatter or self.unexplained or self.refit)
