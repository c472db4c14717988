"""Error functions of a machine, fitted or described by a file, as they show themselves."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from ballplate.presentation import (
    SHOWN,
    Data,
    Result,
    aligned,
    ascii_units,
    number,
    picked,
    table_csv,
    table_lines,
)
from ballplate.simulator.geometry import AXIS_NAMES

from ..machine_files import FittedMap
from .error_functions import (
    POSITIONS,
    ErrorFunctions,
    EstimatedNumber,
    FunctionCurve,
    error_functions,
    stated_functions,
)
from .error_map import UNDETERMINED, expanded
from .error_sources import ErrorSource, source_of_machine, source_of_map

ARCSECOND = np.pi / 180.0 / 3600.0

# Lines of a function that the text has where there are many: those along the edges of the volume.
MOST_LINES = 12


@dataclass(frozen=True, eq=False, repr=False)
class ErrorCurves(Result):
    """The error functions of a machine, its squareness errors and its other numbers."""

    source: ErrorSource
    functions: ErrorFunctions

    @property
    def label(self) -> str:
        return self.source.label

    @property
    def title(self) -> str:
        return self.source.title

    @property
    def warnings(self) -> tuple[str, ...]:
        return self.source.cautions

    def headline(self) -> str:
        names = dict.fromkeys(curve.name for curve in self.functions.curves)
        square = len(self.functions.squareness)
        words = f"{len(names)} error functions, {square} squareness errors"
        open_ = {curve.name for curve in self.functions.curves if curve.is_undetermined}
        return f"{words}, {len(open_)} functions undetermined" if open_ else words

    def lines(self) -> list[str]:
        functions, k = self.functions, self.source.coverage_factor
        lines = [*self.source.lines]
        lines[-1] += ", at each position separately"
        if functions.curves:
            lines += ["", *_curve_table(functions.curves, k)]
        if functions.squareness:
            lines += ["", *_angle_table(functions.squareness, k)]
        if functions.numbers:
            lines += ["", *_number_table(functions.numbers, k)]
        return lines

    def data(self) -> Data:
        k, data = self.source.coverage_factor, {**self.source.data}
        data["functions"] = [
            {
                "error": curve.name,
                **picked(curve, "meaning", "unit"),
                "line": curve.line or None,
                "axis": None if curve.axis is None else AXIS_NAMES[curve.axis],
                "position": curve.positions,
                "value": curve.values,
                "expanded_uncertainty": k * curve.uncertainties,
                "source": curve.source or None,
            }
            for curve in self.functions.curves
        ]
        for part in ("squareness", "numbers"):
            data[part] = [
                {
                    "error": error.name,
                    **picked(error, "meaning", "unit", "value"),
                    "expanded_uncertainty": k * error.standard_uncertainty,
                    "source": error.source,
                }
                for error in getattr(self.functions, part)
            ]
        return data | {"warnings": self.warnings}

    def rows(self) -> list[Data]:
        """One row for each position of each curve, then one for each number; in metres, radians and
        ratios.
        """
        k = self.source.coverage_factor
        rows = [
            _row(curve.name, curve.line, x, value, k * u, k, curve.unit)
            for curve in self.functions.curves
            for x, value, u in zip(
                *(part.tolist() for part in (curve.positions, curve.values, curve.uncertainties)),
                strict=True,
            )
        ]
        numbers = (*self.functions.squareness, *self.functions.numbers)
        return rows + [
            _row(
                error.name,
                "",
                np.nan,
                error.value,
                k * error.standard_uncertainty,
                k,
                error.unit,
            )
            for error in numbers
        ]

    def point_lines(self) -> list[str]:
        """Return all curves and numbers as lines of a CSV file; undetermined cells are empty."""
        fractions = {curve.name for curve in self.functions.curves if curve.axis is None}
        columns = {
            "error": "error",
            "line": "line",
            "position_mm": lambda row: (
                row["position"] * (1.0 if row["error"] in fractions else 1e3)
            ),
            "value": lambda row: 1e6 * row["value"],
            "U": lambda row: 1e6 * row["U"],
            "k": lambda row: f"{row['k']:g}",
            "unit": lambda row: ascii_units(SHOWN[row["unit"]]),
        }
        return table_csv(columns, self.rows())


def error_curves(
    fitted: FittedMap, label: str, names: Collection[str] = (), positions: int = POSITIONS
) -> ErrorCurves:
    """Return the error functions of a map at a number of positions, or those named.

    :raises ValueError: there is none of a name.
    """
    functions = error_functions(fitted, names, positions)
    return ErrorCurves(source_of_map(fitted, label), functions)


def machine_curves(
    file: Path, names: Collection[str] = (), positions: int = POSITIONS
) -> ErrorCurves:
    """Return the error functions that a machine file states, at its reference point, with the
    standard deviations of their random parts.

    :raises ExperimentError: the file is wrong.
    :raises ValueError: there is none of a name.
    """
    built, source = source_of_machine(file)
    return ErrorCurves(source, stated_functions(built, names, positions))


def _row(
    name: str, line: str, position: float, value: float, u: float, k: float, unit: str
) -> Data:
    keys = ("error", "line", "position", "value", "U", "k", "unit")
    return dict(zip(keys, (name, line, position, value, u, k, unit), strict=True))


def _curve_table(curves: Sequence[FunctionCurve], k: float) -> list[str]:
    """Return one row per curve: range of positions, least and largest value, largest band."""
    heads = ["error", "", "along", "from, mm", "to, mm", "least", "largest"]
    heads += ["largest U", "unit", "stated as"]
    rows, line_counts, omitted = list[list[str]](), dict[str, int](), 0
    for curve in curves:
        line_counts[curve.name] = line_counts.get(curve.name, 0) + 1
        if line_counts[curve.name] > MOST_LINES:
            omitted += 1
            continue
        along = curve.line.removeprefix("along ")
        ends = ["", ""]
        if curve.axis is not None:
            along = along or AXIS_NAMES[curve.axis].upper()
            ends = [f"{1e3 * x:.6g}" for x in (curve.positions[0], curve.positions[-1])]
        values = [UNDETERMINED, "", ""]
        if not curve.is_undetermined:
            ranges = (
                np.nanmin(curve.values),
                np.nanmax(curve.values),
                k * np.nanmax(curve.uncertainties),
            )
            values = [number(1e6 * value, 4) for value in ranges]
            if np.isnan(curve.uncertainties).any():
                values[2] += " in part"
        unit = SHOWN[curve.unit]
        rows.append([curve.name, curve.meaning, along, *ends, *values, unit, curve.source])
    right = [False, False, False, True, True, True, True, True, False, False]
    # A map is an estimate throughout.
    shown = slice(None if any(row[-1] for row in rows) else -1)
    more = [f"({omitted} more lines are in --format csv and --json)"] if omitted else []
    return [*aligned([row[shown] for row in (heads, *rows)], right[shown]), *more]


def _angle_table(numbers: Sequence[EstimatedNumber], k: float) -> list[str]:
    """Squareness errors as angles in two units."""
    columns = [
        ("squareness", "name"),
        ("", "meaning"),
        ("µrad", ("value", "standard_uncertainty")),
        ("U", (lambda estimate: k * estimate.standard_uncertainty, expanded)),
        ("arcsec", ("value", "standard_uncertainty")),
        ("U", (lambda estimate: k * estimate.standard_uncertainty / (1e6 * ARCSECOND), expanded)),
        ("", "source"),
    ]
    return table_lines(columns, numbers, unknown=UNDETERMINED)


def _number_table(numbers: Sequence[EstimatedNumber], k: float) -> list[str]:
    columns = {
        "error": "name",
        "": "meaning",
        "value": ("value", "standard_uncertainty"),
        "U": (lambda estimate: k * estimate.standard_uncertainty, expanded),
        "unit": "unit",
    }
    return table_lines(columns, numbers, unknown=UNDETERMINED)
