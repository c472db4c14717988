"""`ballplate budget`: what each source contributes to the uncertainties of a design or a fit."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..results.variance_components.groupings import GROUPINGS
from .common import add_file, add_json, show, single
from .outputs import UsageError
from .table_options import KEYS, add_tables, with_options
from .telling import complain, warn

HELP = "split uncertainties by their sources: readings, certificates, probes, influences"
DESCRIPTION = (
    "Compute what each source of uncertainty contributes to U4, U6, the body diagonals and the"
    " measuring tasks: readings, every item of calibration, offsets of probes, priors and influence"
    " quantities. Sources are independent, so that their contributions add in squares. Without"
    " readings it is the budget of the design; with readings that of their fit, whose sigma"
    " multiplies all contributions. The exit status is 0, or 1 if the fit has not converged."
)


def add_options(parser: ArgumentParser) -> None:
    add_file(parser)
    readings = parser.add_argument(
        "readings",
        metavar="READINGS",
        nargs="+",
        type=Path,
        default=[],
        help="readings to be fitted first: one table or several; default: none, as planned",
    )
    # With nargs="*" none would be looked for behind the first option.
    readings.required = False
    parser.add_argument(
        "--by",
        choices=GROUPINGS,
        default="calibration",
        help=(
            "split readings by axis, probe, position or artefact; default: calibration, with"
            " readings as one source"
        ),
    )
    add_tables(parser)
    parser.add_argument(
        "--certificate",
        metavar="CSV",
        type=Path,
        help="values of certificates, priors and probe offsets, as with fit; with readings only",
    )
    parser.add_argument(
        "--sigma",
        choices=("estimated", "given"),
        help="as with fit; with readings only",
    )
    add_json(parser)


def run(options: Namespace) -> int:
    """Print the budget of one experiment."""
    from ballplate.simulator.experiment.layout import lay_out
    from ballplate.simulator.readings.certificate_files import read_certificate
    from ballplate.simulator.readings.reading_files import read_readings

    from ..results.budget import budget
    from ..results.study import fit

    with_fit = [name for name in ("certificate", "sigma", *KEYS) if getattr(options, name)]
    if with_fit and not options.readings:
        raise UsageError(f"--{with_fit[0]} goes with readings; name a table, or leave it out")
    experiment, fitted = single(options), None
    if options.readings:
        if options.certificate:
            experiment = read_certificate(options.certificate, experiment)
        experiment = with_options(options, experiment)
        observed = read_readings(
            options.readings, lay_out(experiment), settings=experiment.readings
        )
        for remark in observed.remarks:
            complain(remark)
        warn(observed.doubts)
        fitted = fit(experiment, observed, options.sigma)
        if not fitted.converged:
            complain(fitted.complaint)
            return 1
    found = budget(experiment, fitted, options.by)
    show(options, found)
    warn(filter(None, [found.caution]))
    return 0
