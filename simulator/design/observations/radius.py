"""The calibrated radius of a Bryan gauge, which is among the lengths that are read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from ballplate.simulator.geometry.ball_layouts import BallLayout
from ballplate.simulator.machines.protocol import Array, ErrorModel

from ..arrays import Design, State
from .calibration import Calibration, CertifiedValue


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
