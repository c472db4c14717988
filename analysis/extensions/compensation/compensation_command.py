"""`ballplate compensation`: compensation tables for controllers, written and read."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.cli import (
    Output,
    UsageError,
    add_force,
    add_json,
    add_output,
    argument_type,
    check_outputs,
    complain,
    show,
    write,
)

if TYPE_CHECKING:
    from .compensation_tables import CompensationTable

FORMATS = ("csv", "isg", "heidenhain")

DESCRIPTION = (
    "Write the errors of a machine file or map file as a compensation table: CSV with ISO 230-1"
    " columns, the ISG CSV format of volumetric compensation (ISG kernel, Beckhoff TwinCAT CNC),"
    " or HEIDENHAIN .COM and .CMA tables. Prints the largest error of linear interpolation and"
    " rounding. With --read the files of a table are read, and -o writes a machine file. A table"
    " states corrections, to be added to scale readings, or errors of indication, which have the"
    " opposite sign."
)


# In one piece: one option after the other, with its help.
def add_options(parser: ArgumentParser) -> None:
    parser.add_argument(
        "files",
        metavar="FILE",
        nargs="+",
        type=Path,
        help="machine file or map; with --read the files of a table",
    )
    parser.add_argument("--format", choices=FORMATS, required=True, help="format of the table")
    parser.add_argument("--read", action="store_true", help="read a table")
    parser.add_argument(
        "--sense",
        choices=("corrections", "indication"),
        help=(
            "what the table states: corrections or errors of indication; default: corrections, or"
            " what the file says; heidenhain has no default"
        ),
    )
    parser.add_argument(
        "--pitch",
        metavar="LENGTH",
        type=_lengths,
        help='distance of positions, such as "50 mm", or one for each axis; default: a twentieth'
        " of the axis",
    )
    parser.add_argument(
        "--origin",
        metavar="POINT",
        type=_lengths,
        help=(
            'where errors are zero and from where positions count, such as "0 mm, 0 mm, 0 mm";'
            " default: as the machine has it. With --read, from where levers of rotations count"
        ),
    )
    parser.add_argument(
        "--volumetric",
        action="store_true",
        help="with isg, errors of the whole machine on a grid instead of errors of single axes",
    )
    parser.add_argument(
        "--without-rotations",
        action="store_true",
        help="leave out rotations, for which heidenhain tables have no room",
    )
    parser.add_argument(
        "--allow-lack-of-fit",
        action="store_true",
        help="make a table even of a map whose fit has a lack of fit beyond the limit",
    )
    parser.add_argument(
        "--arrangement",
        metavar="NAME",
        help=(
            'with --read: which axis carries which, such as MB2 or "probe x z, workpiece y"; '
            "default: what the file says"
        ),
    )
    add_output(
        parser,
        "-o",
        "--output",
        metavar="FILE",
        help=(
            "write the table; csv and heidenhain also write one file per axis, such as NAME-x.csv."
            " With --read, write a machine file (YAML) and its tables"
        ),
    )
    add_force(parser)
    add_json(parser)


@argument_type
def _lengths(text: str) -> tuple[float, ...]:

    from .compensation_tables import parse_lengths

    return parse_lengths(text)


def run(options: Namespace) -> int:
    """Make or read a table, write it, and tell what it is."""
    misused = _misused(options)
    if misused and options.read:
        raise UsageError("; ".join(misused))
    if options.sense == "indication":
        options.sense = "errors of indication"
    try:
        result, texts = _read(options) if options.read else _made(options)
    except ValueError as error:
        misused.append(str(error))
    if misused:
        raise UsageError("; ".join(misused))
    for remark in result.notes:
        complain(remark)
    paths = {options.output.parent / name: text for name, text in texts.items()} if texts else {}
    if paths:
        options.outputs = tuple(
            Output("output", "-o", path, None, takes_screen=False) for path in paths
        )
        check_outputs(options)
        write(options, paths)
    show(options, result)
    if paths and not options.json:
        print(f"written: {', '.join(map(str, sorted(paths)))}")
    return 0


def _made(options: Namespace) -> tuple[CompensationTable, dict[str, str]]:
    from .compensation_tables import made_compensation, tabled_machine

    if len(options.files) > 1:
        raise UsageError("a table is made of one machine; name one file, or read with --read")
    machine, remarks = tabled_machine(options.files[0], options.allow_lack_of_fit)
    made = made_compensation(
        machine,
        options.files[0].stem,
        options.format,
        options.pitch,
        options.origin,
        options.sense,
        options.volumetric,
        options.without_rotations,
        remarks,
    )
    return made, {} if options.output is None else made.files(options.output.stem)


def _read(options: Namespace) -> tuple[CompensationTable, dict[str, str]]:
    from .compensation_tables import read_compensation_files

    compensation_read = read_compensation_files(
        options.files, options.format, options.sense, options.arrangement, options.origin
    )
    return compensation_read, {} if options.output is None else compensation_read.machine_files(
        options.output.stem
    )


def _misused(options: Namespace) -> list[str]:
    """Faults of options that do not go together."""
    misused = []
    written = "pitch", "volumetric", "without_rotations", "allow_lack_of_fit"
    other_options = written if options.read else ("arrangement",)
    for name in other_options:
        if getattr(options, name):
            whose = "tables that are written" if options.read else "tables that are read"
            misused.append(f"--{name.replace('_', '-')} is for {whose}; leave it out")
    if options.without_rotations and options.format != "heidenhain":
        misused.append(f"{options.format} tables have rotations; leave --without-rotations out")
    if options.output is not None:
        ending = ".yaml" if options.read else ".cma" if options.format == "heidenhain" else ".csv"
        if options.output.suffix.lower() != ending:
            misused.append(f"-o {options.output} should end in {ending}")
    return misused
