"""Effects of a sweep's axes on the average that cases are judged by, and what it costs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing import comparable
from ballplate.simulator.machines import Array, Integers

from .cases import SweepCases


@dataclass(frozen=True, eq=False)
class AxisEffect:
    """Effect of an axis: `ratios` of the largest average to the smallest, one for each of the
    compared `combinations` of the other axes, `complete` of which have all values of the axis.

    `best` are the values with the smallest average in most combinations, `wins`.
    """

    name: str
    values: int
    combinations: int
    complete: int
    ratios: Array
    best: tuple[str, ...]
    wins: int


def effects(result: SweepCases, value: Array) -> list[AxisEffect]:
    """Return the effects of the axes with several values on `value` (rows,), the largest median
    first and unknown ones last. Cases are matched by the other axes' values.
    """
    found = [_effect(result, value, k) for k, axis in enumerate(result.axes) if axis.labels[1:]]
    medians = [-np.median(each.ratios) if len(each.ratios) else np.nan for each in found]
    return [found[k] for k in np.argsort(comparable(medians), kind="stable")]


def _effect(result: SweepCases, value: Array, k: int) -> AxisEffect:
    axis = result.axes[k]
    cells = np.array(result.definition["cells"], np.int64).reshape(-1, len(result.axes))
    others, which = np.unique(np.delete(cells, k, axis=1), axis=0, return_inverse=True)
    rows = np.flatnonzero(result.done & np.isfinite(value))
    places = which.ravel()[result.table["cell"].to_numpy(np.int64)[rows]]
    averages = np.full((len(others), len(axis.labels)), np.nan)
    averages[places, result.chosen[rows, k]] = comparable(value[rows])
    averages = averages[np.isfinite(averages).sum(axis=1) > 1]
    least = np.nanmin(averages, axis=1, initial=np.inf)
    most = np.nanmax(averages, axis=1, initial=0.0)
    wins = (averages == least[:, None]).sum(axis=0)
    best = [axis.labels[i] for i in np.flatnonzero((wins == wins.max()) & (wins > 0))]
    return AxisEffect(
        axis.name,
        len(axis.labels),
        len(others),
        int(np.isfinite(averages).all(axis=1).sum()),
        np.divide(most, least, out=np.full(len(most), np.nan), where=least > 0.0),
        tuple(best),
        int(wins.max()),
    )


def known_hours(result: SweepCases) -> Array | None:
    """Return the hours of all cases (rows,), NaN if unknown; None unless they differ."""
    hours = np.where(result.done, result.figure("hours"), np.nan)
    return hours if len(np.unique(comparable(hours[np.isfinite(hours)]))) > 1 else None


def frontier(cost: Array, value: Array) -> Integers:
    """Return the places, by cost, of which no other has less of one without more of the other,
    except by rounding; NaN is left out.

    >>> frontier(np.array([2.0, 1.0, 1.0, 3.0]), np.array([1.0, 5.0, 6.0, 1.0])).tolist()
    [1, 0]
    """
    known = np.flatnonzero(np.isfinite(cost) & np.isfinite(value))
    cost, value = comparable(cost[known]), comparable(value[known])
    order = np.lexsort([value, cost])
    cost, value = cost[order], value[order]
    least = np.minimum.accumulate(value)
    is_less = np.diff(least, prepend=np.inf) < 0.0
    since = np.maximum.accumulate(np.where(is_less, cost, -np.inf))
    return known[order[(value == least) & (cost == since)]]
