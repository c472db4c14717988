"""Effects of a sweep's axes on the average that cases are judged by, and what it costs."""

from __future__ import annotations

import numpy as np
from ballplate.presentation import number
from ballplate.simulator.computing import comparable
from ballplate.simulator.machines import Array

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
    """Return `value` (rows,) by combination of the other axes' values and by value of axis `k`; NaN
    of cases that are missing.
    """
    import pandas

    others = list(map(str, np.delete(result.chosen, k, axis=1).tolist()))
    frame = pandas.DataFrame({"others": others, "at": result.chosen[:, k], "value": value})
    places = range(len(result.axes[k].labels))
    wide = frame.pivot(index="others", columns="at", values="value")
    return wide.reindex(columns=places).to_numpy(float)


def frontier(result: SweepCases, value: Array) -> list[int]:
    """Return the rows with a smaller `value` (rows,), except by rounding, than all with fewer or as
    many hours, by hours; none unless hours differ.
    """
    hours, value = comparable(result.figure("hours")), comparable(value)
    known = np.flatnonzero(np.isfinite(hours + value))
    order = known[np.lexsort([value[known], hours[known]])]
    is_less = np.diff(np.minimum.accumulate(value[order]), prepend=np.inf) < 0.0
    return order[is_less].tolist() if len(set(hours[known])) > 1 else []
