"""Answer of a sweep: the cases that meet the target, and the cheapest of these."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing import comparable
from ballplate.simulator.design import Flags
from ballplate.simulator.inputs import listing, number_of
from ballplate.simulator.machines import Integers
from ballplate.uncertainty import RECORDED
from numpy.typing import NDArray

from .cases import SweepCases, described

# Cases in the table of the best.
LISTED = 8

WITHIN = "U6_within_target"
NO_U6 = "U6 is not recorded, so that no case is compared with a target uncertainty."
NO_TARGET = "No case has a target uncertainty for its lengths."

# Quantities to judge cases by: the average of the first that is recorded.
PREFERRED = ("U6", "U4", "U5", "U1", "U3_lengths", "U2_lengths", "U3", "U2")
CRITERIA = tuple(dict.fromkeys((*PREFERRED, *RECORDED)))


@dataclass(frozen=True, eq=False)
class SweepAnswer:
    """Sentences, and the rows of the best cases, best first; `case` is the number of the best.

    `is_good` unless no case meets an existing target; `outstanding` are rows to show first, each
    with its sentence.
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
    value, share, cost = (result.figure(name)[done] for name in (column, WITHIN, "hours"))
    meets, judged, known = share == 1.0, np.isfinite(share), np.isfinite(value)
    unit = "known laboratory hours"
    if not np.isfinite(cost[meets]).any():
        unit, cost = "observations", result.figure("observations")[done]
    # Cases to find: by a figure, among some.
    wanted = [(f"smallest average of {quantity(column)}", known, value)]
    if meets.any():
        order = best_first(~meets, comparable(cost), value)
        words = f"fewest {unit} of the cases that meet the target"
        wanted.append((words, meets & np.isfinite(cost), cost))
    elif judged.any():
        order = best_first(-share, value)
        wanted.append(("nearest to the target", judged, -share))
    else:
        order = best_first(~known, value)
    found: dict[int, str] = {}
    for words, mask, figure in wanted:
        alike = mask & (comparable(figure) == comparable(figure)[mask].min(initial=np.inf))
        if rows := done[order[alike[order]]].tolist():
            one_of = f" (one of {len(rows)})" if rows[1:] else ""
            before = f"{found[rows[0]]}; " if rows[0] in found else ""
            found[rows[0]] = f"{before}{words}{one_of}"
    lines = described(result, found)
    outstanding = {
        row: f"{words[:1].upper()}{words[1:]}: {line}."
        for (row, words), line in zip(found.items(), lines, strict=True)
    }
    sentences = [*_verdict(result, meets, judged), *outstanding.values()]
    if not known.any():
        sentences.append(f"Every case leaves some of {quantity(column)} undetermined.")
    sentences += [f"Given {text}." for text in _with_cases(result, "given")]
    sentences += _sentences_on_others(result, done)
    best = tuple(done[order[:LISTED]].tolist())
    is_good = bool(meets.any() or not judged.any())
    case = int(result.table["cell"][best[0]])
    return SweepAnswer(tuple(sentences), best, case, is_good, outstanding)


def _verdict(result: SweepCases, meets: Flags, judged: Flags) -> list[str]:
    """Return sentences on the numbers of cases that meet the target, which may be an axis."""
    count, apart = int(judged.sum()), int((~judged).sum())
    if meets.any():
        found = int(meets.sum())
        verdict = f"{found} of {_cases(count)} {_verb(found, 'meet')}"
    elif count:
        verdict = f"None of the {count} cases meets" if count > 1 else "The only case does not meet"
    else:
        return [NO_TARGET if "U6" in result.definition["record"] else NO_U6]
    more = f"{_cases(apart)} more {_verb(apart, 'have')} no target to be compared with."
    return [f"{verdict} the target uncertainty with all lengths.", *[more] * (apart > 0)]


def criterion(result: SweepCases) -> str | None:
    """Return the column of the average that cases are judged by; None without one."""
    columns = result.table.columns
    found = (c for name in CRITERIA for c in columns if c.startswith(f"{name}_average_"))
    return next(found, None)


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
