"""`ballplate compare`: how far a distances-only estimator is from the full one."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ballplate.cli import (
    add_file,
    add_json,
    add_pairs,
    at_most,
    count,
    experiments,
    print_json,
    print_lines,
    progress,
    trial_count,
    whole,
)
from ballplate.results import COMPARED

DESCRIPTION = (
    "Estimate synthetic data sets of the file's true machine with the full estimator"
    " and with another, and compare the distances that the two correct with one another (NPL Report"
    " CISE 15/98, section 6.2.7) and with the true machine's. The exit status is 0 if all estimates"
    " converged, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    add_file(parser, several=True)
    parser.add_argument(
        "--trials",
        metavar="N",
        type=trial_count,
        default=100,
        help="number of data sets; default 100",
    )
    parser.add_argument(
        "--estimator",
        choices=COMPARED,
        default="distances",
        help=(
            "default: distances; of ball bars and Bryan gauges length-equations or"
            " sphere-then-metric; reversal of a plate in two dimensions"
        ),
    )
    add_pairs(parser)
    parser.add_argument("--seed", type=whole, help="seed of the data sets, instead of the file's")
    parser.add_argument(
        "--points", metavar="N", type=_points, default=200, help="pairs of points; default 200"
    )
    add_json(parser)


def _points(text: str) -> int:
    from .distances import MOST_POINTS

    return at_most(count(text), MOST_POINTS, "pairs of points")


def run(options: Namespace) -> int:
    """Compare the estimators for all experiments of the files; 1 if an estimate did not
    converge.
    """

    from .distances import compare_estimators

    results = []
    for experiment in experiments(options):
        with progress(options) as shown:
            comparison = compare_estimators(
                experiment,
                options.trials,
                options.estimator,
                options.pairs,
                options.across_probes,
                options.seed,
                options.points,
                shown.show,
            )
        results.append(comparison)
        if not options.json:
            print_lines([*([""] if len(results) > 1 else []), *comparison.lines()])
    if options.json:
        print_json([comparison.to_dict() for comparison in results])
    return 0 if not any(comparison.failed for comparison in results) else 1
