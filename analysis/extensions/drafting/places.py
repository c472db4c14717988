"""Tips, and places of a plate that fill a measuring volume within their reach.

Places are parts of the free room, so that they follow the sizes of plate and volume.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np
from ballplate.simulator.geometry import AXIS_INDEX, IN_PLANE_AXES, rotation_matrix
from ballplate.simulator.inputs import format_length
from ballplate.simulator.machines import Array

from .machine_tables import table
from .sheet_values import Plate, StatedTips

Settings = dict[str, Any]

# Usual length of a stylus, at most a tenth of the shortest edge of the volume.
LONGEST = 0.060
# Of levels and of corners along an axis, by their number: more make plans slow.
PARTS: tuple[list[str], ...] = ([], ["middle"], ["low", "high"], ["low", "middle", "high"])
# Play of a plate, as a share of its side, below which it has one place along an axis.
LITTLE_PLAY = 0.1
# Below which a plate fits that is larger than its room, in metres.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Tips:
    """Tips by name with their ``offsets`` (d,) in metres, the reference first.

    ``form`` is one, star, head, or flat in two dimensions; the last carriage moves along the axis
    ``pointing``; ``length`` is that of a stylus in metres.
    """

    form: str
    pointing: str
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
        """Return the lowest and highest co-ordinates (2, d) of balls that all these tips reach.

        The scale readings, ball less offset, stay within the volume, and so do the balls.
        """
        along = np.array([np.zeros(len(volume)), *(self.offsets[name] for name in names)])
        return np.array([along.max(axis=0), volume + along.min(axis=0)])


def tips_of(tips: StatedTips, pointing: str, volume: tuple[float, ...]) -> Tips:
    """Return the tips of a machine of this volume whose last carriage moves along an axis; in two
    dimensions the one without an offset.
    """
    if len(volume) == 2:
        return Tips("flat", "z", 0.0, {"probe": np.zeros(2)})
    # Whole tenths of a millimetre.
    length = min(LONGEST, int(1e3 * min(volume)) / 1e4)
    if tips.length is not None:
        length = tips.length if tips.form == "star" else tips.length / 2
    listed = table("tips")[tips.form][pointing].items()
    offsets = {name: length * np.array(offset) for name, offset in listed}
    return Tips(tips.form, pointing, length, offsets)


def places_of(plate: Plate, tips: Tips, volume: tuple[float, ...]) -> Iterator[Settings]:
    """Yield the candidates that fill a volume: a group for each plane and quarter turn, and
    inclined plates for a single tip.

    :raises ValueError: the plate is larger than the volume, or not within the reach of the tips in
        a plane that they read.
    """
    size = f"the plate of {_crossed(plate.size)}"
    if min(plate.size) > sorted(volume)[-2] or max(plate.size) > max(volume):
        whole = _crossed(volume)
        raise ValueError(f"{size} is larger than the volume, {whole}; correct one of them")
    for plane, names in tips.by_plane.items():
        ends = tips.reach(names, volume)
        places = list(_across(plane, plate, ends))
        where = "" if tips.form == "flat" else f"across {plane} "
        if places and tips.form == "one":
            inclined = list(_inclined(plane, plate, ends))
            places = [*places, *inclined] if inclined else []
            where += "and inclined by 45 degrees to it "
        if not places:
            raise ValueError(
                f"{size} does not fit {where}within the reach of the tips {', '.join(names)},"
                f" {_crossed(np.maximum(0.0, ends[1] - ends[0]))}; give a smaller plate or"
                " shorter tips, or correct the volume"
            )
        yield from (place | {"probes": names} for place in places)


def strategies_of(tips: Tips, places: list[Settings]) -> Iterator[list[Settings]]:
    """Yield simple strategies of positions to start with, the shortest first; positions are turned
    by another quarter where they fit only so.
    """
    for strategy in table("starts")[tips.form][tips.pointing]:
        yield [_fitted(start, places) for start in strategy]


def _fitted(start: Settings, places: list[Settings]) -> Settings:
    fitting = [one for one in places if one.get("planes", []) == [*start.get("plane", "")]]
    turns = {place.get("quarter_turns") for place in fitting}
    if start.get("quarter_turns", turns) not in (turns, *turns):
        start = start | {"quarter_turns": start["quarter_turns"] ^ 1}
    return start | {"probes": fitting[0]["probes"]}


def _across(plane: str, plate: Plate, ends: Array) -> Iterator[Settings]:
    """Yield the places of a plate across an axis, those turned by a quarter separately."""
    space = ends.shape[1] == 3
    levels = _parts(ends[:, AXIS_INDEX[plane]], 0.0, min(plate.size)) if space else ["middle"]
    for turn, size in enumerate((plate.size, plate.size[::-1])):
        corners = {
            axis: _parts(ends[:, AXIS_INDEX[axis]], side, side)
            for axis, side in zip(IN_PLANE_AXES[plane], size, strict=True)
        }
        if levels and all(corners.values()):
            group = {"planes": [plane], "levels": levels} if space else {}
            yield group | {"corners": corners, "quarter_turns": turn}


def _inclined(pointing: str, plate: Plate, ends: Array) -> Iterator[Settings]:
    """Yield places of a plate at 45 degrees to the axis of a single tip, if it fits."""
    balls = np.array([(0.0, 0.0, 0.0), (*plate.size, 0.0)])
    for angles in table("inclined")[pointing]:
        # The other two corner balls are between these along every axis.
        turned = balls @ rotation_matrix([*np.radians(angles)]).T
        fits = (np.ptp(turned, axis=0) <= ends[1] - ends[0]).all()
        for parts in table("inclined")["origins"] if fits else ():
            rotation = [f"{angle} deg" for angle in angles]
            # Without a sign, which names of features do not keep.
            name = " ".join(map(str, ["inclined", *(angle % 360 for angle in angles), parts[0]]))
            yield {"name": name, "pose": {"origin": parts, "rotation": rotation}}


def _parts(ends: Array, side: float, step: float) -> list[str]:
    """Return lower ends of a side as parts of its room, as many as it takes to cover a range in
    steps; none if it does not fit.
    """
    room = ends[1] - ends[0] - side
    most = min(3, max(2, ceil((ends[1] - ends[0]) / step) + (side == 0.0)))
    return PARTS[most if room > LITTLE_PLAY * step else int(room >= -ROUNDING)]


def _crossed(lengths: Iterable[float]) -> str:
    return " x ".join(map(format_length, lengths))
