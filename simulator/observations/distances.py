"""Calibrated distances between balls of a plate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..design.arrays import Design, Words
from ..machines.protocol import Array, Integers
from .balls import BallObservations


@dataclass(frozen=True)
class Distances(BallObservations):
    """Calibrated distances between two balls of an artefact; arrays (m,), lengths in metres.

    `dimensions` is 2 where only the first two co-ordinates of the artefact's frame count.
    """

    word: ClassVar[str] = "distance"
    scales: ClassVar[bool] = True
    words: ClassVar[Words] = Words("certified", "long", "short")

    first: Integers
    second: Integers
    dimensions: Integers
    value: Array
    uncertainty: Array

    @property
    def balls(self) -> Integers:
        return np.stack([self.first, self.second], axis=1)

    def values(self, balls: Array) -> tuple[Array, Array]:
        difference = balls[..., self.first, :] - balls[..., self.second, :]
        difference = difference * (np.arange(balls.shape[-1]) < self.dimensions[:, None])
        length = np.sqrt((difference**2).sum(axis=-1))
        along = difference / length[..., None]
        return length, np.stack([along, -along], axis=-2)

    def name(self, design: Design, k: int) -> str:
        first, second = int(self.first[k]), int(self.second[k])
        return f"distance {design.ball_label(first)} to {design.ball_names[second]}"
