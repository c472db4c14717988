"""Styli that are longer than stated, all by one ratio."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate import Influence
from ballplate.simulator.design import DesignParts, Disturbed, InfluenceParameter
from ballplate.simulator.experiment import InfluenceSettings
from ballplate.simulator.inputs import Ratio
from ballplate.simulator.machines import Array
from pydantic import Field


@dataclass(frozen=True)
class LongStyli(Influence):
    """The ratio by which styli are longer, and the length of the longest in metres."""

    value: float
    uncertainty: float
    longest: float

    @property
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        name = "ratio of the styli"
        return (InfluenceParameter(name, "1", self.value, self.uncertainty, self.longest),)

    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        # The tip is further out, and so the scales stop sooner.
        return -self.value * at.offsets, -at.offsets[:, :, None]


class StyliSettings(InfluenceSettings):
    """Styli that are longer than stated, all by one ratio."""

    kind: Literal["styli"] = Field(description="styli that are longer, all by one ratio")
    value: Ratio = Field(0.0, description="by which ratio; default 0 ppm")
    standard_uncertainty: Ratio | None = Field(None, description="of it; left out: unknown")

    def influence(self, design: DesignParts) -> LongStyli:
        u = np.inf if self.standard_uncertainty is None else self.standard_uncertainty
        longest = np.linalg.norm(design.probes.offsets, axis=1).max(initial=1e-3)
        return LongStyli(self.value, u, float(longest))


SETTINGS = StyliSettings
