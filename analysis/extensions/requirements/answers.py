"""Answers of the search for the requirements of a goal, as text and data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from ballplate.presentation import Data, Result, table_lines

from .goals import Goal, Judgement
from .unknowns import UnknownName

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class Answer:
    """Value that an unknown needs for the goal to be met, the others unchanged.

    `status`: `found`, with the next value, `beside`, insufficient; `any` value tried suffices;
    `none` does; the rank remains `undetermined` with each; or the unknown cannot be `varied`.
    `words` and `value` (metres, the unit of an uncertainty that is not a length, or a number)
    are the value needed, otherwise the nearest, or the last tried; `outcome` is its prediction.
    `remarks` describe the range.
    """

    name: UnknownName
    title: str
    status: Literal["found", "any", "none", "undetermined", "varied"]
    present: str = ""
    grows: bool = False
    words: str = ""
    value: float | None = None
    outcome: str = ""
    beside: str = ""
    remarks: tuple[str, ...] = ()

    @property
    def is_met(self) -> bool:
        return self.status in ("found", "any")


@dataclass(frozen=True, repr=False)
class Reach(Result):
    """A goal, whether the current design meets it, and the necessary value of each unknown."""

    label: str
    title: str
    goal: Goal
    present: Judgement
    deficiency: int
    answers: tuple[Answer, ...]

    def headline(self) -> str:
        return self.present.words

    def lines(self) -> list[str]:
        """The goal, whether the design meets it, and a row for each unknown."""
        now = "met" if self.present.is_met else "not met"
        lines = [
            self.heading,
            f"goal: {self.goal}",
            f"as drawn: {now}; {self.present.words}",
        ]
        if self.present.undetermined:
            lines.append(
                f"rank deficiency {self.deficiency}: repair the design first; ballplate check lists"
                " the undetermined directions"
            )
        columns = {
            "changed alone": "title",
            "as drawn": "present",
            "needed": _needed,
            "result": _outcome,
        }
        lines += ["", *table_lines(columns, self.answers)]
        notes = []
        for answer in self.answers:
            notes += [f"{answer.name}: {answer.beside}"] if answer.beside else []
            notes += [f"{answer.name}: {remark}" for remark in answer.remarks]
        return lines + ["", *notes] if notes else lines

    def data(self) -> Data:
        """The same as plain data, values in metres or as numbers."""
        goal = self.goal
        goal_data: Data = {"kind": goal.kind}
        if goal.kind == "lengths":
            goal_data["share"] = goal.share
        if goal.kind == "quantity":
            goal_data |= {"symbol": goal.symbol, "statistic": goal.statistic, "limit": goal.limit}
        return {
            **self.named,
            "goal": goal_data,
            "is_met": self.present.is_met,
            "as_drawn": self.present.words,
            "rank_deficiency": self.deficiency,
            "undetermined": self.present.undetermined,
            "answers": {answer.name: _answer_data(answer) for answer in self.answers},
        }

    def rows(self) -> list[Data]:
        """One row for each unknown."""
        return [{"unknown": answer.name, **_answer_data(answer)} for answer in self.answers]


def _answer_data(answer: Answer) -> Data:
    return {
        "status": {"varied": "cannot be varied"}.get(answer.status, answer.status),
        "as_drawn": answer.present or None,
        "needed": answer.words if answer.is_met else None,
        "needed_value": answer.value if answer.is_met else None,
        "limit": answer.words if answer.status == "none" else None,
        "outcome": answer.outcome or None,
        "next": answer.beside or None,
        "remarks": list(answer.remarks),
    }


def _needed(answer: Answer) -> str:
    if answer.status == "found":
        return f"at {'least' if answer.grows else 'most'} {answer.words}"
    if answer.status == "any":
        return f"any, even {answer.words}"
    return "cannot be varied" if answer.status == "varied" else "no value does"


def _outcome(answer: Answer) -> str:
    if answer.status == "none":
        return (
            f"even {answer.words}: {answer.outcome}"
            if answer.name != "size"
            else f"best value tried, {answer.words}: {answer.outcome}"
        )
    return answer.outcome
