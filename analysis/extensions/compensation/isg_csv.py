"""The ISG CSV format of the volumetric compensation of the ISG kernel and of TwinCAT CNC.

Source: ISG kernel, functional description C26 "Volumetric compensation", as published for TwinCAT
CNC in Beckhoff's TF5280, sections on the ISG CSV format, units of measure and interpolation.
Columns are separated by blanks, a line of arguments and parameters comes first, // begins a
comment, and # a new table. Displacements are in millimetres, turns in radians, and arguments
in millimetres. Values are interpolated linearly on a grid.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from pathlib import Path

import numpy as np
from ballplate.simulator.inputs import (
    MOST_MESSAGES,
    ExperimentError,
    Mark,
    Message,
    hint,
    listing,
    read_number,
    read_text,
    refused,
    shorten,
)
from ballplate.simulator.machines import AXES, AXIS_ERRORS, SQUARENESS_ERRORS, Arrangement, Array

from .axis_tables import AxisTable, names_of, tool_chain
from .table_formats import (
    MEANING,
    MOST_GRID_NODES,
    Sense,
    StatedTable,
    Table,
    TableFormat,
    in_columns,
    stated_sense,
)
from .volume_tables import VolumeTable

# Squareness errors as the format names them: C0Y for ISO 230-1's EC0Y.
SQUARENESS = {name[1:]: error for name, error in SQUARENESS_ERRORS.items()}
POSITION_ERROR = re.compile("[XYZABC]0[XYZABC]")
CHAIN = re.compile(r"\s*chain\s+([XYZ]{2,3})\b")
LENGTH_DIGITS, ANGLE_DIGITS = 6, 9
AXES_LETTERS = ("X", "Y", "Z")


@dataclass(frozen=True, eq=False)
class _Block:
    """A table of the file: names of its columns, and rows (m, columns) in metres and radians."""

    mark: Mark
    names: tuple[str, ...]
    rows: Array

    @property
    def arguments(self) -> tuple[str, ...]:
        return tuple(name for name in self.names if name in AXES_LETTERS)

    def column(self, name: str) -> Array:
        return self.rows[:, self.names.index(name)]


def _write(table: Table, sense: Sense, stem: str) -> dict[str, str]:
    remarks = [
        f"// states: {sense}, {MEANING[sense]}",
        "// lengths in mm, angles in rad",
    ]
    if isinstance(table, VolumeTable):
        names = "".join(AXES[: table.dimension]).upper()
        remarks.append(f"// chain {names}, workpiece_axes 0: errors of the whole machine on a grid")
        return {".csv": "\n".join([*remarks, *_volume_lines(table), ""])}
    chain = "".join(tool_chain(table.arrangement)).upper()
    remarks.append(f"// chain {chain}, workpiece_axes 0, from the workpiece to the tool")
    remarks.append("// squareness is in the straightness errors: position errors are zero")
    lines = list(remarks)
    for k, axis in enumerate(table.axes):
        heads = (AXES[axis.axis].upper(), *names_of(axis.axis))
        lines += [*(["#"] if k else []), *_aligned(heads, axis.positions[:, None], axis.values)]
    return {".csv": "\n".join([*lines, ""])}


def _volume_lines(table: VolumeTable) -> list[str]:
    """A grid: displacements are told as those of X, turns of the tool as those of the last axis."""
    d = table.dimension
    last = AXES[d - 1].upper()
    points = np.array(list(product(*table.nodes)))
    values = table.values.reshape(-1, 6)
    if d == 2:
        in_plane = values[:, [0, 1, 5]]
        return _aligned(("X", "Y", "EXX", "EYX", f"EC{last}"), points, in_plane)
    turns = (f"E{letter}{last}" for letter in "ABC")
    return _aligned(("X", "Y", "Z", "EXX", "EYX", "EZX", *turns), points, values)


def _aligned(heads: Sequence[str], positions: Array, values: Array) -> list[str]:
    arguments = positions.shape[1]
    rows = [list(heads)]
    for place, row in zip(positions.tolist(), values.tolist(), strict=True):
        cells = [f"{1e3 * value:.10g}" for value in place]
        for name, value in zip(heads[arguments:], row, strict=True):
            is_angle = AXIS_ERRORS[name].is_rotation
            number = f"{value:.{ANGLE_DIGITS}f}" if is_angle else f"{1e3 * value:.{LENGTH_DIGITS}f}"
            cells.append("0" if float(number) == 0.0 else number)
        rows.append(cells)
    return in_columns(rows)


def _read(paths: Sequence[Path]) -> StatedTable:
    """Read the parameter files of a compensation.

    :raises ExperimentError: faults of them.
    """
    blocks: list[_Block] = []
    senses = set()
    arrangement = None
    for path in paths:
        sense = None
        for line in read_text(path).splitlines():
            remark = line.partition("//")[2]
            sense = stated_sense(remark) or sense
            if match := CHAIN.match(remark):
                names = match[1].lower()
                names += "".join(axis for axis in AXES if axis not in names)
                if sorted(names) != list(AXES):
                    raise refused(path, f"chain {match[1]} has an axis twice; name each once")
                arrangement = Arrangement(tuple(names))
        senses.add(sense)
        if len(senses) > 1:
            raise refused(path, "states not what another file does; let all say the same")
        blocks += _blocks(path)
    sense = senses.pop()
    if not blocks:
        raise refused(paths[0], "no table; its first line names the columns, such as X EXX EYX EZX")
    grids = [block for block in blocks if len(block.arguments) > 1]
    if grids and len(blocks) > 1:
        raise refused(
            paths[0],
            "mixes a table of several axes with other tables; give tables of single axes, or one"
            " of all axes",
        )
    if grids:
        return StatedTable((), _grid(grids[0]), sense, arrangement, (0.0, 0.0, 0.0))
    return StatedTable(_axes(blocks, paths[0]), None, sense, arrangement, (0.0, 0.0, 0.0))


def _blocks(path: Path) -> Iterator[_Block]:
    names: list[str] = []
    rows: list[list[float]] = []
    head = Mark(str(path), 1, 1)
    messages: list[Message] = []
    for number, line in enumerate([*read_text(path).splitlines(), "#"], start=1):
        mark, plain = Mark(str(path), number, 1), line.partition("//")[0].strip()
        if plain.startswith("#"):
            if rows and not messages:
                yield _Block(head, tuple(names), np.array(rows))
            elif names and not rows:
                messages.append(head.message("", "names columns and has no rows; add them"))
            names, rows = [], []
        elif plain and not names:
            names, head = plain.split(), mark
            messages += _wrong_names(names, mark)
        elif plain:
            cells = plain.split()
            if len(cells) != len(names):
                text = f"{len(cells)} columns instead of {len(names)}; separate them by blanks"
                messages.append(mark.message("", text))
                continue
            rows.append(
                [
                    _number(cell, name, mark, messages)
                    for cell, name in zip(cells, names, strict=True)
                ]
            )
        if len(rows) > MOST_GRID_NODES:
            messages.append(mark.message("", f"more than {MOST_GRID_NODES} rows; leave some out"))
        if len(messages) >= MOST_MESSAGES or len(rows) > MOST_GRID_NODES:
            break
    if messages:
        raise ExperimentError(messages)


def _number(cell: str, name: str, mark: Mark, messages: list[Message]) -> float:
    """A number in metres or radians; NaN after reporting faults."""
    if name not in AXES_LETTERS and name.removeprefix("E")[0] in "ABC":
        return read_number(cell, name, Fraction(1), mark, messages, "angle")
    return read_number(cell, name, Fraction(1, 1000), mark, messages)


def _wrong_names(names: Sequence[str], mark: Mark) -> list[Message]:
    names_known = (*AXES_LETTERS, *AXIS_ERRORS)
    wrong = [
        name for name in names if name not in names_known and not POSITION_ERROR.fullmatch(name)
    ]
    texts = [
        f'the column "{shorten(name)}" is no linear axis and no error of one;'
        f" {hint(name, names_known)}"
        for name in wrong
    ]
    texts += [f"a second column {name}; remove one" for name in set(names) if names.count(name) > 1]
    arguments = [name for name in names if name in AXES_LETTERS]
    single = [name for name in names if name in AXIS_ERRORS]
    if len(arguments) == 1 and not wrong:
        texts += [
            f"{name} depends on {arguments[0]}; a table by {arguments[0]} has errors of"
            f" {arguments[0]} only"
            for name in single
            if name[2] != arguments[0]
        ]
    if single and not arguments:
        texts.append(f"{single[0]} has no argument; add the column {single[0][2]}")
    return [mark.message("", text) for text in texts]


def _axes(blocks: Sequence[_Block], path: Path) -> tuple[AxisTable, ...]:
    """Tables of axes, and squareness errors as slopes of their straightness errors."""
    axes = {}
    slopes = np.zeros((3, 3))
    for block in blocks:
        for name in block.names:
            if POSITION_ERROR.fullmatch(name):
                _add_slope(block, name, slopes)
    for block in blocks:
        if not block.arguments:
            continue
        axis = "XYZ".index(block.arguments[0])
        order = np.argsort(block.column(block.arguments[0]), kind="stable")
        positions = block.column(block.arguments[0])[order]
        if len(positions) < 2 or (np.diff(positions) <= 0.0).any():
            text = "needs at least two positions, each once; correct its rows"
            raise block.mark.refused(text)
        values = np.column_stack(
            [
                block.column(name)[order] if name in block.names else np.zeros(len(positions))
                for name in names_of(axis)
            ]
        )
        if axis in axes:
            text = f"a second table of {AXES[axis]}; join the columns of both"
            raise block.mark.refused(text)
        axes[axis] = AxisTable(axis, positions, values)
    if sorted(axes) not in ([0, 1], [0, 1, 2]):
        missing = [AXES[k] for k in range(3) if k not in axes]
        raise refused(path, f"has no table of {listing(missing)}; name the files of all axes")
    for axis, table in axes.items():
        table.values[:, :3] += table.positions[:, None] * slopes[axis]
    return tuple(axes[axis] for axis in sorted(axes))


def _add_slope(block: _Block, name: str, slopes: Array) -> None:
    """Add to the slopes (3 axes, 3) of displacements what a squareness error does."""
    values = block.column(name)
    if block.arguments or len(values) != 1:
        text = f"{name} depends on a position; give one row of position errors"
        raise block.mark.refused(text)
    if name in SQUARENESS:
        error = SQUARENESS[name]
        slopes[error.axis, error.to] += error.sign * values[0]
    elif values[0] != 0.0:
        text = f"the position error {name} is not read; {listing(SQUARENESS)} are, leave it out"
        raise block.mark.refused(text)


def _grid(block: _Block) -> VolumeTable:
    """A table of all axes at once."""
    d = len(block.arguments)
    last = "XYZ"[d - 1]
    nodes = tuple(np.unique(block.column(name)) for name in "XYZ"[:d] if name in block.names)
    single = [name for name in block.names if name in AXIS_ERRORS]
    wrong = [name for name in block.names if POSITION_ERROR.fullmatch(name)]
    wrong += [name for name in single if AXIS_ERRORS[name].is_rotation and name[2] != last]
    if wrong or len(nodes) != d:
        text = (
            f"a table of {', '.join(block.arguments)} has displacements and turns by {last} only,"
            f" which carries the tool; {listing(wrong or ['X'])} cannot be read"
        )
        raise block.mark.refused(text)
    counts = tuple(len(node) for node in nodes)
    if min(counts) < 2 or int(np.prod(counts)) != len(block.rows):
        grid = " x ".join(map(str, counts))
        text = f"{len(block.rows)} rows are no grid of {grid} points; give each point once"
        raise block.mark.refused(text)
    places = tuple(
        np.searchsorted(node, block.column(name)) for node, name in zip(nodes, "XYZ", strict=False)
    )
    values = np.zeros((*counts, 6))
    is_seen = np.zeros(counts, bool)
    is_seen[places] = True
    if not is_seen.all():
        raise block.mark.refused("a point of the grid occurs twice; remove one")
    for name in single:
        error = AXIS_ERRORS[name]
        values[..., error.component + 3 * error.is_rotation][places] += block.column(name)
    return VolumeTable(nodes, values)


ISG_CSV = TableFormat(
    "isg",
    "ISG CSV format of volumetric compensation (ISG kernel, Beckhoff TwinCAT CNC)",
    _write,
    _read,
    length_step=1e-9,
    angle_step=1e-9,
    has_volumes=True,
    from_zero=True,
    layout="NAME.csv",
)
