"""A sweep's results as one table: a row for each cell, a column for each figure, with its unit in
the name.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .store import Store, chosen_sweep, results
from .stored import StoredResults

if TYPE_CHECKING:
    import pandas

# Whole numbers up to this are exact in the double precision that a definition keeps them in.
MOST_WHOLE = 2.0**53


def frame(store: Store, sweep: int | None = None) -> pandas.DataFrame:
    """The cells of a sweep, the newest of the store by default, in their order; those not done are
    not in it.

    Columns: `cell` from 0, a column for each axis (in metres or radians, with the unit in its name,
    or texts), `status`, `reason`, the figures by name, `data_set_seed`, `fingerprint`,
    `duration_s`, and the versions. Figures that a cell lacks are NaN. Cells that cannot be read are
    not in it either.

    :raises StoreError: there is no such sweep, or the store cannot be read.
    """
    number, defined = chosen_sweep(store, sweep)
    return frame_of(results(store, number, len(defined["cells"])), defined)


def frame_of(results: StoredResults, defined: dict[str, Any]) -> pandas.DataFrame:
    """The table of `frame`."""
    import pandas

    axes = defined["axes"]
    columns: dict[str, Any] = {"cell": results.cells}
    chosen = np.array(defined["cells"], np.int64).reshape(-1, len(axes))[results.cells]
    for k, axis in enumerate(axes):
        values = np.array(axis["values"] if axis["unit"] else axis["labels"])
        if axis["unit"] == "1" and ((abs(values) < MOST_WHOLE) & (values % 1.0 == 0.0)).all():
            values = values.astype(np.int64)
        columns[axis["column"]] = values[chosen[:, k]]
    columns |= {name: [getattr(row, name) for row in results.rows] for name in ("status", "reason")}
    columns |= results.figures
    columns |= {
        "data_set_seed": np.array([row.seed for row in results.rows], np.int64),
        "fingerprint": results.keys,
        "duration_s": np.array([row.seconds for row in results.rows], float),
    }
    for name in dict.fromkeys(name for row in results.rows for name in row.versions):
        columns[f"{name}_version"] = [row.versions.get(name, "") for row in results.rows]
    return pandas.DataFrame(columns)
