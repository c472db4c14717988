"""A sweep's results as one table: a row for each cell, a column for each figure, with its unit in the name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .store import Store, chosen_sweep, definition_of, results

if TYPE_CHECKING:
    import pandas


def frame(store: Store, sweep: int | None = None) -> pandas.DataFrame:
    """The cells of a sweep, the newest of the store unless told, in their order; those not done are not in it.

    Columns: `cell` from 0, a column for each axis (in metres or radians, with the unit in its name, or texts),
    `status`, `reason`, the figures by name, `data_set_seed`, `fingerprint`, `duration_s`, and the versions. Figures
    that a cell lacks are NaN.

    :raises StoreError: there is no such sweep, or the store cannot be read.
    """
    import pandas

    number = chosen_sweep(store, sweep)
    defined = definition_of(store, number)
    axes, cells = defined["axes"], defined["cells"]
    found = results(store, number)
    columns: dict[str, Any] = {"cell": found.cells}
    chosen = np.array(cells, np.int64).reshape(len(cells), len(axes))[found.cells]
    for k, axis in enumerate(axes):
        values = np.array(axis["values"] if axis["unit"] else axis["labels"])
        if axis["unit"] == "1" and all(float(value).is_integer() for value in axis["values"]):
            values = values.astype(np.int64)
        columns[axis["column"]] = values[chosen[:, k]]
    columns |= {"status": found.statuses, "reason": found.reasons, **found.figures}
    columns |= {"data_set_seed": found.seeds, "fingerprint": found.keys, "duration_s": found.seconds}
    columns |= {f"{name}_version": texts for name, texts in found.versions.items()}
    return pandas.DataFrame(columns)
