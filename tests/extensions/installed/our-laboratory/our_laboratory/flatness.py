"""Heights of balls above the plane through three other balls of their plate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from ballplate import Design
from ballplate.simulator.design import BallObservations, Calibration
from ballplate.simulator.experiment import References
from ballplate.simulator.geometry import BallLayout, Name
from ballplate.simulator.inputs import Length, PositiveLength, Settings, Steps
from ballplate.simulator.machines import Array, Integers
from pydantic import Field


@dataclass(frozen=True)
class Heights(BallObservations):
    """Heights (m,) of balls above the plane through three others, in metres.

    `ends` (m, 4): the ball, then the three, counter-clockwise as seen from above.
    """

    word: ClassVar[str] = "height"
    scales: ClassVar[bool] = True

    ends: Integers
    value: Array
    uncertainty: Array

    @property
    def balls(self) -> Integers:
        return self.ends

    def values(self, balls: Array) -> tuple[Array, Array]:
        ball, origin, one, other = np.moveaxis(balls[..., self.ends, :], -2, 0)
        first, second, up = one - origin, other - origin, ball - origin
        normal = np.cross(first, second)
        area = np.linalg.norm(normal, axis=-1, keepdims=True)
        normal = normal / area
        height = (normal * up).sum(axis=-1)
        lever = (up - height[..., None] * normal) / area
        by_one, by_other = np.cross(second, lever), np.cross(lever, first)
        by_origin = -(normal + by_one + by_other)
        return height, np.stack([normal, by_origin, by_one, by_other], axis=-2)

    def name(self, design: Design, k: int) -> str:
        return f"height of ball {design.ball_label(int(self.ends[k, 0]))}"


@dataclass(frozen=True, eq=False)
class FlatnessCalibration(Calibration):
    """Certified heights: `ends` (m, 4) as in `Heights`, `values` (m,) in metres."""

    artefact: str
    ends: Integers
    values: Array
    certified: bool
    standard_uncertainty: float
    kind: str = "flatness"

    def observed(self, first: int) -> Heights:
        uncertainty = np.full(len(self.ends), self.standard_uncertainty)
        return Heights(self.ends + first, self.values, uncertainty)

    def names(self, layout: BallLayout) -> list[tuple[str, str]]:
        return [(layout.names[ball], "height") for ball in self.ends[:, 0]]


class FlatnessSettings(Settings):
    """Calibrated heights of balls above the plane through three others."""

    kind: Literal["flatness"] = Field(description="calibrated heights of balls above a plane")
    artefact: Name | None = Field(
        None, description="name of the artefact; optional if there is exactly one"
    )
    balls: tuple[Name, ...] = Field(description="whose heights are certified")
    plane: tuple[Name, Name, Name] = Field(description="three balls, counter-clockwise from above")
    values: tuple[Length, ...] | None = Field(None, description="heights; default: as drawn")
    standard_uncertainty: PositiveLength = Field(description="of each height")


SETTINGS = FlatnessSettings


def read(
    settings: FlatnessSettings, artefact: str, steps: Steps, references: References
) -> FlatnessCalibration | None:
    """The item that settings describe, or None after saying what is wrong with them."""
    layout = references.layouts[artefact]
    balls = references.balls(settings.balls, layout, (*steps, "balls"))
    plane = references.balls(settings.plane, layout, (*steps, "plane"))
    if balls is None or plane is None:
        return None
    text = "heights need three dimensions; remove this item"
    if not references.require(references.dimension == 3, (*steps, "kind"), text):
        return None
    text = f"has {len(settings.values or ())} lengths; give {len(balls)}, one for each ball"
    has_all = settings.values is None or len(settings.values) == len(balls)
    if not references.require(has_all, (*steps, "values"), text):
        return None
    ends = np.column_stack([balls, np.tile(plane, (len(balls), 1))]).astype(np.int64)
    values = Heights(ends, np.zeros(0), np.zeros(0)).values(layout.coordinates)[0]
    if settings.values is not None:
        values = np.array(settings.values)
    return FlatnessCalibration(
        artefact, ends, values, settings.values is not None, settings.standard_uncertainty
    )
