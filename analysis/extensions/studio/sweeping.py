"""A sweep from the studio: keys of the present design, every combination of their values."""

from __future__ import annotations

import math
import os
import re
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from ballplate.extensions.repair.yamltext import flow
from ballplate.extensions.sweeps.bundle import Bundle, bundle_of, names_of, unpack
from ballplate.extensions.sweeps.load import load_sweep
from ballplate.extensions.sweeps.local import local_runner
from ballplate.extensions.sweeps.running import (
    SweepResult,
    compute_sweep,
    enter,
    result_of,
    writable_store,
)
from ballplate.extensions.sweeps.store import Store
from ballplate.presentation import finite
from ballplate.simulator.computing import Report
from ballplate.simulator.experiment import named_in, node_at, node_of
from ballplate.simulator.inputs import ExperimentError, Mark, Node, Scalar, Trust

from .actions import ActionError, value_of
from .document import DesignDocument, encoded, experiment_of

# More are for a sweep file, whose store can be continued.
MOST_CELLS = 2000


@dataclass(frozen=True)
class _Axis:
    """Paths that take the same values, as a person has typed them."""

    paths: tuple[str, ...]
    values: tuple[str, ...]

    @property
    def name(self) -> str:
        return " ".join(self.paths)


def swept(document: DesignDocument, settings: Mapping[str, Any], report: Report) -> dict[str, Any]:
    """Compute a sweep over `axes`, each with `paths` and `values`: the text of each combination,
    and the `page`, empty if its modules are not installed.

    :raises ActionError: an axis is incomplete, or there are too many combinations.
    :raises ExperimentError: the text is invalid, a path leads nowhere, or a value would run a model
        in Python in a design that the user has not opened by name.
    """
    axes = _axes(settings.get("axes"))
    tree = experiment_of(document).tree
    with tempfile.TemporaryDirectory() as folder:
        file = _written(document, tree, axes, Path(folder))
        with writable_store(file.with_suffix(".sqlite")) as store:
            result = _computed(file, store, document.trust, report)
            page = _page(store, document.trust.modules)
    return {
        "headline": result.headline(),
        "axes": [list(axis.paths) for axis in axes],
        "cells": [
            _cell(row, values, f"{file.name}:")
            for row, values in zip(
                result.rows(), product(*(sweep_axis.values for sweep_axis in axes)), strict=True
            )
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
    for axis in _axes(settings.get("axes")):
        numbers = (value for value in map(value_of, axis.values) if type(value) in (int, float))
        number = next(numbers, None)
        for path in axis.paths:
            present = node_at(experiment.tree, path)
            if number is None or not isinstance(present, Scalar):
                continue
            if isinstance(present.value, str):
                try:
                    experiment.with_({path: number})
                except ExperimentError as error:
                    raise ActionError(f"{path}: {error.messages[0].text}") from None


def _axes(axes_data: Any) -> list[_Axis]:
    if not isinstance(axes_data, list) or not all(
        isinstance(axis_entry, Mapping) for axis_entry in axes_data
    ):
        raise ActionError("a sweep needs a list of axes, each with its paths and values")
    axes = [_axis(axis_entry) for axis_entry in axes_data]
    cells = math.prod(len(axis_entry.values) for axis_entry in axes)
    if not axes or cells > MOST_CELLS:
        some = f"{cells} combinations; at most {MOST_CELLS} are possible here"
        raise ActionError(some if axes else "a sweep needs a key")
    names = [axis.name for axis in axes]
    for name in names:
        if names.count(name) > 1:
            raise ActionError(f"two axes vary {name}; list their values in one")
    return axes


def _computed(file: Path, store: Store, trust: Trust, report: Report) -> SweepResult:
    try:
        sweep = load_sweep(file, trust=trust)
    except ExperimentError as error:
        # Nobody has seen the file; its words begin with the axis' key.
        raise ActionError("; ".join(message.text for message in error.messages)) from None
    bundle = bundle_of(sweep)
    entered = enter(store, sweep, bundle, beside=False)
    runner = nullcontext(local_runner(sweep, bundle, workers=1))
    summary = compute_sweep(store, sweep, entered, runner, report=report)
    return result_of(store, sweep, entered, summary)


def _page(store: Store, with_modules: bool) -> str:
    from ballplate.extensions.sweeps.report.results import read_results

    try:
        from ballplate.extensions.sweeps.report.page import page

        return page(store, read_results(store, None), with_modules)
    except ImportError:
        return ""


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


def _axis(axis_data: Mapping[str, Any]) -> _Axis:
    lists = [axis_data.get(key) for key in ("paths", "values")]
    if not all(isinstance(value_list, list) for value_list in lists):
        raise ActionError("an axis needs its paths and values, each a list")
    paths, values = (
        tuple(str(value_list).strip() for value_list in some) for some in lists if some is not None
    )
    if not all(paths) or not paths or not values:
        raise ActionError("an axis needs a key and its values")
    return _Axis(paths, values)


def _written(document: DesignDocument, tree: Node, axes: Sequence[_Axis], folder: Path) -> Path:
    """Write the sweep's file in a folder, with the present design and copies of the files that it
    names.
    """
    mark = Mark("sweep", 0, 0)
    nodes = [("", tree)] + [
        (path, node_of(value_of(value), mark))
        for axis in axes
        for path in axis.paths
        for value in axis.values
    ]
    source = Path(os.path.abspath(document.path))
    try:
        names = names_of(sorted({source, *named_in(nodes, source.parent)}))
        contents = ((name, path) for path, name in names.items() if path != source)
        files = tuple((name, Path(path).read_bytes()) for name, path in contents)
    except (OSError, ValueError) as error:
        raise ActionError(f"the files that the design names cannot be copied: {error}") from None
    name = names[source]
    design = unpack(Bundle(name, name, (*files, (name, encoded(document)))), folder)
    lines = [f"title: {flow(experiment_of(document).title)}", f"base: {flow(design.name)}"]
    if document.variant is not None:
        lines.append(f"variant: {flow(document.variant)}")
    lines.append("axes:")
    for axis in axes:
        data = {
            "paths": list(axis.paths),
            "values": [value_of(axis_value) for axis_value in axis.values],
        }
        lines.append(f"  {flow(axis.name)}: {flow(data)}")
    file = design.with_name(".ballplate-sweep.yaml")
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file
