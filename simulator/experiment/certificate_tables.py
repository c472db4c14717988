"""Certified values in tables (CSV), each with its uncertainty, a standard or an expanded one."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from ballplate.simulator.inputs.messages import ExperimentError, Steps
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.settings import shorten

from .references import References

if TYPE_CHECKING:
    from ballplate.simulator.inputs.tables import FileRow, TableLine

STANDARD, EXPANDED, FACTOR = "standard_uncertainty", "expanded_uncertainty", "k"
NO_FACTOR = "-"
# Names of columns that do not say which uncertainty they hold.
UNCLEAR = re.compile(r"(u|u95|unc|uncertainty)_[^_]+", re.IGNORECASE)


def read_rows(
    settings: Any,
    texts: Sequence[str],
    lengths: Sequence[str],
    further: Sequence[str],
    steps: Steps,
    references: References,
) -> tuple[tuple[FileRow, ...], list[Array]] | None:
    """Return rows of a CSV file, and the standard uncertainties of each row's `lengths`, NaN
    without any; or report faults.
    """
    from ballplate.simulator.inputs.tables import read_table, table_lines

    problems = references.problems
    columns_allowed = [f"{length}_{name}" for name in (STANDARD, EXPANDED) for length in lengths]
    optional = [*further, STANDARD, EXPANDED, *columns_allowed]
    columns = [*texts, FACTOR]
    try:
        path = references.file(settings.values)
        _refuse_unclear(table_lines(path), str(path))
        rows = read_table(
            path, columns, lengths, optional, defaults={FACTOR: NO_FACTOR}, absent=math.nan
        )
    except ExperimentError as error:
        problems.take(error, steps)
        return None
    count, before = len(lengths), len(problems.messages)
    uncertainties = []
    for row in rows:
        extra = dict(zip(optional, row.lengths[count:], strict=True))
        factor = _factor(row.texts[-1], settings.coverage_factor)
        values = np.full(count, math.nan)
        for k, length in enumerate(lengths):
            stated = [
                (extra[name], name.endswith(EXPANDED))
                for name in (STANDARD, EXPANDED, f"{length}_{STANDARD}", f"{length}_{EXPANDED}")
                if not math.isnan(extra[name])
            ]
            if not stated:
                continue
            value, is_expanded = stated[0]
            text = _wrong(value, is_expanded, factor, row.texts[-1])
            if len(stated) > 1:
                text = "states an uncertainty twice; leave one column out"
            if text:
                problems.add_at(row.mark, steps, text)
                break
            values[k] = value / (factor or 1.0) if is_expanded else value
        if row.texts[-1] != NO_FACTOR and all(
            math.isnan(value) for name, value in extra.items() if name.endswith(EXPANDED)
        ):
            text = "has a coverage factor k and no expanded uncertainty; call the column"
            problems.add_at(row.mark, steps, f"{text} expanded_uncertainty_um, or leave k out")
        uncertainties.append(values)
    return None if len(problems.messages) > before else (rows, uncertainties)


def _refuse_unclear(lines: list[TableLine], file: str) -> None:
    from ballplate.simulator.inputs.tables import header_cells

    if not lines:
        return
    for place, cell, _, unit in header_cells(file, lines[0], "ball_1,ball_2,distance_mm"):
        if UNCLEAR.fullmatch(cell):
            text = (
                f'"{shorten(cell)}" does not say which uncertainty it is; call it'
                f" {STANDARD}_{unit}, or {EXPANDED}_{unit} beside a column k"
            )
            raise place.refused(text)


def _factor(text: str, common: float | None) -> float | None:
    if text == NO_FACTOR:
        return common
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return math.nan


def _wrong(value: float, is_expanded: bool, factor: float | None, text: str) -> str:
    """Return the fault of a stated uncertainty; possibly empty."""
    if value < 0.0:
        return "an uncertainty is below zero; correct it"
    if not is_expanded:
        return ""
    if factor is None:
        return (
            "an expanded uncertainty has no coverage factor; add a column k, or coverage_factor to"
            " the item, or call the column standard_uncertainty if it is one"
        )
    return (
        ""
        if 0.0 < factor < math.inf
        else f'the coverage factor is "{shorten(text)}"; it must be above 0'
    )
