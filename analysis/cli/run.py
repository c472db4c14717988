"""`ballplate run`: the uncertainty tables of a design."""

from __future__ import annotations

from argparse import Namespace

from .common import add_file, add_json


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser = commands.add_parser(
        "run",
        help="tell the uncertainties U1 to U6 that a design will give",
        description="Compute the rank and the standard uncertainties U1 to U6 of a design at zero machine error. The "
        "exit status is 0 if the rank is as expected, otherwise 1.",
    )
    add_file(parser, several=True)
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Plan all experiments of the files; 1 if the rank of one is not as expected."""
    from ..study import plan
    from ..tables import plan_data, plan_lines
    from .common import experiments, print_json, print_lines

    plans = []
    for experiment in experiments(options):
        plans.append(plan(experiment))
        if not options.json:
            print_lines([*([""] if len(plans) > 1 else []), *plan_lines(plans[-1])])
    if options.json:
        print_json([plan_data(p) for p in plans])
    return 0 if all(p.verdict.as_expected for p in plans) else 1
