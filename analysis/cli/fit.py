"""`ballplate fit`: the estimate from real readings."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..estimators.estimator_choice import (
    DRAWN,
    ESTIMATORS,
    TAKE,
    fit_readings,
    misused,
    takers,
)
from ..results.variance_components.groupings import GROUPINGS
from .common import add_file, add_json, add_page, add_picture, day, map_path
from .compare import add_pairs
from .outputs import UsageError, Writer, add_force, add_output, write
from .table_options import add_tables
from .telling import complain, note, warn

HELP = "estimate machine errors, balls and poses from readings"
DESCRIPTION = (
    "Estimate all parameters of an experiment from readings: a CSV file with the columns position,"
    " ball, probe, x_mm, y_mm, z_mm (or another unit), or tables that measuring programs write. The"
    " exit status is 0 if the estimate converged and the rank is as expected, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    add_file(parser)
    readings = parser.add_argument(
        "readings",
        metavar="READINGS",
        nargs="+",
        type=Path,
        default=[],
        help="readings: one table or several; default: readings.files of the experiment file",
    )
    # With nargs="*" none would be looked for behind the first option.
    readings.required = False
    add_tables(parser)
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
    _add_estimators(parser)
    _add_components(parser)
    add_picture(
        parser,
        "--plot",
        help=("draw the residuals as magnified vectors (.svg, .png or .pdf)"),
    )
    add_page(parser, "write the fit as a page of HTML that needs no other file and no network")
    add_output(
        parser,
        "-o",
        "--output",
        metavar="MAP",
        type=map_path,
        help="write the map of the machine, with its covariance (.yaml, or .npz)",
    )
    parser.add_argument(
        "--date",
        type=day,
        metavar="DAY",
        help="with -o: day of the campaign, such as 2026-11-22, which the map is to state",
    )
    add_force(parser)
    add_json(parser)


def _add_estimators(parser: ArgumentParser) -> None:
    """Add the choice of an estimator, and what goes with only some of them."""
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


def _add_components(parser: ArgumentParser) -> None:
    parser.add_argument(
        "--components",
        choices=GROUPINGS,
        metavar="BY",
        help=(
            "estimate how uncertain groups of observations are against what is stated, by axis,"
            " probe, position, artefact or calibration (variance components, REML)"
        ),
    )
    parser.add_argument(
        "--reweight",
        action="store_true",
        help="with --components: fit again with the estimated variances in place of the stated",
    )


def run(options: Namespace) -> int:
    """Fit one experiment; 1 if there is something to complain of."""
    from ballplate.simulator.experiment.layout import lay_out
    from ballplate.simulator.experiment.map_files import write_map
    from ballplate.simulator.readings.certificate_files import read_certificate
    from ballplate.simulator.readings.reading_files import read_readings

    from ..results.correction import left_out_words
    from ..results.fit import Fit
    from .common import show, single
    from .table_options import named_sources, with_options

    _refuse_misused(options)
    experiment = single(options)
    if options.certificate:
        experiment = read_certificate(options.certificate, experiment)
    experiment = with_options(options, experiment)
    sources = options.readings or named_sources(experiment)
    observed = read_readings(sources, lay_out(experiment), settings=experiment.readings)
    for remark in observed.told:
        note(options, remark)
    for remark in observed.remarks[len(observed.told) :]:
        complain(f"{', '.join(map(str, sources))}: {remark}")
    warn(observed.doubts)
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
        options.components,
        options.reweight,
    )
    writers: dict[Path, Writer] = {}
    if options.plot and result.converged:
        writers[options.plot] = result.plot
    if options.report:
        writers[options.report] = result.report
    if options.output and isinstance(result, Fit) and result.converged:
        fitted = result.to_map(options.date)
        writers[options.output] = lambda path: write_map(fitted, path)
        warn([left_out_words(fitted)] if fitted.left_out else [])
    if writers:
        write(options, writers)
    show(options, result)
    warn(result.cautions)
    if result.complaint:
        complain(result.complaint)
    return 1 if result.complaint else 0


def _refuse_misused(options: Namespace) -> None:
    """Refuse options that do not go together.

    :raises UsageError: there are such.
    """
    given = [name for name in TAKE if getattr(options, name, False)]
    given += ["offsets"] if options.no_offsets else []
    wrong = takers(options.estimator, given)
    if wrong is not None:
        name, estimators = wrong
        option = {"offsets": "no-offsets"}.get(name, name).replace("_", "-")
        raise UsageError(f"--{option} goes with --estimator {estimators} only; leave it out")
    reason = misused(options.components, options.reweight, options.sigma)
    if reason:
        for name in ("components", "sigma"):
            reason = reason.replace(f" {name}", f" --{name}")
        raise UsageError(f"--{reason}")
    first = options.files[0]
    for second in options.readings:
        if first.suffix.lower() == ".csv" and second.suffix.lower() in (".yaml", ".yml"):
            raise UsageError(
                f"the experiment file comes first, then the readings: fit {second} {first}"
            )
    if options.output and options.estimator != "full":
        raise UsageError("-o writes the map of the full estimator; leave it out")
    if options.date and not options.output:
        raise UsageError("--date goes with -o; leave it out")
    if options.plot and options.estimator not in DRAWN:
        raise UsageError("--plot draws residuals by the full estimator or reversal; leave it out")
    if options.report and options.estimator != "full":
        raise UsageError("--report writes the page of the full estimator; leave it out")
