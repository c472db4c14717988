"""Answer of a sweep: the cases that meet the target, and the cheapest of these."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.presentation import number, percent
from ballplate.simulator.computing import comparable
from ballplate.simulator.design import Flags
from ballplate.simulator.inputs import listing, number_of
from ballplate.simulator.machines import Array, Integers
from ballplate.uncertainty import RECORDED
from numpy.typing import NDArray

from .cases import SweepCases, column_unit

# Cases in the table of the best.
LISTED = 8

OBSERVATIONS = "observations"
WITHIN = "U6_within_target"

# Quantities to judge cases by: the average of the first that is recorded.
PREFERRED = ("U6", "U4", "U5", "U1", "U3_lengths", "U2_lengths", "U3", "U2")
CRITERIA = (*PREFERRED, *(symbol for symbol in RECORDED if symbol not in PREFERRED))


@dataclass(frozen=True, eq=False)
class SweepAnswer:
    """Sentences, and the rows of the best cases, best first; `case` is the number of the best.

    `is_good` unless no case meets an existing target; `outstanding` are rows to show first, each
    with the reason.
    """

    sentences: tuple[str, ...]
    best: tuple[int, ...]
    case: int
    is_good: bool
    outstanding: dict[int, str]


def answer(result: SweepCases) -> SweepAnswer | None:
    """Return the answer of a sweep; None if no case is done, or no criterion is recorded."""
    column, done = criterion(result), np.flatnonzero(result.done)
    if column is None or not len(done):
        return None
    value, share = result.figure(column)[done], result.figure(WITHIN)[done]
    meets, partly = share == 1.0, ~np.isfinite(value)
    has_target = bool(np.isfinite(share).any())
    unit, cost = _cost(result, done, meets)
    if has_target:
        sentences = _sentences_with_target(result, done, column, share, (unit, cost), value)
        order = best_first(~meets, cost, value) if meets.any() else best_first(-share, value)
    else:
        sentences = _sentences_without_target(result, done, column, value, partly)
        order = best_first(partly, value)
    sentences += [f"Given {text}." for text in _with_cases(result, "given")]
    sentences += _sentences_on_others(result, done)
    best = tuple(done[order[:LISTED]].tolist())
    found = _outstanding(done, column, value, share, (unit, cost), int(order[0]))
    case, is_good = int(result.table["cell"][best[0]]), bool(meets.any()) or not has_target
    return SweepAnswer(tuple(sentences), best, case, is_good, found)


def _outstanding(
    done: Integers, column: str, value: Array, share: Array, costs: tuple[str, Array], first: int
) -> dict[int, str]:
    """Return the rows of the case with the smallest average and of that at the `first` place, with
    the reasons.
    """
    reasons: dict[int, str] = {}
    (unit, cost), meets, known = costs, share == 1.0, np.isfinite(value)
    if known.any():
        least, alike = _first_of_best(value, np.flatnonzero(known))
        # Of equal cases, the one that heads the list.
        least = first if (comparable(value) == comparable(value)[least])[first] else least
        of_known = "" if known.all() else " of the cases that determine it"
        words = f"smallest average of {quantity(column)}{of_known}{_as_have(alike)}"
        reasons[int(done[least])] = words
    words = ""
    if meets.any() and np.isfinite(cost[first]):
        words = f"fewest {unit} of the cases that meet the target"
        words += _as_have(int((cost[meets] == cost[first]).sum()) - 1)
    elif np.isfinite(share).any() and not meets.any():
        words = f"nearest to the target{_as_have(int((share == share[first]).sum()) - 1)}"
    if words:
        row = int(done[first])
        reasons[row] = "; ".join(filter(None, [reasons.get(row), words]))
    return reasons


def _cost(result: SweepCases, done: Integers, meets: Flags) -> tuple[str, Array]:
    """Return what the cases that meet the target are compared by, and its values (m,): hours if
    known for any of them.
    """
    hours = result.figure("hours")[done]
    if np.isfinite(hours[meets]).any():
        return "laboratory hours", comparable(hours)
    return OBSERVATIONS, result.figure(OBSERVATIONS)[done]


def _as_have(alike: int) -> str:
    """Return that further cases are equal to one."""
    return f", as {_verb(alike, 'have')} {alike} more" if alike else ""


def described(result: SweepCases, row: int, column: str) -> str:
    """Return a case in a line: number, values of the axes, and figures."""
    value, share = result.figure(column)[row], result.figure(WITHIN)[row]
    parts = [
        _with_value(column, value) if np.isfinite(value) else f"{quantity(column)} undetermined"
    ]
    if np.isfinite(share):
        parts.append(f"{percent(float(share))} of the lengths within target")
    for name in ("positions", "observations", "hours"):
        if np.isfinite(count := result.figure(name)[row]):
            parts.append(f"{number(count) if name == 'hours' else int(count)} {name}")
    return f"case {result.table['cell'][row]}: {'; '.join([result.words(row), *parts])}"


def criterion(result: SweepCases) -> str | None:
    """Return the column of the average that cases are judged by; None without one."""
    for name in CRITERIA:
        for column in result.table.columns:
            if column.startswith(f"{name}_average_"):
                return str(column)
    return None


def quantity(column: str) -> str:
    """Return the symbol of the quantity of a column of averages."""
    return column.partition("_average_")[0].replace("_", " ")


def best_first(*keys: NDArray[np.generic]) -> Integers:
    """Return an order by the first of `keys` (m,), then by the next: smallest first and NaN last.

    Values of the last key that differ only by rounding keep their order.

    >>> best_first(np.array([1, 0, 0, 0]), np.array([0.1, 0.1 + 0.2, 0.3, np.nan])).tolist()
    [1, 2, 3, 0]
    """
    *before, value = keys
    return np.lexsort([comparable(value), *reversed(before)])


def _sentences_with_target(
    result: SweepCases,
    done: Integers,
    column: str,
    share: Array,
    costs: tuple[str, Array],
    value: Array,
) -> list[str]:
    """Return sentences on cases with a target, which may be an axis of the sweep."""
    meets, judged = share == 1.0, int(np.isfinite(share).sum())
    apart = len(done) - judged
    if meets.any():
        sentences = [
            f"{meets.sum()} of {_cases(judged)} {_verb(int(meets.sum()), 'meet')} the target"
            " uncertainty with all lengths.",
            _cheapest_sentence(result, done, column, np.flatnonzero(meets), *costs, value),
        ]
    else:
        best = best_first(-share, value)[0]
        alike = int((share == share[best]).sum()) - 1
        tied = f"; {_cases(alike)} more {_verb(alike, 'have')} as many" if alike else ""
        subject = "The only case does not meet" if judged == 1 else f"None of the {judged}"
        subject += "" if judged == 1 else " cases meets"
        sentences = [
            f"{subject} the target uncertainty with all lengths. The"
            f" nearest is {result.words(done[best])}, with {percent(float(share[best]))} of"
            f" the lengths{tied}."
        ]
    if apart:
        sentences.append(
            f"{_cases(apart)} more {_verb(apart, 'have')} no target to be compared with."
        )
    return sentences


def _cheapest_sentence(
    result: SweepCases,
    done: Integers,
    column: str,
    candidates: Integers,
    unit: str,
    cost: Array,
    value: Array,
) -> str:
    """Return a sentence on the case with the least cost in a unit and, among those, the smallest
    average.
    """
    counted = candidates[np.isfinite(cost[candidates])]
    if not len(counted):
        return f"Their numbers of {unit} are not recorded."
    least = cost[counted].min()
    fewest = counted[cost[counted] == least]
    best, same = _first_of_best(value, fewest)
    name, amount = (
        result.words(done[best]),
        number(least) if unit != OBSERVATIONS else f"{least:.0f}",
    )
    unknown = len(candidates) - len(counted)
    more = f" Those of {_cases(unknown)} more that {_verb(unknown, 'meet')} it are unknown."
    more = more if unknown else ""
    if len(fewest) == 1:
        return f"The one with the fewest {unit} is {name}: {amount} {unit}.{more}"
    return (
        f"The fewest {unit} are {amount}, in {len(fewest)} of these cases."
        f" Among these, {name} has the smallest average of {_with_value(column, value[best])}"
        f"{_as_have(same)}.{more}"
    )


def _sentences_without_target(
    result: SweepCases, done: Integers, column: str, value: Array, partly: Flags
) -> list[str]:
    """Return sentences on cases without a target."""
    if WITHIN.partition("_")[0] in result.definition["record"]:
        sentence = "No case has a target uncertainty for its lengths."
    else:
        sentence = "U6 is not recorded, so that no case is compared with a target uncertainty."
    if partly.all():
        return [sentence, f"Every case leaves some of {quantity(column)} undetermined."]
    best, alike = _first_of_best(value, np.flatnonzero(~partly))
    tied = f"; {_cases(alike)} more {_verb(alike, 'have')} the same" if alike else ""
    return [
        sentence,
        f"The smallest average of {_with_value(column, value[best])}, is that of"
        f" {result.words(done[best])}{tied}.",
    ]


def _first_of_best(value: Array, places: Integers) -> tuple[int, int]:
    """Return the first of `places` with the smallest value, and the number of further ones."""
    values = comparable(value[places])
    best = best_first(values)[0]
    return int(places[best]), int((values == values[best]).sum()) - 1


def _sentences_on_others(result: SweepCases, done: Integers) -> list[str]:
    """Return sentences on cases that are deficient, or without results."""
    sentences = []
    deficient = int((result.figure("rank_deficiency")[done] > 0).sum())
    if deficient:
        verb = _verb(deficient, "leave")
        sentences.append(f"{deficient} of {_cases(len(done))} {verb} something undetermined.")
    missing = (result.summary.failed, "failed"), (result.summary.left, "not computed yet")
    parts = [f"{count} {words}" for count, words in missing if count]
    if parts:
        sentences.append(
            f"Of {_cases(result.summary.cells)}, {listing(parts)}; the answer is that of the"
            " others."
        )
    lost = _with_cases(result, "unspanned")
    return sentences + [f"Places do not follow the size: {text}." for text in lost]


def _with_cases(result: SweepCases, name: str) -> list[str]:
    """Return the texts of finished cases in a column, each with its number of cases."""
    if name not in result.table:
        return []
    counts = result.table.loc[result.done, name].value_counts(sort=False)
    total = int(result.done.sum())
    return [
        f"{text}: {'all cases' if count == total else _cases(int(count))}"
        for text, count in counts.items()
        if text
    ]


def _cases(count: int) -> str:
    return number_of(count, "case")


def _verb(count: int, verb: str) -> str:
    """Return a verb that agrees with a number of cases.

    >>> _verb(1, "have"), _verb(2, "have"), _verb(1, "meet")
    ('has', 'have', 'meets')
    """
    return verb if count != 1 else "has" if verb == "have" else f"{verb}s"


def _with_value(column: str, value: float) -> str:
    """Return a quantity with its average."""
    return (
        f"{quantity(column)}, {number(1e6 * value, 3)} {column_unit(column.split('_average_')[1])}"
    )
