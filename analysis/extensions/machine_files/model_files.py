"""Files that an error model rests on besides its settings: a machine file with its tables, the
module of a user's own model.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ballplate.simulator.inputs import child, read_bytes, read_tree, service, to_python

# Keys of settings of error models that name a file or a folder, by the kind of the model.
PLACES = {"machine": "file", "python": "folder"}


def absolute(settings: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Settings of an error model with absolute paths instead of those found from a folder."""
    return _placed(settings, lambda path: str((folder / path).resolve()))


def relative(settings: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Settings of an error model with paths found from a folder instead of absolute ones."""

    def path_from(path: str) -> str:
        try:
            return Path(os.path.relpath(path, folder.resolve())).as_posix()
        except ValueError:
            # Another drive.
            return path

    return _placed(settings, path_from)


def _placed(settings: Mapping[str, Any], place: Any) -> dict[str, Any]:
    placed, key = dict(settings), PLACES.get(settings["kind"])
    if key == "folder" and ":" not in settings["object"]:
        # An entry point is found wherever it is installed.
        return placed
    return placed if key is None else placed | {key: place(placed.get(key, "."))}


def model_files(settings: Mapping[str, Any]) -> dict[str, Path]:
    """Files that an error model of `settings` with absolute paths rests on, by their names.

    :raises ExperimentError: a machine file cannot be read.
    """
    if settings["kind"] == "machine":
        path = Path(settings["file"])
        errors = to_python(child(read_tree(path, []), "errors") or read_tree(path, []))
        named = (error.get("file") for error in errors.values() if isinstance(error, dict))
        tables = [str(name) for name in named if name is not None]
        return {path.name: path, **{name: path.parent / name for name in tables}}
    if settings["kind"] == "python":
        folder = settings.get("folder")
        file = service("module_source")(
            settings["object"], None if folder is None else Path(folder)
        )
        return {} if file is None else {file.name: file}
    return {}


def fingerprints(settings: Mapping[str, Any]) -> dict[str, str]:
    """SHA-256 of the files that an error model rests on, by their names; raises as `model_files`.

    >>> fingerprints({"kind": "metric"})
    {}
    """
    return {
        name: hashlib.sha256(read_bytes(path)).hexdigest()
        for name, path in model_files(settings).items()
    }
