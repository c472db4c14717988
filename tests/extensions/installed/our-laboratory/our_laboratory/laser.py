"""Lengths between two points of the volume, measured by a laser interferometer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from ballplate import Design, ErrorModel, Observations
from ballplate.simulator.design import Calibration, Rows, State, shared_layout
from ballplate.simulator.experiment import References
from ballplate.simulator.geometry import BallLayout
from ballplate.simulator.inputs import Length, PositiveLength, Settings, Steps
from ballplate.simulator.machines import Array
from pydantic import Field


@dataclass(frozen=True)
class LaserLengths(Observations):
    """Lengths (m,) between points whose scale readings are `start` and `end` (m, d), in metres."""

    word: ClassVar[str] = "laser length"

    start: Array
    end: Array
    value: Array
    uncertainty: Array

    def lengths(self, model: ErrorModel, a: Array) -> tuple[Array, Array]:
        """Lengths (m,) on a machine with parameters `a`, and derivatives (m, n) by these."""
        none = np.zeros(self.start.shape)  # the reflector is at the reference point of the probes
        first, last = (p + model.error(p, a, none) for p in (self.start, self.end))
        slopes = model.jacobian(self.end, a, none) - model.jacobian(self.start, a, none)
        length = np.linalg.norm(last - first, axis=1)
        return length, np.einsum("md,mdn->mn", (last - first) / length[:, None], slopes)

    def rows(self, design: Design, state: State, x: Array | None) -> Rows:
        layout = design.once(shared_layout)  # columns of poses, the machine, probe offsets …
        length, by_model = self.lengths(design.model, state.a)
        by_shared = np.zeros((len(self), len(layout)))
        by_shared[:, layout.model] = by_model
        by_no_ball = np.zeros((len(self), 0, design.dimension))
        return Rows(self.whitened(length - self.value), self.whitened(by_shared), by_no_ball)

    def true_values(self, design: Design, truth: State, model: ErrorModel) -> Array:
        return self.lengths(model, truth.a)[0]

    def name(self, design: Design, k: int) -> str:
        return f"laser length {k + 1}"


@dataclass(frozen=True, eq=False)
class LaserCalibration(Calibration):
    """One length: `start` and `end` (1, d), and its `values` (1,) in metres."""

    start: Array
    end: Array
    values: Array
    certified: bool
    standard_uncertainty: float
    artefact: str = ""  # of none, but of the machine
    kind: str = "laser"

    def observed(self, first: int) -> LaserLengths:
        uncertainty = np.array([self.standard_uncertainty])
        return LaserLengths(self.start, self.end, self.values, uncertainty)

    def names(self, layout: BallLayout) -> list[tuple[str, str]]:
        return [("laser", "length")]


class LaserSettings(Settings):
    """A length between two points of the volume, by a laser interferometer."""

    kind: Literal["laser"] = Field(description="a length between two points, by a laser")
    start: tuple[Length, ...] = Field(description="scale readings where it begins")
    end: tuple[Length, ...] = Field(description="scale readings where it ends")
    value: PositiveLength | None = Field(None, description="length; default: that of the scales")
    standard_uncertainty: PositiveLength = Field(description="of the length")


SETTINGS = LaserSettings


def read(
    settings: LaserSettings, artefact: str, steps: Steps, references: References
) -> LaserCalibration | None:
    """The item that settings describe, or None after saying what is wrong with them."""
    ends = {"start": settings.start, "end": settings.end}
    if not all([references.is_in_volume(point, (*steps, key)) for key, point in ends.items()]):
        return None
    text = "is where the length starts; give another point"
    if not references.require(settings.start != settings.end, (*steps, "end"), text):
        return None
    start, end = np.array([settings.start]), np.array([settings.end])
    by_scales = np.linalg.norm(end - start, axis=1)
    values = by_scales if settings.value is None else np.array([settings.value])
    certified, u = settings.value is not None, settings.standard_uncertainty
    return LaserCalibration(start, end, values, certified, u)
