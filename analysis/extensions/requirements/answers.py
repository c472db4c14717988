"""Answers of the search for the requirements of a goal, as text and data."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import Literal

from ballplate.presentation import Data, Result, table_lines
from ballplate.results import Qualification, given_words, qualification_data

from .goals import Goal, Judgement
from .unknowns import UnknownName

Status = Literal["found", "any", "none", "limited", "undetermined", "varied"]


@dataclass(frozen=True)
class Answer:
    """Value that an unknown needs for the goal to be met, the others unchanged.

    `status`: `found`, with the next value, `beside`, insufficient; `any` value tried suffices;
    `none` does, or the largest possible one is too small, `limited`; the rank remains
    `undetermined` with each; or the unknown cannot be `varied`. `words` and `value` (metres, the
    unit of an uncertainty that is not a length, or a number) are the value needed, otherwise the
    nearest, or the last tried; `outcome` is its prediction. `remarks` describe the range, and
    `qualifications` what the outcome takes for granted.
    """

    name: UnknownName
    title: str
    status: Status
    present: str = ""
    grows: bool = False
    words: str = ""
    value: float | None = None
    outcome: str = ""
    beside: str = ""
    remarks: tuple[str, ...] = ()
    qualifications: tuple[Qualification, ...] = ()

    @property
    def is_met(self) -> bool:
        return self.status in ("found", "any")


@dataclass(frozen=True, repr=False)
class Reach(Result):
    """A goal, whether the current design meets it, and the necessary value of each unknown; `limit`
    names what limits the design where some cannot meet the goal. `qualifications` are those of the
    design.
    """

    label: str
    title: str
    goal: Goal
    present: Judgement
    deficiency: int
    answers: tuple[Answer, ...]
    limit: str = ""
    qualifications: tuple[Qualification, ...] = ()

    def headline(self) -> str:
        return self.present.words + given_words(self.qualifications)

    def lines(self) -> list[str]:
        """The goal, whether the design meets it, and a row for each unknown."""
        now = "met" if self.present.is_met else "not met"
        lines = [
            self.heading,
            f"goal: {self.goal}",
            f"as drawn: {now}; {self.headline()}",
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
        notes = [self.limit] if self.limit else []
        for answer in self.answers:
            notes += [f"{answer.name}: {answer.beside}"] if answer.beside else []
            notes += [f"{answer.name}: {remark}" for remark in answer.remarks]
        # A line for each condition: with other values only its figures differ.
        texts: dict[str, str] = {}
        of_answers = (answer.qualifications for answer in self.answers)
        for each in chain(self.qualifications, *of_answers):
            texts.setdefault(each.given, each.text)
        notes += texts.values()
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
            "limit": self.limit or None,
            "qualifications": qualification_data(self.qualifications),
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
        "limit": answer.words if answer.status in ("none", "limited") else None,
        "outcome": answer.outcome or None,
        "next": answer.beside or None,
        "remarks": list(answer.remarks),
        "qualifications": qualification_data(answer.qualifications),
    }


def _needed(answer: Answer) -> str:
    if answer.status == "found":
        return f"at {'least' if answer.grows else 'most'} {answer.words}"
    if answer.status == "any":
        return f"any, even {answer.words}"
    others = {"varied": "cannot be varied", "limited": f"more than {answer.words}"}
    return others.get(answer.status, "no value does")


def _outcome(answer: Answer) -> str:
    outcome = answer.outcome + given_words(answer.qualifications)
    if answer.status == "none":
        best = "best value tried," if answer.name == "size" else "even"
        return f"{best} {answer.words}: {outcome}"
    if answer.status == "limited":
        return f"the largest possible, {answer.words}: {outcome}"
    return outcome
