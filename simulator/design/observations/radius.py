"""The calibrated radius of a Bryan gauge, which is among the lengths that are read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from ballplate.simulator.geometry.artefacts import BryanGaugeSettings
from ballplate.simulator.geometry.ball_layouts import BallLayout, Name
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.quantity_types import LengthUncertainty, PositiveLength
from ballplate.simulator.inputs.settings import Settings
from ballplate.simulator.machines.protocol import Array, ErrorModel
from pydantic import Field

from ..arrays import Design, State
from ..lookup import References
from .calibration import FAR_FROM_DRAWING, Calibration, CertifiedValue, far_from_drawing


@dataclass(frozen=True, eq=False)
class RadiusCalibration(Calibration):
    """The calibrated radius of a Bryan gauge: ``value`` and ``standard_uncertainty`` in metres."""

    artefact: str
    value: float
    standard_uncertainty: float
    kind: Literal["radius"] = "radius"

    @property
    def size(self) -> int:
        return 1

    def certified_values(self, layout: BallLayout) -> Iterator[CertifiedValue]:
        drawn = float(np.sqrt((layout.coordinates[0] ** 2).sum()))
        yield CertifiedValue(
            "", self.artefact, "radius", self.value, self.standard_uncertainty, drawn=drawn
        )

    def true_values(self, design: Design, truth: State, model: ErrorModel, first: int) -> Array:
        return np.sqrt((truth.balls[first : first + 1] ** 2).sum(axis=1))

    def with_values(self, values: Array) -> RadiusCalibration:
        return replace(self, value=float(values[0]))


class RadiusSettings(Settings):
    """The calibrated radius of a Bryan gauge."""

    kind: Literal["radius"] = Field(description="calibrated radius of a Bryan gauge")
    artefact: Name | None = Field(
        None, description="name of the gauge; optional if there is exactly one artefact"
    )
    value: PositiveLength | None = Field(
        None, description="calibrated radius; default: nominal radius"
    )
    standard_uncertainty: LengthUncertainty = Field(
        description="of the radius, the same in all positions of the gauge; 0 um if it is exact"
    )


def read_radius(
    settings: RadiusSettings, artefact: str, steps: Steps, references: References
) -> RadiusCalibration | None:
    gauge = references.artefacts[artefact]
    if not isinstance(gauge, BryanGaugeSettings):
        text = f'only a Bryan gauge has a radius, and "{artefact}" is not one; use kind: distances'
        references.problems.add((*steps, "kind"), text)
        return None
    value = gauge.radius if settings.value is None else settings.value
    text = f"{far_from_drawing(value, gauge.radius)}; correct one of the two"
    if not references.require(
        abs(value - gauge.radius) <= FAR_FROM_DRAWING * gauge.radius, (*steps, "value"), text
    ):
        return None
    return RadiusCalibration(artefact, value, settings.standard_uncertainty)
