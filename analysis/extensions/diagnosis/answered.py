"""What the readings of a fit say of each assumption, as text and data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.presentation import (
    SHOWN,
    Data,
    chance_words,
    given,
    number,
    picked,
    table_lines,
)
from ballplate.results import ParameterEstimate
from ballplate.simulator.inputs import listing
from ballplate.simulator.machines import Unit

from .score_tests import LEVEL


@dataclass(frozen=True)
class Contradicted:
    """A cause that the readings show against what is `assumed`, with its `chance` if it is absent.

    `others` are causes that the readings cannot tell apart from it. A fit that allows for the cause
    gives its `sizes`, the residuals in stated uncertainties, `times`, and the average and the
    maximum of U6 in metres, `lengths`. It `may_be_model` if further terms of the error model are
    among the others.
    """

    assumed: str
    cause: str
    cure: str
    chance: float
    others: tuple[str, ...] = ()
    sizes: tuple[ParameterEstimate, ...] = ()
    times: float = np.nan
    lengths: tuple[float, float] | None = None
    may_be_model: bool = False

    @property
    def verdict(self) -> str:
        """The cause, with those that cannot be told apart from it."""
        return ", or ".join([self.cause, *self.others])

    @property
    def words(self) -> str:
        """The verdict with its chance, size, effect on U6, and cure."""
        facts = [f"chance {chance_words(self.chance)}", *map(_size, self.sizes)]
        if not np.isnan(self.times):
            facts.append(f"then sigma {number(self.times, 3)}")
        if self.lengths is not None:
            facts.append(f"U6 {number(1e6 * self.lengths[0], 3)} µm")
        return f"{self.verdict} ({', '.join(facts)}); {self.cure}"


@dataclass(frozen=True)
class AssumptionAnswer:
    """The smallest chance of so many `tests` of an assumption, times their number, with all
    contradictions removed; NaN without a test.

    Every tested cause of the size `noticed_from`, in `unit`, is noticed with 80 % probability, NaN
    if it has no size. Readings say nothing of the causes `not_seen`.
    """

    assumed: str
    chance: float
    tests: int
    noticed_from: float
    unit: Unit
    not_seen: tuple[str, ...]


@dataclass(frozen=True)
class Answers:
    """Contradictions, the most significant one first, and the answers to all assumptions."""

    contradicted: tuple[Contradicted, ...]
    asked: tuple[AssumptionAnswer, ...]

    @property
    def verdict(self) -> tuple[str, ...]:
        """Causes that the readings show."""
        return tuple(each.verdict for each in self.contradicted)

    @property
    def explains(self) -> bool:
        """Whether residuals need no further terms of the error model."""
        return bool(self.contradicted) and not any(each.may_be_model for each in self.contradicted)

    def lines(self) -> list[str]:
        lines = [f"contradicted: {each.words}" for each in self.contradicted]
        columns = {
            "assumption tested": "assumed",
            "p-value": ("chance", chance_words),
            "smallest effect that would show": [
                _amount(each.noticed_from, each.unit) for each in self.asked
            ],
            "cannot be tested": [listing(each.not_seen, 2) for each in self.asked],
        }
        return [*lines, *table_lines(columns, self.asked)]

    def to_dict(self) -> Data:
        return {
            "level": LEVEL,
            "contradicted": [
                {
                    **picked(each, "assumed", "cause", "others", "chance", "cure", "words"),
                    "parameters": [
                        picked(size, "name", "value", "standard_uncertainty", "unit")
                        for size in each.sizes
                    ],
                    **given(
                        sigma=each.times,
                        U6=each.lengths
                        and dict(zip(("average", "maximum"), each.lengths, strict=True)),
                    ),
                }
                for each in self.contradicted
            ],
            "asked": [{**vars(each), "not_seen": list(each.not_seen)} for each in self.asked],
        }


def _size(size: ParameterEstimate) -> str:
    value, u = 1e6 * size.value, 1e6 * size.standard_uncertainty
    return f"{size.name} {number(value, 3)} ± {number(u, 2)} {SHOWN[size.unit]}"


def _amount(value: float, unit: Unit) -> str:
    return "-" if np.isnan(value) else f"{number(1e6 * value, 2)} {SHOWN[unit]}"
