"""Scores of answers to certified problems, as a result."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ballplate.designs import shipped
from ballplate.presentation import Data, Result
from ballplate.simulator.computing import Report, counted, unreported
from ballplate.simulator.inputs import number_of

from .certified_answers import answers
from .certified_problems import CertifiedProblem, certified_problems, read_results
from .score import Score, all_right, scores
from .score_tables import score_data, score_lines


@dataclass(frozen=True, repr=False)
class CertifiedScores(Result):
    """Digits of the `answers`, by problem, that agree with certified ones."""

    problems: tuple[CertifiedProblem, ...]
    answers: dict[str, Any]
    scores: tuple[Score, ...]

    @property
    def label(self) -> str:
        return "certified"

    @property
    def title(self) -> str:
        return "problems with certified answers"

    @property
    def is_right(self) -> bool:
        """Return whether every rank and every count is correct and every quantity has an answer."""
        return all_right(self.scores)

    def headline(self) -> str:
        count = len(self.problems)
        right = "all right" if self.is_right else "not all right"
        return f"{number_of(count, 'problem')}, {right}"

    def lines(self) -> list[str]:
        return score_lines(self.problems, self.scores)

    def data(self) -> Data:
        return score_data(self.scores, self.answers)

    def rows(self) -> list[Data]:
        """Return one row per quantity of each problem."""
        return [dict(score) for score in self.to_dict()["scores"]]


def score_certified(
    names: Iterable[str] = (),
    results: Path | None = None,
    folder: Path | None = None,
    report: Report = unreported,
) -> CertifiedScores:
    """Solve problems with certified answers, by default all, or score the answers in a JSON file.

    :raises ExperimentError: a file or a problem is missing or has errors.
    """
    problems = certified_problems(folder or shipped("certified"), list(names))
    if results is not None:
        answered = read_results(results, problems)
    else:
        every = counted(problems, "problems", len(problems), report)
        answered = {problem.name: answers(problem) for problem in every}
    scored = tuple(
        score
        for problem in problems
        for score in scores(problem.name, problem.answers, answered.get(problem.name))
    )
    return CertifiedScores(tuple(problems), answered, scored)
