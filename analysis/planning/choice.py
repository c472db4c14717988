"""Selections of positions and certificates, with the effect of each candidate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from ballplate.presentation.formatting import Data
from ballplate.simulator.experiment.model import Candidate, Experiment, Pool

from ..results.prediction import Prediction
from .constraints import Budget, Spent
from .criteria import CriterionName
from .orders import LEAST_CHANGE_OVER, ReadingOrder
from .schedule import Completion
from .set_ups import REST


class DriftInOrders(Protocol):
    """Effect of drift in each order of a campaign, and the chosen order."""

    @property
    def chosen(self) -> ReadingOrder: ...

    def lines(self, campaign: Any) -> list[str]: ...

    def data(self) -> Data: ...


@dataclass(frozen=True)
class Gain:
    """Effect of a candidate: the criterion `without` it and `with_` it, infinite if deficient."""

    candidate: Candidate
    without: float
    with_: float

    @property
    def relative(self) -> float:
        """Relative increase of the criterion without the candidate."""
        return self.without / self.with_ - 1.0


@dataclass(frozen=True)
class CurvePoint:
    """The best selection found for a limit of time; `bound` may be NaN (missing)."""

    budget: Budget
    spent: Spent
    chosen: tuple[Candidate, ...]
    value: float
    bound: float


@dataclass(frozen=True, repr=False)
class Selection:
    """A selection with its evaluation; values in metres, those of `condition` ratios.

    `chosen` follows the order of the pool, `done` (read already, in part or in full) the order of
    reading. `completed` has all its readings, past and future. `interrupted` positions were read
    in part; `left_open` counts the directions of their own poses and lengths that remain
    undetermined, on which no other parameter depends. `ignored` readings are excluded. `value` is
    infinite if the selection is deficient; `bound` is the lower bound of all selections, NaN if
    missing. `drawn` is the criterion of the experiment's own positions, or of an earlier choice,
    within the limits or not, described by `drawn_words`. `prediction` evaluates the full choice in
    this `order`. `orders` give the effect of drift in each order, if requested. `names` are short
    names of composed positions.
    """

    experiment: Experiment
    pool: Pool
    criterion: CriterionName
    unit: str
    excluded: int
    budget: Budget
    chosen: tuple[Candidate, ...]
    done: tuple[Candidate, ...]
    spent: Spent
    value: float
    bound: float
    drawn: float | None
    drawn_words: str
    drawn_spent: Spent | None
    target: float | None
    gains: tuple[Gain, ...]
    left_out: tuple[Gain, ...]
    prediction: Prediction
    curve: tuple[CurvePoint, ...] = ()
    completed: Completion | None = None
    interrupted: tuple[Candidate, ...] = ()
    left_open: int = 0
    ignored: tuple[Candidate, ...] = ()
    order: ReadingOrder = LEAST_CHANGE_OVER
    orders: DriftInOrders | None = None
    names: Mapping[str, str] = field(default_factory=dict)

    def title_of(self, candidate: Candidate) -> str:
        """The name of a candidate, after its short name if it has one."""
        prefix, name = "", candidate.name
        if name.startswith(REST):
            prefix, name = REST, name.removeprefix(REST)
        short = self.names.get(name, name)
        return candidate.name if short == name else f"{prefix}{short}, {name}"

    @property
    def efficiency(self) -> float:
        """Bound over value: the selection is at most this far from the best possible."""
        return self.bound / self.value

    @property
    def drawn_is_within(self) -> bool:
        """True if the reference selection is within the limit; then the choice is never worse."""
        spent, budget = self.drawn_spent, self.budget
        return spent is None or spent.is_within(budget)

    @property
    def is_determined(self) -> bool:
        return bool(np.isfinite(self.value))
