"""What the files of a compensation table say, as errors of a machine and as a machine file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
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


def read_table_files(
    made: TableFormat,
    paths: Sequence[Path],
    sense: Sense | None = None,
    arrangement: Arrangement | None = None,
    origin: Corner | None = None,
) -> tuple[Table, Sense, tuple[str, ...]]:
    """Read the files of a table in a format: as corrections to be added to scale readings, with the
    sense that the files state, and notes on what is not read.

    `sense` says which errors they state where they do not, `arrangement` whose errors are wanted,
    and, where they state none, whose they are; `origin` is the point from which levers count.

    :raises ExperimentError: the files are invalid, say otherwise, or leave open what nobody says.
    """
    statements = made.read(paths)
    meant = _sense(statements, sense, paths[0])
    if statements.volume is not None:
        if arrangement is not None:
            text = "a table of the whole volume has no arrangement of axes; leave it out"
            raise refused(paths[0], text)
        return with_sense(statements.volume, meant), meant, statements.notes
    tables = AxisTables(
        _arrangement(statements, made, arrangement, paths[0]),
        _origin(statements, made, origin, paths[0]),
        statements.axes,
    )
    if arrangement is not None:
        try:
            tables = in_arrangement(tables, arrangement)
        except NotOfAxesError as error:
            raise refused(
                paths[0], f"cannot be expressed in that arrangement: {error}; name another"
            ) from None
    notes = statements.notes
    if not made.has_rotations:
        notes = (*notes, f"{made.name} tables have no rotations: the errors read have none")
    return with_sense(tables, meant), meant, notes


def _sense(statements: StatedTable, sense: Sense | None, path: Path) -> Sense:
    if statements.sense is None and sense is None:
        raise refused(
            path,
            f"does not state whether values are {' or '.join(SENSES)}; state the sense, since the"
            " other sign would double the machine's errors",
        )
    if None not in (statements.sense, sense) and statements.sense != sense:
        raise refused(path, f"states {statements.sense}, not {sense}; leave the sense to the file")
    chosen_sense = statements.sense or sense
    assert chosen_sense is not None
    return chosen_sense


def _arrangement(
    statements: StatedTable, made: TableFormat, wanted: Arrangement | None, path: Path
) -> Arrangement:
    """The arrangement that the values are told in."""
    if statements.arrangement is not None:
        return statements.arrangement
    if wanted is None:
        text = "does not state the machine's arrangement of axes; name it, such as MB2 or FB1"
        raise refused(path, text)
    return Arrangement(tool_chain(wanted)) if made.from_zero else wanted


def _origin(
    statements: StatedTable, made: TableFormat, origin: Corner | None, path: Path
) -> Corner:
    if statements.origin is not None and origin not in (None, statements.origin):
        raise refused(path, "states its origin itself; leave it out")
    chosen_origin = statements.origin or origin
    turns = any(axis.values[:, 3:].any() for axis in statements.axes)
    if chosen_origin is None and turns:
        raise refused(path, "does not state from which point levers of rotations count; give it")
    corner = [float(axis.positions[0]) for axis in statements.axes]
    return chosen_origin or (*corner, *[0.0] * (3 - len(corner)))


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
    nodes = tuple(axis.positions for axis in tables.axes)
    there = tabulated(functions, nodes, reference, tuple(reference.tolist()))
    straight = [_without_slopes(axis, float(reference[axis.axis])) for axis in there.axes]
    slopes = np.array([slope for _, slope in straight])
    files = {}
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
                files[ending] = "\n".join([f"position_mm,{name}_{unit}", *rows, ""])
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
    files[".yaml"] = "\n".join([*(lines if any(square.values()) else lines[:-1]), ""])
    return files


def squareness(slopes: Array) -> dict[str, float]:
    """Squareness errors by their ISO 230-1 names of the slopes (3 axes, 3) of straightness errors,
    in radians.

    The two slopes in a plane differ from those by a turn of the whole.

    >>> squareness(np.array([[0, 1e-6, 0], [2e-6, 0, 0], [0, 0, 0]]))["EC0Y"]
    -3e-06
    """
    return {
        name: float(
            error_name.sign
            * (slopes[error_name.axis, error_name.to] + slopes[error_name.to, error_name.axis])
        )
        for name, error_name in SQUARENESS_ERRORS.items()
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
    for name, named_arrangement in ARRANGEMENTS.items():
        if named_arrangement == arrangement:
            return [f"arrangement: {name}"]
    sides = {"probe_side": arrangement.probe_side, "workpiece_side": arrangement.workpiece_side}
    sides_text = ", ".join(f"{key}: [{', '.join(axes)}]" for key, axes in sides.items())
    return [f"arrangement: {{{sides_text}}}"]


def _volume_line(tables: AxisTables) -> str:
    ends = (
        f"{axis}: [{_mm(low)}, {_mm(high)}]"
        for axis, low, high in zip(AXES, tables.lower, tables.upper, strict=True)
    )
    return f"volume: {{{', '.join(ends)}}}"


def _mm(value: float) -> str:
    return f"{1e3 * value + 0.0:.10g} mm"
