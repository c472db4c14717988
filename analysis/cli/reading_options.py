"""Options about an experiment with its readings, and these as they are read."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from .common import add_file, single
from .table_options import add_tables, named_sources, with_options
from .telling import complain, note, warn

if TYPE_CHECKING:
    from ballplate.simulator.experiment.model import Experiment
    from ballplate.simulator.readings.observed_readings import ObservedReadings


def add_readings(parser: ArgumentParser) -> None:
    """Add the experiment file, tables of readings and how they are written, values of certificates,
    and what uncertainties are.
    """
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


def observed_readings(options: Namespace) -> tuple[Experiment, ObservedReadings]:
    """The experiment that the options choose and its readings; says what is to be said of these.

    :raises ExperimentError: one of the files is wrong.
    """
    from ballplate.simulator.experiment.layout import lay_out
    from ballplate.simulator.readings.certificate_files import read_certificate
    from ballplate.simulator.readings.reading_files import read_readings

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
    return experiment, observed
