"""`ballplate reproduce`: compare published values, or solve certified problems."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ballplate.cli import UsageError, trial_count

DESCRIPTION = (
    "npl: compute the experiments of NPL Report CISE 15/98, sections 5 and 6, from the"
    " shipped designs. Print every legible value with the computed one, their ratio and"
    " the assumptions, also statements on rank, errata and open differences. Exit status:"
    " 0 if everything agrees within the stated limits, otherwise 1. certified: solve the"
    " problems with certified answers, and count the digits that agree, or with --results"
    " those of another program. Exit status: 0 if every rank and every count is correct"
    " and every quantity has an answer, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    parser.add_argument(
        "document",
        metavar="DOCUMENT",
        choices=("npl", "certified"),
        help="npl: NPL Report CISE 15/98; certified: the problems with certified answers",
    )
    parser.add_argument(
        "--experiment",
        metavar="SECTION",
        action="append",
        default=[],
        help=(
            "only the experiment of this section, such as 6.2.1, or the problem of this name; may"
            " be repeated"
        ),
    )
    parser.add_argument(
        "--designs",
        metavar="FOLDER",
        type=Path,
        default=None,
        help="where the shipped designs are; default: those that come with ballplate",
    )
    parser.add_argument(
        "--results",
        metavar="FILE",
        type=Path,
        help="with certified: score the answers in this JSON file instead of ballplate's own",
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
    form = parser.add_mutually_exclusive_group()
    form.add_argument(
        "--json", action="store_true", help="print a JSON object in metres and radians"
    )
    form.add_argument("--markdown", action="store_true", help="print Markdown")


def run(options: Namespace) -> int:
    """Reproduce a document and return 1 unless everything agrees."""
    from ballplate.cli import print_json, print_lines, progress

    from .reproduction_result import ReproducedDocument, reproduce_npl
    from .score_result import CertifiedScores, score_certified

    is_certified = options.document == "certified"
    if is_certified and (options.quick or options.markdown):
        raise UsageError("--quick and --markdown apply to npl only; leave them out")
    if options.results and not is_certified:
        raise UsageError("--results applies to certified only; leave it out")
    chosen, folder = options.experiment, options.designs
    result: CertifiedScores | ReproducedDocument
    try:
        with progress(options) as shown:
            if is_certified:
                result = score_certified(chosen, options.results, folder, shown.show)
            else:
                trials = None if options.quick else options.trials
                result = reproduce_npl(chosen, trials, folder, shown.show)
    except ValueError as error:
        raise UsageError(error) from None
    if options.json:
        print_json([result.to_dict()])
    elif options.markdown:
        print(result.to_markdown())
    else:
        print_lines(result.lines())
    return 0 if result.is_right else 1
