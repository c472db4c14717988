"""`ballplate reproduce`: the published experiments of a document, computed anew beside what it prints."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from .common import count

WRONG_USAGE = 2


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser = commands.add_parser(
        "reproduce",
        help="compute a document's published experiments and set its figures beside ours",
        description="Compute the experiments of NPL Report CISE 15/98, sections 5 and 6, from the shipped designs. "
        "Every legible figure stands beside ours with the ratio and what the comparison rests on; statements on rank, "
        "errata and open differences likewise. The exit status is 0 if all of it agrees within what is stated, "
        "otherwise 1.",
    )
    parser.add_argument("document", metavar="DOCUMENT", choices=("npl",), help="npl: NPL Report CISE 15/98")
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
        default=Path("designs", "npl"),
        help="where the shipped designs are; default: designs/npl below the current folder",
    )
    parser.add_argument("--quick", action="store_true", help="leave out what needs synthetic data sets (6.2.7)")
    parser.add_argument(
        "--trials", metavar="N", type=count, default=100, help="number of data sets for 6.2.7; default 100"
    )
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="print a JSON object in metres and radians")
    form.add_argument("--markdown", action="store_true", help="print Markdown")
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Reproduce a document; 1 if a published figure does not come out within the limits stated."""
    import sys

    from simulator.settings import hint

    from ..reproduction.compare import reproduce
    from ..reproduction.published import npl
    from ..reproduction.shipped import Shipped
    from ..reproduction.tables import reproduction_data, reproduction_lines, reproduction_markdown
    from .common import print_json, print_lines
    from .progress import ProgressBar

    document = npl()
    known = document.statements.sections
    for name in options.experiment:
        if name not in known:
            print(f'ballplate reproduce: no experiment "{name}"; {hint(name, known)}', file=sys.stderr)
            return WRONG_USAGE
    bars: dict[str, ProgressBar] = {}

    def report(what: str, done: int, wanted: int) -> None:
        if what not in bars:
            bars[what] = ProgressBar(what)
        bars[what].show(done, wanted)
        if done == wanted:
            bars[what].close()

    trials = None if options.quick else options.trials
    try:
        found = reproduce(document, Shipped(options.designs), options.experiment, trials, report)
    finally:
        for bar in bars.values():
            bar.close()
    if options.json:
        print_json([reproduction_data(found)])
    elif options.markdown:
        print(reproduction_markdown(found))
    else:
        print_lines(reproduction_lines(found))
    return 0 if found.agrees else 1
