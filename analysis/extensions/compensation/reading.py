"""What the files of a compensation table say, as errors of a machine and as a machine file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from ballplate.simulator.inputs import refused
from ballplate.simulator.machines import (
    ARRANGEMENTS,
    AXIS_ERRORS,
    SQUARENESS_ERRORS,
    Arrangement,
    Array,
)

from .axis_tables import (
    AxisTable,
    AxisTables,
    Corner,
    NotOfAxesError,
    axis_functions,
    in_arrangement,
    names_of,
    tabulated,
    tool_chain,
)
from .table_formats import SENSES, Sense, StatedTable, Table, TableFormat, with_sense

AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class ReadTable:
    """A table as corrections to be added to scale readings, whatever the files state, and in which
    `sense` they do; `notes` tell what is not read.
    """

    table: Table
    sense: Sense
    notes: tuple[str, ...]


def read_table_files(
    made: TableFormat,
    paths: Sequence[Path],
    sense: Sense | None = None,
    arrangement: Arrangement | None = None,
    origin: Corner | None = None,
) -> ReadTable:
    """Read the files of a table in a format.

    `sense` says which errors they state where they do not, `arrangement` whose errors are wanted,
    and, where they state none, whose they are; `origin` is the point from which levers count.

    :raises ExperimentError: the files are invalid, say otherwise, or leave open what nobody says.
    """
    stated = made.read(paths)
    meant = _sense(stated, sense, paths[0])
    if stated.volume is not None:
        if arrangement is not None:
            text = "a table of the whole volume has no arrangement of axes; leave it out"
            raise refused(paths[0], text)
        return ReadTable(with_sense(stated.volume, meant), meant, stated.notes)
    own = _arrangement(stated, made, arrangement, paths[0])
    tables = AxisTables(
        own,
        _origin(stated, made, origin, paths[0]),
        stated.axes,
    )
    if arrangement is not None:
        try:
            tables = in_arrangement(tables, arrangement)
        except NotOfAxesError as error:
            raise refused(
                paths[0], f"cannot be told in that arrangement: {error}; name another"
            ) from None
    notes = stated.notes
    if not made.has_rotations:
        notes = (*notes, f"{made.name} tables have no rotations: there are none in what is read")
    return ReadTable(with_sense(tables, meant), meant, notes)


def _sense(stated: StatedTable, sense: Sense | None, path: Path) -> Sense:
    if stated.sense is None and sense is None:
        raise refused(
            path,
            f"does not state whether values are {' or '.join(SENSES)}; say so, since the other"
            " sign would double the machine's errors",
        )
    if None not in (stated.sense, sense) and stated.sense != sense:
        raise refused(path, f"states {stated.sense}, not {sense}; leave the sense to the file")
    found = stated.sense or sense
    assert found is not None
    return found


def _arrangement(
    stated: StatedTable, made: TableFormat, wanted: Arrangement | None, path: Path
) -> Arrangement:
    """The arrangement that the values are told in."""
    if stated.arrangement is not None:
        own = stated.arrangement
    elif wanted is not None:
        own = Arrangement(tool_chain(wanted)) if made.from_zero else wanted
    else:
        raise refused(
            path,
            "does not state which axis carries which; name the machine's arrangement, such as"
            " MB2 or FB1",
        )
    return own


def _origin(stated: StatedTable, made: TableFormat, origin: Corner | None, path: Path) -> Corner:
    if stated.origin is not None and origin not in (None, stated.origin):
        raise refused(path, "states its origin itself; leave it out")
    found = stated.origin or origin
    turns = any(one.values[:, 3:].any() for one in stated.axes)
    if found is None and turns:
        raise refused(path, "does not state from which point levers of rotations count; give it")
    corner = [float(one.positions[0]) for one in stated.axes]
    return found or (*corner, *[0.0] * (3 - len(corner)))


def machine_files(tables: AxisTables, title: str, stem: str) -> dict[str, str]:
    """A machine file of the tables and the tables that it names, as texts by the ends of their
    names, which begin with `stem`.

    Machine files have straightness errors without slopes, and squareness errors: what slopes there
    are beside those is a turn of the machine's frame, which nothing that is measured tells.

    :raises NotOfAxesError: the tables are of two axes.
    """
    if tables.dimension != 3:
        raise NotOfAxesError("a machine file has three axes, and the tables are of two")
    reference = np.clip(tables.origin, tables.lower, tables.upper)
    machine = tables.machine()
    functions = axis_functions(machine.model, machine.a)
    nodes = tuple(one.positions for one in tables.axes)
    there = tabulated(functions, nodes, reference, tuple(reference.tolist()))
    straight = [_without_slopes(one, float(reference[one.axis])) for one in there.axes]
    slopes = np.array([slope for _, slope in straight])
    found: dict[str, str] = {}
    errors = []
    for table, _ in straight:
        for name, values in zip(names_of(table.axis), table.values.T, strict=True):
            if np.abs(values).max() > 0.0:
                unit = "urad" if AXIS_ERRORS[name].is_rotation else "um"
                rows = [
                    f"{1e3 * position:.10g},{1e6 * value + 0.0:.9g}"
                    for position, value in zip(table.positions, values, strict=True)
                ]
                ending = f"-{name}.csv"
                found[ending] = "\n".join([f"position_mm,{name}_{unit}", *rows, ""])
                errors.append(f'  {name}: {{file: "{stem}{ending}"}}')
    lines = [
        f"title: {json.dumps(title)}",
        *_arrangement_lines(tables.arrangement),
        _volume_line(tables),
    ]
    lines.append(f"reference_point: [{', '.join(_mm(value) for value in reference.tolist())}]")
    lines += ["errors:", *errors] if errors else []
    square = squareness(slopes)
    lines += ["squareness:", *(f"  {name}: {1e6 * v:.9g} urad" for name, v in square.items() if v)]
    found[".yaml"] = "\n".join([*(lines if any(square.values()) else lines[:-1]), ""])
    return found


def squareness(slopes: Array) -> dict[str, float]:
    """Squareness errors by their ISO 230-1 names of the slopes (3 axes, 3) of straightness errors,
    in radians.

    The two slopes in a plane differ from those by a turn of the whole.

    >>> squareness(np.array([[0, 1e-6, 0], [2e-6, 0, 0], [0, 0, 0]]))["EC0Y"]
    -3e-06
    """
    return {
        name: float(one.sign * (slopes[one.axis, one.to] + slopes[one.to, one.axis]))
        for name, one in SQUARENESS_ERRORS.items()
    }


def _without_slopes(table: AxisTable, reference: float) -> tuple[AxisTable, Array]:
    """A table whose straightness errors are equal at both ends, and their slopes (3,) before."""
    length = table.positions[-1] - table.positions[0]
    slope = (table.values[-1, :3] - table.values[0, :3]) / length
    slope[table.axis] = 0.0
    values = table.values.copy()
    values[:, :3] -= slope * (table.positions - reference)[:, None]
    # What is rounding where an error is a straight line.
    size = np.abs(table.values).max(axis=0, initial=0.0)
    values[np.abs(values) <= 1e-12 * size] = 0.0
    return replace(table, values=values), slope


def _arrangement_lines(arrangement: Arrangement) -> list[str]:
    for name, known in ARRANGEMENTS.items():
        if known == arrangement:
            return [f"arrangement: {name}"]
    sides = {"probe_side": arrangement.probe_side, "workpiece_side": arrangement.workpiece_side}
    told = ", ".join(f"{key}: [{', '.join(axes)}]" for key, axes in sides.items())
    return [f"arrangement: {{{told}}}"]


def _volume_line(tables: AxisTables) -> str:
    ends = (
        f"{axis}: [{_mm(low)}, {_mm(high)}]"
        for axis, low, high in zip(AXES, tables.lower, tables.upper, strict=True)
    )
    return f"volume: {{{', '.join(ends)}}}"


def _mm(value: float) -> str:
    return f"{1e3 * value + 0.0:.10g} mm"
