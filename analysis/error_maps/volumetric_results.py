"""Volumetric errors of a machine as they show themselves: on a grid, along a line, and one error
along its axis.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from ballplate.simulator.experiment.error_tables import parse_line, parse_point
from ballplate.simulator.experiment.machine_file import load_machine
from ballplate.simulator.inputs.messages import Message
from ballplate.simulator.machines.volumetric import meaning

from ..presentation.result import Result
from .volumetric_errors import (
    AlongAxis,
    LengthErrors,
    Volumetric,
    VolumetricErrors,
    along_axes,
    between,
)
from .volumetric_plots import draw_along, draw_grid, draw_line
from .volumetric_tables import (
    along_csv,
    along_data,
    along_lines,
    diagonal_data,
    diagonal_lines,
    error_csv,
    error_data,
    error_lines,
    length_data,
    length_line,
    machine_data,
    machine_lines,
    why_not_along,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Points along each axis of the volume, and along a line, unless told.
GRID, POINTS = (5, 5, 5), 21


@dataclass(frozen=True, repr=False)
class MachineErrors(Result):
    """Errors of the machine of a file; `doubts` are what of the file is unlikely to be meant."""

    label: str
    machine: Volumetric
    doubts: tuple[str, ...]

    @property
    def title(self) -> str:
        return self.machine.machine.title

    @property
    def notes(self) -> tuple[str, ...]:
        return tuple(f"warning: {doubt}" for doubt in self.doubts)

    def point_lines(self) -> Iterator[str]:
        """The points alone as lines of a CSV file, in units that its columns name."""
        raise NotImplementedError

    def plot(self, path: str | Path | None = None) -> Figure:
        """The errors as a picture.

        With a path, which ends in .svg, .png or .pdf, the picture is written as well.

        :raises ImportError: matplotlib is missing.
        :raises ValueError: the path ends in something else.
        """
        raise NotImplementedError


@dataclass(frozen=True, eq=False, repr=False)
class ErrorsAtPoints(MachineErrors):
    """Volumetric errors at points: `errors`, and the errors of `lengths` between some of them."""

    errors: VolumetricErrors
    lengths: LengthErrors

    def headline(self) -> str:
        largest = 1e6 * float(self.errors.resultant.max())
        return f"{len(self.errors.points)} points, resultant {largest:.4g} um at most"

    def rows(self) -> list[dict[str, Any]]:
        """One row for each point, in metres."""
        found = self.errors
        columns = {
            **{axis: found.points[:, k] for k, axis in enumerate("xyz")},
            **{f"error {axis}": found.systematic[:, k] for k, axis in enumerate("xyz")},
            "resultant": found.resultant,
            **{f"random {axis}": found.deviation[:, k] for k, axis in enumerate("xyz")},
        }
        values = zip(*(column.tolist() for column in columns.values()), strict=True)
        return [dict(zip(columns, row, strict=True)) | {"unit": "m"} for row in values]

    def point_lines(self) -> Iterator[str]:
        return error_csv(self.errors)


@dataclass(frozen=True, eq=False, repr=False)
class VolumetricMap(ErrorsAtPoints):
    """Errors on a grid of `counts` points along the axes, and of the four body diagonals."""

    counts: tuple[int, int, int]

    def lines(self) -> list[str]:
        diagonals = diagonal_lines(self.lengths)
        return [*machine_lines(self.machine), "", *diagonals, "", *error_lines(self.errors)]

    def to_dict(self) -> dict[str, Any]:
        return {
            **machine_data(self.machine),
            "diagonals": diagonal_data(self.lengths),
            "grid": error_data(self.errors),
        }

    def plot(self, path: str | Path | None = None, magnification: float | None = None) -> Figure:
        """The outside of the grid, nominal and displaced by its magnified errors."""
        return draw_grid(self.errors, self.lengths, self.counts, magnification, path)


@dataclass(frozen=True, eq=False, repr=False)
class ErrorsOnLine(ErrorsAtPoints):
    """Errors along a line, and that of its length."""

    def lines(self) -> list[str]:
        return [*error_lines(self.errors), length_line(self.lengths)]

    def to_dict(self) -> dict[str, Any]:
        return {
            **machine_data(self.machine),
            "length": length_data(self.lengths)[0],
            "line": error_data(self.errors),
        }

    def plot(self, path: str | Path | None = None) -> Figure:
        return draw_line(self.errors, path)


@dataclass(frozen=True, eq=False, repr=False)
class ErrorAlongAxis(MachineErrors):
    """One parametric error along its axis."""

    along: AlongAxis

    def headline(self) -> str:
        error, unit = self.along.error, "urad" if self.along.error.is_rotation else "um"
        return f"{error.name}, {meaning(error.name)}, range {1e6 * self.along.range:.4g} {unit}"

    def lines(self) -> list[str]:
        return along_lines(self.along)

    def to_dict(self) -> dict[str, Any]:
        return along_data(self.along)

    def rows(self) -> list[dict[str, Any]]:
        """One row for each place along the axis, in metres and radians."""
        data = self.to_dict()
        names = [name for name in ("position", "stated", "value", "random") if data[name]]
        columns = zip(*(data[name] for name in names), strict=True)
        return [dict(zip(names, row, strict=True)) | {"unit": data["unit"]} for row in columns]

    def point_lines(self) -> Iterator[str]:
        return along_csv(self.along)

    def plot(self, path: str | Path | None = None) -> Figure:
        return draw_along(self.along, path)


Line = Mapping[str, float] | Sequence[Sequence[float]]
"""The places in metres of the two fixed axes, by their names, or two points."""


def parse_places(text: str) -> Line:
    """A line that is written as on the command line.

    :raises ValueError: written otherwise.

    >>> parse_places("y = 600 mm, z = 600 mm")
    {'y': 0.6, 'z': 0.6}
    """
    start, to, end = text.partition(" to ")
    if to:
        ends = parse_point(start), parse_point(end)
        if ends[0] == ends[1]:
            raise ValueError("a line ends where it begins; give two points")
        return ends
    found = parse_line(text)
    if len(found) != 2:
        raise ValueError("a line keeps two axes fixed; write for example y = 600 mm, z = 600 mm")
    return found


def machine_errors(
    file: Path,
    grid: tuple[int, int, int] | None = None,
    line: Line | None = None,
    error: str | None = None,
    points: int | None = None,
) -> MachineErrors:
    """Errors of a machine file: on a grid over the volume, or along a line of so many points, or of
    one parametric error.

    :raises ExperimentError: the file is wrong.
    :raises ValueError: what does not go together, or is not in the machine.
    """
    given = {"grid": grid, "line": line, "error": error}
    several = [name for name, value in given.items() if value is not None]
    if len(several) > 1:
        raise ValueError(f"{' and '.join(several)} do not go together; give one of them")
    if points is not None and line is None:
        raise ValueError("points go with a line; leave them out")
    doubts: list[Message] = []
    machine = load_machine(file, doubts)
    built = Volumetric(machine)
    common = file.stem, built, tuple(map(str, doubts))
    if error is not None:
        every = {one.error.name: one for one in along_axes(machine)}
        if error not in every:
            raise ValueError(why_not_along(error, built, str(file)))
        return ErrorAlongAxis(*common, every[error])
    if line is None:
        counts = grid or GRID
        return VolumetricMap(*common, built.errors(built.grid(counts)), built.diagonals(), counts)
    start, end = (
        built.parallel(dict(line)) if isinstance(line, Mapping) else np.asarray(line, float)
    )
    ends = np.stack([start, end])
    outside = np.flatnonzero(((ends < machine.lower) | (ends > machine.upper)).any(axis=0))
    if len(outside):
        named = " and ".join("xyz"[k] for k in outside)
        raise ValueError(f"the line is outside the volume in {named}")
    errors = built.errors(between(start, end, points or POINTS))
    return ErrorsOnLine(*common, errors, built.lengths(start[None], end[None]))
