"""`ballplate sweep --report`: write a page of a sweep's results, or their table."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from contextlib import closing
from pathlib import Path

from ballplate.cli import UsageError, add_force, add_output, complain, write

from .export_command import add_store

SUFFIXES = {
    ".html": "html",
    ".htm": "html",
    ".txt": "text",
    ".md": "markdown",
    ".tex": "latex",
}


DESCRIPTION = (
    "Write the results of a sweep as one HTML page that needs no network: the best case and the"
    " cheapest that meets the target, effects of the axes, all cases, and their designs; with"
    " --format text, markdown or latex, the table alone. Exit status: 3 if the store is damaged."
)


def add_options(parser: ArgumentParser) -> None:
    add_store(parser)
    add_output(
        parser,
        "-o",
        "--output",
        metavar="FILE",
        takes_screen=True,
        help="page or table; default, and -: the screen",
    )
    add_force(parser)
    parser.add_argument(
        "--format",
        choices=tuple(dict.fromkeys(SUFFIXES.values())),
        help="default: by the ending of FILE, or html",
    )


def run(options: Namespace) -> int:
    """Write the report."""
    from .running import stored_result
    from .store import open_store

    output: Path | None = options.output
    if str(output) == "-":
        output = None
    suffix = "" if output is None else output.suffix.lower()
    if options.format is None and suffix not in ("", *SUFFIXES):
        endings = ", ".join(SUFFIXES)
        raise UsageError(f"{output} should end in one of {endings}; or state --format")
    with closing(open_store(options.store)) as store:
        result = stored_result(store, options.sweep)
    forms = {
        "html": result.page_text,
        "text": lambda: f"{result}\n",
        "markdown": result.to_markdown,
        "latex": result.to_latex,
    }
    text = forms[options.format or SUFFIXES.get(suffix, "html")]()
    if not result.summary.done:
        counted = f"0 of {result.summary.cells} cases done"
        complain(f"{options.store}: {counted}; to continue, run ballplate sweep again")
    if output is None:
        sys.stdout.write(text)
    else:
        content = text.encode("utf-8", "replace")
        write(options, {output: lambda path: path.write_bytes(content)})
    return 0
