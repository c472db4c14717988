"""Tables of one row per axis: `position, ball, probe, axis, value`; rows of diameters, form and
other characteristics may stand between.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from ballplate.simulator.inputs import listing, shorten

from .heading_words import MEASURED, folded
from .headings import Headings
from .thousands import Row


def joined_axes(
    rows: Sequence[Row], headings: Headings, axes: Sequence[str]
) -> tuple[list[Row], list[tuple[int, str]], Counter[str]]:
    """Return a row per reading of rows per axis, with co-ordinates behind its cells, faults by
    line, and how many rows are of other characteristics, by these.

    Rows of a reading have the same names, and the same in all other columns in use, in any order.
    A repeated reading must begin below the complete one: mixed rows are refused.
    """
    if headings.by_axis is None:
        return list(rows), [], Counter()
    axis_place, value_place = headings.by_axis
    # Rows of other times, units or uncertainties are of other readings.
    same = list(headings.places.values())
    latest: dict[tuple[str, ...], Row] = {}
    joined: list[Row] = []
    wrong: list[tuple[int, str]] = []
    others: Counter[str] = Counter()
    for line, cells in rows:
        axis = " ".join(word for word in folded(cells[axis_place]).split() if word not in MEASURED)
        if axis not in axes:
            others[cells[axis_place]] += 1
            continue
        key = tuple(cells[i] for i in same)
        first, reading = latest.get(key, (line, []))
        values = reading[len(cells) :]
        if all(values):
            first, reading = latest[key] = line, [*cells, *("" for _ in axes)]
            joined.append(latest[key])
        place = len(cells) + axes.index(axis)
        if reading[place]:
            text = f"{axis} again, in the reading of line {first}, which lacks others; write the"
            wrong.append((line, f"{text} rows of a reading together"))
        reading[place] = cells[value_place] or "-"
    # Rather misspelt axes than other characteristics.
    if 0 < others.total() <= sum("" in cells[-len(axes) :] for _, cells in joined) or not joined:
        wrong += [
            (line, f'"{shorten(cells[axis_place])}" is no axis; write {listing(axes)}')
            for line, cells in rows
            if cells[axis_place] in others
        ]
    return joined, wrong, others
