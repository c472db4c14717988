"""Suspected causes of a fit's residuals: observations, events, the scatter of some readings, or
the model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.machines.protocol import Array, Integers, Unit

from .bias_patterns import Patterns
from .scatter import Scatter


@dataclass(frozen=True)
class Suspect:
    """A cause that the residuals show: its `columns` (q,) among `patterns`, their sizes and
    standard uncertainties.

    `values` (q,), in metres, radians or ratios, are estimated together with the other suspects'.
    `statistic` is that of a normal variable of the same chance, which exceeded `limit` when the
    cause was found. `alternatives` are patterns of causes that the readings cannot tell from it,
    and `of_model` errors of the model that they cannot; `first` and `last` are readings that a slip
    may have come before, -1 of other causes. `of_exact`: it is of values that are stated as exact.
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
        """Place of the most significant direction."""
        return int(np.argmax(np.abs(self.values) / self.standard_uncertainties))

    @property
    def pattern(self) -> int:
        """The most significant direction among the patterns."""
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
    """Readings of one position or with one probe that scatter `times` as much as the others."""

    design: Design
    of: Scatter
    times: float
    statistic: float
    limit: float


@dataclass(frozen=True)
class Unexplained:
    """Residuals that no single gross error explains; `words` tell the smooth error that does best,
    empty without one.

    They are `times` as large as the stated uncertainties make them, which is `too_large` if these
    do not explain it.
    """

    words: str
    times: float
    too_large: bool
    statistic: float
    limit: float


@dataclass(frozen=True)
class Refit:
    """A mistake in the experiment file that an estimate without it shows: one of `causes`, in
    words, which the readings do not distinguish.

    Residuals are `times` as large as stated without it, `before` with it. `kind` is offsets or
    arrangement.
    """

    kind: str
    causes: tuple[str, ...]
    cure: str
    before: float
    times: float
    statistic: float
    limit: float


@dataclass(frozen=True)
class Diagnosis:
    """What the residuals show: mistakes, readings that scatter more, or that no single gross error
    explains them.

    Readings may scatter more beside mistakes, or beside what no single gross error explains. With a
    `refit` all else is what that leaves.
    """

    suspects: tuple[Suspect, ...] = ()
    scatter: MoreScatter | None = None
    unexplained: Unexplained | None = None
    refit: Refit | None = None

    def __bool__(self) -> bool:
        return bool(self.suspects or self.scatter or self.unexplained or self.refit)
