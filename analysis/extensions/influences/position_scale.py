"""Scale of a position: in each position all lengths of an artefact seem longer, or shorter, by a
ratio of their own.

A ball at R y + o is found at R y + o + s R y, or with s for each axis; s is the same for all
readings of a position. Temperatures that were not measured do that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate.simulator.design import DesignParts, Disturbed, Influence, InfluenceParameter
from ballplate.simulator.experiment import InfluenceSettings, References
from ballplate.simulator.geometry import AXIS_NAMES, Name
from ballplate.simulator.inputs import NonEmpty, Ratio, Steps
from ballplate.simulator.machines import Array, Integers
from pydantic import Field

from .temperature import or_unknown

# Balls of a position that extend along an axis by less than this, in metres, tell nothing of the
# scale there.
LEAST_EXTENT = 1e-3


class PositionScaleSettings(InfluenceSettings):
    """Variation of scales from position to position."""

    kind: Literal["position scale"] = Field(description="scale error of each position")
    standard_uncertainty: Ratio | None = Field(
        None,
        description="of the scale in each position, independent of all others; left out: unknown",
    )
    by_axis: bool = Field(
        False,
        description=(
            "whether the scale of each axis varies separately; default: all vary together"
        ),
    )
    positions: NonEmpty[Name] | None = Field(
        None, description="positions whose scale varies; default: all"
    )

    def check(self, steps: Steps, positions: Mapping[str, str], references: References) -> None:
        """Report unknown positions and an uncertainty below zero."""
        for i, name in enumerate(self.positions or ()):
            references.is_position(name, positions, (*steps, "positions", i))
        references.is_not_negative(self.standard_uncertainty, (*steps, "standard_uncertainty"))

    def influence(self, design: DesignParts) -> PositionScale:
        """The scales in a design."""
        u = or_unknown(self.standard_uncertainty)
        names, d = design.positions.names, design.machine.dimension
        place = np.full((len(names), d), -1)
        parameters: list[InfluenceParameter] = []
        for k in np.unique(design.readings.position).tolist():
            if names[k] not in (self.positions or names):
                continue
            is_at_position = design.readings.position == k
            balls = design.balls.places[np.unique(design.readings.ball[is_at_position])]
            arms = balls @ design.positions.rotations[k].T
            extent = arms.max(axis=0) - arms.min(axis=0)
            reach = float(np.abs(arms).max(initial=LEAST_EXTENT))
            for axes in [[axis] for axis in range(d)] if self.by_axis else [list(range(d))]:
                if extent[axes].max() < LEAST_EXTENT:
                    continue
                place[k, axes] = len(parameters)
                name = f"scale {AXIS_NAMES[axes[0]]}" if self.by_axis else "scale"
                words = f"{name} in {names[k]}"
                parameters.append(
                    InfluenceParameter(words, "1", 0.0, u, reach, k, "scales of positions")
                )
        return PositionScale(place, tuple(parameters))


@dataclass(frozen=True)
class PositionScale(Influence):
    """Scales of positions; `place` (k, d) is the parameter index of each position and axis,
    or -1.
    """

    place: Integers
    listed: tuple[InfluenceParameter, ...]

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        return self.listed

    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        """Balls are found farther from the origin of their artefact."""
        arms = at.arms
        derivative = np.zeros((*arms.shape, len(self.listed)))
        for axis in range(arms.shape[1]):
            place = self.place[at.position, axis]
            rows = np.flatnonzero(place >= 0)
            derivative[rows, axis, place[rows]] = arms[rows, axis]
        return np.zeros(arms.shape), derivative


SETTINGS = PositionScaleSettings
