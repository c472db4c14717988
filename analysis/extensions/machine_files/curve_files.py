"""Measured error curves in CSV files: a position along the axis and functions by their ISO 230-1
names.
"""

from __future__ import annotations

from itertools import compress
from pathlib import Path

import numpy as np
from ballplate.simulator.inputs import (
    ANGLE_UNITS,
    LENGTH_UNITS,
    listing,
    read_table,
    refused,
    table_lines,
)
from ballplate.simulator.machines import AXIS_ERRORS, TRANSLATIONS, Array, AxisError, Integers

from .curves import NAMES, Points

POSITION = "position"
EXAMPLE = "position_mm,EXX_um,EYX_um,EAX_urad"
BANDWIDTH = "_bandwidth"
# Units of errors, the usual ones first.
LENGTHS = {"um": LENGTH_UNITS["um"], **LENGTH_UNITS}
ANGLES = {"urad": ANGLE_UNITS["urad"], **ANGLE_UNITS}
# Far more than are measured along an axis.
MOST_POINTS = 20_000
# Of the smallest step of a run: what a machine misses a target by is far less, and no curve's
# shape is lost between positions so near.
SAME_TARGET = 1 / 200


def read_numbered_curves(
    path: Path, bandwidths: bool = False
) -> tuple[dict[str, Points], tuple[int, ...], str]:
    """Read curves of one axis from a file whose first line names the columns, such as
    position_mm,EXX_um,EAX_urad; return them with the number of each point's line, and a note on
    means. With `bandwidths` columns such as EXX_bandwidth_um are curves too.

    Target positions that occur several times, as in runs there and back, have the mean of both
    directions, in position too: runs meet a target within `SAME_TARGET` of their smallest step.

    :raises ExperimentError: all faults of the file at once.
    """
    file, lines = str(path), table_lines(path)
    if len(lines) > MOST_POINTS + 1:
        text = (
            f"{len(lines) - 1} points are too many; at most {MOST_POINTS} are possible: leave some"
            " of them out"
        )
        raise refused(file, text, line=lines[0].number)
    errors = (*NAMES, *(f"{name}{BANDWIDTH}" for name in NAMES)) if bandwidths else NAMES
    units = {name: ANGLES if _error(name).is_rotation else LENGTHS for name in errors}
    rows = read_table(path, (), (POSITION,), errors, absent=np.nan, units=units)
    table = np.array([row.lengths for row in rows])
    is_there = ~np.isnan(table).all(axis=0)
    table, names = table[:, is_there], [*compress((POSITION, *errors), is_there)]
    axes = sorted({TRANSLATIONS[_error(name).axis] for name in names[1:]})
    if len(axes) != 1:
        text = f"errors of the axes {listing(axes)}; write one file for each axis"
        if not axes:
            text = f"has no error; write columns as in {EXAMPLE}"
        raise refused(file, text, line=lines[0].number)
    targets = _targets(table[:, 0])
    positions, first, index = np.unique(targets, return_index=True, return_inverse=True)
    if len(positions) < 2:
        raise refused(file, "a curve needs at least two points; add rows", line=lines[0].number)
    # Equal positions stay exactly what they are.
    table[:, 0] -= targets
    means, reversal, one_way = _means(targets, index, table)
    points = tuple((positions + means[:, 0]).tolist())
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
    return curves, tuple(rows[k].mark.line for k in first.tolist()), note


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


def _error(name: str) -> AxisError:
    return AXIS_ERRORS[name.removesuffix(BANDWIDTH)]
