"""Fingerprints of validated experiments: equal where the same is computed, whatever the file looks
like.
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

# The methods that figures and verdicts have been computed by, and what each corrected of the one
# before. A new one begins whenever any experiment comes to other figures or another verdict; its
# number is part of every cell's key.
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
}
METHOD = max(METHODS)

# What says nothing about the result: names, and where things stand; and what was made of a file
# whose content counts.
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
# The same, of single classes: how the laboratory's tables are read; and functions in Python, which
# the text of their module and their options tell.
LEFT_OUT_OF = {
    "Experiment": ("readings", "extensions"),
    "Prior": ("data",),
    "PythonCalibration": ("functions",),
}

# Names of fields in the fingerprints that stores hold, where the field has another name today.
EARLIER_NAMES = {"target_uncertainty": "target_accuracy"}  # earlier name second

# Keys that files did not have at first, by what has them: where they are left out, all is as it was
# without them.
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

# Settings that decide only how a fit of real readings is told: the axes of a plate.
TOLD_LATER = ("axes",)


def with_method(text: str) -> str:
    """A cell's key: the number of the method, and a text that tells what is computed."""
    return f"{METHOD} {text}"


def method_of(key: str) -> int:
    """The number of the method that a key's row was computed by; the first had none in its keys.

    >>> method_of("2 0f3a"), method_of("0f3a"), method_of("invalid 0f3a")
    (2, 1, 1)
    """
    number, space, _ = key.partition(" ")
    return (
        int(number) if space and number.isdecimal() and number.isascii() and len(number) < 10 else 1
    )


def without_method(key: str) -> str:
    """What a key tells of what is computed, by whatever method."""
    return key.partition(" ")[2] if key.partition(" ")[0].isdigit() and " " in key else key


def fingerprint(experiment: Experiment, *more: object) -> str:
    """A hash of everything that the figures of an experiment depend on, and of `more`.

    Files that the experiment names count by their content, a user's own error model by the text of
    its module.

    :raises TypeError: a value of a kind that is not known here, so that nothing is passed over.
    """
    pieces: list[bytes] = []
    _add(pieces, replace(experiment, name=None))
    for one in more:
        _add(pieces, one)
    return hashlib.blake2b(b"".join(pieces), digest_size=20).hexdigest()


def _add(pieces: list[bytes], value: Any) -> None:
    """Add a value with its type and length, so that neighbours cannot be mistaken for one
    another.
    """
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
        for name, found in _entries(value):
            if name not in left_out and not _is_as_before(value, name, found):
                pieces.append(_text(EARLIER_NAMES.get(name, name)))
                _add(pieces, found)
        if isinstance(value, PythonCalibration):
            pieces.append(_text(module_text(value.object, value.source)))
    else:
        raise TypeError(f"no fingerprint of a {type(value).__name__}")


def _entries(value: Any) -> Iterator[tuple[str, Any]]:
    """Fields of a data class with their values; probes are two mappings, as they were at first."""
    for field in fields(value):
        found = getattr(value, field.name)
        if isinstance(value, Experiment) and field.name == "probes":
            found = {name: probe.offset for name, probe in value.probes.items()}
        yield field.name, found
        if isinstance(value, Experiment) and field.name == "priors":
            estimated = {k: one for k, one in value.probes.items() if one.is_estimated}
            yield (
                "offset_uncertainties",
                {name: probe.standard_uncertainty for name, probe in estimated.items()},
            )


@cache
def _later_keys(kinds: tuple[Any, ...]) -> frozenset[str]:
    """Keys of a class and of those that it is made from that files did not have at first."""
    return frozenset(name for one in kinds for name in LATER_KEYS.get(one.__name__, ()))


def _is_as_before(value: Any, name: str, found: Any) -> bool:
    """Whether this is the default of a key that files did not have at first."""
    if name not in _later_keys(tuple(type(value).__mro__)):
        return False
    if isinstance(value, BaseModel):
        of_settings = type(value).model_fields[name]
        return bool(found == of_settings.get_default(call_default_factory=True))
    default = next(field for field in fields(value) if field.name == name)
    made = default.default_factory
    return bool(found == (default.default if made is MISSING else made()))


# The same names and counts come again and again, in a cell and from cell to cell.
@lru_cache(maxsize=10_000)
def _text(text: str) -> bytes:
    data = text.encode("utf-8", errors="surrogatepass")
    return b"%d:%b" % (len(data), data)


def _settings(pieces: list[bytes], value: BaseModel) -> None:
    pieces.append(_text(f"settings {type(value).__name__}"))
    for name in type(value).model_fields:
        found = getattr(value, name)
        if name not in TOLD_LATER and not _is_as_before(value, name, found):
            pieces.append(_text(EARLIER_NAMES.get(name, name)))
            _add(pieces, found)
    for name, item in sorted((value.__pydantic_private__ or {}).items()):
        if name not in LEFT_OUT:
            pieces.append(_text(name))
            _add(pieces, item)
    if isinstance(value, PythonSettings):
        pieces.append(_text(module_text(value.object, value._folder)))


def module_text(made_by: str, folder: Path | None) -> str:
    """The text of the module with a user's own error model or calibration, `made_by` an object
    there; empty where Python has none of it.
    """
    place = module_source(made_by, folder)
    if place is None or place.suffix != ".py" or not place.is_file():
        return ""
    return place.read_text(encoding="utf-8", errors="replace")
