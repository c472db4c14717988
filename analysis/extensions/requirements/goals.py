"""Goals of a design, and whether they are met."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from ballplate.presentation import number, percent, shown_unit, uncertainty_words
from ballplate.results import PlannedUncertainty, Prediction
from ballplate.simulator.computing import comparable
from ballplate.simulator.inputs import (
    QuantityError,
    listing,
    parse_positive_angle,
    parse_positive_length,
)
from ballplate.uncertainty import DESCRIPTIONS, QUANTITIES, NamedUncertainty, Quantity

# Goals that are met if all values of a quantity with names are within their targets.
NAMED = {
    "tasks": ("task", "evaluation.tasks"),
    "dimensions": ("dimension", "part"),
}
FORMS = (
    'lengths, tasks, dimensions, or a quantity such as "U6 average 0.3 um" or'
    ' "U2 angles maximum 1 urad"'
)
# Wholes that have values of several units.
MIXED = tuple(symbol for symbol, kind in QUANTITIES.items() if kind.parts)
RATIOS = tuple(
    f"{symbol} {kind.parts['1'][0]}" for symbol, kind in QUANTITIES.items() if "1" in kind.parts
)
SYMBOLS = tuple(symbol for symbol in DESCRIPTIONS if symbol not in (*MIXED, *RATIOS))
PATTERN = re.compile(r"\s*(.+?)\s+(maximum|average)\s+(.+?)\s*", re.DOTALL)


class GoalError(ValueError):
    """A text is no goal, or not one that the experiment can have; the message says what would be
    right.
    """


@dataclass(frozen=True)
class Goal:
    """A goal of a design.

    `lengths`: at least the `share` of the distances between corrected points (U6) within the
    target uncertainty of the file. `tasks` and `dimensions`: every one within its target.
    `quantity`: a
    `statistic` of the quantity `symbol` at most `limit`, in metres or radians.
    """

    kind: Literal["lengths", "tasks", "dimensions", "quantity"] = "lengths"
    share: float = 1.0
    symbol: str = "U6"
    statistic: Literal["maximum", "average"] = "average"
    limit: float = 0.0

    def __str__(self) -> str:
        if self.kind == "lengths":
            share = "all" if self.share == 1.0 else f"{percent(self.share)} of"
            return f"{share} lengths (U6) within the target uncertainty"
        if self.kind in NAMED:
            return f"every {NAMED[self.kind][0]} within its target"
        unit = "µrad" if self.symbol.endswith("angles") else "µm"
        return f"{self.statistic} {self.symbol} at most {1e6 * self.limit:.9g} {unit}"


@dataclass(frozen=True)
class Judgement:
    """Verdict on a goal, the distance from it (smaller is better), and a text.

    `undetermined` counts quantities of the goal that the observations do not determine.
    """

    is_met: bool
    distance: float
    words: str
    undetermined: int


def parse_goal(text: str, share: float | None = None) -> Goal:
    """Read a goal.

    :raises GoalError: it cannot be parsed.

    >>> str(parse_goal("U6 average 0.3 um"))
    'average U6 at most 0.3 µm'
    >>> str(parse_goal("lengths", 0.95))
    '95 % of lengths (U6) within the target uncertainty'
    """
    if text == "lengths" or text in NAMED:
        if share is not None and text in NAMED:
            raise GoalError("a share applies to the goal lengths; leave it out")
        return Goal(text, 1.0 if share is None else share)  # type: ignore[arg-type]
    match = PATTERN.fullmatch(text)
    if match is None:
        raise GoalError(f'"{text}" is not a goal; write {FORMS}')
    symbol, statistic, limit = match.groups()
    if symbol not in SYMBOLS:
        advice = (
            f"give {symbol} lengths or {symbol} angles"
            if symbol in MIXED
            else f"known: {listing(SYMBOLS, 20)}"
        )
        raise GoalError(f'"{symbol}" is not a quantity with a limit; {advice}')
    if share is not None:
        raise GoalError("a share applies to the goal lengths; leave it out")
    try:
        value = (parse_positive_angle if symbol.endswith("angles") else parse_positive_length)(
            limit
        )
    except QuantityError as error:
        raise GoalError(str(error)) from None
    return Goal("quantity", 1.0, symbol, statistic, value)  # type: ignore[arg-type]


def check_goal(goal: Goal, prediction: Prediction | PlannedUncertainty) -> None:
    """Refuse a goal without its subject in the design.

    :raises GoalError: no target, no tasks, or no such quantity.
    """
    symbol = {"lengths": "U6", "quantity": goal.symbol}.get(goal.kind)
    if symbol is not None and symbol not in prediction.quantities:
        raise GoalError(f"the design has no {symbol}; it has {listing(prediction.quantities, 20)}")
    if goal.kind == "lengths" and prediction.quantities["U6"].within_target is None:
        raise GoalError(
            'the file states no target_uncertainty; add it, such as "0.5 um + L/1000000", or give'
            " --target or --goal"
        )
    if goal.kind in NAMED:
        word, key = NAMED[goal.kind]
        if goal.kind not in prediction.quantities:
            raise GoalError(f"the file has no {word}s; add {key}, or give another goal")
        without = [one.name for one in prediction.quantities[goal.kind].named if one.target is None]
        if len(without) == len(prediction.quantities[goal.kind].named) and word == "dimension":
            raise GoalError("the part states no tolerance; add one, or give another goal")
        if without and goal.kind == "tasks":
            raise GoalError(
                f"no target for {listing(without)}; give target_uncertainty to tasks, or to the"
                " file"
            )


def judge(goal: Goal, prediction: Prediction | PlannedUncertainty) -> Judgement:
    """Return the judgement of a goal that `check_goal` accepts."""
    if goal.kind in NAMED:
        return _judge_named(NAMED[goal.kind][0], prediction.quantities[goal.kind].named)
    if goal.kind == "quantity":
        summary = prediction.quantities[goal.symbol]
        value = getattr(summary, goal.statistic)
        is_met = not summary.undetermined and value <= goal.limit
        words = f"{goal.statistic} {goal.symbol} {number(1e6 * value)} {shown_unit(summary.unit)}"
        # A file whose targets are of expanded uncertainties may make one think that this is one.
        words += "" if summary.coverage_factor == 1.0 else " (standard uncertainty)"
        distance = math.inf if math.isnan(value) else value / goal.limit
        return Judgement(
            is_met, distance + summary.undetermined, words + _open(summary), summary.undetermined
        )
    summary = prediction.quantities["U6"]
    share = summary.within_target or 0.0
    average = (
        "" if math.isnan(summary.average) else f", average U6 {number(1e6 * summary.average)} µm"
    )
    # An exact count: the share is a ratio of two whole numbers.
    missing = summary.count - round(share * summary.count)
    is_met = missing <= (1.0 - goal.share) * summary.count * (1.0 + 1e-12)
    by = uncertainty_words(summary.coverage_factor)
    share_words = "all" if not missing else f"{percent(share)} of"
    words = f"{share_words} lengths within the target by the {by}{average}{_open(summary)}"
    return Judgement(is_met, 1.0 - share, words, summary.undetermined)


def _judge_named(word: str, named: Sequence[NamedUncertainty]) -> Judgement:
    judged = [one for one in named if one.target is not None]
    ratios = [one.share_of_target for one in judged]
    undetermined = sum(map(math.isnan, ratios))
    within = sum(ratio <= 1.0 for ratio in ratios)
    words = f"{within} of {len(ratios)} {word}s within their targets"
    if not judged:
        return Judgement(True, 0.0, words, 0)
    words += f" by the {uncertainty_words(judged[0].coverage_factor)}"
    if undetermined:
        words += f", {undetermined} undetermined"
        return Judgement(False, math.inf, words, undetermined)
    worst = int(comparable(ratios).argmax())
    words += (
        f"; the largest share of its target has {judged[worst].name},"
        f" {number(100 * ratios[worst])} %"
    )
    return Judgement(within == len(ratios), ratios[worst], words, 0)


def _open(quantity: Quantity) -> str:
    return (
        f", {quantity.undetermined} of {quantity.count} undetermined"
        if quantity.undetermined
        else ""
    )
