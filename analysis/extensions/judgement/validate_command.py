"""`ballplate validate`: what is left out is predicted from the rest; two campaigns are compared."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ballplate.cli import (
    UsageError,
    add_json,
    add_readings,
    observed_readings,
    refuse_other_files,
    tables,
    warn_of,
)

GROUP = "evaluate"
HELP = "leave out positions, plates and directions in turn and predict them; compare two campaigns"
DESCRIPTION = (
    "Leave out each position, plate and direction in turn, predict its readings from all others,"
    " and compare the errors with their uncertainties. With --against, compare what the readings of"
    " two campaigns find throughout the volume. The exit status is 0 if no prediction fails, or the"
    " campaigns agree, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    add_readings(parser)
    parser.add_argument(
        "--against",
        metavar="READINGS",
        type=Path,
        action="append",
        default=[],
        help="readings of a second campaign by the same file; may be repeated for several tables",
    )
    parser.add_argument(
        "--other-plate",
        action="store_true",
        help=(
            "with --against: the second campaign read another plate, or one that was certified"
            " anew, so that errors of certificates are not the same in both"
        ),
    )
    add_json(parser)


def run(options: Namespace) -> int:
    """Validate a fit; 1 if a prediction fails, or two campaigns differ."""
    from ballplate.cli import progress, show
    from ballplate.presentation import FitResult

    if options.other_plate and not options.against:
        raise UsageError("--other-plate goes with --against only; leave it out")
    for path in options.against:
        refuse_other_files(path)
    experiment, observed = observed_readings(options)
    result: FitResult
    if options.against:
        from .cross_validation import cross_validate

        other = tables(options, experiment, options.against)
        common = not options.other_plate
        result = cross_validate(experiment, observed, other, options.sigma, common)
    else:
        from .left_out import validate

        with progress(options) as shown:
            result = validate(experiment, observed, options.sigma, shown.show)
    show(options, result)
    return warn_of(result)
