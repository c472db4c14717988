"""Compensation value tables of HEIDENHAIN controls: a .COM file for each axis, and the .CMA file
that assigns them.

Source: HEIDENHAIN, Technical Manual MANUALplus 620, January 2012, section 6.10.3, pages 713 to 718.
A .COM table has the positions of the axis (AXISPOS, evenly spaced, at most 256), compensation
values by the name of the axis that is corrected, and in BACKLASH those of the other direction
of traverse. The .CMA table has its file's name in the column of the axis on which the values
depend, * in the column ACTIVE of the line that counts.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from ballplate.simulator.inputs import (
    ExperimentError,
    Mark,
    listing,
    read_number,
    read_text,
    refused,
    shorten,
)
from ballplate.simulator.machines import AXES

from .axis_tables import AxisTable, AxisTables
from .table_formats import Sense, StatedTable, Table, TableFormat, in_columns

LETTERS = ("X", "Y", "Z")
POSITION, BACKLASH, ACTIVE = "AXISPOS", "BACKLASH", "ACTIVE"
EVEN = 1e-3
"""Part of a distance by which others may differ from it."""


@dataclass(frozen=True)
class _Line:
    """A line of a table: its cells by the names of their columns, empty ones left out."""

    mark: Mark
    cells: Mapping[str, str]


def _write(table: Table, sense: Sense, stem: str) -> dict[str, str]:
    assert isinstance(table, AxisTables)
    letters = LETTERS[: table.dimension]
    contents = {}
    for axis in table.axes:
        rows = [["NR", POSITION, BACKLASH, *letters]]
        for k, (position, values) in enumerate(
            zip(axis.positions.tolist(), axis.values.tolist(), strict=True)
        ):
            values_written = (f"{1e3 * value + 0.0:+.4f}" for value in values[: table.dimension])
            rows.append([str(k), f"{1e3 * position + 0.0:+.4f}", "", *values_written])
        ending = f"-{AXES[axis.axis]}.com"
        contents[ending] = _file(f"{stem}{ending}", rows)
    names = [f"{stem}-{AXES[axis.axis]}.com" for axis in table.axes]
    contents[".cma"] = _file(f"{stem}.cma", [["NR", ACTIVE, *letters], ["0", "*", *names]])
    return contents


def _file(name: str, rows: Sequence[Sequence[str]]) -> str:
    return "\n".join([f"BEGIN {name.upper()} MM", *in_columns(rows), "[END]", ""])


def _read(paths: Sequence[Path]) -> StatedTable:
    """Read a .CMA file and the .COM files that its active line names, from the same folder.

    :raises ExperimentError: faults of them.
    """
    path = paths[0]
    if len(paths) > 1 or path.suffix.lower() != ".cma":
        text = (
            "is not a single .CMA file; name the .CMA file, which assigns each .COM file to an axis"
        )
        raise refused(path, text)
    active = [line for line in _lines(path) if line.cells.get(ACTIVE) == "*"]
    if len(active) != 1:
        raise refused(path, f"{len(active)} lines are active; mark one with * in {ACTIVE}")
    axes, notes = [], []
    for letter in LETTERS:
        name = active[0].cells.get(letter)
        if name is not None:
            # Paths on a control are not paths here.
            axis_file = path.parent / re.split(r"[\\/:]", name)[-1]
            table, axis_read = _axis(axis_file, LETTERS.index(letter))
            axes.append(table)
            notes += axis_read
    other_columns = [name for name in active[0].cells if name not in (*LETTERS, ACTIVE, "NR")]
    notes += [f"{path}: tables of {listing(other_columns)} are not read"] if other_columns else []
    if [table.axis for table in axes] not in ([0, 1], [0, 1, 2]):
        raise refused(path, "the active line names no tables of x and y; add them")
    return StatedTable(tuple(axes), notes=tuple(notes))


def _axis(path: Path, axis: int) -> tuple[AxisTable, list[str]]:
    messages = []
    rows, has_backlash = [], False
    for line in _lines(path):
        unknown = [name for name in line.cells if name not in ("NR", POSITION, BACKLASH, *LETTERS)]
        if unknown:
            text = (
                f"the column {listing(unknown)} is not read; columns are {POSITION}, {BACKLASH}"
                f" and {listing(LETTERS)}"
            )
            raise line.mark.refused(text)
        if POSITION not in line.cells:
            messages.append(line.mark.message("", f"no {POSITION}; write the position"))
            continue
        has_backlash |= BACKLASH in line.cells
        rows.append(
            [
                read_number(line.cells.get(name, "0"), name, Fraction(1, 1000), line.mark, messages)
                for name in (POSITION, *LETTERS)
            ]
        )
    if messages:
        raise ExperimentError(messages)
    table = np.array(rows).reshape(-1, 4)
    positions = table[:, 0]
    steps = np.diff(positions)
    if len(table) < 2 or steps.min() <= 0.0 or np.ptp(steps) > EVEN * steps.max():
        text = (
            f"{POSITION} should have two positions or more, ascending and evenly spaced; correct it"
        )
        raise refused(path, text)
    notes = []
    if has_backlash:
        notes.append(
            f"{path}: {BACKLASH} is not read: a machine file has one error for both directions"
        )
    values = np.hstack([table[:, 1:], np.zeros((len(table), 3))])
    return AxisTable(axis, positions, values), notes


def _lines(path: Path) -> Iterator[_Line]:
    """Lines of a table between BEGIN and [END].

    A cell belongs to the column whose name it stands under, since cells may be empty.

    :raises ExperimentError: it is no such table, or is in inches.
    """
    heads: list[tuple[int, str]] = []
    ended = False
    lines = read_text(path).splitlines()
    if not lines or not re.match(r"\s*BEGIN\s", lines[0]):
        raise refused(path, "no table of a HEIDENHAIN control; its first line begins with BEGIN")
    if re.search(r"\bINCH\b", lines[0]):
        raise refused(path, "the table is in inches; have it written in MM")
    for number, line in enumerate(lines[1:], start=2):
        mark = Mark(str(path), number, 1)
        if line.strip().startswith("[END]"):
            ended = True
            break
        if line.strip() and not heads:
            heads = [(word.start(), word[0]) for word in re.finditer(r"\S+", line)]
        elif line.strip():
            yield _Line(mark, dict(_cells(line, heads, mark)))
    if not ended:
        raise refused(path, "[END] is missing, the file is not whole; copy it again")


def _cells(line: str, heads: Sequence[tuple[int, str]], mark: Mark) -> Iterator[tuple[str, str]]:
    cells = [(cell.start(), cell[0]) for cell in re.finditer(r"\S+", line)]
    if len(cells) == len(heads):
        yield from ((name, cell) for (_, name), (_, cell) in zip(heads, cells, strict=True))
        return
    names_seen = set()
    for start, cell in cells:
        name = [name for place, name in heads if place <= start][-1:] or [""]
        if name[0] in names_seen or not name[0]:
            text = f'"{shorten(cell)}" is under no column of its own; align the columns'
            raise mark.refused(text)
        names_seen.add(name[0])
        yield name[0], cell


HEIDENHAIN = TableFormat(
    "heidenhain",
    "HEIDENHAIN .COM and .CMA tables",
    _write,
    _read,
    length_step=1e-7,
    angle_step=1e-9,
    sense=None,
    has_rotations=False,
    from_zero=False,
    even=True,
    most_points=256,
    layout="NAME.cma, NAME-x.com, NAME-y.com and NAME-z.com",
)
