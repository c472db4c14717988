"""Covariance and correlation matrices in CSV files, with the names of their values."""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .messages import MOST_MESSAGES, ExperimentError, Message, refused
from .quantities import LENGTH_UNITS, plain_unit
from .settings import hint, shorten
from .spreadsheets import text_of_cell
from .tables import split_cells, table_lines, wrong_count, wrong_number
from .yamltree import Mark

Floats = NDArray[np.float64]

MOST_NAMES = 2000
# Two halves of a matrix are the same where they differ by no more than so many halves of their last
# digit.
SAME_DIGITS = 2.0


@dataclass(frozen=True, eq=False)
class NamedMatrix:
    """A covariance matrix (m, m), in square metres, or a correlation matrix of values with `names`;
    entries are known to `rounding` (m, m), half a unit of their last digit. `marks` are the rows',
    and `unit` the length whose square the file has, for messages.
    """

    names: tuple[str, ...]
    values: Floats
    rounding: Floats
    is_correlation: bool
    marks: tuple[Mark, ...]
    unit: str = "um"

    def shown(self, value: float) -> str:
        """An entry as the file has it, with its unit."""
        if self.is_correlation:
            return f"{value:.6g}"
        area = float(LENGTH_UNITS[self.unit] ** 2)
        return f"{value / area:.6g} {self.unit.replace('u', 'µ')}²"


def unit_of_area(area: float) -> str:
    """The length whose square is an area in square metres; the micrometre where none is.

    >>> unit_of_area(1e-6), unit_of_area(1e-18), unit_of_area(2.0)
    ('mm', 'nm', 'um')
    """
    apart = {name: abs(area / float(one**2) - 1.0) for name, one in LENGTH_UNITS.items()}
    return next((name for name, one in apart.items() if one < 1e-9), "um")


def half_digit(text: str) -> float:
    """Half a unit of the last digit of a number; 0 of a whole number without a point.

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
    """The matrix of a CSV file: its first cell is covariance with a unit, such as covariance_um2,
    or correlation; then names in the first row and in the first column, the same in the same order.

    :raises ExperimentError: it cannot be read, is not square, not symmetric or no matrix of
        variances; all that is wrong with it, up to `MOST_MESSAGES`.
    """
    lines, file = table_lines(path), str(path)
    if not lines:
        text = "the file is empty; its first line should be covariance_um2 and the names of values"
        raise refused(file, text, line=1)
    head = Mark(file, lines[0][0], 1)
    cells = split_cells(lines[0][1])
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
    for k, (number, line) in enumerate(lines[1:]):
        mark = Mark(file, number, 1)
        marks.append(mark)
        row = split_cells(line)
        if row is None or len(row) != len(cells):
            messages.append(mark.message("", wrong_count(line, row, len(cells))))
            continue
        name = text_of_cell(row[0][1])
        if name != names[k]:
            text = f'row "{shorten(name)}", but column {k + 1} is "{shorten(names[k])}"'
            messages.append(mark.message("", f"{text}; name rows and columns in the same order"))
        for j, (column, cell) in enumerate(row[1:]):
            found = _number(cell)
            if not math.isfinite(found):
                place = Mark(file, number, column)
                text = wrong_number(cell, names[j]) or f'"{shorten(cell)}" is not a number'
                messages.append(place.message("", text))
            values[k, j], rounding[k, j] = found, half_digit(cell)
        if len(messages) > MOST_MESSAGES:
            break
    if messages:
        raise ExperimentError(messages[:MOST_MESSAGES])
    is_correlation = factor is None
    scale = 1.0 if factor is None else factor
    found_matrix = NamedMatrix(
        *(tuple(names), values * scale, rounding * scale, is_correlation, tuple(marks)),
        unit=unit_of_area(scale),
    )
    wrong = matrix_problems(found_matrix)
    if wrong:
        raise ExperimentError(wrong[:MOST_MESSAGES])
    return found_matrix


def matrix_problems(matrix: NamedMatrix) -> list[Message]:
    """What makes a matrix no covariance, or no correlations: entry by entry, with the line."""
    values, size = matrix.values, np.sqrt(np.abs(np.diag(matrix.values)))
    messages = []
    for k, name in enumerate(matrix.names):
        own = values[k, k]
        if matrix.is_correlation and abs(own - 1.0) > max(1e-9, matrix.rounding[k, k]):
            text = f'the correlation of "{name}" with itself is {own:.6g}; it must be 1'
            messages.append(matrix.marks[k].message("", text))
        elif own < 0.0:
            messages.append(matrix.marks[k].message("", f'the variance of "{name}" is negative'))
    digits = matrix.rounding + matrix.rounding.T
    apart = np.abs(values - values.T) > np.maximum(
        SAME_DIGITS * digits, 1e-9 * np.maximum(np.abs(values), np.abs(values.T))
    )
    for k, j in np.argwhere(np.triu(apart)).tolist():
        text = (
            f'not symmetric: "{matrix.names[k]}" with "{matrix.names[j]}" is'
            f" {matrix.shown(values[k, j])}, the other way round {matrix.shown(values[j, k])};"
            " correct one of the two"
        )
        messages.append(matrix.marks[k].message("", text))
    bound = np.outer(size, size)
    slack = matrix.rounding + 1e-9 * bound
    slack += 0.5 * (np.diag(matrix.rounding)[:, None] + np.diag(matrix.rounding))
    large = np.triu(np.abs(values) > bound + slack, 1) & ~apart
    for k, j in np.argwhere(large).tolist():
        text = (
            f'"{matrix.names[k]}" and "{matrix.names[j]}" are correlated by more than 1, which no'
            " two values are; correct the covariance or the variances"
        )
        messages.append(matrix.marks[k].message("", text))
    return messages


def _factor(mark: Mark, cell: str) -> float | None:
    """Square metres in the unit of a first cell, None where it says correlation."""
    if cell.lower() == "correlation":
        return None
    what, _, unit = cell.rpartition("_")
    known = [f"{one}2" for one in LENGTH_UNITS]
    plain = plain_unit(unit).replace("²", "2").replace("^", "")
    if what.lower() == "covariance" and plain in known:
        return float(LENGTH_UNITS[plain[:-1]] ** 2)
    text = f'the first cell is "{shorten(cell)}"; write covariance_um2, or correlation'
    if what.lower() == "covariance":
        text = f'"{shorten(cell)}" has no unit of area; {hint(plain, known)}'
    raise mark.refused(text)


def _number(cell: str) -> float:
    try:
        return float(Decimal(cell.strip()))
    except InvalidOperation:
        return math.nan
