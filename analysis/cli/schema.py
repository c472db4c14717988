"""`ballplate schema`: the JSON Schema of experiment files."""

from __future__ import annotations

import json
from argparse import Namespace


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser = commands.add_parser(
        "schema",
        help="print the JSON Schema of experiment files",
        description="Print the JSON Schema of experiment files, for editors that complete and check as you type.",
    )
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Print the schema."""
    from simulator.experiment.schema import schema

    print(json.dumps(schema(), indent=2, ensure_ascii=False))
    return 0
