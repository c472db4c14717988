"""`ballplate init`: a commented experiment or machine file to start from."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser = commands.add_parser(
        "init",
        help="write a commented experiment or machine file to start from",
        description="Write an experiment file with comments on what may be said, ready for check and run, or a machine "
        "file, ready for map.",
    )
    parser.add_argument("file", metavar="NAME.yaml", type=Path, help="file to write; must not exist")
    parser.add_argument("--machine", action="store_true", help="write a machine file, for map and kind: machine")
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Write the file unless it exists."""
    from importlib.resources import files

    from ballplate.simulator.experiment.messages import ExperimentError, Message

    name, command = ("machine_template.yaml", "map") if options.machine else ("template.yaml", "run")
    text = files(__package__).joinpath(name).read_text(encoding="utf-8")
    try:
        with options.file.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise ExperimentError([Message(str(options.file), 0, 0, "", "exists already; name a new file")]) from None
    except OSError as error:
        reason = f"cannot be written ({error.strerror}); name a file in a folder that exists"
        raise ExperimentError([Message(str(options.file), 0, 0, "", reason)]) from None
    print(f"{options.file} written; next: ballplate {command} {options.file}", file=sys.stderr)
    return 0
