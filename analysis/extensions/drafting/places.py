"""Tips, and places of a plate that fill a measuring volume within their reach."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np
from ballplate.simulator.geometry import AXIS_INDEX, IN_PLANE_AXES, rotation_matrix
from ballplate.simulator.inputs import format_length, typed_length
from ballplate.simulator.machines import Array

from .machine_tables import table
from .sheet_values import Plate, StatedTips

Settings = dict[str, Any]

# Usual length of a stylus, at most a tenth of the shortest edge of the volume.
LONGEST = 0.060
# Of levels and of corners along an axis: more make plans slow, and hardly better.
MOST_PLACES = 3
# Play of a plate, as a share of its side, below which it has one place along an axis.
LITTLE_PLAY = 0.1


@dataclass(frozen=True)
class Tips:
    """Tips by name with their ``offsets`` (3,) in metres, the reference first.

    ``length`` is that of a stylus in metres.
    """

    form: str
    length: float
    offsets: dict[str, Array]

    @property
    def by_plane(self) -> dict[str, list[str]]:
        """Return the tips that read a plate across each axis."""
        return {
            axis: there
            for axis, names in table("planes").items()
            if (there := [name for name in names if name in self.offsets])
        }

    def reach(self, names: list[str], volume: tuple[float, ...]) -> Array:
        """Return the lowest and highest co-ordinates (2, 3) of balls that all these tips reach.

        The scale readings, ball less offset, stay within the volume, and so do the balls.
        """
        along = np.array([(0.0, 0.0, 0.0), *(self.offsets[name] for name in names)])
        return np.array([along.max(axis=0), volume + along.min(axis=0)])


def tips_of(tips: StatedTips, pointing: str, volume: tuple[float, ...]) -> Tips:
    """Return the tips of a machine of this volume whose last carriage moves along an axis."""
    # Whole tenths of a millimetre.
    length = min(LONGEST, int(1e3 * min(volume)) / 1e4)
    if tips.length is not None:
        length = tips.length if tips.form == "star" else tips.length / 2
    listed = table("tips")[tips.form][pointing].items()
    return Tips(tips.form, length, {name: length * np.array(offset) for name, offset in listed})


def places_of(plate: Plate, tips: Tips, volume: tuple[float, ...]) -> Iterator[Settings]:
    """Yield the candidates that fill a volume: a group for each plane and quarter turn, and
    inclined plates for a single tip.

    :raises ValueError: the plate is larger than the volume, or not within the reach of the tips in
        a plane that they read.
    """
    size = f"the plate of {_crossed(plate.size)}"
    if min(plate.size) > sorted(volume)[1] or max(plate.size) > max(volume):
        whole = _crossed(volume)
        raise ValueError(f"{size} is larger than the volume, {whole}; correct one of them")
    for plane, names in tips.by_plane.items():
        ends = tips.reach(names, volume)
        places = list(_across(plane, plate, ends))
        where = f"across {plane}"
        if places and tips.form == "one":
            inclined = list(_inclined(plane, plate, ends))
            places = [*places, *inclined] if inclined else []
            where += " and inclined by 45 degrees to it"
        if not places:
            raise ValueError(
                f"{size} does not fit {where} within the reach of the tips {', '.join(names)},"
                f" {_crossed(np.maximum(0.0, ends[1] - ends[0]))}; give a smaller plate or"
                " shorter tips, or correct the volume"
            )
        yield from (place | {"probes": names} for place in places)


def starts_of(places: list[Settings]) -> Iterator[Settings]:
    """Yield positions to start with: a plate at the lower end in each plane, one turned at the
    upper end, and one of each inclination.
    """
    planes = ["".join(place.get("planes", ())) for place in places]
    for place, plane in zip(places, planes, strict=True):
        if not plane and place["name"].endswith("low"):
            yield place
        for end, word in enumerate(("low", "high") if plane else ()):
            if place["quarter_turns"] == end or planes.count(plane) == 1:
                corner = {axis: corners[-end] for axis, corners in place["corners"].items()}
                start = {"name": f"{plane} {word}", "plane": plane, "level": place["levels"][-end]}
                start |= {"corner": corner, "quarter_turns": place["quarter_turns"]}
                yield start | {"probes": place["probes"]}


def _across(plane: str, plate: Plate, ends: Array) -> Iterator[Settings]:
    """Yield the places of a plate across an axis, those turned by a quarter separately."""
    levels = _spread(ends[:, AXIS_INDEX[plane]], 0.0, min(plate.size))
    for turn, size in enumerate((plate.size, plate.size[::-1])):
        corners = {
            axis: _spread(ends[:, AXIS_INDEX[axis]], side, side)
            for axis, side in zip(IN_PLANE_AXES[plane], size, strict=True)
        }
        if levels and all(corners.values()):
            group = {"planes": [plane], "levels": levels, "corners": corners}
            yield group | {"quarter_turns": turn}


def _inclined(pointing: str, plate: Plate, ends: Array) -> Iterator[Settings]:
    """Yield places of a plate at 45 degrees to the axis of a single tip, if it fits."""
    balls = np.array([(0.0, 0.0, 0.0), (*plate.size, 0.0)])
    for angles in table("inclined")[pointing]:
        # The other two corner balls are between these along every axis.
        turned = balls @ rotation_matrix([*np.radians(angles)]).T
        # Whole tenths of a millimetre, which are not beyond the range.
        first, last = ends - [turned.min(axis=0) - 1e-4, turned.max(axis=0) + 1e-4]
        for share, word in enumerate(("low", "middle", "high") if (first <= last).all() else ()):
            origin = np.round(first + share / 2 * (last - first), 4)
            pose = {"origin": [*map(typed_length, origin)]}
            pose["rotation"] = [f"{angle} deg" for angle in angles]
            yield {"name": f"inclined {' '.join(map(str, angles))} {word}", "pose": pose}


def _spread(ends: Array, side: float, step: float) -> list[str]:
    """Return lower ends of a side, as many as it takes to cover a range in steps; none if it does
    not fit.
    """
    # Whole tenths of a millimetre that are not beyond the range.
    room = np.floor(1e4 * (ends[1] - side - ends[0]) + 1e-6) * 1e-4
    most = min(MOST_PLACES, max(2, ceil(np.ptp(ends) / step) + (side == 0.0)))
    count = most if room > LITTLE_PLAY * step else int(room >= 0.0)
    shares = np.linspace(0.0, 1.0, count)
    return [typed_length(round(float(ends[0] + room * share), 4)) for share in shares]


def _crossed(lengths: Iterable[float]) -> str:
    return " x ".join(map(format_length, lengths))
