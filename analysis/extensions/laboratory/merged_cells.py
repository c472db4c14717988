"""Blank cells of names, as below merged cells of spreadsheets."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ballplate.simulator.inputs import shorten

from .thousands import Row


def fill_down(rows: Sequence[Row], places: Iterable[int]) -> int:
    """Write the name above into blank cells of columns of rows, and return how many."""
    count = 0
    for place in places:
        above = ""
        for _, cells in rows:
            count += not cells[place] and above != ""
            cells[place] = above = cells[place] or above
    return count


def question(names: Iterable[str], lines: Sequence[int], may_fill: bool) -> str:
    """Return the question whether blank cells of columns in lines continue the name above."""
    shown = " or ".join(f'"{shorten(name)}"' for name in names)
    if may_fill:
        return f"no {shown}, nor one above it; write the name"
    return (
        f"no {shown} in line {lines[0]} and {len(lines) - 1} more; if it is the name above, as"
        " below merged cells, give --fill-down, or readings: {fill_down: true}; otherwise write"
        " the names"
    )
