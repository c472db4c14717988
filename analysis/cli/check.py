"""`ballplate check`: does the design determine what it asks for?"""

from __future__ import annotations

from argparse import Namespace

from .common import add_file, add_json


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser = commands.add_parser(
        "check",
        help="judge whether designs determine all their parameters",
        description="Judge the rank of each design. The exit status is 0 if every deficiency is the one that the "
        "file expects (none, where it says nothing), otherwise 1.",
    )
    add_file(parser, several=True)
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Check all designs; 1 if one of them is not as expected."""
    from ..study import check
    from ..tables import plan_data, plan_lines
    from .common import experiments, print_json, print_lines

    plans = []
    for experiment in experiments(options):
        plans.append(check(experiment))
        if not options.json:
            print_lines(plan_lines(plans[-1]))
    if options.json:
        print_json([plan_data(plan) for plan in plans])
    return 0 if all(plan.verdict.as_expected for plan in plans) else 1
