"""A sweep from the studio: keys of the present design, every combination of their values."""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

from ballplate.extensions.sweeps.load import load_sweep
from ballplate.extensions.sweeps.running import computed
from ballplate.extensions.sweeps.temporary import written_sweep
from ballplate.presentation import finite
from ballplate.simulator.computing import Report
from ballplate.simulator.experiment import node_at
from ballplate.simulator.inputs import ExperimentError, Scalar

from .actions import ActionError, value_of
from .document import DesignDocument, encoded, experiment_of

# More are for a sweep file, whose store can be continued.
MOST_CELLS = 2000


Axes = Mapping[tuple[str, ...], tuple[str, ...]]
"""Values as a person has typed them, by the paths that take them."""


def swept(document: DesignDocument, settings: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """Compute a sweep over `axes`, each with `paths` and `values`: the text of each combination,
    and the `page`.

    :raises ActionError: an axis is incomplete, or there are too many combinations.
    :raises ExperimentError: the text is invalid, a path leads nowhere, or a value would run a model
        in Python in a design that the user has not opened by name.
    """
    axes = _axes(settings.get("axes"))
    with tempfile.TemporaryDirectory() as folder:
        file = _written(document, axes, Path(folder))
        try:
            sweep = load_sweep(file, trust=document.trust)
        except ExperimentError as error:
            # Nobody has seen the file; its words begin with the axis' key.
            raise ActionError("; ".join(message.text for message in error.messages)) from None
        store = file.with_suffix(".sqlite")
        result = computed(sweep, store, report=report)
        page = result.page_text()
    return {
        "headline": result.headline(),
        "axes": [list(paths) for paths in axes],
        "cells": [
            _cell(row, values, f"{file.name}:")
            for row, values in zip(result.rows(), product(*axes.values()), strict=True)
        ],
        "page": page,
    }


def ensure_possible(document: DesignDocument, settings: Mapping[str, Any]) -> None:
    """Ensure that a sweep over `axes` can begin, and that numbers replace texts only with units.

    :raises ActionError: an axis is incomplete, there are too many combinations, or a number lacks
        its unit.
    :raises ExperimentError: the text is invalid.
    """
    experiment = experiment_of(document)
    for paths, values in _axes(settings.get("axes")).items():
        numbers = [value for value in map(value_of, values) if type(value) in (int, float)]
        for path, number in product(paths, numbers[:1]):
            present = node_at(experiment.tree, path)
            if isinstance(present, Scalar) and isinstance(present.value, str):
                try:
                    experiment.with_({path: number})
                except ExperimentError as error:
                    raise ActionError(f"{path}: {error.messages[0].text}") from None


def _axes(data: Any) -> Axes:
    axes: dict[tuple[str, ...], tuple[str, ...]] = {}
    if not isinstance(data, list) or not all(isinstance(axis, Mapping) for axis in data):
        raise ActionError("a sweep needs a list of axes, each with its paths and values")
    for axis in data:
        if not all(isinstance(axis.get(key), list) for key in ("paths", "values")):
            raise ActionError("an axis needs its paths and values, each a list")
        paths, values = (
            tuple(str(text).strip() for text in axis[key]) for key in ("paths", "values")
        )
        if not paths or not all(paths) or not values:
            raise ActionError("an axis needs a key and its values")
        if paths in axes:
            raise ActionError(f"two axes vary {' '.join(paths)}; list their values in one")
        axes[paths] = values
    cells = math.prod(map(len, axes.values()))
    if not axes or cells > MOST_CELLS:
        text = f"{cells} combinations; at most {MOST_CELLS} are possible here"
        raise ActionError(text if axes else "a sweep needs a key")
    return axes


def _cell(row: Mapping[str, Any], values: Sequence[str], file: str) -> dict[str, Any]:
    # A place in a file that nobody has seen.
    reason = re.sub(rf"{re.escape(file)}\d+:\d+: ", "", str(row["reason"]))
    figures = {
        "deficiency": row.get("rank_deficiency"),
        "average": row.get("U6_average_m"),
        "maximum": row.get("U6_maximum_m"),
        "within": row.get("U6_within_target"),
    }
    return {"values": list(values), "reason": reason} | {
        key: finite(value) if isinstance(value, float) else None for key, value in figures.items()
    }


def _written(document: DesignDocument, axes: Axes, folder: Path) -> Path:
    """Write the sweep's file in a folder, with the present design and copies of the files that it
    names.
    """
    experiment = experiment_of(document)
    variant = {} if document.variant is None else {"variant": document.variant}
    content = {
        "title": experiment.title,
        **variant,
        "axes": {
            " ".join(paths): {"paths": list(paths), "values": [*map(value_of, values)]}
            for paths, values in axes.items()
        },
    }
    try:
        return written_sweep(encoded(document), experiment, document.path, content, folder)
    except (OSError, ValueError) as error:
        raise ActionError(f"the files that the design names cannot be copied: {error}") from None
