"""Measured error curves in CSV files: a position along the axis and functions by their ISO 230-1
names.
"""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

from ..inputs.messages import MORE_ERRORS, MOST_MESSAGES, ExperimentError, Message, refused
from ..inputs.quantities import ANGLE_UNITS, LENGTH_UNITS
from ..inputs.settings import hint, listing, shorten
from ..inputs.tables import (
    TableLine,
    decimal_sign,
    header_cells,
    read_number,
    table_lines,
    wrong_count,
)
from ..inputs.yamltree import Mark
from ..machines.curves import NAMES, Points
from ..machines.error_names import AXIS_ERRORS, TRANSLATIONS

POSITION = "position"
EXAMPLE = "position_mm,EXX_um,EYX_um,EAX_urad"
BANDWIDTH = "_bandwidth"
# Far more than are measured along an axis.
MOST_POINTS = 100_000


def read_curves(path: Path) -> dict[str, Points]:
    """Read curves of one axis from a file whose first line names the columns, such as
    position_mm,EXX_um,EAX_urad.

    :raises ExperimentError: all faults of the file at once.
    """
    return read_numbered_curves(path)[0]


def read_numbered_curves(
    path: Path, bandwidths: bool = False
) -> tuple[dict[str, Points], tuple[int, ...]]:
    """The same with the number of each point's line; with `bandwidths` columns such as
    EXX_bandwidth_um are curves too.

    :raises ExperimentError: as `read_curves`.
    """
    file = str(path)
    lines = table_lines(path)
    if not lines:
        raise refused(file, f"the file is empty; its first line should be {EXAMPLE}")
    if len(lines) > MOST_POINTS + 1:
        text = (
            f"{len(lines) - 1} points are too many; at most {MOST_POINTS} are possible: leave some"
            " of them out"
        )
        raise refused(file, text, line=lines[0].number)
    names_known = (*NAMES, *(f"{name}{BANDWIDTH}" for name in NAMES)) if bandwidths else NAMES
    names, factors = _columns(file, lines[0], names_known)
    decimal = decimal_sign(lines[1:], range(len(names)))
    messages: list[Message] = []
    rows = []
    for line in lines[1:]:
        number = line.number
        if len(messages) >= MOST_MESSAGES:
            messages.append(Message(file, number, 1, "", MORE_ERRORS))
            break
        cells = line.cells()
        if cells is None or len(cells) != len(names):
            messages.append(Message(file, number, 1, "", wrong_count(line, cells, len(names))))
            continue
        row = [
            read_number(cell, name, factor, Mark(file, number, column), messages, decimal=decimal)
            for (column, cell), name, factor in zip(cells, names, factors, strict=True)
        ]
        rows.append((number, row))
    if messages:
        raise ExperimentError(messages)
    if len(rows) < 2:
        raise refused(file, "a curve needs at least two points; add rows", line=lines[0].number)
    place = names.index(POSITION)
    rows.sort(key=lambda row: row[1][place])
    for (_, before), (number, after) in zip(rows, rows[1:], strict=False):
        if after[place] == before[place]:
            text = "this position is in the file twice; leave one of the rows out"
            raise refused(file, text, line=number)
    positions = tuple(row[place] for _, row in rows)
    curves = {
        name: Points(positions, tuple(row[k] for _, row in rows))
        for k, name in enumerate(names)
        if name != POSITION
    }
    return curves, tuple(number for number, _ in rows)


def _columns(
    file: str, header: TableLine, errors: tuple[str, ...]
) -> tuple[list[str], list[Fraction]]:
    mark = Mark(file, header.number, 1)
    messages = []
    names = []
    factors = []
    for place, cell, name, unit in header_cells(file, header, EXAMPLE):
        if name != POSITION and name not in errors:
            is_known = cell in (POSITION, *errors)
            remedy = (
                f"write it with its unit, as in {EXAMPLE}"
                if is_known
                else hint(name or cell, [POSITION, *errors])
            )
            problem = "has no unit" if is_known else "is not an error of an axis"
            messages.append(place.message("", f'the column "{shorten(cell)}" {problem}; {remedy}'))
            continue
        error = AXIS_ERRORS.get(name.removesuffix(BANDWIDTH))
        is_angle = error is not None and error.is_rotation
        units = ANGLE_UNITS if is_angle else LENGTH_UNITS
        if unit not in units:
            messages.append(
                place.message(
                    "", f'unknown unit in the column "{shorten(cell)}"; {hint(unit, units)}'
                )
            )
            continue
        if name in names:
            messages.append(
                place.message("", f'a second column "{shorten(cell)}"; remove one of them')
            )
        names.append(name)
        factors.append(units[unit])
    axes = sorted(
        {
            TRANSLATIONS[AXIS_ERRORS[name.removesuffix(BANDWIDTH)].axis]
            for name in names
            if name != POSITION
        }
    )
    if not messages and (POSITION not in names or not axes):
        messages.append(
            mark.message("", f"has no position, or no error; write columns as in {EXAMPLE}")
        )
    if len(axes) > 1:
        messages.append(
            mark.message("", f"errors of the axes {listing(axes)}; write one file for each axis")
        )
    if messages:
        raise ExperimentError(messages)
    return names, factors
