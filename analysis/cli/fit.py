"""`ballplate fit`: the estimate from real readings."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.results.estimator_choice import DRAWN, ESTIMATORS, TAKE, fit_readings, takers
from ballplate.simulator.inputs.extensions import service

from .common import add_json, add_page, add_picture, day, map_path, show
from .notes import note_singular_values, warn
from .outputs import UsageError, add_force, add_output, write
from .reading_options import add_pairs, add_readings, observed_readings, warn_of

if TYPE_CHECKING:
    from ballplate.presentation.files import Writer

DESCRIPTION = (
    "Estimate all parameters of an experiment from readings: a CSV file with the columns position,"
    " ball, probe, x_mm, y_mm, z_mm (or another unit), or tables that measuring programs write. The"
    " exit status is 0 if the estimate converged, the rank is as expected and no lack of fit is"
    " beyond the limit, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    add_readings(parser)
    parser.add_argument(
        "--monomials",
        action="store_true",
        help="report error functions by the coefficients of t, t^2, ... on [0, 1]",
    )
    _add_estimators(parser)
    add_picture(
        parser,
        "--plot",
        help=("draw the residuals as magnified vectors (.svg, .png or .pdf)"),
    )
    add_output(
        parser,
        "-o",
        "--output",
        metavar="MAP",
        type=map_path,
        help="write the map of the machine, with its covariance (.yaml)",
    )
    parser.add_argument(
        "--date",
        type=day,
        metavar="DAY",
        help="with -o: day of the campaign, such as 2026-11-22, which the map is to state",
    )
    add_page(parser, "write the fit as a page of HTML that needs no other file and no network")
    add_force(parser)
    add_json(parser)


def _add_estimators(parser: ArgumentParser) -> None:
    """Add the choice of an estimator, and the options of some estimators."""
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


def run(options: Namespace) -> int:
    """Fit one experiment; 1 if there is something to complain of."""
    from ballplate.results.fits import Fit

    _refuse_misused(options)
    experiment, observed = observed_readings(options)
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
    contents: dict[Path | None, Writer] = {options.report: result.report}
    if result.converged:
        contents[options.plot] = result.plot
    if options.output and isinstance(result, Fit) and result.converged:
        fitted = result.to_map(options.date)
        contents[options.output] = partial(service("write_map"), fitted)
    write(options, contents)
    if options.output and options.output in contents and fitted.left_out:
        warn([service("left_out_words")(fitted)])
    show(options, result)
    if isinstance(result, Fit):
        note_singular_values(options, result.verdict)
    return warn_of(result)


def _refuse_misused(options: Namespace) -> None:
    """Refuse options that do not go together.

    :raises UsageError: there are such.
    """
    names_misused = [name for name in TAKE if getattr(options, name, False)]
    names_misused += ["offsets"] if options.no_offsets else []
    wrong = takers(options.estimator, names_misused)
    if wrong is not None:
        name, estimators = wrong
        option = {"offsets": "no-offsets"}.get(name, name).replace("_", "-")
        raise UsageError(f"--{option} applies to --estimator {estimators} only; leave it out")
    if options.output and options.estimator != "full":
        raise UsageError("-o writes the map of the full estimator; leave it out")
    if options.output:
        # Refused before the estimate where its extension is missing.
        service("write_map")
    if options.date and not options.output:
        raise UsageError("--date applies to -o only; leave it out")
    if options.plot and options.estimator not in DRAWN:
        raise UsageError("--plot draws residuals by the full estimator or reversal; leave it out")
    if options.report and options.estimator != "full":
        raise UsageError("--report writes the page of the full estimator; leave it out")
