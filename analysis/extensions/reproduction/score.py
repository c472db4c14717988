"""Score of a program: the number of correct digits of certified answers.

An uncertainty or a sum of squares v with the certified value c has -log10(|v - c| / |c|) digits.
Estimates are judged against their own uncertainty, which is what matters of them: the largest error
of balls counts in units of the average U1, that of origins of U2, that of the machine's parameters
of U3, and digits are its negative decadic logarithm. At most 15 are counted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ballplate.simulator.inputs import listing

MOST_DIGITS = 15.0

# What each group of estimates is measured by.
MEASURES = {"machine": "U3", "balls": "U1", "origins": "U2"}
WORDS = {"count": "values", "undetermined": "undetermined"}


@dataclass(frozen=True)
class Score:
    """Digits of one quantity of a problem; NaN where the program gives no answer, `note` then says
    so.

    `part` is "as drawn" or "estimate". Counts have all digits or none.
    """

    problem: str
    part: str
    quantity: str
    digits: float
    note: str = ""


def scores(problem: str, certified: Mapping[str, Any], found: Any) -> list[Score]:
    """Scores of the answers `found`, in the form of `certified`, quantity by quantity."""
    told: list[Score] = []
    for key, part in (("as_drawn", "as drawn"), ("estimate", "estimate")):
        if key not in certified:
            continue
        answers = found.get(key) if isinstance(found, Mapping) else None
        if not isinstance(answers, Mapping):
            told.append(Score(problem, part, "all", math.nan, "no answer"))
            continue
        told += [Score(problem, part, *one) for one in _part(certified[key], answers)]
    return told


def all_right(scores: Sequence[Score]) -> bool:
    """Whether every rank and every count is right and nothing is without an answer."""
    return all(score.digits > 0.0 for score in scores)


def _part(
    certified: Mapping[str, Any], found: Mapping[str, Any]
) -> Iterator[tuple[str, float, str]]:
    if "rank_deficiency" in certified:
        right = found.get("rank_deficiency") == certified["rank_deficiency"]
        note = (
            ""
            if right
            else f"{found.get('rank_deficiency')!r} instead of {certified['rank_deficiency']}"
        )
        yield "rank deficiency", MOST_DIGITS if right else 0.0, note
    if "sum_of_squares" in certified:
        yield _judged(
            "sum of squares",
            relative_digits(found.get("sum_of_squares"), certified["sum_of_squares"]),
        )
    uncertainties = certified["uncertainties"]
    for group, symbol in MEASURES.items():
        if symbol in uncertainties and certified.get(group):
            unit = uncertainties[symbol]["average"]
            yield _group(group, found.get(group), certified[group], unit)
    given = found.get("uncertainties")
    for symbol, own in uncertainties.items():
        other = given.get(symbol) if isinstance(given, Mapping) else None
        yield _uncertainty(symbol, own, other)


def _group(group: str, found: Any, certified: Any, unit: float) -> tuple[str, float, str]:
    """Estimates of one kind; parameters of the machine that the program does not tell, or that are
    none, are named.
    """
    if isinstance(found, Mapping) and isinstance(certified, Mapping):
        for words, names in (
            ("no", set(certified) - set(found)),
            ("unknown", set(found) - set(certified)),
        ):
            if names:
                return group, math.nan, f"{words} {listing(sorted(names))}"
    return _judged(group, absolute_digits(found, certified, unit))


def _judged(quantity: str, digits: float) -> tuple[str, float, str]:
    if math.isnan(digits):
        return quantity, digits, "no answer, or not of this form"
    return quantity, digits, "" if digits > 0.0 else "no digit agrees"


def _uncertainty(symbol: str, certified: Mapping[str, Any], found: Any) -> tuple[str, float, str]:
    if not isinstance(found, Mapping):
        return symbol, math.nan, "no answer"
    for key in ("count", "undetermined"):
        if key not in found:
            return symbol, math.nan, f'no "{key}"'
        if found[key] != certified[key]:
            return symbol, 0.0, f"{found[key]!r} {WORDS[key]} instead of {certified[key]}"
    if certified["maximum"] is None:
        return symbol, MOST_DIGITS, "all undetermined"
    return _judged(
        symbol,
        _least([relative_digits(found.get(k), certified[k]) for k in ("maximum", "average")]),
    )


def relative_digits(found: Any, certified: float) -> float:
    """Digits that a number has in common with a certified one; NaN for what is no number.

    >>> relative_digits(1.001, 1.0), relative_digits(2.0, 2.0), relative_digits("2", 2.0)
    (3.0, 15.0, nan)
    """
    return _digits(_difference(found, certified) / abs(certified)) if certified else math.nan


def absolute_digits(found: Any, certified: Any, unit: float) -> float:
    """Digits of numbers in lists or mappings of one form, of which the worst counts, in units of
    `unit`.

    >>> absolute_digits({"a": [1.0, 2.01]}, {"a": [1.0, 2.0]}, 10.0)
    3.0
    >>> absolute_digits([1.0], [1.0, 2.0], 1.0)
    nan
    """
    if isinstance(certified, Mapping):
        if not isinstance(found, Mapping) or set(found) != set(certified):
            return math.nan
        return _least(
            [absolute_digits(found[key], value, unit) for key, value in certified.items()]
        )
    if isinstance(certified, Sequence):
        if (
            not isinstance(found, Sequence)
            or isinstance(found, str)
            or len(found) != len(certified)
        ):
            return math.nan
        return _least([absolute_digits(a, b, unit) for a, b in zip(found, certified, strict=True)])
    return _digits(_difference(found, certified) / unit)


def _difference(found: Any, certified: float) -> float:
    if isinstance(found, bool) or not isinstance(found, int | float):
        return math.nan
    try:
        return abs(float(found) - certified)
    except OverflowError:
        return math.inf


def _digits(error: float) -> float:
    if math.isnan(error):
        return math.nan
    # Rounded so that 1.001 against 1 has three digits, not 2.9999.
    return round(min(max(-math.log10(error), 0.0), MOST_DIGITS), 3) if error > 0.0 else MOST_DIGITS


def _least(digits: list[float]) -> float:
    return math.nan if any(math.isnan(one) for one in digits) else min(digits, default=MOST_DIGITS)
