"""`ballplate init`: a commented experiment or machine file to start from."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from .notes import note
from .outputs import add_force, add_output, write

GROUP = "plan"
HELP = "write a commented experiment or machine file to start from"
DESCRIPTION = (
    "Write a commented experiment file, ready for check and run, or a machine file, ready for map."
)


def add_options(parser: ArgumentParser) -> None:
    add_output(parser, "file", metavar="NAME.yaml", help="file to write")
    parser.add_argument(
        "--machine", action="store_true", help="write a machine file, for map and kind: machine"
    )
    add_force(parser)


def run(options: Namespace) -> int:
    """Write the file."""
    from importlib.resources import files

    name, command = (
        ("machine_template.yaml", "map") if options.machine else ("template.yaml", "check")
    )
    text = files(__package__).joinpath(name).read_text(encoding="utf-8")
    if write(options, {options.file: text}):
        note(options, f"{options.file} written; next: ballplate {command} {options.file}")
    return 0
