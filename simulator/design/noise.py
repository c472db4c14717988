"""Distribution of the noise of generated readings: simulation and Monte Carlo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate.simulator.inputs.settings import Settings
from ballplate.simulator.machines.protocol import Array, Integers
from pydantic import Field

Distribution = Literal["normal", "uniform", "student t"]


class NoiseSettings(Settings):
    """Distribution of the noise of readings; its standard deviation is their uncertainty."""

    distribution: Distribution = Field(
        "normal", description="normal, uniform or student t; default: normal"
    )
    degrees_of_freedom: float | None = Field(
        None, gt=2, le=1e6, description="of student t; the fewer, the heavier are the tails"
    )
    correlation: float = Field(
        0.0,
        ge=0,
        lt=1,
        description="of the noise along an axis of any two readings in one position; default: 0",
    )


@dataclass(frozen=True)
class Noise:
    """Noise of unit variance: normal, uniform, or of Student's t with `degrees_of_freedom`.

    Readings of a position share a normal component along each axis, of variance `correlation`.
    """

    distribution: Distribution = "normal"
    degrees_of_freedom: float = np.inf
    correlation: float = 0.0

    def draw(
        self,
        generator: np.random.Generator,
        shape: tuple[int, ...],
        position: Integers,
        axis: int,
    ) -> Array:
        """Noise of a `shape` whose `axis` counts readings, made in `position` (m,)."""
        noise = self._independent(generator, shape)
        if not self.correlation:
            return noise
        names, place = np.unique(position, return_inverse=True)
        of_positions = [*shape]
        of_positions[axis] = len(names)
        common = generator.standard_normal(of_positions)
        shared = np.sqrt(self.correlation) * np.take(common, place.ravel(), axis)
        return np.sqrt(1.0 - self.correlation) * noise + shared

    def _independent(self, generator: np.random.Generator, shape: tuple[int, ...]) -> Array:
        if self.distribution == "normal":
            return generator.standard_normal(shape)
        if self.distribution == "uniform":
            return generator.uniform(-np.sqrt(3.0), np.sqrt(3.0), shape)
        nu = self.degrees_of_freedom
        return generator.standard_t(nu, shape) * np.sqrt(1.0 - 2.0 / nu)
