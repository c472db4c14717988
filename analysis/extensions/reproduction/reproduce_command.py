"""`ballplate reproduce`: compare published values with ballplate's."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ballplate.cli import UsageError, print_json, print_lines, progress, trial_count

DESCRIPTION = (
    "Compute the experiments of NPL Report CISE 15/98, sections 5 and 6, from the shipped designs."
    " Print every legible value and every statement on rank, averages, iterations and misprints"
    " with the computed one, their ratio and its limits. Exit status: 0 if everything agrees"
    " within the limits, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    parser.add_argument(
        "document",
        metavar="DOCUMENT",
        choices=("npl",),
        help="npl: NPL Report CISE 15/98",
    )
    parser.add_argument(
        "--experiment",
        metavar="SECTION",
        action="append",
        default=[],
        help="only the experiment of this section, such as 6.2.1; may be repeated",
    )
    parser.add_argument(
        "--designs",
        metavar="FOLDER",
        type=Path,
        default=None,
        help="where the shipped designs are; default: those that come with ballplate",
    )
    parser.add_argument(
        "--quick", action="store_true", help="leave out what needs synthetic data sets (6.2.7)"
    )
    parser.add_argument(
        "--trials",
        metavar="N",
        type=trial_count,
        default=100,
        help="number of data sets for 6.2.7; default 100",
    )
    parser.add_argument(
        "--json", action="store_true", help="print a JSON object in metres and radians"
    )


def run(options: Namespace) -> int:
    """Reproduce the report and return 1 unless everything agrees."""

    from .reproduction_result import reproduce_npl

    try:
        with progress(options) as shown:
            trials = None if options.quick else options.trials
            result = reproduce_npl(options.experiment, trials, options.designs, shown.show)
    except ValueError as error:
        raise UsageError(error) from None
    if options.json:
        print_json([result.to_dict()])
    else:
        print_lines(result.lines())
    return 0 if result.is_right else 1
