"""Balls evenly along a circle."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from ballplate.simulator.geometry import ArtefactSettings, BallLayout, frozen
from ballplate.simulator.inputs import PositiveLength
from pydantic import Field


class RingSettings(ArtefactSettings):
    """Balls evenly along a circle, named b1, b2, … counter-clockwise from the x axis."""

    kind: Literal["ring"] = Field(description="balls evenly along a circle")
    balls: Annotated[int, Field(ge=3, le=1000)] = Field(description="number of balls")
    diameter: PositiveLength = Field(description="of the circle through their centres")

    def layout(self) -> BallLayout:
        """Return the balls, with their neighbours and, where their number is even, diameters."""
        n = self.balls
        angles = 2 * np.pi * np.arange(n) / n
        # The lower corner of what it covers is at the origin.
        places = 0.5 * self.diameter * np.stack([1 + np.cos(angles), 1 + np.sin(angles)], axis=1)
        sets = {"neighbours": tuple((i, (i + 1) % n) for i in range(n))}
        if n % 2 == 0:
            sets["diameters"] = tuple((i, i + n // 2) for i in range(n // 2))
        names = tuple(f"b{i + 1}" for i in range(n))
        return BallLayout(names, frozen(np.pad(places, ((0, 0), (0, 1)))), sets)


SETTINGS = RingSettings
