"""Displacements shared by readings that have something in common: one along each axis for each
combination of positions, probes and balls.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate.simulator.design import (
    DesignParts,
    Disturbed,
    Influence,
    InfluenceParameter,
    Readings,
)
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.machines import Array, Integers

Level = Literal["position", "probe", "ball"]


@dataclass(frozen=True)
class SharedDisplacements(Influence):
    """Displacements of balls, or of tips, which are those of balls with the opposite sign.

    `place` has the index of each by the indices of its `levels`, -1 without one.
    """

    levels: tuple[Level, ...]
    place: Integers
    listed: tuple[InfluenceParameter, ...]
    of_tips: bool = False

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        return self.listed

    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        """A tip that is further along an axis is where the ball is with less on the scale."""
        m, d = at.x.shape
        derivative = np.zeros((m, d, len(self.listed)))
        place = self.place[tuple(getattr(at, level) for level in self.levels)]
        rows = np.flatnonzero(place >= 0)
        for axis in range(d):
            derivative[rows, axis, d * place[rows] + axis] = -1.0 if self.of_tips else 1.0
        return np.zeros((m, d)), derivative


def displacements(
    design: DesignParts,
    levels: tuple[Level, ...],
    readings: Readings,
    uncertainty: float,
    words: Callable[[Mapping[Level, str]], str],
    component: str,
    of_tips: bool = False,
) -> SharedDisplacements:
    """A displacement for every combination of `levels` among some readings; `words` call one by the
    names of its position, probe and ball.
    """
    names = {
        "position": design.positions.names,
        "probe": design.probes.names,
        "ball": tuple(
            design.balls.label(k, design.artefacts.names) for k in range(len(design.balls.names))
        ),
    }
    sizes = tuple(len(names[level]) for level in levels)
    index = tuple(getattr(readings, level) for level in levels)
    used = np.unique(np.ravel_multi_index(index, sizes))
    place = np.full(int(np.prod(sizes)), -1)
    place[used] = np.arange(len(used))
    parameters = []
    for key in used.tolist():
        index_by_level = dict(zip(levels, np.unravel_index(key, sizes), strict=True))
        label = words({level: names[level][k] for level, k in index_by_level.items()})
        position = int(index_by_level.get("position", -1))
        parameters += [
            InfluenceParameter(f"{label}: {axis}", "m", 0.0, uncertainty, 1.0, position, component)
            for axis in AXIS_NAMES[: design.machine.dimension]
        ]
    return SharedDisplacements(levels, place.reshape(sizes), tuple(parameters), of_tips)
