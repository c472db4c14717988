"""`ballplate sweep --report`: write a page of a sweep's results, or their tables."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.cli import UsageError, add_force, add_output, complain, write

from .export_command import add_store, warn_of_damage, warn_of_other_methods
from .interface import FORMS

if TYPE_CHECKING:
    from .report.results import ReportedSweep
    from .report.store_comparison import StoreComparison

BAD_FILE = 3

SUFFIXES = {
    ".html": "html",
    ".htm": "html",
    ".txt": "text",
    ".md": "markdown",
    ".csv": "csv",
    ".tex": "latex",
}


DESCRIPTION = (
    "Write the results of a sweep as one HTML page that needs no network: tables, plots, rank, the"
    " best and the worst design; with --format text, markdown, csv or latex, only the tables. From"
    " a damaged store, report the readable cases. Exit status: 3 if the store is damaged."
)


def add_options(parser: ArgumentParser) -> None:
    add_store(parser)
    add_output(
        parser,
        "-o",
        "--output",
        metavar="FILE",
        takes_screen=True,
        help="page or tables; default, and -: the screen",
    )
    add_force(parser)
    parser.add_argument(
        "--format",
        choices=FORMS,
        help="default: by the ending of FILE, or html",
    )
    parser.add_argument(
        "--run-modules",
        action="store_true",
        help="run the sweep's error models in Python, to draw its designs",
    )

    parser.add_argument(
        "--compare",
        metavar="STORE",
        type=Path,
        help="compare with a store of a sweep over the same axes, on the page",
    )


def run(options: Namespace) -> int:
    """Write the report."""
    from .report.results import read_results
    from .store import open_store

    output: Path | None = options.output
    if str(output) == "-":
        output = None
    suffix = "" if output is None else output.suffix.lower()
    if options.format is None and suffix not in ("", *SUFFIXES):
        endings = ", ".join(SUFFIXES)
        raise UsageError(f"{output} should end in one of {endings}; or state --format")
    form = options.format or SUFFIXES.get(suffix, "html")
    if options.compare is not None and form != "html":
        raise UsageError("--compare is for the page; leave it out, or name a page with -o")
    with closing(open_store(options.store)) as store:
        results = read_results(store, options.sweep)
        is_damaged = warn_of_damage(store.path, results.found)
        warn_of_other_methods(store.path, results.found.keys)
        if form == "html":
            from ballplate.cli import progress

            from .report.page import page

            comparison = _comparison(results, options.compare)
            with progress(options) as shown:
                text = page(store, results, options.run_modules, shown.show, comparison)
        else:
            from ballplate.presentation import FORMATS

            from .report.tables import text_tables

            text = FORMATS[form](results.title, text_tables(results))
        if not results.count("done") and not is_damaged:
            text_of_count = f"0 of {len(results.cells)} cases done"
            complain(f"{store.path}: {text_of_count}; to continue, run ballplate sweep again")
    if output is None:
        sys.stdout.write(text)
    else:
        content = text.encode("utf-8", "replace")
        write(options, {output: lambda path: path.write_bytes(content)})
    return BAD_FILE if is_damaged else 0


def _comparison(results: ReportedSweep, path: Path | None) -> StoreComparison | None:
    """Return the comparison with the newest sweep of another store; None without one.

    :raises UsageError: the two have no quantity in common.
    """
    if path is None:
        return None
    from .report.results import read_results
    from .report.store_comparison import IncomparableError, compared
    from .store import open_store

    with closing(open_store(path)) as store:
        reference = read_results(store, None)
        warn_of_damage(store.path, reference.found)
        try:
            return compared(results, reference, path.name)
        except IncomparableError as error:
            raise UsageError(error) from None
