"""Axes of a plate, defined by two of its balls: the origin and a ball on one axis.

They make co-ordinates from fits in different frames comparable (NBSIR 79-1752, section 2). The
axes are two-dimensional.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Self

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.quantity_types import Angle
from ballplate.simulator.inputs.settings import Forms, Settings
from pydantic import Field, model_validator

from .ball_layouts import AxesSettings, BallLayout

# A ball nominally this near to an axis, as a fraction of its distance from the origin, is meant to
# be on it.
ON_AXIS = 1e-6


@dataclass(frozen=True)
class PlateAxes:
    """The balls at the origin and on axis 0 (x) or 1 (y); `sign` -1: on its negative half."""

    origin: int
    ball: int
    axis: int
    sign: float = 1.0


def plate_axes(layout: BallLayout, settings: AxesSettings | None = None) -> PlateAxes | None:
    """Return the stated axes of a plate or default ones; ``None`` for a single ball.

    By default the first ball is the origin, and the axis goes through the farthest ball that
    nominally lies on x, otherwise on y. If no ball lies on either, the x axis goes through the
    ball farthest along x.

    :raises KeyError: a stated ball is not in the layout.

    >>> layout = BallLayout(("a", "b", "c"), np.array([[0.0, 0, 0], [0, 0.2, 0], [0.3, 0.1, 0]]))
    >>> plate_axes(layout)
    PlateAxes(origin=0, ball=1, axis=1, sign=1.0)
    >>> plate_axes(layout, AxesSettings(origin="b", x="c"))
    PlateAxes(origin=1, ball=2, axis=0, sign=1.0)
    """
    if len(layout.names) < 2:
        return None
    index = {name: i for i, name in enumerate(layout.names)}
    if settings is not None:
        axis = 0 if settings.x is not None else 1
        origin, ball = index[settings.origin], index[str(settings.x if axis == 0 else settings.y)]
    else:
        origin = 0
        ball, axis = _farthest(layout.coordinates[:, :2] - layout.coordinates[0, :2])
    along = layout.coordinates[ball, axis] - layout.coordinates[origin, axis]
    return PlateAxes(origin, ball, axis, -1.0 if along < 0.0 else 1.0)


def _farthest(offsets: Array) -> tuple[int, int]:
    """Return the ball that fixes an axis best, and the axis, from offsets (n, 2) to the origin."""
    distance = np.linalg.norm(offsets, axis=1)
    for axis in (0, 1):
        on_axis = np.abs(offsets[:, 1 - axis]) <= ON_AXIS * distance
        reach = np.where(on_axis, np.abs(offsets[:, axis]), 0.0)
        if reach.max() > 0.0:
            return int(reach.argmax()), axis
    return int(np.abs(offsets[:, 0]).argmax()), 0


def axes_words(axes: PlateAxes, names: tuple[str, ...]) -> str:
    """Return a description of the axes.

    >>> axes_words(PlateAxes(0, 1, 1), ("a", "b"))
    'origin: ball a, y axis through ball b'
    """
    return (
        f"origin: ball {names[axes.origin]}, {'xy'[axes.axis]} axis through ball {names[axes.ball]}"
    )


def in_plate_axes(balls: Array, axes: PlateAxes) -> tuple[Array, Array]:
    """Return co-ordinates (n, 2) of balls (n, 2) in the plate's axes, and their rotation (2, 2).

    >>> in_plate_axes(np.array([[1.0, 1.0], [1.0, 3.0]]), PlateAxes(0, 1, 0))[0].tolist()
    [[0.0, 0.0], [2.0, 0.0]]
    """
    moved = balls - balls[axes.origin]
    along = axes.sign * moved[axes.ball]
    c, s = along / np.hypot(*along)
    to_x = np.array([[c, s], [-s, c]])
    rotation = to_x if axes.axis == 0 else np.array([[s, -c], [c, s]])
    turned = moved @ rotation.T
    # Zero by definition.
    turned[axes.ball, 1 - axes.axis] = 0.0
    return turned, rotation


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
