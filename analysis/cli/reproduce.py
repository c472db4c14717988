"""`ballplate reproduce`: published experiments and certified problems, computed anew beside what is
printed of them.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from .common import trial_count
from .outputs import UsageError

HELP = "compute published experiments or certified problems, and compare the figures"
DESCRIPTION = (
    "npl: compute the experiments of NPL Report CISE 15/98, sections 5 and 6, from the"
    " shipped designs. Every legible figure is printed beside the computed one, with the"
    " ratio and the basis of the comparison, as are statements on rank, errata and open"
    " differences. The exit status is 0 if everything agrees within the stated limits,"
    " otherwise 1. certified: solve the problems with certified answers, and count the"
    " digits that agree, or with --results those of another program. The exit status is"
    " 0 if every rank and every count is right and every quantity has an answer,"
    " otherwise 1."
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
    """Reproduce a document; 1 if a published figure does not come out within the limits stated."""
    if options.document == "certified":
        return _certified(options)
    if options.results:
        raise UsageError("--results goes with certified only; leave it out")

    from ballplate.designs import shipped
    from ballplate.simulator.inputs.settings import hint

    from ..reproduction.compare import reproduce
    from ..reproduction.published import npl
    from ..reproduction.reproduction_tables import (
        reproduction_data,
        reproduction_lines,
        reproduction_markdown,
    )
    from ..reproduction.shipped import Shipped
    from .common import print_json, print_lines
    from .progress import progress

    document = npl()
    known = document.statements.sections
    for name in options.experiment:
        if name not in known:
            raise UsageError(f'no experiment "{name}"; {hint(name, known)}')
    trials = None if options.quick else options.trials
    with progress(options) as shown:
        found = reproduce(
            document,
            Shipped(options.designs or shipped("npl")),
            options.experiment,
            trials,
            shown.show,
        )
    if options.json:
        print_json([reproduction_data(found)])
    elif options.markdown:
        print(reproduction_markdown(found))
    else:
        print_lines(reproduction_lines(found))
    return 0 if found.agrees else 1


def _certified(options: Namespace) -> int:
    """Score answers to certified problems; 1 if a rank or count is wrong, or an answer is
    missing.
    """
    from ballplate.designs import shipped

    from ..reproduction.certified_answers import answers
    from ..reproduction.certified_problems import certified_problems, read_results
    from ..reproduction.score import all_right, scores
    from ..reproduction.score_tables import score_data, score_lines
    from .common import print_json, print_lines
    from .progress import progress

    if options.quick or options.markdown:
        raise UsageError("--quick and --markdown go with npl only; leave them out")
    problems = certified_problems(options.designs or shipped("certified"), options.experiment)
    if options.results:
        results = read_results(options.results, problems)
    else:
        results = {}
        with progress(options) as shown:
            for done, problem in enumerate(problems):
                shown.show("problems", done, len(problems))
                results[problem.name] = answers(problem)
    found = [
        one
        for problem in problems
        for one in scores(problem.name, problem.answers, results.get(problem.name))
    ]
    if options.json:
        print_json([score_data(found, results)])
    else:
        print_lines(score_lines(problems, found))
    return 0 if all_right(found) else 1
