"""Options that say how tables of readings are written."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from .common import argument_type

if TYPE_CHECKING:
    from ballplate.simulator.experiment.model import Experiment

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
    from ballplate.simulator.experiment.name_rules import check_rule

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
