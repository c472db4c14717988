"""`ballplate report`: a sweep's results as a page for people, or as tables for a document."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from contextlib import closing
from pathlib import Path

from .export import add_store, warn_of_damage, warn_of_other_methods
from .outputs import PAGE, add_force, add_output, write_outputs

WRONG_USAGE, BAD_FILE = 2, 3

SUFFIXES = {
    ".html": "html",
    ".htm": "html",
    ".txt": "text",
    ".md": "markdown",
    ".csv": "csv",
    ".tex": "latex",
}


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser: ArgumentParser = commands.add_parser(
        "report",
        help="write a sweep's results as an HTML page, or its tables",
        description=(
            "Write the results of a sweep as one HTML page that needs no network: tables,"
            " plots, rank, the best and the worst design; with --format text, markdown, csv or"
            " latex, the tables alone. From a damaged store, the cells that can be read are"
            " reported, and the exit status is 3."
        ),
    )
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
        choices=("html", "text", "markdown", "csv", "latex"),
        help="default: by the ending of FILE, or html",
    )
    parser.add_argument(
        "--run-modules",
        action="store_true",
        help="run the sweep's error models in Python, which drawings of its designs need",
    )
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Write the report."""
    from ballplate.simulator.inputs.messages import in_one_line

    from ..report.results import read_results
    from ..sweeps.store import StoreError, open_store

    output: Path | None = options.output
    if str(output) == "-":
        output = None
    suffix = "" if output is None else output.suffix.lower()
    if options.format is None and suffix not in ("", *SUFFIXES):
        endings = ", ".join(SUFFIXES)
        print(
            f"ballplate report: {output} should end in one of {endings}; or state --format",
            file=sys.stderr,
        )
        return WRONG_USAGE
    form = options.format or SUFFIXES.get(suffix, "html")
    if form == "html" and PAGE.is_missing:
        print(f"ballplate report: {PAGE.told}", file=sys.stderr)
        return BAD_FILE
    try:
        with closing(open_store(options.store)) as store:
            results = read_results(store, options.sweep)
            is_damaged = warn_of_damage(store.path, results.found, len(results.cells))
            warn_of_other_methods(store.path, results.found.keys)
            if form == "html":
                from ..report.page import page
                from .progress import progress

                with progress(options) as shown:
                    text = page(store, results, options.run_modules, shown.show)
            else:
                from ..presentation.formats import FORMATS
                from ..report.tables import report_tables

                text = FORMATS[form](results.title, report_tables(results))
            if not results.count("done") and not is_damaged:
                told = f"none of its {len(results.cells)} cells is done; ballplate sweep continues"
                print(in_one_line(f"{store.path}: {told}"), file=sys.stderr)
    except StoreError as error:
        print(error, file=sys.stderr)
        return BAD_FILE
    if output is None:
        sys.stdout.write(text)
        return BAD_FILE if is_damaged else 0
    content = text.encode("utf-8", "replace")
    if not write_outputs({output: lambda path: path.write_bytes(content)}, options.force):
        return BAD_FILE
    return BAD_FILE if is_damaged else 0
