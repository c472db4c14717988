"""Measured error curves in CSV files: a position along the axis and functions by their ISO 230-1
names.
"""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np

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
from ..machines.protocol import Array, Integers

POSITION = "position"
EXAMPLE = "position_mm,EXX_um,EYX_um,EAX_urad"
BANDWIDTH = "_bandwidth"
# Far more than are measured along an axis.
MOST_POINTS = 100_000
# Of the smallest step of a run: what a machine misses a target by is far less, and no curve's
# shape is lost between positions so near.
SAME_TARGET = 1 / 200


def read_curves(path: Path) -> dict[str, Points]:
    """Read curves of one axis from a file whose first line names the columns, such as
    position_mm,EXX_um,EAX_urad.

    :raises ExperimentError: all faults of the file at once.
    """
    return read_numbered_curves(path)[0]


def read_numbered_curves(
    path: Path, bandwidths: bool = False
) -> tuple[dict[str, Points], tuple[int, ...], str]:
    """The same with the number of each point's line, and a note on means; with `bandwidths` columns
    such as EXX_bandwidth_um are curves too.

    Target positions that occur several times, as in runs there and back, have the mean of both
    directions, in position too: runs meet a target within `SAME_TARGET` of their smallest step.

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
    table = np.array([row for _, row in rows]).reshape(-1, len(names))
    column = names.index(POSITION)
    targets = _targets(table[:, column])
    positions, first, index = np.unique(targets, return_index=True, return_inverse=True)
    if len(positions) < 2:
        raise refused(file, "a curve needs at least two points; add rows", line=lines[0].number)
    # Equal positions stay exactly what they are.
    table[:, column] -= targets
    means, reversal, one_way = _means(targets, index, table)
    points = tuple((positions + means[:, column]).tolist())
    curves = {
        name: Points(points, tuple(means[:, k].tolist()))
        for k, name in enumerate(names)
        if name != POSITION
    }
    note = f"means of {len(rows)} values at {len(points)} positions" * (len(points) < len(rows))
    if places := listing(f"{1e3 * points[k]:.6g} mm" for k in one_way.nonzero()[0].tolist()):
        note += f"{'; ' * bool(note)}read in one direction only: {places}"
    if len(points) < len(rows):
        sizes = (
            f"{name} {1e6 * size:.3g} {'µrad' if AXIS_ERRORS[name].is_rotation else 'µm'}"
            for name, size in zip(names, reversal.tolist(), strict=True)
            if name in AXIS_ERRORS and size == size
        )
        if largest := listing(sizes):
            note += f"; largest reversal values, which the means leave out: {largest}"
    return curves, tuple(rows[k][0] for k in first.tolist()), note


def _targets(x: Array) -> Array:
    """Return, for each position (n,), the least of those that are one target position with it."""
    step = np.diff(x)
    step = step[step != 0]
    turn = (step[:-1] * step[1:] < 0).nonzero()[0]
    if not len(step) or not (len(turn) or (np.diff(np.sort(x)) == 0).any()):
        return x
    # The shorter step at a turn may lead from one run to the next, to the same target.
    between = turn + (abs(step[turn]) > abs(step[turn + 1]))
    inside = np.delete(abs(step), between)
    nearest = inside.min() if len(inside) else 0.0
    positions, index = np.unique(x, return_inverse=True)
    is_new = np.r_[True, np.diff(positions) > SAME_TARGET * nearest]
    least: Array = positions[is_new][np.cumsum(is_new) - 1][index]
    return least


def _means(x: Array, index: Integers, table: Array) -> tuple[Array, Array, Array]:
    """Return the means of the rows (n, c) at each position by its `index` (n,), of both directions
    if there are two; their largest difference (c,), else NaN (ISO 230-2: reversal value); and
    which positions only one of two directions has.
    """
    step = np.diff(x)
    before, after = np.r_[0.0, step], np.r_[step, 0.0]
    # The first row of a run has gone a longer way back than to its next.
    is_first = (before == 0) | (before * after < 0) & (abs(before) > 1.5 * abs(after))
    place = np.sign(np.where(is_first, after, before)).astype(int), index
    sums = np.zeros((3, index.max() + 1, table.shape[1]))
    counts = np.zeros((*sums.shape[:2], 1))
    np.add.at(sums, place, table)
    np.add.at(counts, place, 1.0)
    with np.errstate(invalid="ignore"):
        forwards, backwards = sums[1] / counts[1], sums[-1] / counts[-1]
    both = (forwards + backwards) / 2
    means = np.where(np.isnan(both), sums.sum(axis=0) / counts.sum(axis=0), both)
    there, back = counts[1, :, 0] > 0, counts[-1, :, 0] > 0
    one_way = (there != back) & (there & back).any()
    return means, np.fmax.reduce(abs(forwards - backwards)), one_way


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
