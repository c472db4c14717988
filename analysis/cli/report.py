"""`ballplate report`: a sweep's results as a page for people, or as tables for a document."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from contextlib import closing
from pathlib import Path

from .export import add_store, warn_of_other_methods

WRONG_USAGE, BAD_FILE = 2, 3

SUFFIXES = {".html": "html", ".htm": "html", ".txt": "text", ".md": "markdown", ".csv": "csv", ".tex": "latex"}


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser: ArgumentParser = commands.add_parser(
        "report",
        help="write a sweep's results as an HTML page, or its tables",
        description="Write what a sweep has found as one HTML page that needs no network: tables, plots, rank, the "
        "best and the worst design. With --format text, markdown, csv or latex the tables alone.",
    )
    add_store(parser)
    parser.add_argument("-o", "--output", metavar="FILE", type=Path, help="page or tables; default, and -: the screen")
    parser.add_argument(
        "--format",
        choices=("html", "text", "markdown", "csv", "latex"),
        help="default: by the ending of FILE, or html",
    )
    parser.add_argument(
        "--run-modules",
        action="store_true",
        help="run error models in Python that the sweep uses, which the drawings of its designs need",
    )
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Write the report."""
    from ..report.results import read_results
    from ..sweeps.store import StoreError, chosen_sweep, open_store

    output: Path | None = options.output
    if output is not None and output.resolve() == options.store.resolve():
        print(f"ballplate report: -o {output} is the store itself; name another file", file=sys.stderr)
        return WRONG_USAGE
    if str(output) == "-":
        output = None
    suffix = "" if output is None else output.suffix.lower()
    if options.format is None and suffix not in ("", *SUFFIXES):
        endings = ", ".join(SUFFIXES)
        print(f"ballplate report: {output} should end in one of {endings}; or state --format", file=sys.stderr)
        return WRONG_USAGE
    form = options.format or SUFFIXES.get(suffix, "html")
    try:
        with closing(open_store(options.store)) as store:
            results = read_results(store, options.sweep)
            warn_of_other_methods(store, chosen_sweep(store, options.sweep))
            if form == "html":
                from ..report.page import page

                text = page(store, results, options.run_modules)
            else:
                from ..report.tables import report_tables
                from ..results.formats import FORMATS

                text = FORMATS[form](results.title, report_tables(results))
    except StoreError as error:
        print(error, file=sys.stderr)
        return BAD_FILE
    except ImportError as error:
        if error.name is None or error.name.partition(".")[0] not in ("jinja2", "markupsafe", "matplotlib"):
            raise
        told = "a page needs jinja2 and matplotlib; install them with: python -m pip install 'ballplate[report]'"
        print(f"ballplate report: {told}", file=sys.stderr)
        return BAD_FILE
    if output is None:
        sys.stdout.write(text)
        return 0
    try:
        output.write_bytes(text.encode("utf-8", "replace"))
    except OSError as error:
        print(f"{output}: cannot be written ({error.strerror or error}); check the folder", file=sys.stderr)
        return BAD_FILE
    return 0
