"""Points of an error curve from a CSV file: an abscissa, or the nominal profile of a part, and an
error.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Literal

import numpy as np
from ballplate.simulator.inputs import (
    ANGLE_UNITS,
    LENGTH_UNITS,
    MORE_ERRORS,
    MOST_MESSAGES,
    MOST_ROWS,
    ExperimentError,
    Mark,
    Message,
    TableLine,
    decimal_sign,
    header_cells,
    hint,
    listing,
    read_number,
    refused,
    shorten,
    table_lines,
    wrong_count,
)
from ballplate.simulator.machines import Array

EXAMPLE = "position_mm,error_um"
PROFILES = (("nominal_x", "nominal_z"), ("x", "z"))
POINT, FEATURE, UNCERTAINTY, ARC_LENGTH = "point", "feature", "u", "arc_length"
MOST_POINTS = 20_000
NO_TABLES = (".yaml", ".yml", ".json")


@dataclass(frozen=True)
class Column:
    """A column with a unit: its name without it, and how many metres or radians the unit is."""

    name: str
    unit: str
    factor: float
    kind: Literal["length", "angle"]

    @property
    def words(self) -> str:
        """The name in a sentence."""
        return self.name.replace("_", " ")


@dataclass(frozen=True)
class CurvePoints:
    """Points in the order of the file, in metres and radians.

    `x` (m,) is not there where the abscissa is the arc length along the profile; `places` (m, 2),
    radius and axial co-ordinate, are not there where the file has no profile.
    """

    names: tuple[str, ...]
    features: tuple[str, ...]
    x_column: Column
    y_column: Column
    x: Array | None = field(repr=False)
    y: Array = field(repr=False)
    uncertainties: Array | None = field(repr=False)
    places: Array | None = field(repr=False)

    def chosen(self, indices: Sequence[int]) -> CurvePoints:
        """Those of some indices."""
        index = list(indices)
        return CurvePoints(
            tuple(self.names[k] for k in index),
            tuple(self.features[k] for k in index),
            self.x_column,
            self.y_column,
            None if self.x is None else self.x[index],
            self.y[index],
            None if self.uncertainties is None else self.uncertainties[index],
            None if self.places is None else self.places[index],
        )


# In one piece: one pass over the lines collects all points and all that is wrong with them.
def read_points(path: Path, x: str | None = None, y: str | None = None) -> CurvePoints:
    """Read points from a file whose first line names the columns, each with its unit, such as
    position_mm,error_um.

    `x` and `y` choose columns, with or without the unit. Without `x` the abscissa is the arc
    length along the profile if the file has the columns nominal_x and nominal_z (or x and z),
    otherwise the first column with a unit; without `y` the error is the only column left. `point`
    and `feature` are texts, `u` a standard uncertainty of the error. Other columns are not read.

    :raises ExperimentError: all faults of the file at once.
    """
    file = str(path)
    if path.suffix.lower() in NO_TABLES:
        text = (
            f"this is {path.suffix[1:].upper().replace('YML', 'YAML')}, not a table; give a CSV"
            " file that begins"
        )
        raise refused(file, f"{text} with a line such as {EXAMPLE}")
    lines = table_lines(path)
    if not lines:
        raise refused(file, f"the file is empty; its first line should be {EXAMPLE}")
    header = _Header(file, lines[0])
    x_column, y_column, profile = header.choose(x, y)
    wanted = [*([] if x_column is None else [x_column]), y_column, *profile]
    if UNCERTAINTY in header.columns:
        wanted.append(header.columns[UNCERTAINTY])
        if wanted[-1].kind != y_column.kind:
            text = (
                f"the uncertainty is an {wanted[-1].kind} and {y_column.name} a {y_column.kind};"
                " correct the unit"
            )
            raise refused(file, text, line=lines[0].number)
    messages: list[Message] = []
    values: list[list[float]] = []
    names: list[str] = []
    features = []
    names_seen: dict[str, int] = {}
    decimal = decimal_sign(lines[1:], [header.index(column) for column in wanted])
    for line in lines[1:]:
        number = line.number
        if len(messages) >= MOST_MESSAGES or len(values) > MOST_POINTS:
            break
        mark = Mark(file, number, 1)
        cells = line.cells()
        if cells is None or len(cells) != len(header.order):
            messages.append(mark.message("", wrong_count(line, cells, len(header.order))))
            continue
        row = []
        for column in wanted:
            start, cell = cells[header.index(column)]
            place, factor = Mark(file, number, start), header.factors[column.name]
            row.append(
                read_number(cell, column.name, factor, place, messages, column.kind, decimal)
            )
            if column.name == UNCERTAINTY and row[-1] <= 0:
                text = f'"{cell}" is not a standard uncertainty; give one above zero'
                messages.append(place.message("", text))
        values.append(row)
        name = cells[header.texts[POINT]][1] if POINT in header.texts else str(len(names) + 1)
        if name in names_seen:
            messages.append(
                mark.message(
                    "",
                    f'a second point "{shorten(name)}", as in line {names_seen[name]}; rename one',
                )
            )
        names_seen[name] = number
        names.append(name)
        features.append(cells[header.texts[FEATURE]][1] if FEATURE in header.texts else "")
    if len(messages) >= MOST_MESSAGES:
        messages.append(Message(file, lines[0].number, 1, "", MORE_ERRORS))
    if len(lines) == 1:
        messages.append(
            Message(
                file,
                lines[0].number,
                1,
                "",
                "no rows below the names of the columns; add at least one",
            )
        )
    if len(values) > MOST_POINTS or len(lines) > MOST_ROWS:
        messages.append(
            Message(file, lines[0].number, 1, "", f"more than {MOST_POINTS} points; leave some out")
        )
    if messages:
        raise ExperimentError(messages)
    table = np.array(values)
    by_name = {column.name: table[:, k] for k, column in enumerate(wanted)}
    return CurvePoints(
        tuple(names),
        tuple(features),
        x_column or Column(ARC_LENGTH, profile[0].unit, profile[0].factor, "length"),
        y_column,
        None if x_column is None else by_name[x_column.name],
        by_name[y_column.name],
        by_name.get(UNCERTAINTY),
        np.stack([by_name[column.name] for column in profile], axis=1) if profile else None,
    )


def choose_points(points: CurvePoints, text: str, file: str) -> list[int]:
    """Indices of the points that a text such as 12-32, 40 names.

    :raises ExperimentError: names that the file does not have.
    """
    by_name = {name: k for k, name in enumerate(points.names)}
    numbers = {int(name): k for name, k in by_name.items() if re.fullmatch("[0-9]{1,9}", name)}
    indices = set()
    messages = []
    for part in re.split(r"\s*,\s*", text.strip()):
        span = re.fullmatch(r"([0-9]{1,9})\s*-\s*([0-9]{1,9})", part)
        if part in by_name:
            indices.add(by_name[part])
        elif span and numbers and (int(span[1]) < min(numbers) or int(span[2]) > max(numbers)):
            text = (
                f'"{shorten(part)}" goes beyond the points, {min(numbers)} to {max(numbers)}; leave'
                " those out"
            )
            messages.append(Message(file, 0, 0, "", text))
        elif span and any(int(span[1]) <= number <= int(span[2]) for number in numbers):
            indices |= {
                k for number, k in numbers.items() if int(span[1]) <= number <= int(span[2])
            }
        else:
            noun = "no points" if span else "no point"
            messages.append(
                Message(file, 0, 0, "", f'{noun} "{shorten(part)}"; {hint(part, points.names)}')
            )
    if messages:
        raise ExperimentError(messages)
    return sorted(indices)


class _Header:
    """The first line: columns with a unit by their names, and where texts are."""

    def __init__(self, file: str, line: TableLine) -> None:
        self.mark = Mark(file, line.number, 1)
        cells = list(header_cells(file, line, EXAMPLE))
        self.order = [cell for _, cell, _, _ in cells]
        self.columns: dict[str, Column] = {}
        self.factors: dict[str, Fraction] = {}
        self.texts: dict[str, int] = {}
        self._index: dict[str, int] = {}
        messages = []
        for k, (place, cell, name, unit) in enumerate(cells):
            kind: Literal["length", "angle"] = "length" if unit in LENGTH_UNITS else "angle"
            units: Mapping[str, Fraction] = LENGTH_UNITS if kind == "length" else ANGLE_UNITS
            if name in self.columns or cell in self.texts:
                messages.append(place.message("", f'a second column "{shorten(cell)}"; remove one'))
            elif cell in (POINT, FEATURE):
                self.texts[cell] = k
            elif name and unit in units:
                self.columns[name] = Column(name, unit, float(units[unit]), kind)
                self.factors[name], self._index[name] = units[unit], k
        if messages:
            raise ExperimentError(messages)

    def index(self, column: Column) -> int:
        """Where a column stands."""
        return self._index[column.name]

    def choose(
        self, x: str | None, y: str | None
    ) -> tuple[Column | None, Column, tuple[Column, ...]]:
        """The abscissa, None for the arc length, the error, and the profile's two columns where
        there are.
        """
        profile: tuple[Column, ...] = ()
        for names in PROFILES:
            if all(name in self.columns and self.columns[name].kind == "length" for name in names):
                profile = tuple(self.columns[name] for name in names)
                break
        columns_left = [
            column
            for column in self.columns.values()
            if column not in profile and column.name != UNCERTAINTY
        ]
        messages: list[Message] = []
        x_column = None
        if x is not None and not (x == ARC_LENGTH and ARC_LENGTH not in self.columns):
            x_column = self._named("x", x, messages)
        elif x is not None and not profile:
            text = "the arc length needs a profile; add the columns nominal_x_mm and nominal_z_mm"
            messages.append(self.mark.message("", text))
        elif not profile and len(columns_left) > 1:
            x_column = columns_left[0]
        columns_left = [column for column in columns_left if column is not x_column]
        y_column = None
        if y is not None:
            y_column = self._named("y", y, messages)
        elif len(columns_left) == 1:
            y_column = columns_left[0]
        elif columns_left:
            text = (
                f"several columns may be the error: {listing(c.name for c in columns_left)};"
                " choose one"
                " with --y"
            )
            messages.append(self.mark.message("", text))
        else:
            text = f"no column is left for the error; its name needs a unit, as in {EXAMPLE}"
            messages.append(self.mark.message("", text))
        if not profile and x_column is None and not messages:
            assert y_column is not None
            bare = [
                name
                for name in self.order
                if name not in self.texts and name.rpartition("_")[0] != y_column.name
            ]
            lack = (
                f"; {listing(bare)} has no unit, and columns without are not read" if bare else ""
            )
            text = f"there is an error but no abscissa{lack}; write for example {EXAMPLE}"
            messages.append(self.mark.message("", text))
        if x_column is not None and x_column is y_column:
            messages.append(
                self.mark.message(
                    "", f"{x_column.name} is chosen for x and for y; choose another for one"
                )
            )
        if messages:
            raise ExperimentError(messages)
        assert y_column is not None
        return x_column, y_column, profile

    def _named(self, option: str, name: str, messages: list[Message]) -> Column | None:
        plain = name if name in self.columns else name.rpartition("_")[0]
        if plain not in self.columns:
            advice = hint(name, self.columns)
            unit = (
                f'the column "{shorten(name)}" has no unit of length or angle; add it, as in'
                f" {shorten(name)}_um"
            )
            text = (
                unit
                if name in self.order
                else f'no column "{shorten(name)}" for --{option}; {advice}'
            )
            messages.append(self.mark.message("", text))
            return None
        return self.columns[plain]
