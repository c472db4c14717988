"""Progress of a campaign and its next position, in a few lines."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from ballplate.extensions.requirements.goals import Goal, Judgement
from ballplate.presentation import Data, MainTable, Result, number
from ballplate.results import (
    Fit,
    PlannedUncertainty,
    Qualification,
    freedom_words,
    given_words,
    qualification_data,
)
from ballplate.simulator.computing import comparable
from ballplate.simulator.inputs import listing, number_of
from ballplate.simulator.readings import ObservedReadings
from ballplate.uncertainty import can_stretch


@dataclass(frozen=True)
class Offered:
    """A possible next position, with its number of `readings` and its judgement."""

    name: str
    readings: int
    then: Judgement
    planned: PlannedUncertainty

    @property
    def average(self) -> float:
        """Average U6 in metres; NaN without a determined length."""
        return (
            self.planned.quantities["U6"].average if "U6" in self.planned.quantities else math.nan
        )

    @property
    def order(self) -> tuple[int, int, float]:
        """The better, the smaller: what stays undetermined, then the goal, or U6 on average."""
        aim = self.average if math.isfinite(self.average) else self.then.distance
        aim = aim if math.isfinite(aim) else 1e300
        return self.then.undetermined, self.planned.deficiency, float(comparable(aim))


@dataclass(frozen=True, repr=False)
class NextStep(Result):
    """Judgement of the positions `read`, in their order, and of possible next ones.

    `missing` counts planned readings that positions lack. `fit` is None if nothing can be estimated
    yet, for the reason `why`. Uncertainties are those stated times `sigma`, with upper limit
    `bound`; `now` judges the goal, `is_sure` also at the bound. `suspected` are findings of the
    residuals as text. `offered` are possible next positions, the best first; empty once the target
    is met. `qualifications` are those of the positions read.
    """

    label: str
    title: str
    goal: Goal
    read: tuple[str, ...]
    missing: Mapping[str, int]
    observed: ObservedReadings
    fit: Fit | None
    why: str = ""
    sigma: float = 1.0
    bound: float = math.inf
    now: Judgement | None = None
    is_sure: bool = False
    suspected: tuple[str, ...] = ()
    offered: tuple[Offered, ...] = field(default=())
    qualifications: tuple[Qualification, ...] = ()

    @property
    def is_met(self) -> bool:
        """True if the goal is met, also at the upper limit of sigma, without flagged readings."""
        return self.now is not None and self.now.is_met and self.is_sure and not self.suspected

    @property
    def next(self) -> Offered | None:
        """The best next position; None if the target is met, or all are read."""
        return self.offered[0] if self.offered else None

    def headline(self) -> str:
        return self._verdict()

    def lines(self) -> list[str]:
        """Return the verdict, then its grounds."""
        count, planned = len(self.read), self.next
        lines = [
            f"{number_of(count, 'position')} read, last {self.read[-1]}; {self._answer()}",
            *self._missing(),
            *self._sigma_lines(),
        ]
        if planned is not None:
            lines.append(f"with {planned.name}: {planned.then.words}")
        return lines

    def _missing(self) -> list[str]:
        """Return the numbers of planned readings that positions lack."""
        if not self.missing:
            return []
        named = listing(f"{name} {count}" for name, count in self.missing.items())
        return [f"readings missing in positions read ({sum(self.missing.values())}): {named}"]

    def _sigma_lines(self) -> list[str]:
        if self.fit is None or self.now is None:
            return [f"no estimate is possible yet ({self.why})"]
        freedom = self.fit.sum_freedom
        if freedom <= 0:
            sigma_text = "sigma unknown: no redundant readings"
        else:
            sigma = math.sqrt(self.fit.sum_of_squares / freedom)
            sigma_text = f"sigma {number(sigma, 3)} of {freedom_words(freedom)}"
        shown = [f"suspected: {words}" for words in self.suspected] or ["nothing suspected"]
        lengths = self.fit.quantities.get("U6")
        reached = [self.now.words, *([] if lengths is None else self._maximum())]
        qualified = (each.text for each in self.qualifications)
        return [sigma_text, *shown, "; ".join(reached), *qualified]

    def _maximum(self) -> list[str]:
        """Return the largest U6, unless the goal states it."""
        assert self.fit is not None
        lengths = self.fit.quantities["U6"]
        if lengths.undetermined:
            part = "all" if lengths.undetermined == lengths.count else f"{lengths.undetermined} of"
            return [f"U6 undetermined of {part} {lengths.count} lengths"]
        largest = lengths.maximum * self.sigma / self.fit.sigma
        return [f"largest U6 {number(1e6 * largest)} µm"]

    def _verdict(self) -> str:
        then = "" if self.next is None else f", then {self.next.then.words}"
        return self._answer() + then

    def _answer(self) -> str:
        if self.is_met:
            assert self.fit is not None
            by_itself = not can_stretch(self.fit.design, self.fit.solution.state)
            limitation = " by the machine's own scales: not traceable" if by_itself else ""
            return f"target met{limitation}{given_words(self.qualifications)}: stop"
        reason = self._reason()
        if self.next is None:
            return f"{reason}; no position is left to read"
        addition = self.next
        more = "rest of " if addition.name in self.read else ""
        return f"{reason}; next: {more}{addition.name} ({number_of(addition.readings, 'reading')})"

    def _reason(self) -> str:
        if self.now is None or not self.now.is_met:
            return "target not met"
        if self.suspected:
            return "target met, but readings are flagged: inspect them first"
        if math.isinf(self.bound):
            return "target met if the repeatability is as stated: no evidence yet"
        return (
            "target met if the repeatability is as stated: with so few degrees of freedom it may be"
            f" {number(self.bound, 2)} times as large"
        )

    @property
    def notes(self) -> tuple[str, ...]:
        cautions = () if self.fit is None else (self.fit.untested,)
        doubts = (
            f"warning: {caution}" for caution in (*self.observed.doubts, *cautions) if caution
        )
        return (*self.observed.table_notes, *doubts)

    def data(self) -> Data:
        fit = self.fit
        lengths = None if fit is None else fit.quantities.get("U6")
        times = 1.0 if fit is None else self.sigma / fit.sigma
        return {
            **self.named,
            "goal": str(self.goal),
            "read": self.read,
            "missing": dict(self.missing),
            "target_met": self.is_met,
            "verdict": self._verdict(),
            "why_no_estimate": self.why or None,
            "sigma": fit and self.sigma,
            "sigma_bound": self.bound,
            "degrees_of_freedom": fit and fit.sum_freedom,
            "suspected": self.suspected,
            "U6_average": lengths and times * lengths.average,
            "U6_maximum": lengths and times * lengths.maximum,
            "goal_met": self.now is not None and self.now.is_met,
            "goal_met_at_bound": self.is_sure,
            "qualifications": qualification_data(self.qualifications),
            "next": self.next and self.next.name,
            "offered": self.rows(),
            "remarks": self.notes,
        }

    def columns(self) -> MainTable:
        """One row for each position that can be read next, the best first."""
        columns = {
            "position": "name",
            "readings": "readings",
            "U6 average, µm": "average",
            "undetermined": "then.undetermined",
            "target met": "then.is_met",
        }
        return columns, self.offered
