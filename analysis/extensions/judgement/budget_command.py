"""`ballplate run --budget`: contributions of each source to uncertainties of a design or a fit."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ballplate.cli import (
    KEYS,
    UsageError,
    add_json,
    add_readings,
    observed_readings,
    show,
    single,
    warn_of,
)

from .observation_groups import GROUPINGS

DESCRIPTION = (
    "Compute what each source of uncertainty contributes to U4, U6, the body diagonals and the"
    " measuring tasks: readings, every item of calibration, offsets of probes, priors and influence"
    " quantities. Sources are independent, so that their contributions add in squares. Without"
    " readings it is the budget of the design; with readings that of their fit, whose sigma"
    " multiplies all contributions. The exit status is 0 if the estimate"
    " converged, the rank is as expected and no lack of fit is beyond the limit, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    add_readings(
        parser, "readings to be fitted first: one table or several; default: none, as planned"
    )
    parser.add_argument(
        "--by",
        choices=GROUPINGS,
        default="calibration",
        help=(
            "split readings by axis, probe, position or artefact; default: calibration, with"
            " readings as one source"
        ),
    )
    add_json(parser)


def run(options: Namespace) -> int:
    """Print the budget of one experiment."""
    from ballplate.results import fit

    from .budget import budget

    with_fit = [name for name in ("certificate", "sigma", *KEYS) if getattr(options, name)]
    if with_fit and not options.readings:
        name = {"names": "name"}.get(with_fit[0], with_fit[0]).replace("_", "-")
        raise UsageError(f"--{name} applies to readings; name a table, or leave it out")
    if not options.readings:
        show(options, budget(single(options), None, options.by))
        return 0
    experiment, observed = observed_readings(options)
    fitted = fit(experiment, observed, options.sigma)
    if fitted.converged:
        show(options, budget(experiment, fitted, options.by))
    return warn_of(fitted)
