"""Directions in space, listed, on a grid or at random: azimuth about z from x, elevation above the
xy plane.
"""

from __future__ import annotations

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from ..inputs.number_arrays import Array
from ..inputs.quantities import Angle
from ..inputs.settings import Forms, Settings

MOST_DIRECTIONS = 5000
UPRIGHT = 0.5 * np.pi
LISTED = ("azimuths", "elevations")
DRAWN = ("lowest", "highest", "seed")


class GeneratedDirectionsSettings(Settings):
    """Directions on a grid of azimuths and elevations, or drawn evenly from a zone of the
    sphere.
    """

    azimuths: Annotated[int, Field(ge=1, le=360)] | None = Field(
        None, description="of a grid: number of azimuths around z, the first along x"
    )
    elevations: Annotated[tuple[Angle, ...], Field(min_length=1, max_length=180)] | None = Field(
        None,
        description="of a grid: elevations above the xy plane; at 90 deg there is one direction",
    )
    random: Annotated[int, Field(ge=1, le=MOST_DIRECTIONS)] | None = Field(
        None, description="number of directions drawn evenly from the zone, instead of a grid"
    )
    lowest: Angle | None = Field(None, description="of random ones: least elevation; default 0 deg")
    highest: Angle | None = Field(
        None, description="of random ones: largest elevation; default 90 deg"
    )
    seed: Annotated[int, Field(ge=0, strict=True)] | None = Field(
        None, description="seed of random ones; default 1"
    )

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        stated_keys = [key for key in (*LISTED, "random", *DRAWN) if getattr(self, key) is not None]
        if self.random is None and not set(LISTED) <= set(stated_keys):
            raise ValueError(
                "needs either azimuths and elevations, or random; write {random: 60, lowest: 20"
                " deg}"
            )
        misplaced = [
            key for key in stated_keys if key in (DRAWN if self.random is None else LISTED)
        ]
        if misplaced:
            kind = "a grid" if self.random is None else "random directions"
            raise ValueError(f'"{misplaced[0]}" has no meaning with {kind}; remove it')
        lowest, highest = self._zone()
        count = (self.azimuths or 0) * len(self.elevations or ())
        if count > MOST_DIRECTIONS:
            raise ValueError(
                f"{count} directions are too many; at most {MOST_DIRECTIONS} are possible"
            )
        if any(abs(angle) > UPRIGHT for angle in (*(self.elevations or ()), lowest, highest)):
            raise ValueError("an elevation is outside -90 deg to 90 deg; give one of that range")
        if self.random is not None and lowest >= highest:
            raise ValueError(
                "the least elevation must be below the largest; exchange or correct them"
            )
        return self

    def _zone(self) -> tuple[float, float]:
        return (
            0.0 if self.lowest is None else self.lowest,
            UPRIGHT if self.highest is None else self.highest,
        )


Listed = Annotated[
    tuple[Annotated[tuple[Angle, Angle], Field()], ...],
    Field(min_length=1, max_length=MOST_DIRECTIONS),
]
DirectionsSettings = Forms[GeneratedDirectionsSettings, Listed, GeneratedDirectionsSettings]
DIRECTIONS = (
    "azimuth about z from x and elevation above the xy plane: a list of [azimuth, elevation],"
    " {azimuths: 8, elevations: [0 deg, 30 deg, 60 deg]}, or {random: 60, lowest: 20 deg, highest:"
    " 90 deg, seed: 1}"
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
    if settings.random is not None:
        generator = np.random.default_rng(
            np.random.SeedSequence(1 if settings.seed is None else settings.seed)
        )
        turn, height = generator.random((2, settings.random))
        # Zones of equal height on a sphere have equal areas.
        low, high = np.sin(settings._zone())
        return _unit_vectors(
            np.column_stack([2 * np.pi * turn, np.arcsin(low + (high - low) * height)])
        )
    count, elevations = settings.azimuths or 1, settings.elevations or ()
    pairs = [
        (2 * np.pi * k / count, elevation)
        for elevation in elevations
        for k in range(1 if abs(elevation) > UPRIGHT - 1e-9 else count)
    ]
    return _unit_vectors(np.array(pairs))


def _unit_vectors(angles: Array) -> Array:
    azimuth, elevation = angles.T
    flat = np.cos(elevation)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=1)
