"""Reproducibility: readings that have something in common, such as their position and their ball,
are displaced together.

Of readings repeated in one go the repeatability is what they scatter by; from one position, probe
or ball to the next more may change. There is one displacement for each combination of what is
stated, drawn anew along each axis: a ball at R y + o is found at R y + o + v.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from ...geometry.motions import AXIS_NAMES
from ...inputs.messages import Steps
from ...inputs.quantities import Length
from ...inputs.settings import NonEmpty
from ...machines.protocol import Array, Integers
from ..lookup import References
from .protocol import DesignParts, Disturbed, Influence, InfluenceParameter, InfluenceSettings

Level = Literal["position", "probe", "ball"]


class ReproducibilitySettings(InfluenceSettings):
    """How well readings agree beyond their repeatability."""

    kind: Literal["reproducibility"] = Field(description="displacements that readings share")
    each: NonEmpty[Level] = Field(
        description=(
            "what has a displacement of its own: each combination of position, probe and ball, such"
            " as [position, ball]"
        )
    )
    standard_uncertainty: Length = Field(
        description="standard deviation of the displacements along each axis"
    )

    def check(self, steps: Steps, positions: Mapping[str, str], references: References) -> None:
        """Report what stands there twice, displacements that nobody can see, and an uncertainty
        below zero.
        """
        references.require(
            len(set(self.each)) == len(self.each),
            (*steps, "each"),
            "has one of them twice; name each once",
        )
        references.require(
            self.each != ("position",),
            (*steps, "each"),
            "a displacement of a whole position is part of its pose; add probe or ball",
        )
        references.require(
            self.standard_uncertainty >= 0.0,
            (*steps, "standard_uncertainty"),
            "is below zero; give it without the sign",
        )

    def influence(self, design: DesignParts) -> Reproducibility:
        """The displacements in a design: of every combination that is read."""
        d, levels = design.machine.dimension, tuple(self.each)
        names = {
            "position": design.positions.names,
            "probe": design.probes.names,
            "ball": design.balls.names,
        }
        sizes = tuple(len(names[level]) for level in levels)
        index = tuple(getattr(design.readings, level) for level in levels)
        used = np.unique(np.ravel_multi_index(index, sizes))
        place = np.full(int(np.prod(sizes)), -1)
        place[used] = np.arange(len(used))
        parameters = []
        for key in used.tolist():
            at = dict(zip(levels, np.unravel_index(key, sizes), strict=True))
            words = ", ".join(
                f"{'ball ' if level == 'ball' else ''}{names[level][k]}" for level, k in at.items()
            )
            parameters += [
                InfluenceParameter(
                    f"displacement of {words}: {axis}",
                    "m",
                    0.0,
                    self.standard_uncertainty,
                    1.0,
                    int(at.get("position", -1)),
                    f"displacements by {' and '.join(levels)}",
                )
                for axis in AXIS_NAMES[:d]
            ]
        return Reproducibility(levels, place.reshape(sizes), tuple(parameters))


@dataclass(frozen=True)
class Reproducibility(Influence):
    """Displacements; `place` has the number of each by the indices of its `levels`, -1 without
    one.
    """

    levels: tuple[Level, ...]
    place: Integers
    listed: tuple[InfluenceParameter, ...]

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        return self.listed

    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        m, d = at.x.shape
        derivative = np.zeros((m, d, len(self.listed)))
        place = self.place[tuple(getattr(at, level) for level in self.levels)]
        rows = np.flatnonzero(place >= 0)
        for axis in range(d):
            derivative[rows, axis, d * place[rows] + axis] = 1.0
        return np.zeros((m, d)), derivative
