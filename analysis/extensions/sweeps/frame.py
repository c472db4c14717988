"""A sweep's results as one table: one row per cell, one column per value, with its unit in the
name.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .stored import StoredResults

if TYPE_CHECKING:
    import pandas

# Whole numbers up to this are exact in double precision.
MOST_WHOLE = 2.0**53


def frame_of(results: StoredResults, defined: dict[str, Any]) -> pandas.DataFrame:
    """Return the cells of a sweep in their order, without unfinished and unreadable ones.

    Columns: `cell` from 0, one for each axis (in metres or radians, with the unit in its name, or
    texts), `status`, `reason`, what figures take for granted (`given`), `unspanned` if a size
    leaves a part of the volume out, the names of the `chosen` candidates of plans, the content of a
    `drawing` as JSON, the results by name (NaN if a cell lacks one), `data_set_seed`,
    `fingerprint`, `duration_s`, and the versions.
    """
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
    columns["given"] = ["; ".join(row.details.get("given", ())) for row in results.rows]
    for name in ("unspanned", "chosen", "drawing"):
        details = [row.details.get(name, "") for row in results.rows]
        texts = ["; ".join(text) if isinstance(text, list) else text for text in details]
        columns |= {name: texts} if any(texts) else {}
    columns |= results.figures
    columns |= {
        "data_set_seed": np.array([row.seed for row in results.rows], np.int64),
        "fingerprint": results.keys,
        "duration_s": np.array([row.seconds for row in results.rows], float),
    }
    for name in dict.fromkeys(name for row in results.rows for name in row.versions):
        columns[f"{name}_version"] = [row.versions.get(name, "") for row in results.rows]
    return pandas.DataFrame(columns)
