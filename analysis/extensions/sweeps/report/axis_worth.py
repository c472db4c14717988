"""What each axis of a sweep changes while all others stay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from ballplate.presentation import number
from numpy.typing import NDArray

from .results import Integers, ReportAxis, ReportedSweep

# Averages within this part of one another are the same but for rounding.
SAME = 1e-9


@dataclass(frozen=True)
class AxisWorth:
    """What an axis changes: the average uncertainty at the last value divided by that at the first
    of `ends`, of axes with texts the largest divided by the smallest; `low` to `high` over so many
    `settings` of the other axes, of `planned`. No setting has both ends where there are none.

    In `between` settings of an axis with numbers, the smallest average is at neither end. Of texts,
    `best` is the one with the smallest average in every setting, empty where they disagree.
    """

    axis: str
    ends: tuple[str, str] | None
    low: float
    high: float
    settings: int
    planned: int
    between: int = 0
    best: str = ""

    def __str__(self) -> str:
        if not self.settings:
            return f"{self.axis}: no two of its values are known in the same setting of the others"
        low, high = number(self.low, 3), number(self.high, 3)
        by = low if low == high else f"{low} to {high}"
        if self.ends is None:
            said = f"{self.axis}: its values differ by a factor of {by}"
        else:
            said = f"{self.axis}: from {self.ends[0]} to {self.ends[1]} it is multiplied by {by}"
        if self.planned > 1:
            of = "" if self.settings == self.planned else f" of {self.planned}"
            said += f", in {self.settings}{of} settings of the other axes"
        if self.between:
            whole = self.between == self.settings
            where = "" if self.settings == 1 else f" in {'all' if whole else self.between} of them"
            said += f"; a value between has the smallest average{where}"
        if self.best:
            said += f"; {self.best} has the smallest"
        return said


def axis_worths(results: ReportedSweep, column: str, rows: Integers) -> list[AxisWorth]:
    """What each axis of several values changes of a figure, by `rows` that are determined."""
    value, chosen = results.figure(column)[rows], results.chosen[rows]
    found = []
    for k, axis in enumerate(results.axes):
        if len(axis.labels) < 2:
            continue
        others = [i for i in range(len(results.axes)) if i != k]
        planned = len(np.unique(results.cells[:, others], axis=0))
        _, group = np.unique(chosen[:, others], axis=0, return_inverse=True)
        kind = _of_numbers if axis.numbers else _of_texts
        found.append(kind(axis, value, group.ravel(), chosen[:, k], planned))
    return found


def _of_numbers(
    axis: ReportAxis,
    value: NDArray[np.float64],
    group: Integers,
    place: Integers,
    planned: int,
) -> AxisWorth:
    """From the smallest value of the axis that is determined anywhere to the largest."""
    ranks = np.argsort(np.argsort(np.array(axis.numbers), kind="stable"))[place]
    order, starts, ends = _grouped(group, ranks)
    first, last = order[starts], order[ends]
    lowest, highest = (ranks.min(), ranks.max()) if len(ranks) else (0, 0)
    both = (ranks[first] == lowest) & (ranks[last] == highest) & (first != last)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = value[last] / value[first]
    both &= np.isfinite(ratios)
    least = np.minimum.reduceat(value[order], starts) if len(starts) else value[:0]
    at_ends = np.minimum(value[first], value[last])
    between = int((both & (least < at_ends * (1.0 - SAME))).sum())
    labels = [axis.labels[i] for i in np.argsort(axis.numbers, kind="stable")]
    told = (labels[lowest], labels[highest])
    return _worth(axis, told, ratios[both], planned, between=between)


def _of_texts(
    axis: ReportAxis,
    value: NDArray[np.float64],
    group: Integers,
    place: Integers,
    planned: int,
) -> AxisWorth:
    """Over all values of the axis that are determined in a setting, two at least."""
    order, starts, ends = _grouped(group, place)
    if not len(starts):
        return _worth(axis, None, value, planned)
    least, most = (kind.reduceat(value[order], starts) for kind in (np.minimum, np.maximum))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = most / least
    several = (starts != ends) & np.isfinite(ratios)
    # A value that is the smallest wherever it is compared, and is compared everywhere.
    smallest = value[order] <= np.repeat(least, ends - starts + 1) * (1.0 + SAME)
    compared = np.repeat(several, ends - starts + 1)
    wins = np.bincount(place[order][smallest & compared], minlength=len(axis.labels))
    best = np.flatnonzero(wins == several.sum())
    name = axis.labels[best[0]] if len(best) == 1 and several.any() else ""
    return _worth(axis, None, ratios[several], planned, best=name)


def _grouped(group: Integers, place: Integers) -> tuple[Integers, Integers, Integers]:
    """An order by group and place, and where in it each group begins and ends."""
    order = np.lexsort((place, group))
    starts = np.flatnonzero(np.r_[True, np.diff(group[order]) != 0]) if len(order) else order
    return order, starts, np.r_[starts[1:], len(order)][: len(starts)] - 1


def _worth(
    axis: ReportAxis,
    ends: tuple[str, str] | None,
    ratios: Sequence[float] | NDArray[np.float64],
    planned: int,
    between: int = 0,
    best: str = "",
) -> AxisWorth:
    if not len(ratios):
        return AxisWorth(axis.name, ends, np.nan, np.nan, 0, planned)
    low, high = float(min(ratios)), float(max(ratios))
    return AxisWorth(axis.name, ends, low, high, len(ratios), planned, between, best)
