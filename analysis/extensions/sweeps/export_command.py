"""`ballplate sweep --export`: write a sweep's results as one table for other programs."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.cli import PARQUET, UsageError, add_force, add_output, complain, write

if TYPE_CHECKING:
    from collections.abc import Iterable

    from .stored import StoredResults


BAD_FILE = 3

REPLACE = "run ballplate sweep again to replace unreadable cases"


DESCRIPTION = (
    "Write one row per case of a store and one column per value, in metres and radians, with the"
    " unit in the column's name. From a damaged store, write the readable cases. Exit status: 3 if"
    " the store is damaged."
)


def add_options(parser: ArgumentParser) -> None:
    add_store(parser)
    add_output(
        parser,
        "-o",
        "--output",
        metavar="FILE",
        required=True,
        takes_screen=True,
        needed=lambda path: PARQUET if path.suffix.lower() == ".parquet" else None,
        help="table, .csv or .parquet; - for CSV on the screen",
    )
    add_force(parser)


def add_store(parser: ArgumentParser) -> None:
    """Add the options that choose a store and a sweep in it."""
    parser.add_argument(
        "store", metavar="STORE", type=Path, help="store written by ballplate sweep"
    )
    parser.add_argument(
        "--sweep",
        metavar="N",
        type=int,
        help="number of the sweep in the store; default: the newest",
    )


def warn_of_other_methods(path: Path, keys: Iterable[str]) -> None:
    """Warn of rows that another method computed."""
    from .store import of_other_methods

    for text in of_other_methods(keys):
        complain(f"{path}: {text}; run ballplate sweep again to replace them")


def warn_of_damage(path: Path, results: StoredResults) -> bool:
    """Warn of unreadable cells, and return whether there are any."""
    from .store import damaged_cells
    from .store_file import RECOMPUTE

    # `sweep` replaces damaged rows, but refuses a file that SQLite finds damaged.
    remedy = f"restore a copy, or {RECOMPUTE}" if results.file_fault else REPLACE
    text = damaged_cells(path, results, remedy)
    if text:
        complain(text)
    return bool(text)


def run(options: Namespace) -> int:
    """Write the table."""
    from ballplate.simulator.inputs import cell_of_text

    from .frame import frame_of
    from .store import chosen_sweep, open_store, results

    suffix = options.output.suffix.lower()
    if suffix not in (".csv", ".parquet") and str(options.output) != "-":
        raise UsageError(f"{options.output} should end in .csv or .parquet")
    with closing(open_store(options.store)) as store:
        number, defined = chosen_sweep(store, options.sweep)
        stored = results(store, number, len(defined["cells"]))
        is_damaged = warn_of_damage(store.path, stored)
        table = frame_of(stored, defined)
        warn_of_other_methods(store.path, stored.keys)
    if suffix != ".parquet":
        # A label or a reason may begin like a formula.
        table = table.map(lambda cell: cell_of_text(cell) if isinstance(cell, str) else cell)
        table.columns = [cell_of_text(name) for name in table.columns]
    if str(options.output) == "-":
        table.to_csv(sys.stdout, index=False, lineterminator="\n")
    else:
        to_csv = partial(table.to_csv, lineterminator="\n")
        to_file = table.to_parquet if suffix == ".parquet" else to_csv
        write(options, {options.output: lambda path: to_file(path, index=False)})
    return BAD_FILE if is_damaged else 0
