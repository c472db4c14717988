"""Balls in one line, with the same distance from each to the next."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from ballplate.simulator.geometry import ArtefactSettings, BallLayout, frozen
from ballplate.simulator.inputs import PositiveLength
from pydantic import Field


class StepGaugeSettings(ArtefactSettings):
    """A step gauge with balls, named b1, b2, … along the artefact's x axis."""

    kind: Literal["step_gauge"] = Field(description="balls in one line at one distance")
    balls: Annotated[int, Field(ge=2, le=500)] = Field(description="number of balls")
    step: PositiveLength = Field(description="distance from each ball to the next")

    def layout(self) -> BallLayout:
        """The balls, and the pairs of them that certificates of step gauges state."""
        n = self.balls
        places = np.zeros((n, 3))
        places[:, 0] = self.step * np.arange(n)
        sets = {
            "neighbours": tuple((i, i + 1) for i in range(n - 1)),
            "from the first": tuple((0, i) for i in range(1, n)),
        }
        return BallLayout(tuple(f"b{i + 1}" for i in range(n)), frozen(places), sets)


SETTINGS = StepGaugeSettings
