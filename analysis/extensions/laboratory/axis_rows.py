"""Tables of one row per axis: `position, ball, probe, axis, value`."""

from __future__ import annotations

from collections.abc import Sequence

from ballplate.simulator.inputs import listing, shorten

from .heading_words import AXIS_WORDS, folded
from .headings import Headings
from .thousands import Row


def joined_axes(
    rows: Sequence[Row], headings: Headings, axes: Sequence[str]
) -> tuple[list[Row], list[tuple[int, str]]]:
    """Return a row per reading of rows per axis, with co-ordinates behind its cells, and faults by
    line.

    Rows of a reading have the same names, and the same in all other columns in use, in any order.
    A repeated reading must begin below the complete one: mixed rows are refused.
    """
    if headings.by_axis is None:
        return list(rows), []
    axis_place, value_place = headings.by_axis
    # Rows of other times, units or uncertainties are of other readings.
    same = list(headings.places.values())
    latest: dict[tuple[str, ...], Row] = {}
    joined: list[Row] = []
    wrong: list[tuple[int, str]] = []
    for line, cells in rows:
        axis = " ".join(
            word for word in folded(cells[axis_place]).split() if word not in AXIS_WORDS
        )
        key = tuple(cells[i] for i in same)
        first, reading = latest.get(key, (line, []))
        values = reading[len(cells) :]
        if all(values):
            first, reading = latest[key] = line, [*cells, *("" for _ in axes)]
            joined.append(latest[key])
        if axis not in axes:
            text = f'"{shorten(cells[axis_place])}" is no axis; write {listing(axes)}'
            wrong.append((line, text))
            continue
        place = len(cells) + axes.index(axis)
        if reading[place]:
            text = f"{axis} again, in the reading of line {first}, which lacks others; write the"
            wrong.append((line, f"{text} rows of a reading together"))
        reading[place] = cells[value_place] or "-"
    return joined, wrong
