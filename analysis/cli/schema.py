"""`ballplate schema`: the JSON Schema of experiment and sweep files."""

from __future__ import annotations

import json
from argparse import Namespace


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser = commands.add_parser(
        "schema",
        help="print the JSON Schema of experiment or sweep files",
        description="Print the JSON Schema of experiment files, or of sweep files, for editors that complete and check "
        "as you type.",
    )
    parser.add_argument("files", choices=("experiment", "sweep"), nargs="?", default="experiment", help="which files")
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Print the schema."""
    from simulator.experiment.schema import schema

    from ..sweeps.schema import schema as sweep_schema

    found = sweep_schema() if options.files == "sweep" else schema()
    print(json.dumps(found, indent=2, ensure_ascii=False))
    return 0
