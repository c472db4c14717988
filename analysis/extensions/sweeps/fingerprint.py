"""Fingerprints of validated experiments: equal if the computation is equal, however the file is
written.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import service
from pydantic import BaseModel

# Without influence on the result: names, positions in files, and how data were read.
LEFT_OUT = frozenset(
    ("title", "description", "source", "mark", "path", "doubts", "notes", "tree", "builder")
    + ("trust", "_folder", "_trust", "_found")
)
# The same for single classes: what is read, which no cell fits, and functions in Python, of which
# the text of the module counts.
LEFT_OUT_OF = {
    "Experiment": {"name", "readings", "extensions", "switched_off", "faults"},
    "Prior": {"data"},
    "PythonCalibration": {"functions"},
    "GuardedModel": {"model"},
    "GuardedModelWithLines": {"model"},
}


def fingerprint(experiment: Experiment, *more: object) -> str:
    """Return a hash of everything that influences the results of an experiment, and of `more`.

    Tables that it names count by their values, a user's own error model by the text of its module.

    :raises TypeError: a value of an unknown type, which must not be ignored.
    """
    text = json.dumps([experiment, *more], default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: Any) -> Any:
    """Return a value as plain data, with its type."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Path):
        return value.as_posix()
    if isinstance(value, Mapping):
        return list(value.items())
    kind = type(value).__name__
    if isinstance(value, BaseModel):
        content = {name: getattr(value, name) for name in type(value).model_fields}
        content |= value.__pydantic_private__ or {}
    elif is_dataclass(value):
        content = {field.name: getattr(value, field.name) for field in fields(value)}
    else:
        raise TypeError(f"no fingerprint of a {kind}")
    if kind == "PythonSettings":
        content["module"] = _module_text(value.object, value._folder)
    elif kind == "PythonCalibration":
        content["module"] = _module_text(value.object, value.source)
    left_out = LEFT_OUT | LEFT_OUT_OF.get(kind, set())
    return [kind, {name: item for name, item in content.items() if name not in left_out}]


def _module_text(made_by: str, folder: Path | None) -> str:
    """Return the text of the module with the object `made_by`; empty if it is not in Python."""
    path = service("module_source")(made_by, folder)
    if path is None or path.suffix != ".py" or not path.is_file():
        return ""
    return path.read_text(encoding="utf-8", errors="replace")
