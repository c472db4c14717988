"""Angles at a ball between two others, in radians."""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from ballplate.simulator.design import BallObservations, Calibration
from ballplate.simulator.geometry import Name
from ballplate.simulator.inputs import PositiveAngle, Settings


@dataclass(frozen=True)
class Angles(BallObservations):
    word: ClassVar[str] = "angle"
    measured_in: ClassVar[str] = "rad"
    ends: np.ndarray
    value: np.ndarray
    uncertainty: np.ndarray

    @property
    def balls(self):
        return self.ends

    def values(self, balls):
        first, vertex, second = np.moveaxis(balls[..., self.ends, :], -2, 0)
        legs = [first - vertex, second - vertex]
        lengths = [np.linalg.norm(leg, axis=-1, keepdims=True) for leg in legs]
        one, other = (leg / length for leg, length in zip(legs, lengths, strict=True))
        cosine = (one * other).sum(axis=-1, keepdims=True)
        sine = np.sqrt(1.0 - cosine**2)
        by_first = (cosine * one - other) / (sine * lengths[0])
        by_second = (cosine * other - one) / (sine * lengths[1])
        slopes = np.stack([by_first, -by_first - by_second, by_second], axis=-2)
        return np.arccos(cosine[..., 0]), slopes

    def name(self, design, k):
        return f"angle at ball {design.ball_label(int(self.ends[k, 1]))}"


@dataclass(frozen=True, eq=False)
class CornerCalibration(Calibration):
    artefact: str
    ends: np.ndarray
    values: np.ndarray
    certified: bool
    standard_uncertainty: float
    kind: str = "corner"

    def observed(self, first):
        uncertainty = np.full(len(self.ends), self.standard_uncertainty)
        return Angles(self.ends + first, self.values, uncertainty)

    def names(self, layout):
        return [(layout.names[ends[1]], "angle") for ends in self.ends]


class CornerSettings(Settings):
    kind: Literal["corner"]
    artefact: Name | None = None
    balls: tuple[Name, ...]
    standard_uncertainty: PositiveAngle


SETTINGS = CornerSettings


def read(settings, artefact, steps, references):
    layout = references.layouts[artefact]
    found = [layout.names.index(ball) for ball in settings.balls]
    ends = np.array(found, np.int64).reshape(-1, 3)
    values = Angles(ends, np.zeros(0), np.zeros(0)).values(layout.coordinates)[0]
    return CornerCalibration(artefact, ends, values, False, settings.standard_uncertainty)
