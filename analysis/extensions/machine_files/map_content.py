"""Content of a map file except its covariance, and the checksum that detects changes of it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.results import verdict_content
from ballplate.simulator.experiment import MapData
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import provider, shipped, to_list
from ballplate.simulator.machines import KINDS, Array

from .fitted_map import FittedMap
from .model_files import fingerprints, relative

# What is not hashed: it may be corrected by hand.
WORDS = ("title", "experiment", "date", "program", "frame", "checksum")


def head_of(fitted: FittedMap, folder: Path) -> dict[str, Any]:
    """Return the content of a map file except its covariance and undetermined directions."""
    lower, upper = fitted.volume.corners
    head: dict[str, Any] = {
        "map": 1,
        "title": fitted.title,
        "experiment": fitted.experiment,
        "date": fitted.date,
        "program": fitted.program,
        "extensions": _needed(fitted.settings["kind"]),
        "error_model": to_list(relative(fitted.settings, folder)),
        "files": fingerprints(fitted.settings),
        "volume": {
            axis: [_length(low), _length(high)]
            for axis, low, high in zip(AXIS_NAMES, lower, upper, strict=False)
        },
        "frame": fitted.frame,
        "repeatability": [_length(component) for component in fitted.repeatability.tolist()],
        "probes": _probe_data(fitted),
        "probe": fitted.probe,
        "sigma": {
            "value": fitted.sigma,
            "estimated": fitted.sigma_is_estimated,
            "degrees_of_freedom": fitted.degrees_of_freedom,
            "sum_of_squares": fitted.sum_of_squares,
        },
        "coverage_factor": fitted.coverage_factor,
        "temperatures": None if fitted.temperatures is None else dict(fitted.temperatures),
        "data": None if fitted.data is None else to_list(_data(fitted.data)),
        "lack_of_fit": verdict_content(fitted.lack_of_fit),
        "left_out": [
            {key: value for key, value in vars(left_out).items() if value is not None}
            for left_out in fitted.left_out
        ],
        "parameters": [
            {"name": value_of.name, "unit": value_of.unit, "value": value}
            for value_of, value in zip(fitted.model.parameters, fitted.values.tolist(), strict=True)
        ],
    }
    head = {key: value for key, value in head.items() if value not in (None, {}, [], "")}
    head["checksum"] = checksum_of(head, fitted.covariance, fitted.undetermined)
    return head


def _needed(kind: str) -> list[str]:
    """Return the extension that has a kind of error model, unless it is shipped."""
    extension = None if kind in KINDS else provider("error_models", kind)
    return [] if extension is None or extension in shipped() else [extension.name]


def _data(map_data: MapData) -> dict[str, Any]:
    return {key: value for key, value in vars(map_data).items() if value not in ((), None)}


def _probe_data(fitted: FittedMap) -> dict[str, Any]:
    """Probes as a file states them, by name."""
    data = {}
    for k, name in enumerate(fitted.probes.names):
        data[name] = {
            "offset": [_length(component) for component in fitted.probes.offsets[k].tolist()]
        }
        if fitted.probes.free[k].any():
            data[name] |= {
                "estimated": [AXIS_NAMES[axis] for axis in np.flatnonzero(fitted.probes.free[k])],
                "nominal": [_length(component) for component in fitted.drawn_offsets[k].tolist()],
            }
    return data


def _length(value: float) -> str:
    return f"{value!r} m"


def checksum_of(head: Mapping[str, Any], covariance: Array, undetermined: Array) -> str:
    """Return the SHA-256 of a file's content, independent of its form."""
    checked = {key: value for key, value in head.items() if key not in WORDS}
    digest = hashlib.sha256(json.dumps(checked, sort_keys=True).encode())
    for array in (covariance[np.tril_indices(len(covariance))], undetermined):
        digest.update(repr(array.shape).encode())
        digest.update(np.ascontiguousarray(array, "<f8").tobytes())
    return digest.hexdigest()
