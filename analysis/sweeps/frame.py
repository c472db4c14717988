"""A sweep's results as one table: a row for each cell, a column for each figure, with its unit in the name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .store import Store, results, sweeps

if TYPE_CHECKING:
    import pandas

# Columns that tell when and with what a row was computed, not what came out.
CIRCUMSTANCES = ("duration_s",)


def frame(store: Store, sweep: int | None = None) -> pandas.DataFrame:
    """The cells of a sweep, the newest of the store unless told, in their order; those not done are not in it.

    Columns: `cell` from 0, a column for each axis (in metres or radians, with the unit in its name, or texts),
    `status`, `reason`, the figures by name, `seed`, `fingerprint`, `duration_s`, and the versions. Figures that a cell
    lacks are NaN.
    """
    import pandas

    defined = sweeps(store)
    number = max(defined) if sweep is None else sweep
    axes, cells = defined[number]["axes"], defined[number]["cells"]
    found = list(results(store, number))
    columns: dict[str, Any] = {"cell": np.array([one.cell for one in found], np.int64)}
    for k, axis in enumerate(axes):
        values = axis["values"] if axis["unit"] else axis["labels"]
        chosen = [values[cells[one.cell][k]] for one in found]
        is_whole = axis["unit"] == "1" and all(float(value).is_integer() for value in values)
        columns[axis["column"]] = np.array(chosen, np.int64) if is_whole else chosen
    columns["status"] = [one.status for one in found]
    columns["reason"] = [one.reason for one in found]
    for name in dict.fromkeys(name for one in found for name in one.figures):
        columns[name] = np.array([one.figures.get(name, np.nan) for one in found])
    columns["seed"] = np.array([one.seed for one in found], np.int64)
    columns["fingerprint"] = [one.key for one in found]
    columns["duration_s"] = np.array([one.seconds for one in found])
    for name in dict.fromkeys(name for one in found for name in one.versions):
        columns[f"{name}_version"] = [one.versions.get(name, "") for one in found]
    return pandas.DataFrame(columns)
