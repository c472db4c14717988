"""Covariance and correlation matrices in CSV files, with the names of their values."""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np

from .messages import MOST_MESSAGES, ExperimentError, Message, refused
from .number_arrays import Array
from .settings import hint, shorten
from .tables import decimal_sign, pointed, table_lines, wrong_count, wrong_number
from .units import LENGTH_UNITS, plain_unit
from .writing import text_of_cell
from .yamltree import Mark

MOST_NAMES = 2000
# Tolerance of symmetry, in halves of the last digit: both entries were rounded separately.
SAME_DIGITS = 2.0


@dataclass(frozen=True, eq=False)
class NamedMatrix:
    """A covariance matrix (m, m), in square metres, or a correlation matrix of values with `names`.

    `rounding` (m, m) is half a unit of the entries' last digits, `marks` are those of the rows.
    """

    names: tuple[str, ...]
    values: Array
    rounding: Array
    is_correlation: bool
    marks: tuple[Mark, ...]

    def shown(self, value: float) -> str:
        """Return an entry for messages."""
        return f"{value:.6g}" if self.is_correlation else f"{1e12 * value:.6g} µm²"


def half_digit(text: str) -> float:
    """Return half a unit of a number's last digit; 0 of a whole number without a point.

    >>> half_digit("0.040"), half_digit("1.2e-3"), half_digit("4")
    (0.0005, 5e-05, 0.0)
    """
    try:
        exponent = Decimal(text.strip()).as_tuple().exponent
    except InvalidOperation:
        return 0.0
    if not isinstance(exponent, int) or exponent >= 0:
        return 0.0
    return 0.5 * 10.0**exponent


def read_matrix(path: Path) -> NamedMatrix:
    """Return the matrix of a CSV file.

    The first cell is correlation, or covariance with a unit, such as covariance_um2; names follow
    in the first row and, in the same order, in the first column.

    :raises ExperimentError: it cannot be read, is not square, not symmetric or no matrix of
        variances; up to `MOST_MESSAGES` errors.
    """
    lines, file = table_lines(path), str(path)
    if not lines:
        text = "the file is empty; its first line should be covariance_um2 and the names of values"
        raise refused(file, text, line=1)
    head = Mark(file, lines[0].number, 1)
    cells = lines[0].cells()
    if cells is None or len(cells) < 2:
        text = "the first line should be covariance_um2, or correlation, and the names of values"
        raise head.refused(text)
    factor = _factor(head, text_of_cell(cells[0][1]))
    names = [text_of_cell(cell) for _, cell in cells[1:]]
    if len(names) > MOST_NAMES:
        raise head.refused(f"{len(names)} values; at most {MOST_NAMES}")
    messages = [
        head.message("", f'a second column "{shorten(name)}"; remove one of the two')
        for name in sorted({name for name in names if names.count(name) > 1})
    ]
    if len(lines) - 1 != len(names):
        text = f"{len(names)} columns and {len(lines) - 1} rows; a covariance is square"
        raise ExperimentError([*messages, head.message("", text)])
    values, rounding = np.zeros((len(names), len(names))), np.zeros((len(names), len(names)))
    marks = []
    decimal = decimal_sign(lines[1:], range(1, len(cells)))
    for k, line in enumerate(lines[1:]):
        mark = Mark(file, line.number, 1)
        marks.append(mark)
        row = line.cells()
        if row is None or len(row) != len(cells):
            messages.append(mark.message("", wrong_count(line, row, len(cells))))
            continue
        name = text_of_cell(row[0][1])
        if name != names[k]:
            text = f'row "{shorten(name)}", but column {k + 1} is "{shorten(names[k])}"'
            messages.append(mark.message("", f"{text}; name rows and columns in the same order"))
        for j, (column, cell) in enumerate(row[1:]):
            number = pointed(cell, decimal)
            entry = _number(number)
            if not math.isfinite(entry):
                place = Mark(file, line.number, column)
                text = wrong_number(cell, names[j]) or f'"{shorten(cell)}" is not a number'
                messages.append(place.message("", text))
            values[k, j], rounding[k, j] = entry, half_digit(number)
        if len(messages) > MOST_MESSAGES:
            break
    if messages:
        raise ExperimentError(messages[:MOST_MESSAGES])
    scale = 1.0 if factor is None else factor
    matrix = NamedMatrix(
        tuple(names), values * scale, rounding * scale, factor is None, tuple(marks)
    )
    errors = matrix_problems(matrix)
    if errors:
        raise ExperimentError(errors[:MOST_MESSAGES])
    return matrix


def matrix_problems(matrix: NamedMatrix) -> list[Message]:
    """Return messages about entries that no covariance or correlation matrix can have."""
    values, size = matrix.values, np.sqrt(np.abs(np.diag(matrix.values)))
    messages = []
    for k, name in enumerate(matrix.names):
        variance = values[k, k]
        if matrix.is_correlation and abs(variance - 1.0) > max(1e-9, matrix.rounding[k, k]):
            text = f'the correlation of "{name}" with itself is {variance:.6g}; it must be 1'
            messages.append(matrix.marks[k].message("", text))
        elif variance < 0.0:
            messages.append(matrix.marks[k].message("", f'the variance of "{name}" is negative'))
    digits = matrix.rounding + matrix.rounding.T
    is_asymmetric = np.abs(values - values.T) > np.maximum(
        SAME_DIGITS * digits, 1e-9 * np.maximum(np.abs(values), np.abs(values.T))
    )
    for k, j in np.argwhere(np.triu(is_asymmetric)).tolist():
        text = (
            f'not symmetric: "{matrix.names[k]}" with "{matrix.names[j]}" is'
            f" {matrix.shown(values[k, j])}, vice versa {matrix.shown(values[j, k])};"
            " correct one of the two"
        )
        messages.append(matrix.marks[k].message("", text))
    limit = np.outer(size, size)
    slack = matrix.rounding + 1e-9 * limit
    slack += 0.5 * (np.diag(matrix.rounding)[:, None] + np.diag(matrix.rounding))
    large = np.triu(np.abs(values) > limit + slack, 1) & ~is_asymmetric
    for k, j in np.argwhere(large).tolist():
        text = (
            f'"{matrix.names[k]}" and "{matrix.names[j]}" are correlated by more than 1, which no'
            " two values are; correct the covariance or the variances"
        )
        messages.append(matrix.marks[k].message("", text))
    return messages


def _factor(mark: Mark, cell: str) -> float | None:
    """Return the square metres of a first cell's unit, None if it says correlation."""
    if cell.lower() == "correlation":
        return None
    heading, _, unit = cell.rpartition("_")
    areas = [f"{unit_of_length}2" for unit_of_length in LENGTH_UNITS]
    plain = plain_unit(unit).replace("²", "2").replace("^", "")
    if heading.lower() == "covariance" and plain in areas:
        return float(LENGTH_UNITS[plain[:-1]] ** 2)
    text = f'the first cell is "{shorten(cell)}"; write covariance_um2, or correlation'
    if heading.lower() == "covariance":
        text = f'"{shorten(cell)}" has no unit of area; {hint(plain, areas)}'
    raise mark.refused(text)


def _number(cell: str) -> float:
    try:
        return float(Decimal(cell.strip()))
    except InvalidOperation:
        return math.nan
