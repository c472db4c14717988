"""`ballplate export`: a sweep's results as one table for other programs."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from .outputs import PARQUET, add_force, add_output, write_outputs

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ..sweeps.store import StoredResults

WRONG_USAGE, BAD_FILE = 2, 3


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser: ArgumentParser = commands.add_parser(
        "export",
        help="write a sweep's results as CSV or Parquet",
        description=(
            "Write a row for each cell of a store and a column for each figure, in metres and"
            " radians, with the unit in the column's name. Of a damaged store these are the cells"
            " that can be read; the exit status then is 3."
        ),
    )
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
    parser.set_defaults(run=run)


def add_store(parser: ArgumentParser) -> None:
    """Add the store and the choice of a sweep in it."""
    parser.add_argument(
        "store", metavar="STORE", type=Path, help="store that ballplate sweep has made"
    )
    parser.add_argument(
        "--sweep", metavar="N", type=int, help="which sweep of the store; default: the newest"
    )


def warn_of_other_methods(path: Path, keys: Iterable[str]) -> None:
    """Tell of rows that this version would compute by another method."""
    from ballplate.simulator.inputs.messages import in_one_line

    from ..sweeps.store import of_other_methods

    for text in of_other_methods(keys):
        print(
            in_one_line(f"{path}: {text}; run ballplate sweep again to compute them anew"),
            file=sys.stderr,
        )


def warn_of_damage(path: Path, results: StoredResults, count: int) -> bool:
    """Tell what of a store could not be read; whether there is anything."""
    from ..sweeps.store import unread
    from ..sweeps.store_file import GO_ON

    go_on = GO_ON if results.damage else "ballplate sweep computes anew what is missing"
    text = unread(path, results.unreadable, results.strays, count, results.damage, go_on)
    if text:
        print(text, file=sys.stderr)
    return bool(text)


def run(options: Namespace) -> int:
    """Write the table."""
    from ballplate.simulator.inputs.spreadsheets import cell_of_text

    from ..sweeps.frame import frame_of
    from ..sweeps.store import StoreError, chosen_sweep, definition_of, open_store, results

    suffix = options.output.suffix.lower()
    if suffix not in (".csv", ".parquet") and str(options.output) != "-":
        print(f"ballplate export: {options.output} should end in .csv or .parquet", file=sys.stderr)
        return WRONG_USAGE
    try:
        with closing(open_store(options.store)) as store:
            number = chosen_sweep(store, options.sweep)
            try:
                defined = definition_of(store, number)
            except StoreError as error:
                print(error, file=sys.stderr)
                defined = None
            found = results(store, number, None if defined is None else len(defined["cells"]))
            count = (
                len(found.cells) + len(found.unreadable)
                if defined is None
                else len(defined["cells"])
            )
            is_damaged = warn_of_damage(store.path, found, count) or defined is None
            table = frame_of(found, defined)
            warn_of_other_methods(store.path, found.keys)
    except StoreError as error:
        print(error, file=sys.stderr)
        return BAD_FILE
    if suffix != ".parquet":
        # A label or a reason may begin like a formula.
        table = table.map(lambda cell: cell_of_text(cell) if isinstance(cell, str) else cell)
        table.columns = [cell_of_text(name) for name in table.columns]
    if str(options.output) == "-":
        table.to_csv(sys.stdout, index=False, lineterminator="\n")
        return BAD_FILE if is_damaged else 0
    write = table.to_parquet if suffix == ".parquet" else partial(table.to_csv, lineterminator="\n")
    if not write_outputs({options.output: lambda path: write(path, index=False)}, options.force):
        return BAD_FILE
    return BAD_FILE if is_damaged else 0
