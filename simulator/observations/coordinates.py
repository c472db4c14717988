"""Calibrated co-ordinates of balls in the frame of their plate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..design.arrays import Design
from ..estimation.parameters import AXIS_NAMES
from ..machines.protocol import Array, Integers
from .balls import BallObservations


@dataclass(frozen=True)
class Coordinates(BallObservations):
    """Calibrated ball co-ordinates in the artefact's frame; arrays (m,), metres."""

    word: ClassVar[str] = "coordinate"
    scales: ClassVar[bool] = True

    ball: Integers
    axis: Integers
    value: Array
    uncertainty: Array

    @property
    def balls(self) -> Integers:
        return self.ball[:, None]

    @property
    def along(self) -> Integers:
        return self.axis

    def values(self, balls: Array) -> tuple[Array, Array]:
        return balls[..., self.ball, self.axis], np.eye(balls.shape[-1])[self.axis][:, None]

    def name(self, design: Design, k: int) -> str:
        return f"{AXIS_NAMES[self.axis[k]]} of ball {design.ball_label(int(self.ball[k]))}"

    def fixing(self) -> tuple[Integers, Integers]:
        return self.ball, self.axis
