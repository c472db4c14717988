"""`ballplate fit`: the estimate from real readings."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from .common import add_file, add_json, add_picture
from .compare import add_pairs
from .estimators import ESTIMATORS
from .outputs import UsageError, add_force, write
from .telling import complain, warn

if TYPE_CHECKING:
    from ballplate.simulator.experiment.model import Experiment
    from ballplate.simulator.readings.reading_files import ObservedReadings

    from ..results.fit import Fit

HELP = "estimate machine errors, balls and poses from readings"
DESCRIPTION = (
    "Estimate all parameters of an experiment from a CSV file of readings with the columns"
    " position, ball, probe, x_mm, y_mm, z_mm (or another unit). The exit status is 0 if"
    " the estimate converged and the rank is as expected, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
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
        choices=("full", *ESTIMATORS),
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
        help=(
            "draw the residuals of a two-dimensional experiment as magnified vectors (.svg, .png or"
            " .pdf)"
        ),
    )
    add_force(parser)
    add_json(parser)


OF_DISTANCES = ("distances", "cresto", "kruth")


def run(options: Namespace) -> int:
    """Fit one experiment; 1 if it did not converge or its rank is not as expected."""
    from ballplate.simulator.design.layout import lay_out
    from ballplate.simulator.readings.certificate_files import read_certificate
    from ballplate.simulator.readings.reading_files import read_readings

    from ..results.study import fit
    from .common import show, single

    _refuse_misused(options)
    experiment = single(options)
    if options.certificate:
        experiment = read_certificate(options.certificate, experiment)
    if options.plot and (
        experiment.dimension != 2 or options.estimator not in ("full", "reversal")
    ):
        raise UsageError(
            "--plot draws residuals of readings in two dimensions, by the full estimator or"
            " reversal; leave it out"
        )
    observed = read_readings(options.readings, lay_out(experiment))
    _warn_of_readings(options, observed)
    if options.estimator != "full":
        return _run_other(options, experiment, observed)
    result = fit(experiment, observed, options.sigma, options.monomials)
    if options.plot and result.converged:
        write(options, {options.plot: result.plot})
    show(options, result)
    if not result.converged:
        complain(
            f"the estimate has {result.solution.status} and nothing is made of it: see the record"
            " of iterations, and look for wrong units, balls or probes among the readings"
        )
        return 1
    _warn(result)
    if not result.verdict.as_expected:
        complain(result.verdict.complaint)
        return 1
    return 0


def _refuse_misused(options: Namespace) -> None:
    """Refuse options that do not go together.

    :raises UsageError: there are such.
    """
    for option, given, estimators in (
        ("--scale", options.scale, ("reversal",)),
        ("--no-offsets", options.no_offsets, ("reversal",)),
        ("--pairs", options.pairs, OF_DISTANCES),
        ("--across-probes", options.across_probes, OF_DISTANCES),
        ("--monomials", options.monomials, ("full", *OF_DISTANCES)),
    ):
        if given and options.estimator not in estimators:
            wanted = " or ".join(filter(None, (", ".join(estimators[:-1]), estimators[-1])))
            raise UsageError(f"{option} goes with --estimator {wanted} only; leave it out")
    if options.files[0].suffix.lower() == ".csv" and options.readings.suffix.lower() in (
        ".yaml",
        ".yml",
    ):
        raise UsageError(
            f"the experiment file comes first, then the readings: fit {options.readings}"
            f" {options.files[0]}"
        )


def _warn_of_readings(options: Namespace, observed: ObservedReadings) -> None:
    """Warn of readings that are missing or not planned, and of those that are in doubt."""
    from ballplate.simulator.inputs.settings import listing
    from ballplate.simulator.readings.gross_error_messages import (
        doubts_about_lengths,
        doubts_about_volume,
    )

    for what, names in (
        ("planned but not read", observed.missing),
        ("read but not planned", observed.unplanned),
    ):
        if names:
            complain(f"{options.readings}: {what} ({len(names)}): {listing(names)}")
    warn(doubts_about_lengths(observed.design, observed.x))
    warn(doubts_about_volume(observed.design, observed.x, observed.marks))


def _warn(result: Fit) -> None:
    """Warn where the fit leaves more than the stated uncertainties explain, and of its doubts."""
    if result.too_large:
        times = result.solution.factor.sum_of_squares / result.degrees_of_freedom
        advice = (
            "no single mistake explains that: try a richer error model or larger uncertainties, and"
            " think of drifts"
        )
        if result.diagnosis.suspects or result.diagnosis.scatter:
            advice = "look at what is suspected"
        warn([f"S^2 is {times:.3g} times what the stated uncertainties explain; {advice}"])
    warn(result.doubts)


def _run_other(options: Namespace, experiment: Experiment, observed: ObservedReadings) -> int:
    """Fit with another estimator than the full one; 1 if it complains."""
    from .common import print_json, print_lines

    found = ESTIMATORS[options.estimator](options, experiment, observed)
    if options.plot and found.draw:
        write(options, {options.plot: found.draw})
    if options.json:
        print_json([found.data])
    else:
        print_lines(found.lines)
    warn(found.warnings)
    if found.complaint:
        complain(found.complaint)
    return 1 if found.complaint else 0
