"""`ballplate fit`: the estimate from real readings."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path

from ..estimators.estimator_choice import DRAWN, ESTIMATORS, TAKE, fit_readings, takers
from .common import add_file, add_json, add_picture
from .compare import add_pairs
from .outputs import add_force, write_outputs

WRONG_USAGE, BAD_FILE = 2, 3


# In one piece: one option after the other, with its help.
def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser = commands.add_parser(
        "fit",
        help="estimate machine errors, balls and poses from readings",
        description=(
            "Estimate all parameters of an experiment from a CSV file of readings with the columns"
            " position, ball, probe, x_mm, y_mm, z_mm (or another unit). The exit status is 0 if"
            " the estimate converged and the rank is as expected, otherwise 1."
        ),
    )
    add_file(parser)
    parser.add_argument("readings", metavar="READINGS", type=Path, help="readings (CSV)")
    parser.add_argument(
        "--certificate",
        metavar="CSV",
        type=Path,
        help=(
            "values of certificates, priors and probe offsets in place of the experiment file's, as"
            " simulate --certificate writes them"
        ),
    )
    parser.add_argument(
        "--sigma",
        choices=("estimated", "given"),
        help=(
            "scale the uncertainties by the residuals, or take them as stated; default: what the"
            " file says"
        ),
    )
    parser.add_argument(
        "--monomials",
        action="store_true",
        help="report error functions by the coefficients of t, t^2, ... on [0, 1]",
    )
    parser.add_argument(
        "--estimator",
        choices=ESTIMATORS,
        default="full",
        help=(
            "full (default); distances, cresto or kruth, which use distances alone and estimate the"
            " machine's parameters only; reversal, of a plate in two dimensions and two positions a"
            " quarter turn apart; length-equations or sphere-then-metric, of ball bars and Bryan"
            " gauges"
        ),
    )
    add_pairs(parser)
    parser.add_argument(
        "--scale",
        choices=("x", "y", "split", "none"),
        help="with reversal: which axis takes the scale difference; default: what the file says",
    )
    parser.add_argument(
        "--no-offsets",
        action="store_true",
        help=(
            "with reversal: leave out the offsets between the positions, three parameters instead"
            " of five"
        ),
    )
    add_picture(
        parser,
        "--plot",
        help=("draw the residuals as magnified vectors (.svg, .png or .pdf)"),
    )
    add_force(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Fit one experiment; 1 if there is something to complain of."""
    from ballplate.simulator.experiment.layout import lay_out
    from ballplate.simulator.inputs.messages import in_one_line
    from ballplate.simulator.readings.certificate_files import read_certificate
    from ballplate.simulator.readings.reading_files import read_readings

    from .common import print_json, print_lines, single

    refusal = _refusal(options)
    if refusal:
        print(f"ballplate fit: {refusal}", file=sys.stderr)
        return WRONG_USAGE
    experiment = single(options)
    if options.certificate:
        experiment = read_certificate(options.certificate, experiment)
    observed = read_readings(options.readings, lay_out(experiment))
    for remark in observed.remarks:
        print(in_one_line(f"{options.readings}: {remark}"), file=sys.stderr)
    for doubt in observed.doubts:
        print(f"warning: {doubt}", file=sys.stderr)
    result = fit_readings(
        experiment,
        observed,
        options.estimator,
        options.sigma,
        options.monomials,
        options.pairs,
        options.across_probes,
        options.scale,
        not options.no_offsets,
    )
    is_drawn = (
        not options.plot
        or not result.converged
        or write_outputs({options.plot: result.plot}, options.force)
    )
    if options.json:
        print_json([result.to_dict()])
    else:
        print_lines(result.lines())
    for caution in result.cautions if is_drawn else ():
        print(f"warning: {caution}", file=sys.stderr)
    if not is_drawn:
        return BAD_FILE
    if result.complaint:
        print(result.complaint, file=sys.stderr)
    return 1 if result.complaint else 0


def _refusal(options: Namespace) -> str:
    """Why the options do not go together; empty where they do."""
    given = [name for name in TAKE if getattr(options, name, False)]
    given += ["offsets"] if options.no_offsets else []
    wrong = takers(options.estimator, given)
    if wrong is not None:
        name, estimators = wrong
        option = {"offsets": "no-offsets"}.get(name, name).replace("_", "-")
        return f"--{option} goes with --estimator {estimators} only; leave it out"
    first, second = options.files[0], options.readings
    if first.suffix.lower() == ".csv" and second.suffix.lower() in (".yaml", ".yml"):
        return f"the experiment file comes first, then the readings: fit {second} {first}"
    if options.plot and options.estimator not in DRAWN:
        return "--plot draws residuals by the full estimator or reversal; leave it out"
    return ""
