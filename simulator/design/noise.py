"""Distribution of the noise of generated readings: simulation and Monte Carlo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from pydantic import Field

from ..inputs.settings import Settings
from ..machines.protocol import Integers

Precision = type[np.float32] | type[np.float64]
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
        dtype: Precision = np.float64,
    ) -> Any:
        """Noise of a `shape` whose `axis` counts readings, made in `position` (m,)."""
        noise = self._independent(generator, shape, dtype)
        if not self.correlation:
            return noise
        names, place = np.unique(position, return_inverse=True)
        of_positions = [*shape]
        of_positions[axis] = len(names)
        common = generator.standard_normal(of_positions).astype(dtype)
        noise *= np.sqrt(1.0 - self.correlation)
        noise += np.sqrt(self.correlation) * np.take(common, place.ravel(), axis)
        return noise.astype(dtype, copy=False)

    def _independent(
        self, generator: np.random.Generator, shape: tuple[int, ...], dtype: Precision
    ) -> Any:
        if self.distribution == "normal":
            return generator.standard_normal(shape, dtype)
        if self.distribution == "uniform":
            half = np.sqrt(3.0)
            return generator.uniform(-half, half, shape).astype(dtype, copy=False)
        nu = self.degrees_of_freedom
        return (generator.standard_t(nu, shape) * np.sqrt(1.0 - 2.0 / nu)).astype(dtype, copy=False)
