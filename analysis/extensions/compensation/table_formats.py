"""What a format of compensation tables consists of, and in which sense a table states errors."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from ballplate.simulator.inputs import listing
from ballplate.simulator.machines import ARRANGEMENTS, AXES, Arrangement, Array

from .axis_tables import AxisTable, AxisTables, Corner
from .volume_tables import VolumeTable

Sense = Literal["corrections", "errors of indication"]
SENSES: tuple[Sense, ...] = get_args(Sense)
MEANING: Mapping[Sense, str] = {
    "corrections": "to be added to scale readings: position of the tip minus scale reading",
    "errors of indication": "scale reading minus position of the tip",
}


@dataclass(frozen=True, eq=False)
class StatedTable:
    """What the files of a table say, with the signs that they have; None is not stated.

    `axes` are tables of single axes, or there is a table of the `volume`. `notes` tell what the
    files have and is not read.
    """

    axes: tuple[AxisTable, ...]
    volume: VolumeTable | None = None
    sense: Sense | None = None
    arrangement: Arrangement | None = None
    origin: Corner | None = None
    notes: tuple[str, ...] = ()


# Of an axis, and of a grid.
MOST_NODES, MOST_GRID_NODES = 5000, 100_000

Table = AxisTables | VolumeTable
Written = Callable[[Table, Sense, str], dict[str, str]]


def in_columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of cells as lines of text, each column as wide as its widest cell."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        " ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


@dataclass(frozen=True)
class TableFormat:
    """A format by its `name`: `words` say whose it is.

    `write` gives the texts of its files by the ends of their names, of a table whose values have
    the sense stated and a stem of the names; `read` reads files. Values are written in steps of
    `length_step` metres and `angle_step` radians. A format without a `sense` of its own leaves it
    to whoever writes; `from_zero` formats count levers from the zero of the scales, with all axes
    on the tool's side; `even` ones have equal distances between positions, `most_points` of them.
    """

    name: str
    words: str
    write: Written
    read: Callable[[Sequence[Path]], StatedTable]
    length_step: float
    angle_step: float
    sense: Sense | None = "corrections"
    has_rotations: bool = True
    has_volumes: bool = False
    from_zero: bool = False
    even: bool = False
    most_points: int | None = None
    layout: str = ""


def rounded(values: Array, made: TableFormat) -> Array:
    """Values (..., 6) as the format writes them."""
    steps = np.repeat([made.length_step, made.angle_step], 3)
    rounded_values = np.round(values / steps) * steps
    return rounded_values if made.has_rotations else rounded_values * (np.arange(6) < 3)


def with_sense(table: Table, sense: Sense) -> Table:
    """A table of corrections with the signs of a sense, or the reverse."""
    if sense == "corrections":
        return table
    if isinstance(table, VolumeTable):
        return replace(table, values=-table.values)
    return table.changed(lambda table: -table.values)


def stated_sense(comment: str) -> Sense | None:
    """What a comment says of the sense of a table.

    >>> stated_sense("states: errors of indication, in mm"), stated_sense("by hand")
    ('errors of indication', None)
    """
    match = re.match(r"\s*states:\s*(.*)", comment)
    return next(
        (sense_name for sense_name in SENSES if match and match[1].startswith(sense_name)), None
    )


def arrangement_words(arrangement: Arrangement) -> str:
    """An arrangement as tables state it.

    >>> arrangement_words(ARRANGEMENTS["FB1"])
    'probe x z, workpiece y'
    """
    sides = (("probe", arrangement.probe_side), ("workpiece", arrangement.workpiece_side))
    return ", ".join(" ".join([name, *axes]) for name, axes in sides if axes)


def parse_arrangement(text: str) -> Arrangement:
    """An arrangement by its name, or as `arrangement_words` has it.

    :raises ValueError: it is none.

    >>> parse_arrangement("probe z, workpiece x y") == ARRANGEMENTS["CX1"]
    True
    """
    if text.strip() in ARRANGEMENTS:
        return ARRANGEMENTS[text.strip()]
    sides: dict[str, tuple[str, ...]] = {"probe": (), "workpiece": ()}
    words = [part.split() for part in text.split(",")]
    if all(part and part[0] in sides for part in words):
        sides |= {part[0]: tuple(part[1:]) for part in words}
        if sorted((*sides["probe"], *sides["workpiece"])) == list(AXES):
            return Arrangement(sides["probe"], sides["workpiece"])
    raise ValueError(
        f'"{text.strip()}" is no arrangement; choose from {listing(ARRANGEMENTS)}, or write the'
        ' axes from the ground outwards, as in "probe x z, workpiece y"'
    )
