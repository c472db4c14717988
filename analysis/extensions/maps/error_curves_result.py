"""Error functions of a fitted machine with their bands, as they show themselves."""

from __future__ import annotations

import io
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from ballplate.presentation.formatting import SHOWN, aligned, ascii_units, number, picked
from ballplate.presentation.result import Result
from ballplate.presentation.table_columns import table_lines
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.spreadsheets import CsvWriter
from ballplate.simulator.maps.fitted_map import FittedMap

from .error_functions import (
    POSITIONS,
    ErrorFunctions,
    EstimatedNumber,
    FunctionCurve,
    error_functions,
)
from .fitted_errors_result import map_cautions
from .fitted_tables import UNDETERMINED, expanded, head_lines, map_data
from .function_plots import draw_functions

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ARCSECOND = np.pi / 180.0 / 3600.0

# Lines of a function that the text has where there are many: those along the edges of the volume.
MOST_LINES = 12

HEADS = ("error", "line", "position_mm", "value", "U", "k", "unit")


@dataclass(frozen=True, eq=False, repr=False)
class ErrorCurves(Result):
    """The error functions of a fitted machine, its squareness errors and its other numbers."""

    label: str
    fitted: FittedMap
    functions: ErrorFunctions

    @property
    def title(self) -> str:
        return self.fitted.title

    @property
    def k(self) -> float:
        """The coverage factor of expanded uncertainties."""
        return self.fitted.coverage_factor

    def headline(self) -> str:
        names = dict.fromkeys(one.name for one in self.functions.curves)
        square = len(self.functions.squareness)
        words = f"{len(names)} error functions, {square} squareness errors"
        open_ = {one.name for one in self.functions.curves if one.is_undetermined}
        return f"{words}, {len(open_)} functions undetermined" if open_ else words

    def lines(self) -> list[str]:
        found, lines = self.functions, head_lines(self.label, self.fitted)
        lines[-1] += ", at each position by itself"
        if found.curves:
            lines += ["", *_curve_table(found.curves, self.k)]
        if found.squareness:
            lines += ["", *_angle_table(found.squareness, self.k)]
        if found.numbers:
            lines += ["", *_number_table(found.numbers, self.k)]
        return lines

    def data(self) -> dict[str, Any]:
        found = map_data(self.label, self.fitted)
        found["functions"] = [
            {
                "error": one.name,
                **picked(one, "meaning", "unit"),
                "line": one.line or None,
                "axis": None if one.axis is None else AXIS_NAMES[one.axis],
                "position": one.positions,
                "value": one.values,
                "expanded_uncertainty": self.k * one.uncertainties,
            }
            for one in self.functions.curves
        ]
        for key in ("squareness", "numbers"):
            found[key] = [
                {
                    "error": one.name,
                    **picked(one, "meaning", "unit", "value"),
                    "expanded_uncertainty": self.k * one.standard_uncertainty,
                    "source": one.source,
                }
                for one in getattr(self.functions, key)
            ]
        return found | {"warnings": self.warnings}

    def rows(self) -> list[dict[str, Any]]:
        """One row for each position of each curve, then one for each number; in metres, radians and
        ratios.
        """
        rows = [
            _row(one.name, one.line, x, value, self.k * u, self.k, one.unit)
            for one in self.functions.curves
            for x, value, u in zip(
                *(part.tolist() for part in (one.positions, one.values, one.uncertainties)),
                strict=True,
            )
        ]
        numbers = (*self.functions.squareness, *self.functions.numbers)
        return rows + [
            _row(
                one.name, "", np.nan, one.value, self.k * one.standard_uncertainty, self.k, one.unit
            )
            for one in numbers
        ]

    def point_lines(self) -> Iterator[str]:
        """All curves and numbers as lines of a CSV file; what is undetermined is empty."""
        text = io.StringIO()
        writer = CsvWriter(text)
        writer.writerow(HEADS)
        for row in self.rows():
            along = row["position"] * (1.0 if self._is_fraction(row) else 1e3)
            cells = [_cell(one) for one in (along, 1e6 * row["value"], 1e6 * row["U"])]
            unit = ascii_units(SHOWN[row["unit"]])
            writer.writerow([row["error"], row["line"], *cells, f"{self.k:g}", unit])
        yield from text.getvalue().splitlines()

    def _is_fraction(self, row: dict[str, Any]) -> bool:
        return any(one.axis is None for one in self.functions.curves if one.name == row["error"])

    @property
    def warnings(self) -> tuple[str, ...]:
        return map_cautions(self.fitted)

    def plot(self, path: str | Path | None = None) -> Figure:
        """All curves side by side, each with its band, those in the same unit to the same scale.

        With a path, which ends in .svg, .png or .pdf, the picture is written as well.

        :raises ImportError: matplotlib is missing.
        :raises ValueError: the path ends in something else, or there is no curve.
        """
        if not self.functions.curves:
            raise ValueError(
                "there are no curves to draw, only single numbers; leave the picture out"
            )
        return draw_functions(self.functions, self.title, self.k, path)


def error_curves(
    fitted: FittedMap, label: str, names: Collection[str] = (), positions: int = POSITIONS
) -> ErrorCurves:
    """The error functions of a map at so many positions, or those with some names.

    :raises ValueError: there is none of a name.
    """
    return ErrorCurves(label, fitted, error_functions(fitted, names, positions))


def _row(
    name: str, line: str, position: float, value: float, u: float, k: float, unit: str
) -> dict[str, Any]:
    keys = ("error", "line", "position", "value", "U", "k", "unit")
    return dict(zip(keys, (name, line, position, value, u, k, unit), strict=True))


def _cell(value: float) -> str:
    return "" if np.isnan(value) else f"{value + 0.0:.12g}"


def _curve_table(curves: Sequence[FunctionCurve], k: float) -> list[str]:
    """A line for each curve: where it runs, its least and largest value, and its largest U."""
    heads = ["error", "", "along", "from, mm", "to, mm", "least", "largest", "largest U", "unit"]
    rows, told, left = [heads], dict[str, int](), 0
    for one in curves:
        told[one.name] = told.get(one.name, 0) + 1
        if told[one.name] > MOST_LINES:
            left += 1
            continue
        along = one.line.removeprefix("along ")
        ends = ["", ""]
        if one.axis is not None:
            along = along or AXIS_NAMES[one.axis].upper()
            ends = [f"{1e3 * x:.6g}" for x in (one.positions[0], one.positions[-1])]
        values = [UNDETERMINED, "", ""]
        if not one.is_undetermined:
            ranges = np.nanmin(one.values), np.nanmax(one.values), k * np.nanmax(one.uncertainties)
            values = [number(1e6 * float(value), 4) for value in ranges]
            if np.isnan(one.uncertainties).any():
                values[2] += " in part"
        rows.append([one.name, one.meaning, along, *ends, *values, SHOWN[one.unit]])
    right = [False, False, False, True, True, True, True, True, False]
    more = [f"({left} more lines are in --format csv and --json)"] if left else []
    return [*aligned(rows, right), *more]


def _angle_table(numbers: Sequence[EstimatedNumber], k: float) -> list[str]:
    """Squareness errors as angles in two units."""
    columns = [
        ("squareness", "name"),
        ("", "meaning"),
        ("µrad", ("value", "standard_uncertainty")),
        ("U", (lambda one: k * one.standard_uncertainty, expanded)),
        ("arcsec", ("value", "standard_uncertainty")),
        ("U", (lambda one: k * one.standard_uncertainty / (1e6 * ARCSECOND), expanded)),
        ("", "source"),
    ]
    return table_lines(columns, numbers, unknown=UNDETERMINED)


def _number_table(numbers: Sequence[EstimatedNumber], k: float) -> list[str]:
    columns = {
        "error": "name",
        "": "meaning",
        "value": ("value", "standard_uncertainty"),
        "U": (lambda one: k * one.standard_uncertainty, expanded),
        "unit": "unit",
    }
    return table_lines(columns, numbers, unknown=UNDETERMINED)
