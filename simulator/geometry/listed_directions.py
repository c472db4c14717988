"""Directions in space, listed or on a grid, by azimuth about z from x and elevation."""

from __future__ import annotations

from typing import Annotated, Self

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.quantity_types import Angle
from ballplate.simulator.inputs.settings import Forms, Settings
from pydantic import Field, model_validator

MOST_DIRECTIONS = 5000
UPRIGHT = 0.5 * np.pi


class GeneratedDirectionsSettings(Settings):
    """Directions on a grid of azimuths and elevations."""

    azimuths: Annotated[int, Field(ge=1, le=360)] = Field(
        description="number of azimuths around z, the first along x"
    )
    elevations: Annotated[tuple[Angle, ...], Field(min_length=1, max_length=180)] = Field(
        description="elevations above the xy plane; at 90 deg there is one direction"
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        count = self.azimuths * len(self.elevations)
        if count > MOST_DIRECTIONS:
            raise ValueError(
                f"{count} directions are too many; at most {MOST_DIRECTIONS} are possible"
            )
        if any(abs(angle) > UPRIGHT for angle in self.elevations):
            raise ValueError("an elevation is outside -90 deg to 90 deg; give one of that range")
        return self


Listed = Annotated[
    tuple[Annotated[tuple[Angle, Angle], Field()], ...],
    Field(min_length=1, max_length=MOST_DIRECTIONS),
]
DirectionsSettings = Forms[GeneratedDirectionsSettings, Listed, GeneratedDirectionsSettings]
DIRECTIONS = (
    "azimuth about z from x and elevation above the xy plane: a list of [azimuth, elevation], or"
    " {azimuths: 8, elevations: [0 deg, 30 deg, 60 deg]}"
)


def directions(
    settings: GeneratedDirectionsSettings | tuple[tuple[float, float], ...],
) -> Array:
    """Return unit vectors (m, 3).

    >>> directions(((0.0, 0.0), (np.pi / 2, 0.0))).round(9).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """
    if isinstance(settings, tuple):
        return _unit_vectors(np.array(settings))
    count = settings.azimuths
    pairs = [
        (2 * np.pi * k / count, elevation)
        for elevation in settings.elevations
        for k in range(1 if abs(elevation) > UPRIGHT - 1e-9 else count)
    ]
    return _unit_vectors(np.array(pairs))


def _unit_vectors(angles: Array) -> Array:
    azimuth, elevation = angles.T
    flat = np.cos(elevation)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=1)
