"""`ballplate init`: a commented experiment or machine file to start from."""

from __future__ import annotations

from argparse import Namespace

from .outputs import add_force, add_output, text_writer, write_outputs
from .telling import note

BAD_FILE = 3


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser = commands.add_parser(
        "init",
        help="write a commented experiment or machine file to start from",
        description=(
            "Write a commented experiment file, ready for check and run, or a machine file,"
            " ready for map."
        ),
    )
    add_output(parser, "file", metavar="NAME.yaml", help="file to write")
    parser.add_argument(
        "--machine", action="store_true", help="write a machine file, for map and kind: machine"
    )
    add_force(parser)
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Write the file."""
    from importlib.resources import files

    name, command = (
        ("machine_template.yaml", "map") if options.machine else ("template.yaml", "run")
    )
    text = files(__package__).joinpath(name).read_text(encoding="utf-8")
    if not write_outputs(
        {options.file: text_writer(lambda stream: stream.write(text))}, options.force
    ):
        return BAD_FILE
    note(options, f"{options.file} written; next: ballplate {command} {options.file}")
    return 0
