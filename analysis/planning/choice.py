"""Choice of positions and certificates, and the gain of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from ballplate.simulator.experiment.model import Candidate, Experiment, Pool
from ballplate.simulator.inputs.messages import ExperimentError

from ..results.prediction import Prediction
from .constraints import Budget, Spent
from .criteria import CriterionName
from .orders import LEAST_CHANGE_OVER, ReadingOrder
from .schedule import Completion
from .set_ups import REST


class DriftInOrders(Protocol):
    """What a drift does in each order of a campaign, and the order that was chosen."""

    @property
    def chosen(self) -> ReadingOrder: ...

    def lines(self, campaign: Any) -> list[str]: ...

    def data(self) -> dict[str, Any]: ...


class OpenPool(Protocol):
    """What all candidates together leave undetermined, and what would determine it, in words."""

    @property
    def words(self) -> str: ...

    @property
    def remedy(self) -> str: ...

    def to_dict(self) -> dict[str, Any]: ...

    def refusing(self, error: ExperimentError) -> ExperimentError: ...


@dataclass(frozen=True)
class Gain:
    """What a candidate gains: the criterion `without` it and `with_` it, infinite where something
    is undetermined.
    """

    candidate: Candidate
    without: float
    with_: float

    @property
    def relative(self) -> float:
        """How much larger the criterion is without it."""
        return self.without / self.with_ - 1.0


@dataclass(frozen=True)
class CurvePoint:
    """The best selection found for a budget; `bound` is NaN where there is none."""

    budget: Budget
    spent: Spent
    chosen: tuple[Candidate, ...]
    value: float
    bound: float


@dataclass(frozen=True, repr=False)
class Selection:
    """A selection and what is to be said of it; values in metres, those of `condition` ratios.

    `chosen` in the order of the pool, `done` those of them that have been read already, in part or
    in full, in the order of reading. Of `chosen`, that which is `completed` has all its readings,
    those done and those to come. `interrupted` are all that were read in part, and `left_open`
    counts the directions of their own poses and lengths that stay undetermined where they are left
    so; nothing else depends on these. What has been read and is `ignored` is no part of it. `value`
    is infinite where the selection leaves something undetermined; `bound` is what no selection can
    do better than, NaN where there is none. `drawn` is the criterion of the positions of the
    experiment itself, or of an earlier choice, whether these keep to the limits or not, told as
    `drawn_words`; None without any. `prediction` judges what is chosen in full, in this `order`.
    `orders` tell what a drift does in each order, where that was asked. `names` are the short
    names of positions whose names the pool composed. `gap` is what the whole pool leaves
    undetermined, None where nothing.
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
    gap: OpenPool | None = None

    def title_of(self, candidate: Candidate) -> str:
        """The name of a candidate, after its short name if it has one."""
        prefixes, name = "", candidate.name
        if name.startswith(REST):
            prefixes, name = REST, name.removeprefix(REST)
        short = self.names.get(name, name)
        return candidate.name if short == name else f"{prefixes}{short}, {name}"

    @property
    def efficiency(self) -> float:
        """Bound over value: the selection is at most this far from the best possible."""
        return self.bound / self.value

    @property
    def drawn_is_within(self) -> bool:
        """Whether what it is compared with keeps to the budget; then the choice is never worse."""
        spent, budget = self.drawn_spent, self.budget
        return spent is None or spent.is_within(budget)

    @property
    def is_determined(self) -> bool:
        return bool(np.isfinite(self.value))
