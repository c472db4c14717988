"""Map files: writing a fitted map as YAML, and reading it with all faults."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ballplate.simulator.inputs import (
    OPENED,
    ExperimentError,
    Message,
    Problems,
    Trust,
    in_order,
    read_bytes,
    read_tree,
)
from ballplate.simulator.machines import Array

from .fitted_map import FittedMap
from .map_checks import map_of_tree
from .map_content import head_of

# A map file has this key, which no other file has.
OF_MAPS = re.compile(rb"^map\s*:", re.MULTILINE)


def is_map_file(path: Path) -> bool:
    """Identify a map file by its contents.

    :raises ExperimentError: it cannot be read.
    """
    return bool(OF_MAPS.search(read_bytes(path)))


def write_map(fitted: FittedMap, path: str | os.PathLike[str]) -> None:
    """Write a map file, numbers with all their digits.

    :raises ExperimentError: the error model cannot be named in a file, or a file that it uses
        cannot be read.
    """
    target = Path(path)
    text = map_text(fitted, head_of(fitted, target.parent))
    target.write_text(text, encoding="utf-8", newline="\n")


def map_text(fitted: FittedMap, head: Mapping[str, Any]) -> str:
    """Return the text of a map file; `head` is its content except arrays."""
    lines = []
    for key, value in head.items():
        if key == "checksum":
            continue
        if isinstance(value, list):
            lines += [f"{key}:", *(f"- {_json(entry)}" for entry in value)]
        elif key == "probes":
            lines += [
                f"{key}:",
                *(f"  {_json(name)}: {_json(entry)}" for name, entry in value.items()),
            ]
        else:
            lines.append(f"{key}: {_json(value)}")
    if fitted.undetermined.shape[1]:
        lines.append("undetermined:")
        lines += [f'- "{_row(entry)}"' for entry in fitted.undetermined.T]
    lines.append("covariance:")
    lines += [f'- "{_row(row[: k + 1])}"' for k, row in enumerate(fitted.covariance)]
    return "\n".join([*lines, f"checksum: {head['checksum']}", ""])


def _row(values: Array) -> str:
    return " ".join(map(repr, values.tolist()))


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)


def read_map(path: str | os.PathLike[str], trust: Trust = OPENED) -> FittedMap:
    """Read a map file; an error model in Python is run if the file is trusted.

    :raises ExperimentError: it cannot be read, is damaged, incomplete or edited, is no map, or
        rests on a file that has changed; holds everything that was found.
    """
    source = Path(path)
    refused_messages: list[Message] = []
    root = read_tree(source, refused_messages)
    problems = Problems(root)
    content = map_of_tree(root, source, problems, trust)
    if content is None or problems.messages or refused_messages:
        raise ExperimentError(in_order(problems.messages, refused_messages, source))
    return content
