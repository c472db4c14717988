"""Values with names as text and as plain data: measuring tasks, dimensions of a part."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ballplate.presentation.formatting import Data, given, picked, uncertainty_words
from ballplate.presentation.result import Result
from ballplate.presentation.table_columns import table_lines
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.inputs.extensions import service
from ballplate.uncertainty.named_values import NamedUncertainty
from ballplate.uncertainty.summaries import Quantity, tasks_of


def named_lines(design: Design, quantities: dict[str, Quantity], caveat: str = "") -> list[str]:
    """Return tables of all values with names as lines of text; a `caveat` follows the target."""
    tasks, part = tasks_of(quantities), _part(design, quantities)
    lines = ["", *task_table(tasks, caveat)] if tasks else []
    return lines if part is None else [*lines, "", *part.lines()]


def named_data(design: Design, quantities: dict[str, Quantity]) -> Data:
    """Return all values with names as plain data, if there are any."""
    part = _part(design, quantities)
    return given(tasks=task_data(tasks_of(quantities)), part=part and part.to_dict())


def _part(design: Design, quantities: dict[str, Quantity]) -> Result | None:
    """Return the dimensions of the part of a design as the extension that has them shows them."""
    if "dimensions" not in quantities:
        return None
    shown: Result = service("part_uncertainty")(design, quantities["dimensions"])
    return shown


def task_table(tasks: Sequence[NamedUncertainty], caveat: str = "") -> list[str]:
    """Return measuring tasks as lines of text; a `caveat` follows the target's uncertainty."""
    columns = {
        "task": "name",
        "length, mm": ("length", 6),
        "standard uncertainty, µm": "standard_uncertainty",
        f"expanded (k = {tasks[0].expansion:g}), µm": "expanded_uncertainty",
        "target, µm": "target",
        "within target": _judged,
    }
    with_target = any(task.target is not None for task in tasks)
    uncertainty = next(
        (uncertainty_words(task.coverage_factor) for task in tasks if task.target is not None), ""
    )
    note = [f"(the target is compared with the {uncertainty}{caveat})"] if with_target else []
    return [*table_lines(columns, tasks), *note]


def _judged(task: NamedUncertainty) -> str:
    if math.isnan(task.standard_uncertainty):
        return "undetermined"
    return "" if task.is_within is None else "yes" if task.is_within else "no"


def task_data(tasks: Sequence[NamedUncertainty]) -> Data:
    """Return measuring tasks as plain data in metres."""
    return {
        task.name: {
            **picked(task, "length", "standard_uncertainty", "expanded_uncertainty"),
            "coverage_factor": task.expansion,
            "target": task.target,
            **({} if task.target is None else {"target_coverage_factor": task.coverage_factor}),
            "within_target": task.is_within,
            "unit": "m",
        }
        for task in tasks
    }
