"""Experiments with readings, as commands take them that judge a fit."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from .common import add_file
from .outputs import UsageError
from .table_options import add_tables
from .telling import complain, note, warn

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ballplate.simulator.experiment.model import Experiment
    from ballplate.simulator.readings.observed_readings import ObservedReadings


def add_readings(parser: ArgumentParser) -> None:
    """Add the experiment file, its readings, and how uncertainties are taken."""
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
        help="values of certificates, priors and probe offsets in place of the file's, as for fit",
    )
    parser.add_argument(
        "--sigma",
        choices=("estimated", "given"),
        help=(
            "test against the scatter of the residuals, or the stated uncertainties; default: what"
            " the file says"
        ),
    )


def observed_readings(options: Namespace) -> tuple[Experiment, ObservedReadings]:
    """The experiment that the options choose, and what its readings are."""
    from ballplate.simulator.readings.certificate_files import read_certificate

    from .common import single
    from .table_options import named_sources, with_options

    first = options.files[0]
    for second in options.readings:
        if first.suffix.lower() == ".csv" and second.suffix.lower() in (".yaml", ".yml"):
            raise UsageError(
                f"the experiment file comes first, then the readings: {second} {first}"
            )
    experiment = single(options)
    if options.certificate:
        experiment = read_certificate(options.certificate, experiment)
    experiment = with_options(options, experiment)
    return experiment, tables(options, experiment, options.readings or named_sources(experiment))


def tables(options: Namespace, experiment: Experiment, sources: Sequence[Path]) -> ObservedReadings:
    """Readings of tables, with what is to be said of them."""
    from ballplate.simulator.experiment.layout import lay_out
    from ballplate.simulator.readings.reading_files import read_readings

    observed = read_readings(sources, lay_out(experiment), settings=experiment.readings)
    for remark in observed.told:
        note(options, remark)
    for remark in observed.remarks[len(observed.told) :]:
        complain(f"{', '.join(map(str, sources))}: {remark}")
    warn(observed.doubts)
    return observed
