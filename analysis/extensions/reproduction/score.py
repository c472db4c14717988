"""Score of a program: the number of correct digits of certified answers.

An uncertainty or a sum of squares v with the certified value c has -log10(|v - c| / |c|) digits.
Estimates have an error relative to their own uncertainty: the largest error of balls in units of
the average U1, of origins of U2, of the machine's parameters of U3, and digits are its negative
decadic logarithm. At most 15 digits count.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ballplate.simulator.inputs import listing

MOST_DIGITS = 15.0

# Units of each group of estimates.
MEASURES = {"machine": "U3", "balls": "U1", "origins": "U2"}
WORDS = {"count": "values", "undetermined": "undetermined"}


@dataclass(frozen=True)
class Score:
    """Digits of one quantity of a problem; NaN without an answer, with a `note`.

    `part` is "as drawn" or "estimate". Counts have all digits or 0.
    """

    problem: str
    part: str
    quantity: str
    digits: float
    note: str = ""


def scores(problem: str, certified: Mapping[str, Any], answered: Any) -> list[Score]:
    """Return scores of a program's answers, in the form of `certified`, quantity by quantity."""
    scored = []
    for key, part in (("as_drawn", "as drawn"), ("estimate", "estimate")):
        if key not in certified:
            continue
        answers = answered.get(key) if isinstance(answered, Mapping) else None
        if not isinstance(answers, Mapping):
            scored.append(Score(problem, part, "all", math.nan, "no answer"))
            continue
        scored += [
            Score(problem, part, *quantity_score)
            for quantity_score in _part(certified[key], answers)
        ]
    return scored


def all_right(scores: Sequence[Score]) -> bool:
    """Return whether every rank and every count is correct and every quantity has an answer."""
    return all(score.digits > 0.0 for score in scores)


def _part(
    certified: Mapping[str, Any], answered: Mapping[str, Any]
) -> Iterator[tuple[str, float, str]]:
    if "rank_deficiency" in certified:
        right = answered.get("rank_deficiency") == certified["rank_deficiency"]
        note = (
            ""
            if right
            else f"{answered.get('rank_deficiency')!r} instead of {certified['rank_deficiency']}"
        )
        yield "rank deficiency", MOST_DIGITS if right else 0.0, note
    if "sum_of_squares" in certified:
        yield _judged(
            "sum of squares",
            relative_digits(answered.get("sum_of_squares"), certified["sum_of_squares"]),
        )
    uncertainties = certified["uncertainties"]
    for group, symbol in MEASURES.items():
        if symbol in uncertainties and certified.get(group):
            unit = uncertainties[symbol]["average"]
            yield _group(group, answered.get(group), certified[group], unit)
    answered_uncertainties = answered.get("uncertainties")
    for symbol, certified_uncertainty in uncertainties.items():
        answer = (
            answered_uncertainties.get(symbol)
            if isinstance(answered_uncertainties, Mapping)
            else None
        )
        yield _uncertainty(symbol, certified_uncertainty, answer)


def _group(group: str, answered: Any, certified: Any, unit: float) -> tuple[str, float, str]:
    """Return the score of estimates of one type; missing or unknown parameters of the machine
    are named.
    """
    if isinstance(answered, Mapping) and isinstance(certified, Mapping):
        for words, names in (
            ("no", set(certified) - set(answered)),
            ("unknown", set(answered) - set(certified)),
        ):
            if names:
                return group, math.nan, f"{words} {listing(sorted(names))}"
    return _judged(group, absolute_digits(answered, certified, unit))


def _judged(quantity: str, digits: float) -> tuple[str, float, str]:
    if math.isnan(digits):
        return quantity, digits, "no answer, or not of this form"
    return quantity, digits, "" if digits > 0.0 else "no digit agrees"


def _uncertainty(
    symbol: str, certified: Mapping[str, Any], answered: Any
) -> tuple[str, float, str]:
    if not isinstance(answered, Mapping):
        return symbol, math.nan, "no answer"
    for key in ("count", "undetermined"):
        if key not in answered:
            return symbol, math.nan, f'no "{key}"'
        if answered[key] != certified[key]:
            return symbol, 0.0, f"{answered[key]!r} {WORDS[key]} instead of {certified[key]}"
    if certified["maximum"] is None:
        return symbol, MOST_DIGITS, "all undetermined"
    return _judged(
        symbol,
        _least([relative_digits(answered.get(k), certified[k]) for k in ("maximum", "average")]),
    )


def relative_digits(answered: Any, certified: float) -> float:
    """Return the digits that a number and a certified one have in common; NaN unless it is a
    number.

    >>> relative_digits(1.001, 1.0), relative_digits(2.0, 2.0), relative_digits("2", 2.0)
    (3.0, 15.0, nan)
    """
    return _digits(_difference(answered, certified) / abs(certified)) if certified else math.nan


def absolute_digits(answered: Any, certified: Any, unit: float) -> float:
    """Return the least number of digits of numbers in lists or mappings of one form, in units of
    `unit`.

    >>> absolute_digits({"a": [1.0, 2.01]}, {"a": [1.0, 2.0]}, 10.0)
    3.0
    >>> absolute_digits([1.0], [1.0, 2.0], 1.0)
    nan
    """
    if isinstance(certified, Mapping):
        if not isinstance(answered, Mapping) or set(answered) != set(certified):
            return math.nan
        return _least(
            [absolute_digits(answered[key], value, unit) for key, value in certified.items()]
        )
    if isinstance(certified, Sequence):
        if (
            not isinstance(answered, Sequence)
            or isinstance(answered, str)
            or len(answered) != len(certified)
        ):
            return math.nan
        return _least(
            [absolute_digits(a, b, unit) for a, b in zip(answered, certified, strict=True)]
        )
    return _digits(_difference(answered, certified) / unit)


def _difference(answered: Any, certified: float) -> float:
    if isinstance(answered, bool) or not isinstance(answered, int | float):
        return math.nan
    try:
        return abs(float(answered) - certified)
    except OverflowError:
        return math.inf


def _digits(error: float) -> float:
    if math.isnan(error):
        return math.nan
    # Rounded so that 1.001 against 1 has three digits, not 2.9999.
    return round(min(max(-math.log10(error), 0.0), MOST_DIGITS), 3) if error > 0.0 else MOST_DIGITS


def _least(digits: list[float]) -> float:
    return math.nan if any(map(math.isnan, digits)) else min(digits, default=MOST_DIGITS)
