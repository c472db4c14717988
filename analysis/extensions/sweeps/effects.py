"""Effects of a sweep's axes on the average that cases are judged by, and what it costs."""

from __future__ import annotations

import numpy as np
from ballplate.presentation import number
from ballplate.simulator.computing import comparable
from ballplate.simulator.machines import Array, Integers

from .cases import SweepCases


def effects(result: SweepCases, value: Array) -> list[list[str]]:
    """Return a row of texts for each axis along which cases can be compared: its name, the largest
    of `value` (rows,) over the smallest as median, least and most, the values that most often have
    the smallest, and the numbers of the other axes' combinations that have two values, and all.
    """
    found = []
    for k, axis in enumerate(result.axes):
        averages = comparable(averages_along(result, value, k))
        known = np.isfinite(averages).sum(axis=1)
        if not (compared := averages[known > 1]).size:
            continue
        least = np.nanmin(compared, axis=1)
        ratios = np.nanmax(compared, axis=1) / np.where(least > 0.0, least, np.nan)
        wins = (compared == least[:, None]).sum(axis=0)
        best = " or ".join(axis.labels[i] for i in np.flatnonzero(wins == wins.max()))
        texts = [number(how(ratios), 3) for how in (np.median, np.min, np.max)]
        texts += [f"{best}, in {wins.max()}", f"{len(least)} of {len(averages)}"]
        found.append([axis.name, *texts, str((known == len(axis.labels)).sum())])
    return found


def averages_along(result: SweepCases, value: Array, k: int) -> Array:
    """Return `value` (rows,) of finished cases by combination of the other axes' values and by
    value of axis `k`; NaN of cases that are missing.
    """
    cells = np.array(result.definition["cells"], np.int64).reshape(-1, len(result.axes))
    others, which = np.unique(np.delete(cells, k, axis=1), axis=0, return_inverse=True)
    averages = np.full((len(others), len(result.axes[k].labels)), np.nan)
    rows = np.flatnonzero(result.done)
    places = which.ravel()[result.table["cell"].to_numpy()[rows]]
    averages[places, result.chosen[rows, k]] = value[rows]
    return averages


def frontier(cost: Array, value: Array) -> Integers:
    """Return the places, by cost, of which no other has less of one without more of the other,
    except by rounding; NaN is left out.

    >>> frontier(np.array([2.0, 1.0, 1.0, 3.0]), np.array([1.0, 5.0, 6.0, 1.0])).tolist()
    [1, 0]
    """
    known = np.flatnonzero(np.isfinite(cost + value))
    cost, value = comparable(cost[known]), comparable(value[known])
    order = np.lexsort([value, cost])
    least = np.minimum.accumulate(value[order])
    since = np.maximum.accumulate(np.where(np.diff(least, prepend=np.inf) < 0.0, cost[order], -1.0))
    return known[order[(value[order] == least) & (cost[order] == since)]]
