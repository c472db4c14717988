"""`ballplate schema`: the JSON Schema of experiment, sweep, machine and map files."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from typing import Any

from ballplate.simulator.inputs.extensions import module_with, names

DESCRIPTION = (
    "Print the JSON Schema of experiment files, or of sweep, machine or map files, for editors"
    " that complete and check as you type."
)


def add_options(parser: ArgumentParser) -> None:
    parser.add_argument(
        "files",
        choices=(*SCHEMAS, *names("schemas", with_registered=True)),
        nargs="?",
        default="experiment",
        help="which files",
    )


def run(options: Namespace) -> int:
    """Print the schema."""
    kind = options.files
    schema = SCHEMAS[kind] if kind in SCHEMAS else module_with("schemas", kind).schema
    print(json.dumps(schema(), indent=2, ensure_ascii=False))
    return 0


def _experiment() -> dict[str, Any]:
    from ballplate.simulator.experiment.json_schema import schema

    return schema()


SCHEMAS = {"experiment": _experiment}
