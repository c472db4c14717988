"""Map files: writing a fitted map as YAML, or as arrays of NumPy, and reading it with all
faults.
"""

from __future__ import annotations

import io
import json
import math
import os
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..inputs.messages import ExperimentError, Message, refused
from ..inputs.problems import Problems, in_order
from ..inputs.settings import shorten
from ..inputs.trust import OPENED, Trust
from ..inputs.yamltree import MOST_BYTES, Mark, Node, read_bytes, read_tree
from ..machines.protocol import Array
from ..maps.fitted_map import FittedMap
from .changes import node_of
from .map_checks import map_of_tree
from .map_content import head_of

BINARY = ".npz"
# A map file in text has this key, which no other file has.
OF_MAPS = re.compile(rb"^map\s*:", re.MULTILINE)


def is_map_file(path: Path) -> bool:
    """Identify a map file, by its name or contents.

    :raises ExperimentError: it cannot be read.
    """
    return path.suffix.lower() == BINARY or bool(OF_MAPS.search(read_bytes(path)))


def write_map(fitted: FittedMap, path: str | os.PathLike[str]) -> None:
    """Write a map file: YAML, or arrays of NumPy if the name ends in .npz. Numbers are written
    with all their digits.

    :raises ExperimentError: the error model cannot be named in a file, or a file that it uses
        cannot be read.
    """
    target = Path(path)
    head = head_of(fitted, target.parent)
    if target.suffix.lower() != BINARY:
        target.write_text(map_text(fitted, head), encoding="utf-8", newline="\n")
        return
    lower = np.tril(np.ones(fitted.covariance.shape, bool))
    covariance = np.where(lower, fitted.covariance, fitted.covariance.T)
    parts = {"covariance": covariance, "undetermined": fitted.undetermined}
    # Opened here, as NumPy would add an ending to names that have it in capitals.
    with target.open("wb") as stream:
        np.savez(stream, map=np.array(json.dumps(head)), **parts)  # type: ignore[arg-type,unused-ignore]


def map_text(fitted: FittedMap, head: Mapping[str, Any]) -> str:
    """Return a map file as YAML; `head` is its content except arrays."""
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
    """Read a map file, YAML or arrays of NumPy; an error model in Python is run if the file is
    trusted.

    :raises ExperimentError: it cannot be read, is damaged, incomplete or edited, is no map, or
        rests on a file that has changed; holds everything that was found.
    """
    source = Path(path)
    refused_messages: list[Message] = []
    root, arrays = map_tree(source, refused_messages)
    problems = Problems(root)
    content = map_of_tree(root, arrays, source, problems, trust)
    if content is None or problems.messages or refused_messages:
        raise ExperimentError(in_order(problems.messages, refused_messages, source))
    return content


def map_tree(source: Path, minor: list[Message]) -> tuple[Node, dict[str, Array]]:
    """Return the content of a map file, and its arrays; `minor` as for `read_tree`.

    :raises ExperimentError: it cannot be read.
    """
    if source.suffix.lower() == BINARY:
        return _binary(source)
    if read_bytes(source)[:2] == b"PK":
        raise refused(source, "has arrays of NumPy; give it the ending .npz")
    return read_tree(source, minor), {}


def _binary(source: Path) -> tuple[Node, dict[str, Array]]:
    """Return the content of a file of arrays, as a tree whose nodes are all at its name, and its
    arrays.
    """
    content = read_bytes(source)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            head = json.loads(str(_array(archive, "map")))
            arrays = {name: _array(archive, name) for name in ("covariance", "undetermined")}
        if not all(
            array.dtype == float and array.ndim == 2 and np.isfinite(array).all()
            for array in arrays.values()
        ):
            raise ValueError("its arrays are no matrices of finite doubles")
        root = node_of({**head, "covariance": [""]}, Mark(str(source), 0, 0))
    except (OSError, ValueError, TypeError, KeyError, EOFError, zipfile.BadZipFile) as error:
        text = f"is no map, or damaged ({shorten(str(error))}); write it again with fit -o"
        raise refused(source, text) from None
    return root, arrays


def _array(archive: zipfile.ZipFile, name: str) -> Array:
    """Return an array of a file within the size of the file: neither compression nor the array's
    own head may enlarge it.

    :raises ValueError: it is larger than a file may be, or than its head states.
    """
    size = archive.getinfo(f"{name}.npy").file_size
    if size > MOST_BYTES:
        raise ValueError(f"{name} has {size / 1e6:.0f} MB, and {MOST_BYTES / 1e6:.0f} are possible")
    stream = io.BytesIO(archive.read(f"{name}.npy"))
    np.lib.format.read_magic(stream)
    shape, _, kind = np.lib.format.read_array_header_1_0(stream)
    if math.prod(shape) * kind.itemsize > size:
        raise ValueError(f"{name} is cut off")
    stream.seek(0)
    return np.lib.format.read_array(stream, allow_pickle=False)
