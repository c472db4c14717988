"""Fingerprints of validated experiments: equal if the computation is equal, however the file is
written.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields, is_dataclass, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.simulator.design import PythonCalibration
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.machines import PythonSettings, module_source
from pydantic import BaseModel

# Methods of computation, each with its corrections of the one before. A new method begins whenever
# any experiment gets other results; its number is part of every cell's key.
METHODS = {
    1: "",
    2: (
        "lengths of standards that share a ball, priors and readings far tighter than others, the"
        " ratio of actual errors to those predicted, and the order and number of weakly determined"
        " directions"
    ),
    3: (
        "data sets of Monte Carlo that are hard to estimate, the standard errors of biases, and"
        " scales with several expansions whose temperature one sensor measures"
    ),
    4: "averages of what is undetermined in part, and what figures take for granted",
}
METHOD = max(METHODS)

# Without influence on the result: names, positions in files, and data read from files whose content
# counts.
LEFT_OUT = (
    "title",
    "description",
    "source",
    "mark",
    "path",
    "doubts",
    "notes",
    "tree",
    "builder",
    "trust",
    "_folder",
    "_trust",
    "_found",
)
# The same, for single classes: the reading of the laboratory's tables; positions that are not read,
# which no experiment that is computed has, and how a file states places; and functions in Python,
# whose module text and options count instead.
LEFT_OUT_OF = {
    "Experiment": ("readings", "extensions", "switched_off", "faults"),
    "Position": ("enabled", "room", "parts"),
    "Prior": ("data",),
    "PythonCalibration": ("functions",),
    "GuardedModel": ("model",),
    "GuardedModelWithLines": ("model",),
}

# Names of fields in the fingerprints that stores hold, where the field has another name today.
EARLIER_NAMES = {"target_uncertainty": "target_accuracy"}  # earlier name second

# Keys added since the first stores, by class: with its default, such a key does not change a
# fingerprint.
LATER_KEYS = {
    "Experiment": ("influences", "noise", "stars", "sections"),
    "ArtefactSettings": ("reads", "flatness"),
    "DistanceCalibration": ("root",),
    "CoordinateCalibration": ("root",),
    "Prior": ("by_offset",),
    "KinematicSettings": ("functions", "squareness"),
    "EmpiricalSettings": ("rotation_functions",),
    "RadialSettings": ("function",),
    "TrueMachineFileSettings": ("level",),
}

# Keys that matter only when real readings are reported: the axes of a plate.
REPORT_ONLY = ("axes",)


def with_method(text: str) -> str:
    """Return a cell's key: the number of the method, and a text that identifies the computation."""
    return f"{METHOD} {text}"


def method_of(key: str) -> int:
    """Return the number of the method of a key; keys of the first method have no number.

    >>> method_of("2 0f3a"), method_of("0f3a"), method_of("invalid 0f3a")
    (2, 1, 1)
    """
    number, space, _ = key.partition(" ")
    return (
        int(number) if space and number.isdecimal() and number.isascii() and len(number) < 10 else 1
    )


def without_method(key: str) -> str:
    """Return a key without the number of its method."""
    return key.partition(" ")[2] if key.partition(" ")[0].isdigit() and " " in key else key


def fingerprint(experiment: Experiment, *more: object) -> str:
    """Return a hash of everything that influences the results of an experiment, and of `more`.

    Named files count by content, a user's own error model by the text of its module.

    :raises TypeError: a value of an unknown type, which must not be ignored.
    """
    pieces: list[bytes] = []
    _add(pieces, replace(experiment, name=None))
    for value in more:
        _add(pieces, value)
    return hashlib.blake2b(b"".join(pieces), digest_size=20).hexdigest()


def _add(pieces: list[bytes], value: Any) -> None:
    """Add a value with its type and length, so that neighbours remain distinct."""
    if value is None or isinstance(value, (bool, int, str)):
        pieces.append(_text(f"{type(value).__name__} {value!r}"))
    elif isinstance(value, (tuple, list)):
        pieces.append(_text(f"list {len(value)}"))
        for item in value:
            _add(pieces, item)
    elif isinstance(value, float):
        pieces.append(_text(f"float {value.hex()}"))
    elif isinstance(value, np.ndarray):
        pieces.append(_text(f"array {value.dtype.str} {value.shape}"))
        pieces.append(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, np.generic):
        _add(pieces, value.item())
    elif isinstance(value, Path):
        pieces.append(_text(f"path {value.as_posix()}"))
    elif isinstance(value, Mapping):
        pieces.append(_text(f"mapping {len(value)}"))
        for key, item in value.items():
            _add(pieces, key)
            _add(pieces, item)
    elif isinstance(value, BaseModel):
        _settings(pieces, value)
    elif is_dataclass(value) and not isinstance(value, type):
        pieces.append(_text(f"object {type(value).__name__}"))
        left_out = (*LEFT_OUT, *LEFT_OUT_OF.get(type(value).__name__, ()))
        for name, item_value in _entries(value):
            if name not in left_out and not _is_later_default(value, name, item_value):
                pieces.append(_text(EARLIER_NAMES.get(name, name)))
                _add(pieces, item_value)
        if isinstance(value, PythonCalibration):
            pieces.append(_text(module_text(value.object, value.source)))
    else:
        raise TypeError(f"no fingerprint of a {type(value).__name__}")


def _entries(value: Any) -> Iterator[tuple[str, Any]]:
    """Return the fields of a data class with their values; probes remain two mappings, as in the
    first stores.
    """
    for field in fields(value):
        content = getattr(value, field.name)
        if isinstance(value, Experiment) and field.name == "probes":
            content = {name: probe.offset for name, probe in value.probes.items()}
        yield field.name, content
        if isinstance(value, Experiment) and field.name == "priors":
            uncertainties = {
                name: probe.standard_uncertainty
                for name, probe in value.probes.items()
                if probe.is_estimated
            }
            yield "offset_uncertainties", uncertainties


@cache
def _later_keys(kinds: tuple[Any, ...]) -> frozenset[str]:
    """Return the later keys of a class and of its bases."""
    return frozenset(name for kind in kinds for name in LATER_KEYS.get(kind.__name__, ()))


def _is_later_default(value: Any, name: str, content: Any) -> bool:
    """Return whether a value is the default of a later key."""
    if name not in _later_keys(tuple(type(value).__mro__)):
        return False
    if isinstance(value, BaseModel):
        of_settings = type(value).model_fields[name]
        return bool(content == of_settings.get_default(call_default_factory=True))
    default = next(field for field in fields(value) if field.name == name)
    factory = default.default_factory
    return bool(content == (default.default if factory is MISSING else factory()))


# The same names and counts come again and again, in a cell and from cell to cell.
@lru_cache(maxsize=10_000)
def _text(text: str) -> bytes:
    data = text.encode("utf-8", errors="surrogatepass")
    return b"%d:%b" % (len(data), data)


def _settings(pieces: list[bytes], value: BaseModel) -> None:
    pieces.append(_text(f"settings {type(value).__name__}"))
    for name in type(value).model_fields:
        content = getattr(value, name)
        if name not in REPORT_ONLY and not _is_later_default(value, name, content):
            pieces.append(_text(EARLIER_NAMES.get(name, name)))
            _add(pieces, content)
    for name, item in sorted((value.__pydantic_private__ or {}).items()):
        if name not in LEFT_OUT:
            pieces.append(_text(name))
            _add(pieces, item)
    if isinstance(value, PythonSettings):
        pieces.append(_text(module_text(value.object, value._folder)))


def module_text(made_by: str, folder: Path | None) -> str:
    """Return the text of the module of a user's own error model or calibration; empty if there is
    none.

    `made_by` names an object in the module.
    """
    path = module_source(made_by, folder)
    if path is None or path.suffix != ".py" or not path.is_file():
        return ""
    return path.read_text(encoding="utf-8", errors="replace")
