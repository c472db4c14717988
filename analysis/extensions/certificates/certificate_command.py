"""`ballplate certificate`: what a fit says of a plate's balls, for others to use."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from pathlib import Path
from typing import Any

from ballplate.cli import (
    Output,
    OutputAction,
    UsageError,
    add_force,
    add_json,
    add_readings,
    coverage_factor,
    observed_readings,
    show,
    warn_of,
    write_noted,
)

ENDINGS = (".html", ".csv", ".xml")

DESCRIPTION = (
    "Fit readings and state the co-ordinates of a plate's balls in the plate's own axes with their"
    " full covariance, and distances with U: as a page (.html), as tables that calibration items"
    " read (.csv, with the covariance in a second file) or as a digital calibration"
    " certificate (.xml). Lengths without a calibrated"
    " source of scale are refused. The exit status is 0 if the estimate converged, the rank is as"
    " expected and no lack of fit is beyond the limit, otherwise 1."
)


class _Written(OutputAction):
    """A file to be written and, with a table of co-ordinates, that of their covariance."""

    def __call__(
        self, parser: ArgumentParser, namespace: Namespace, values: Any, option_string: Any = None
    ) -> None:
        super().__call__(parser, namespace, values, option_string)
        other_outputs = [output for output in namespace.outputs if output.dest != "covariance"]
        if values.suffix.lower() == ".csv":
            beside = values.with_name(f"{values.stem}-covariance{values.suffix}")
            other_outputs.append(Output("covariance", "the covariance's", beside, None, False))
        namespace.outputs = tuple(other_outputs)


def add_options(parser: ArgumentParser) -> None:
    add_readings(parser)
    parser.add_argument(
        "-o",
        "--output",
        action=_Written,
        metavar="FILE",
        type=_output,
        help="write the certificate: .html, .csv or .xml (DCC); default: print it",
    )
    parser.add_argument(
        "--plate", metavar="NAME", help="the plate; optional if there is exactly one"
    )
    parser.add_argument(
        "--datum",
        metavar="BALL,…",
        type=_balls,
        default=(),
        help=(
            "balls that define the axes: the one at the origin, one on an axis and, in space, one"
            " in the xy plane; or all, for axes in which the plate is as close as possible to its"
            " drawing; default: corners, as printed"
        ),
    )
    parser.add_argument(
        "--coverage-factor",
        metavar="K",
        type=coverage_factor,
        help="coverage factor of U; default: that of the file, or 2",
    )
    parser.add_argument(
        "--about",
        action="append",
        metavar="KEY=TEXT",
        type=_stated,
        default=[],
        help=(
            "what else is to be stated, once for each key: identifier, date, country, laboratory,"
            " e-mail, city, person, customer, manufacturer, serial number; a DCC needs date"
            " (2026-11-02, or 2026-11-02/2026-11-03) and country (DE)"
        ),
    )
    add_force(parser)
    add_json(parser)


def _output(text: str) -> Path:
    if not text.lower().endswith(ENDINGS):
        raise ArgumentTypeError(f'a certificate\'s name ends in {", ".join(ENDINGS)}, not "{text}"')
    return Path(text)


def _balls(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(","))


def _stated(text: str) -> tuple[str, str]:
    key, sign, value = (part.strip() for part in text.partition("="))
    if not sign or not value:
        raise ArgumentTypeError(f'expected a key and a text, such as country=DE, not "{text}"')
    return key, value


def run(options: Namespace) -> int:
    """Print or write the certificate; 1 if there is something to complain of."""
    from ballplate.results import fit

    from .plate_certificate import plate_certificate

    experiment, observed = observed_readings(options)
    result = fit(experiment, observed, options.sigma)
    warn_of(result)
    if not result.converged:
        return 1
    try:
        asked = options.plate, options.datum, options.coverage_factor, dict(options.about)
        result_certificate = plate_certificate(result, *asked)
        texts = {} if options.output is None else result_certificate.texts(options.output)
    except ValueError as error:
        raise UsageError(error) from None
    write_noted(options, texts)
    if options.json or not texts:
        show(options, result_certificate)
    return 1 if result.complaint else 0
