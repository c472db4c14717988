"""Effect of each axis of a sweep while all others stay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from ballplate.presentation import number
from ballplate.simulator.machines import Array, Integers

from .results import ReportAxis, ReportedSweep

# Averages with a smaller relative difference are equal, except for rounding.
SAME = 1e-9


@dataclass(frozen=True)
class AxisWorth:
    """Effect of an axis on an average uncertainty, over the settings of the other axes.

    With numbers, `low` to `high` are ratios of the average at the last of `ends` to that at the
    first; with texts, of the largest to the smallest. `settings` of `planned` have both ends. In
    `between` settings of an axis with numbers, the smallest average is at neither end. Of texts,
    `best` has the smallest average in every setting; empty if they disagree.
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
            return (
                f"{self.axis}: no two of its values are known at the same values of the other axes"
            )
        low, high = number(self.low, 3), number(self.high, 3)
        factor = low if low == high else f"{low} to {high}"
        if self.ends is None:
            text = f"{self.axis}: its values differ by a factor of {factor}"
        else:
            text = (
                f"{self.axis}: from {self.ends[0]} to {self.ends[1]} it is multiplied by {factor}"
            )
        if self.planned > 1:
            total = "" if self.settings == self.planned else f" of {self.planned}"
            text += f", in {self.settings}{total} combinations of the other axes"
        if self.between:
            whole = self.between == self.settings
            where = "" if self.settings == 1 else f" in {'all' if whole else self.between} of them"
            text += f"; a value between has the smallest average{where}"
        if self.best:
            text += f"; {self.best} has the smallest"
        return text


def axis_worths(results: ReportedSweep, column: str, rows: Integers) -> list[AxisWorth]:
    """Return the effect of each axis with several values on a column, from `rows` with
    determined values.
    """
    value, chosen = results.figure(column)[rows], results.chosen[rows]
    worths = []
    for k, axis in enumerate(results.axes):
        if len(axis.labels) < 2:
            continue
        other_axes = [i for i in range(len(results.axes)) if i != k]
        planned = len(np.unique(results.cells[:, other_axes], axis=0))
        _, group = np.unique(chosen[:, other_axes], axis=0, return_inverse=True)
        kind = _worth_of_numbers if axis.numbers else _worth_of_texts
        worths.append(kind(axis, value, group.ravel(), chosen[:, k], planned))
    return worths


def _worth_of_numbers(
    axis: ReportAxis,
    value: Array,
    group: Integers,
    place: Integers,
    planned: int,
) -> AxisWorth:
    """Compare the smallest value of the axis that is determined anywhere with the largest."""
    ranks = np.argsort(np.argsort(np.array(axis.numbers), kind="stable"))[place]
    order, starts, ends = _grouped(group, ranks)
    first, last = order[starts], order[ends]
    lowest, highest = (ranks.min(), ranks.max()) if len(ranks) else (0, 0)
    has_both = (ranks[first] == lowest) & (ranks[last] == highest) & (first != last)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = value[last] / value[first]
    has_both &= np.isfinite(ratios)
    least = np.minimum.reduceat(value[order], starts) if len(starts) else value[:0]
    at_ends = np.minimum(value[first], value[last])
    between = int((has_both & (least < at_ends * (1.0 - SAME))).sum())
    labels = [axis.labels[i] for i in np.argsort(axis.numbers, kind="stable")]
    labels_of_ends = (labels[lowest], labels[highest])
    return _worth(axis, labels_of_ends, ratios[has_both], planned, between=between)


def _worth_of_texts(
    axis: ReportAxis,
    value: Array,
    group: Integers,
    place: Integers,
    planned: int,
) -> AxisWorth:
    """Compare all values of the axis that are determined in a setting, two at least."""
    order, starts, ends = _grouped(group, place)
    if not len(starts):
        return _worth(axis, None, value, planned)
    least, most = (kind.reduceat(value[order], starts) for kind in (np.minimum, np.maximum))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = most / least
    several = (starts != ends) & np.isfinite(ratios)
    # The best value is the smallest in every comparison, and takes part in all.
    smallest = value[order] <= np.repeat(least, ends - starts + 1) * (1.0 + SAME)
    compared = np.repeat(several, ends - starts + 1)
    wins = np.bincount(place[order][smallest & compared], minlength=len(axis.labels))
    best = np.flatnonzero(wins == several.sum())
    name = axis.labels[best[0]] if len(best) == 1 and several.any() else ""
    return _worth(axis, None, ratios[several], planned, best=name)


def _grouped(group: Integers, place: Integers) -> tuple[Integers, Integers, Integers]:
    """Return an order by group and value, and the first and last index of each group in it."""
    order = np.lexsort((place, group))
    starts = np.flatnonzero(np.r_[True, np.diff(group[order]) != 0]) if len(order) else order
    return order, starts, np.r_[starts[1:], len(order)][: len(starts)] - 1


def _worth(
    axis: ReportAxis,
    ends: tuple[str, str] | None,
    ratios: Sequence[float] | Array,
    planned: int,
    between: int = 0,
    best: str = "",
) -> AxisWorth:
    if not len(ratios):
        return AxisWorth(axis.name, ends, np.nan, np.nan, 0, planned)
    low, high = float(min(ratios)), float(max(ratios))
    return AxisWorth(axis.name, ends, low, high, len(ratios), planned, between, best)
