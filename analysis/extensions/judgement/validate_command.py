"""`ballplate validate`: positions left out are predicted from the rest."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ballplate.cli import add_json, add_readings, observed_readings, progress, show, warn_of

DESCRIPTION = (
    "Leave out each position in turn, predict its readings from all others,"
    " and compare the errors with their uncertainties. The exit status is 0 if no"
    " prediction fails, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    add_readings(parser)
    add_json(parser)


def run(options: Namespace) -> int:
    """Validate a fit; 1 if a prediction fails."""

    from .left_out import validate

    experiment, observed = observed_readings(options)
    with progress(options) as shown:
        result = validate(experiment, observed, options.sigma, shown.show)
    show(options, result)
    return warn_of(result)
