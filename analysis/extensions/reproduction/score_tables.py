"""Scores of certified problems as text and as plain data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ballplate.presentation import Data, aligned

from .certified_problems import CertifiedProblem
from .score import Score

QUANTITIES = (
    "rank deficiency",
    "sum of squares",
    "machine",
    "balls",
    "origins",
    "U1",
    "U2",
    "U3",
    "U4",
    "U5",
    "U6",
)
HEADS = ("rank", "S^2", *QUANTITIES[2:])


def score_lines(problems: Sequence[CertifiedProblem], scores: Sequence[Score]) -> list[str]:
    """Return one line per part of a problem, with the digits of every quantity, and notes on
    errors.
    """
    rows = [["problem", "", *HEADS]]
    for problem in problems:
        for part in ("as drawn", "estimate"):
            by_quantity = {
                score.quantity: score
                for score in scores
                if (score.problem, score.part) == (problem.name, part)
            }
            if by_quantity:
                cells = [_cell(by_quantity.get(quantity)) for quantity in QUANTITIES]
                rows.append([problem.name, part, *cells])
    notes = [
        f"{score.problem}, {score.part}: {score.quantity}: {score.note}"
        for score in scores
        if not score.digits > 0.0 and score.note
    ]
    return [
        "digits that agree with certified answers, at most 15",
        "",
        *aligned(rows, [False, False, *(True for _ in HEADS)]),
        *(["", *notes] if notes else []),
    ]


def _cell(score: Score | None) -> str:
    if score is None:
        return ""
    if math.isnan(score.digits):
        return "-"
    if score.quantity == "rank deficiency":
        return "right" if score.digits else "wrong"
    return f"{score.digits:.1f}"


def score_data(scores: Sequence[Score], results: dict[str, Any]) -> Data:
    """Return scores, with their answers."""
    return {"scores": scores, "problems": results}
