"""`ballplate export`: a sweep's results as one table for other programs."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..sweeps.store import Store

WRONG_USAGE, BAD_FILE = 2, 3


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser: ArgumentParser = commands.add_parser(
        "export",
        help="write a sweep's results as CSV or Parquet",
        description="Write a row for each cell of a store and a column for each figure, in metres and radians, with "
        "the unit in the column's name.",
    )
    add_store(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        type=Path,
        required=True,
        help="table, .csv or .parquet; - for CSV on the screen",
    )
    parser.set_defaults(run=run)


def add_store(parser: ArgumentParser) -> None:
    """Add the store and the choice of a sweep in it."""
    parser.add_argument("store", metavar="STORE", type=Path, help="store that ballplate sweep has made")
    parser.add_argument("--sweep", metavar="N", type=int, help="which sweep of the store; default: the newest")


def warn_of_other_methods(store: Store, sweep: int) -> None:
    """Tell of rows that this version would compute by another method."""
    from ..sweeps.store import of_other_methods

    for text in of_other_methods(store, sweep):
        print(f"{store.path}: {text}; run ballplate sweep again to compute them anew", file=sys.stderr)


def run(options: Namespace) -> int:
    """Write the table."""
    from ballplate.simulator.spreadsheets import cell_of_text

    from ..sweeps.frame import frame
    from ..sweeps.store import StoreError, chosen_sweep, open_store

    suffix = options.output.suffix.lower()
    if suffix not in (".csv", ".parquet") and str(options.output) != "-":
        print(f"ballplate export: {options.output} should end in .csv or .parquet", file=sys.stderr)
        return WRONG_USAGE
    if options.output.resolve() == options.store.resolve():
        print(f"ballplate export: -o {options.output} is the store itself; name another file", file=sys.stderr)
        return WRONG_USAGE
    try:
        with closing(open_store(options.store)) as store:
            table = frame(store, options.sweep)
            warn_of_other_methods(store, chosen_sweep(store, options.sweep))
    except StoreError as error:
        print(error, file=sys.stderr)
        return BAD_FILE
    if suffix != ".parquet":
        # A label or a reason may begin like a formula.
        table = table.map(lambda cell: cell_of_text(cell) if isinstance(cell, str) else cell)
        table.columns = [cell_of_text(name) for name in table.columns]
    if str(options.output) == "-":
        table.to_csv(sys.stdout, index=False)
        return 0
    try:
        if suffix == ".csv":
            table.to_csv(options.output, index=False)
        else:
            table.to_parquet(options.output, index=False)
    except ImportError:
        text = "Parquet needs pyarrow; install it with: python -m pip install 'ballplate[parquet]'"
        print(f"ballplate export: {text}", file=sys.stderr)
        return BAD_FILE
    except OSError as error:
        print(f"{options.output}: cannot be written ({error.strerror or error}); check the folder", file=sys.stderr)
        return BAD_FILE
    return 0
