"""Options of an experiment with readings, and their evaluation."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from .common import add_file, single
from .notes import complain, note, warn
from .outputs import UsageError
from .table_options import add_tables, named_sources, with_options

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ballplate.presentation.result import FitResult
    from ballplate.simulator.experiment.model import Experiment
    from ballplate.simulator.readings.observed_readings import ObservedReadings


# Of a command that fits readings in any case.
NAMED = "tables of readings or reports; default: readings.files of the experiment file"


def add_readings(parser: ArgumentParser, of_readings: str = NAMED) -> None:
    """Add the experiment file, tables of readings and how they are written, values of certificates,
    and what uncertainties are.
    """
    add_file(parser)
    add_readings_argument(parser, of_readings)
    add_tables(parser)
    parser.add_argument(
        "--certificate",
        metavar="CSV",
        type=Path,
        help=(
            "values of certificates, priors and probe offsets instead of the experiment file's, as"
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


def add_readings_argument(parser: ArgumentParser, help: str) -> None:
    """Add tables of readings, which may be left out."""
    readings = parser.add_argument(
        "readings", metavar="READINGS", nargs="+", type=Path, default=[], help=help
    )
    # With nargs="*" none would be looked for behind the first option.
    readings.required = False


def refuse_wrong_order(options: Namespace) -> None:
    """Refuse readings before the experiment file, and other files than tables after it.

    :raises UsageError: in these cases.
    """
    first = options.files[0]
    for second in options.readings:
        if first.suffix.lower() == ".csv" and second.suffix.lower() in (".yaml", ".yml"):
            raise UsageError(
                "the experiment file comes first, then the readings:"
                f" {options.command} {second} {first}"
            )
        refuse_other_files(second)


def refuse_other_files(path: Path) -> None:
    """Refuse a map, or another YAML file, as readings.

    :raises UsageError: it is one.
    """
    if path.suffix.lower() in (".yaml", ".yml"):
        raise UsageError(
            f"{path} is no table of readings; give a table or a report of a measuring program"
            " (ballplate diff compares maps)"
        )


def observed_readings(options: Namespace) -> tuple[Experiment, ObservedReadings]:
    """Return the experiment that the options choose and its readings, and print their notes.

    :raises UsageError: the readings come first, and the experiment file after them.
    :raises ExperimentError: one of the files is invalid.
    """
    from ballplate.simulator.inputs.extensions import service

    refuse_wrong_order(options)
    experiment = with_options(options, single(options))
    count_of_doubts = len(experiment.doubts)
    if options.certificate:
        experiment = service("CertificateFiles").read(options.certificate, experiment)
    sources = options.readings or named_sources(experiment)
    return experiment, tables(options, experiment, sources, experiment.doubts[count_of_doubts:])


def warn_of(result: FitResult) -> int:
    """Print the warnings of an estimate; return 1 if it has a failure reason."""
    warn(result.cautions)
    if result.complaint:
        complain(result.complaint)
    return 1 if result.complaint else 0


def tables(
    options: Namespace,
    experiment: Experiment,
    sources: Sequence[Path],
    of_certificate: tuple[str, ...] = (),
) -> ObservedReadings:
    """Print the notes of tables of readings and of a certificate's values."""
    from ballplate.simulator.experiment.layout import lay_out
    from ballplate.simulator.readings.reading_files import read_readings

    observed = read_readings(sources, lay_out(experiment), settings=experiment.readings)
    observed = replace(observed, certificate_doubts=of_certificate)
    for remark in observed.table_notes:
        note(options, remark)
    for remark in observed.remarks[len(observed.table_notes) :]:
        complain(f"{', '.join(map(str, sources))}: {remark}")
    warn(observed.doubts)
    return observed


def add_pairs(parser) -> None:  # type: ignore[no-untyped-def]
    """Add the choice of the pairs of balls whose distances an alternative estimator uses."""
    parser.add_argument(
        "--pairs",
        metavar="SET",
        help=(
            "pairs of balls whose distances are used, a set that the artefacts have, such as corner"
            " sides, corners, neighbours or all; default: braced for grids (neighbours along rows,"
            " columns and one diagonal, and all corners), otherwise all"
        ),
    )
    parser.add_argument(
        "--across-probes",
        action="store_true",
        help="also use distances between balls read with different probes in the same position",
    )
