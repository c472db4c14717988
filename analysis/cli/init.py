"""`ballplate init`: a commented experiment or machine file to start from."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ballplate.simulator.inputs.extensions import optional_service

from .notes import note
from .outputs import add_force, add_output, write

DESCRIPTION = (
    "Write a commented experiment file, ready for check, run and plan, or a machine file, ready for"
    " map."
)


def add_options(parser: ArgumentParser) -> None:
    add_output(parser, "file", metavar="NAME.yaml", help="file to write")
    parser.add_argument(
        "--machine", action="store_true", help="write a machine file, for map and kind: machine"
    )
    add_force(parser)
    add_data_sheet = optional_service("add_data_sheet")
    if add_data_sheet is not None:
        add_data_sheet(parser)


def run(options: Namespace) -> int:
    """Write the file."""
    drafted = optional_service("drafted")
    draft = None if drafted is None else drafted(options)
    text, command = _example(options) if draft is None else draft
    if write(options, {options.file: text}):
        note(options, f"{options.file} written; next: {command}")
    return 0


def _example(options: Namespace) -> tuple[str, str]:
    """Return the text of the example and the next command."""
    from importlib.resources import files

    name, command = (
        ("machine_template.yaml", "map") if options.machine else ("template.yaml", "check")
    )
    text = files(__package__).joinpath(name).read_text(encoding="utf-8")
    return text, f"ballplate {command} {options.file}"
