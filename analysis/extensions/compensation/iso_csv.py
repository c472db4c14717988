"""Tables of axes as CSV, one file for each, whose columns are errors by their ISO 230-1 names."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from ballplate.simulator.experiment import LineError, parse_point, read_curves
from ballplate.simulator.inputs import (
    ExperimentError,
    Mark,
    Message,
    format_length,
    listing,
    read_text,
    refused,
)
from ballplate.simulator.machines import AXES, AXIS_ERRORS, Arrangement

from .axis_tables import AxisTable, AxisTables, Corner, names_of
from .table_formats import (
    MEANING,
    SENSES,
    Sense,
    StatedTable,
    Table,
    TableFormat,
    arrangement_words,
    parse_arrangement,
    stated_sense,
)

COMMENT = re.compile(r"\s*#\s*(.*?)\s*$")


def _write(table: Table, sense: Sense, stem: str) -> dict[str, str]:
    assert isinstance(table, AxisTables)
    point = ", ".join(format_length(value) for value in table.origin)
    head = [
        f"# states: {sense}, {MEANING[sense]}",
        f"# arrangement: {arrangement_words(table.arrangement)}",
        f"# origin: {point}",
        "# straightness errors keep their slopes: squareness is in them",
    ]
    contents = {}
    for axis in table.axes:
        names = [
            f"{name}_{'urad' if AXIS_ERRORS[name].is_rotation else 'um'}"
            for name in names_of(axis.axis)
        ]
        lines = [*head, ",".join(["position_mm", *names])]
        for position, values in zip(axis.positions.tolist(), axis.values.tolist(), strict=True):
            cells = (f"{1e6 * value + 0.0:.3f}" for value in values)
            lines.append(",".join([f"{1e3 * position:.10g}", *cells]))
        contents[f"-{AXES[axis.axis]}.csv"] = "\n".join([*lines, ""])
    return contents


def _read(paths: Sequence[Path]) -> StatedTable:
    """Read one file for each axis.

    :raises ExperimentError: faults of the files, or they do not go together.
    """
    axes: dict[int, AxisTable] = {}
    statements: dict[str, object] = {}
    silent = []
    messages: list[Message] = []
    for path in paths:
        try:
            table = _axis(path)
            comments = _comments(path)
        except ExperimentError as error:
            messages += error.messages
            continue
        if table.axis in axes:
            text = f"a second table of {AXES[table.axis]}; name one file for each axis"
            messages.append(Message(str(path), 0, 0, "", text))
        axes[table.axis] = table
        silent += [] if "sense" in comments else [path]
        for key, value in comments.items():
            if statements.setdefault(key, value) != value:
                text = f"its {key} is not that of {paths[0]}; let all files of a table say the same"
                messages.append(Message(str(path), 0, 0, "", text))
    if "sense" in statements:
        text = (
            f"does not state whether values are {' or '.join(SENSES)}, as others do; add # states:"
        )
        messages += [Message(str(path), 0, 0, "", text) for path in silent]
    missing = [AXES[k] for k in range(3) if k not in axes]
    if not messages and missing not in ([], ["z"]):
        text = f"no table of {listing(missing)}; name the files of x, y and z together"
        raise refused(paths[0], text)
    if messages:
        raise ExperimentError(messages)
    sense, arrangement, origin = (statements.get(key) for key in ("sense", "arrangement", "origin"))
    return StatedTable(
        tuple(axes[k] for k in sorted(axes)),
        sense=sense,  # type: ignore[arg-type]
        arrangement=arrangement if isinstance(arrangement, Arrangement) else None,
        origin=origin if isinstance(origin, tuple) else None,
    )


def _axis(path: Path) -> AxisTable:
    curves = read_curves(path)
    axis = AXIS_ERRORS[next(iter(curves))].axis
    positions = np.array(next(iter(curves.values())).positions)
    columns = [
        np.array(curves[name].values) if name in curves else np.zeros(len(positions))
        for name in names_of(axis)
    ]
    return AxisTable(axis, positions, np.column_stack(columns))


def _comments(path: Path) -> dict[str, Sense | Arrangement | Corner]:
    """What the comments of a file say.

    :raises ExperimentError: they say what cannot be.
    """
    statements: dict[str, Sense | Arrangement | Corner] = {}
    messages = []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        match = COMMENT.match(line)
        if match is None:
            continue
        key, _, text = match[1].partition(":")
        mark = Mark(str(path), number, 1)
        try:
            if key == "states":
                sense = stated_sense(match[1])
                if sense is None:
                    raise ValueError("unknown sense; write corrections or errors of indication")
                statements["sense"] = sense
            elif key == "arrangement":
                statements["arrangement"] = parse_arrangement(text)
            elif key == "origin":
                statements["origin"] = parse_point(text)
        except (LineError, ValueError) as error:
            messages.append(mark.message("", f"{key}: {error}"))
    if messages:
        raise ExperimentError(messages)
    return statements


ISO_CSV = TableFormat(
    "csv",
    "CSV with ISO 230-1 columns, one file for each axis",
    _write,
    _read,
    length_step=1e-9,
    angle_step=1e-9,
    layout="NAME-x.csv, NAME-y.csv and NAME-z.csv",
)
