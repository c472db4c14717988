"""Compute the sweeps again and write their tables: `tables/NAME.csv` of `sweeps/NAME.yaml`.

    python designs/study/make_tables.py --workers 2

takes a quarter of an hour on two processors. An interrupted sweep continues if `--stores` names the
same folder.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import ballplate as bp
import pandas as pd

HERE = Path(__file__).resolve().parent

# Columns of a table after those of the axes, with their names there; all lengths in micrometres.
KEPT = {
    "U6_average_m": "U6_average_um",
    "U6_maximum_m": "U6_maximum_um",
    "bound_m": "bound_um",
    "rank_deficiency": "rank_deficiency",
    "parameters": "parameters",
    "observations": "observations",
    "positions": "positions",
    "readings": "readings",
    "hours": "hours",
}
DIGITS = 6


def names() -> list[str]:
    """The names of the sweeps, in alphabetical order."""
    return sorted(path.stem for path in (HERE / "sweeps").glob("*.yaml"))


def compact(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the axes and the kept columns of a sweep's rows, rounded.

    :raises ValueError: a case has failed.
    """
    failed = rows[rows["status"] != "done"]
    if len(failed):
        raise ValueError(f"case {failed['cell'].iloc[0]} failed: {failed['reason'].iloc[0]}")
    columns = list(rows.columns)
    axes = columns[columns.index("cell") + 1 : columns.index("status")]
    kept = [name for name in KEPT if name in columns]
    table = rows[axes + kept].rename(columns=KEPT)
    for name in table.columns:
        if name.endswith("_um") and name not in axes:
            table[name] *= 1e6
        if pd.api.types.is_float_dtype(table[name]):
            table[name] = [float(f"{value:.{DIGITS}g}") for value in table[name]]
        if name in ("rank_deficiency", "parameters", "observations", "positions", "readings"):
            table[name] = table[name].astype("Int64")
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--workers", type=int, default=1, help="number of processes; default: 1")
    parser.add_argument(
        "--stores", type=Path, help="folder of the stores; default: a temporary one"
    )
    parser.add_argument("names", nargs="*", help="sweeps, such as recipes; default: all")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        stores = arguments.stores or Path(temporary)
        stores.mkdir(parents=True, exist_ok=True)
        for name in arguments.names or names():
            store = stores / f"{name}.sqlite"
            file = HERE / "sweeps" / f"{name}.yaml"
            swept = bp.sweep(file, store=store, workers=arguments.workers)
            table = compact(swept.to_frame())
            table.to_csv(HERE / "tables" / f"{name}.csv", index=False, lineterminator="\n")
            print(f"{name}.csv: {len(table)} rows", flush=True)


if __name__ == "__main__":
    main()
