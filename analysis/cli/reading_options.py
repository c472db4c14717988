"""Options of an experiment with readings, and their evaluation."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from .common import add_file, argument_type, single
from .notes import complain, note, warn
from .outputs import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ballplate.presentation.result import FitResult
    from ballplate.simulator.experiment.model import Experiment
    from ballplate.simulator.readings.observed_readings import ObservedReadings

KEYS = ("columns", "unit", "decimal", "coordinates", "names", "fill_down", "sheet", "swap_names")


def add_tables(parser: ArgumentParser) -> None:
    """Add what can be said of tables of readings instead of the experiment file."""
    parser.add_argument(
        "--columns",
        metavar="NAME=COLUMN,…",
        type=columns,
        help=(
            "columns of the readings by name or number, such as position=Lage,ball=Nr; =NAME is the"
            " same in all rows, such as probe==down"
        ),
    )
    parser.add_argument(
        "--unit", metavar="UNIT", help="unit of readings in columns without a unit, such as mm"
    )
    parser.add_argument(
        "--decimal", choices=("point", "comma"), help="decimal separator of readings"
    )
    parser.add_argument(
        "--coordinates",
        choices=("scale readings", "ball centres", "part"),
        help=(
            "type of readings: scale readings (default); ball centres, to which the measuring"
            " program has applied the offsets of probes; or ball centres in part co-ordinates"
        ),
    )
    parser.add_argument(
        "--name",
        dest="names",
        metavar="RULE",
        type=rule,
        help=(
            'how reports, or a column of a table, name features, such as "{position}_{ball}_*"; '
            "default: detected in reports"
        ),
    )
    parser.add_argument(
        "--fill-down",
        action="store_const",
        const=True,
        help="take the name above for a blank one, as below merged cells; default: refuse these",
    )
    parser.add_argument(
        "--sheet", metavar="NAME", help="sheet of a workbook, or all; default: the only table"
    )
    parser.add_argument(
        "--swap-names",
        action="store_const",
        const=True,
        help=(
            "swap the names of two balls of a position where readings show that they are swapped,"
            " and tell; default: refuse them"
        ),
    )


@argument_type
def rule(text: str) -> str:
    """Read a rule of names from the command line."""
    from ballplate.simulator.experiment.readings_section import check_rule

    return check_rule(text)


def columns(text: str) -> dict[str, str]:
    """Read columns from the command line."""
    assignments = {}
    for part in text.split(","):
        name, sign, column = (piece.strip() for piece in part.partition("="))
        if not sign or not column or name in assignments:
            raise ArgumentTypeError(
                f'expected columns such as position=Lage,ball=Nr, not "{text}"; write names with'
                " commas in the experiment file"
            )
        assignments[name] = column
    return assignments


def with_options(options: Namespace, experiment: Experiment) -> Experiment:
    """Return the experiment with the options on tables of readings.

    :raises ExperimentError: they are invalid.
    """
    return experiment.with_readings({key: getattr(options, key) for key in KEYS})


def named_sources(experiment: Experiment) -> list[Path]:
    """Return the tables that the experiment file names.

    :raises ExperimentError: the file names no table.
    """
    from ballplate.simulator.inputs.messages import refused

    named = experiment.readings.named_files
    if not named:
        text = "names no readings; give a table, or add readings: {files: readings.csv}"
        raise refused(experiment.source, text)
    return [experiment.source.parent / name for name in named]


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
