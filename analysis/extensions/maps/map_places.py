"""Locations for the errors of a machine: a grid, a plane, a line, or points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from ballplate.presentation import picked
from ballplate.results import ensure_points
from ballplate.simulator.design import Volume
from ballplate.simulator.geometry import AXIS_NAMES, even_grid
from ballplate.simulator.inputs import GivenText, header_names, parse_length, refused
from ballplate.simulator.machines import Array, Integers

from ..machine_files import parse_line, parse_point
from .point_files import PROBE, read_points

# Points along each axis of the volume, and along a line, unless told.
GRID, POINTS = (5, 5, 5), 21

PlaceKind = Literal["grid", "plane", "line", "points"]

Line = Mapping[str, float] | Sequence[Sequence[float]]
"""Co-ordinates in metres of the fixed axes, by their names, or two points."""


@dataclass(frozen=True, eq=False)
class PlacesAsked:
    """Requested locations: a `grid` with numbers of points along the axes; a `line` of `points`; a
    `plane` by the co-ordinate of the axis across it, with the grid's points; points `at` (m, d), in
    metres or in a table. Default: a grid.
    """

    grid: tuple[int, ...] | None = None
    line: Line | None = None
    plane: Mapping[str, float] | None = None
    points: int | None = None
    at: Array | Path | GivenText | None = None


@dataclass(frozen=True, eq=False)
class MapPlaces:
    """Points (m, d), with numbers along the axes of a grid, and `starts` and `ends` (k, d) of
    lengths with `names`: the body diagonals, or the line's; metres.

    Points of a table may have `names_of_points`, and `probes` (m,) by index.
    """

    kind: PlaceKind
    points: Array
    counts: tuple[int, ...]
    starts: Array
    ends: Array
    names: tuple[str, ...]
    names_of_points: tuple[str, ...] = ()
    probes: Integers | None = None


def parse_places(text: str) -> Line:
    """A line that is written as on the command line.

    :raises ValueError: written otherwise.

    >>> parse_places("y = 600 mm, z = 600 mm")
    {'y': 0.6, 'z': 0.6}
    >>> parse_places("0 mm, 0 mm to 500 mm, 300 mm")
    ((0.0, 0.0), (0.5, 0.3))
    """
    start, to, end = text.partition(" to ")
    if not to:
        return parse_line(text)
    in_plane = start.count(",") == end.count(",") == 1
    ends = (_two(start), _two(end)) if in_plane else (parse_point(start), parse_point(end))
    if ends[0] == ends[1]:
        raise ValueError("both ends of a line coincide; give two points")
    return ends


def _two(text: str) -> tuple[float, float]:
    first, _, second = text.partition(",")
    return parse_length(first), parse_length(second)


def parse_plane(text: str) -> dict[str, float]:
    """Return a plane by the co-ordinate of the axis across it.

    :raises ValueError: written otherwise.

    >>> parse_plane("z = 200 mm")
    {'z': 0.2}
    """
    axes = parse_line(text)
    if len(axes) != 1:
        raise ValueError("a plane keeps one axis fixed; write for example z = 200 mm")
    return axes


def map_places(
    volume: Volume, asked: PlacesAsked, probes: tuple[str, ...] = ("",), probe: str = ""
) -> MapPlaces:
    """Return the requested locations in a volume; a table of points may name one of the `probes`
    for each, default `probe`.

    :raises ExperimentError: a table of points that is wrong.
    :raises ValueError: what does not go together, or is not in the volume.
    """
    choices = {
        "grid": asked.grid if asked.plane is None else None,
        **picked(asked, "line", "plane"),
        "points of a file": asked.at,
    }
    several = [name for name, value in choices.items() if value is not None]
    if len(several) > 1:
        raise ValueError(f"{' and '.join(several)} do not go together; give only one")
    if asked.points is not None and asked.line is None:
        raise ValueError("points need a line; leave them out")
    d, ends = len(volume.lower), volume.diagonals
    names = tuple(f"diagonal {k + 1}" for k in range(len(ends[0])))
    if asked.at is not None:
        if isinstance(asked.at, np.ndarray):
            return MapPlaces("points", ensure_points(asked.at, volume), (), *ends, names)
        if not probe and PROBE in header_names(asked.at):
            text = "a machine file states its own probe; remove the column probe"
            raise refused(str(asked.at), text)
        points_read = read_points(asked.at, probes, probe, volume)
        of_points = points_read.names if any(points_read.names) else ()
        return MapPlaces(
            "points", points_read.points, (), *ends, names, of_points, points_read.probes
        )
    if asked.line is not None:
        start, end = _ends(volume, asked.line)
        points = np.linspace(start, end, asked.points or POINTS)
        return MapPlaces("line", points, (), start[None], end[None], ("length",))
    lower, upper = volume.lower.copy(), volume.upper.copy()
    counts = list(asked.grid or GRID[:d] if asked.plane is None else asked.grid or GRID[: d - 1])
    if asked.plane is not None:
        if d == 2:
            raise ValueError("this machine has two axes; leave the plane out")
        ((name, value),) = asked.plane.items()
        axis = AXIS_NAMES.index(name)
        lower[axis] = upper[axis] = value
        _ensure_inside(volume, np.stack([lower, upper]), "plane")
        if len(counts) != d - 1:
            raise ValueError("a plane has points along two axes; write for example --grid 9,9")
        counts.insert(axis, 1)
    if len(counts) != d:
        expected = "three numbers of points, such as 5,5,5" if d == 3 else "two, such as 5,5"
        raise ValueError(f"the machine has {d} axes; give {expected}")
    points = even_grid(lower, upper, counts)
    kind: PlaceKind = "grid" if asked.plane is None else "plane"
    return MapPlaces(kind, points, tuple(counts), *ends, names)


def _ends(volume: Volume, line: Line) -> tuple[Array, Array]:
    """Start and end (d,) of a line within the volume."""
    d = len(volume.lower)
    if isinstance(line, Mapping):
        if len(line) != d - 1 or not set(line) <= set(AXIS_NAMES[:d]):
            remedy = "two axes fixed; write for example y = 600 mm, z = 600 mm"
            raise ValueError(f"a line keeps {remedy}" if d == 3 else "a line keeps x or y fixed")
        ends = np.stack([volume.lower, volume.upper])
        for name, value in line.items():
            ends[:, AXIS_NAMES.index(name)] = value
    else:
        ends = np.asarray(line, float)
        if ends.shape != (2, d):
            raise ValueError(f"a line of this machine is between two points of {d} co-ordinates")
    _ensure_inside(volume, ends, "line")
    return ends[0], ends[1]


def _ensure_inside(volume: Volume, ends: Array, subject: str) -> None:
    outside = np.flatnonzero(((ends < volume.lower) | (ends > volume.upper)).any(axis=0))
    if len(outside):
        named = " and ".join(AXIS_NAMES[k] for k in outside)
        raise ValueError(f"the {subject} is outside the volume in {named}")
