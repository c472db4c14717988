"""Effect of each axis of a sweep while all others stay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from ballplate.presentation import number
from ballplate.simulator.machines import Integers

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
    value, chosen = results.figure(column)[rows].tolist(), results.chosen[rows]
    worths = []
    for k, axis in enumerate(results.axes):
        if len(axis.labels) < 2:
            continue
        other_axes = [i for i in range(len(results.axes)) if i != k]
        planned = len(np.unique(results.cells[:, other_axes], axis=0))
        settings: dict[tuple[int, ...], dict[int, float]] = {}
        for setting, place, average in zip(
            map(tuple, chosen[:, other_axes].tolist()), chosen[:, k].tolist(), value, strict=True
        ):
            settings.setdefault(setting, {})[place] = average
        kind = _worth_of_numbers if axis.numbers else _worth_of_texts
        worths.append(kind(axis, list(settings.values()), planned))
    return worths


def _worth_of_numbers(
    axis: ReportAxis, settings: Sequence[dict[int, float]], planned: int
) -> AxisWorth:
    """Compare the smallest value of the axis that is determined anywhere with the largest."""
    places = sorted({place for averages in settings for place in averages} or {0})
    first, *_, last = sorted([*places, places[0]], key=lambda place: axis.numbers[place])
    ratios, between = [], 0
    for averages in settings:
        if first != last and last in averages and averages.get(first, 0.0) > 0.0:
            ratios.append(averages[last] / averages[first])
            at_ends = min(averages[first], averages[last])
            between += min(averages.values()) < at_ends * (1.0 - SAME)
    ends = axis.labels[first], axis.labels[last]
    return AxisWorth(axis.name, ends, *_range(ratios), len(ratios), planned, between)


def _worth_of_texts(
    axis: ReportAxis, settings: Sequence[dict[int, float]], planned: int
) -> AxisWorth:
    """Compare all values of the axis that are determined in a setting, two at least."""
    ratios = []
    # The best value is the smallest in every comparison, and takes part in all.
    best = set(range(len(axis.labels)))
    for averages in settings:
        least = min(averages.values())
        if len(averages) > 1 and least > 0.0:
            ratios.append(max(averages.values()) / least)
            best &= {place for place in averages if averages[place] <= least * (1.0 + SAME)}
    name = axis.labels[best.pop()] if len(best) == 1 and ratios else ""
    return AxisWorth(axis.name, None, *_range(ratios), len(ratios), planned, best=name)


def _range(ratios: Sequence[float]) -> tuple[float, float]:
    return (min(ratios), max(ratios)) if ratios else (np.nan, np.nan)
