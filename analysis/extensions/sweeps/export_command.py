"""`ballplate sweep --export`: write a sweep's results as one table for other programs."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from contextlib import closing
from functools import partial
from pathlib import Path

from ballplate.cli import PARQUET, XLSX, UsageError, add_force, add_output, complain, write

BAD_FILE = 3

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
        needed=lambda path: {".parquet": PARQUET, ".xlsx": XLSX}.get(path.suffix.lower()),
        help="table, .csv, .xlsx or .parquet; - for CSV on the screen",
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


def run(options: Namespace) -> int:
    """Write the table."""
    from ballplate.simulator.inputs import cell_of_text, in_one_line, number_of

    from .frame import frame_of
    from .store import chosen_sweep, open_store, results
    from .store_file import RECOMPUTE

    suffix = options.output.suffix.lower()
    if suffix not in (".csv", ".xlsx", ".parquet") and str(options.output) != "-":
        raise UsageError(f"{options.output} should end in .csv, .xlsx or .parquet")
    with closing(open_store(options.store, damaged=True)) as store:
        number, defined = chosen_sweep(store, options.sweep)
        stored = results(store, number, len(defined["cells"]))
        table = frame_of(stored, defined).drop(columns="drawing", errors="ignore")
    if stored.damaged:
        counted = number_of(len(stored.damaged), "unreadable case")
        first, fault = min(stored.damaged.items())
        text = f"{counted}, from {first} ({fault}); restore a copy, or {RECOMPUTE}"
        complain(in_one_line(f"{options.store}: {text}"))
    if suffix != ".parquet":
        # A label or a reason may begin like a formula.
        table = table.map(lambda cell: cell_of_text(cell) if isinstance(cell, str) else cell)
        table.columns = [cell_of_text(name) for name in table.columns]
    if str(options.output) == "-":
        table.to_csv(sys.stdout, index=False, lineterminator="\n")
    else:
        forms = {".parquet": table.to_parquet, ".xlsx": table.to_excel}
        to_file = forms.get(suffix, partial(table.to_csv, lineterminator="\n"))
        write(options, {options.output: lambda path: to_file(path, index=False)})
    return BAD_FILE if stored.damaged else 0
