"""`ballplate models`: smallest sufficient error model of readings."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace

from ballplate.cli import add_json, add_readings, observed_readings, progress, show, warn_of, whole

DESCRIPTION = (
    "Fit the file's error model, kinematic ones with more and more coefficients and empirical ones,"
    " as far as the design determines them. Recommend the smallest that no larger"
    " one improves significantly; print the changes of corrected lengths. The exit status is 0 if"
    " one is recommended, otherwise 1."
)

# Numbers of coefficients of polynomials.
LEAST, MOST = 3, 12


def add_options(parser: ArgumentParser) -> None:
    add_readings(parser)
    parser.add_argument(
        "--coefficients",
        metavar="N",
        type=_coefficients,
        help=f"most coefficients that are tried, {LEAST} to {MOST}; default 8",
    )
    add_json(parser)


def _coefficients(text: str) -> int:
    count = whole(text, LEAST)
    if count > MOST:
        raise ArgumentTypeError(f"{count} coefficients are too many; at most {MOST} are possible")
    return count


def run(options: Namespace) -> int:
    """Compare error models; return 1 if no model is recommended."""

    from .compared_models import compared_models
    from .rungs import MOST_COEFFICIENTS

    experiment, observed = observed_readings(options)
    with progress(options) as shown:
        most = options.coefficients or MOST_COEFFICIENTS
        result = compared_models(experiment, observed, options.sigma, most, shown.show)
    show(options, result)
    return warn_of(result)
