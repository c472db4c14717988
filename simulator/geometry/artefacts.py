"""Artefacts: their keys in an experiment file and the co-ordinates of their balls.

A new artefact of the kernel is one file with a subclass of `ArtefactSettings` that has a
``layout``, and one line in ``ARTEFACTS``; extensions provide their own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Literal, Self, Union

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.quantity_types import Angle, PositiveLength
from ballplate.simulator.inputs.settings import Forms, Name, Settings
from ballplate.simulator.inputs.validation import OpenKinds
from pydantic import Discriminator, Field, Tag, model_validator

from .ball_layouts import (
    MOST_BALLS,
    ArtefactSettings,
    BallLayout,
    BallsPerSide,
    Coordinates,
    frozen,
)

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


class GridSettings(ArtefactSettings):
    """Balls in rows and columns, r1c1 at the lower corner."""

    kind: Literal["grid"] = Field(description="balls in rows and columns")
    balls: tuple[BallsPerSide, BallsPerSide] = Field(
        description="number of columns, number of rows"
    )
    size: tuple[PositiveLength, PositiveLength] = Field(
        description="distance between the outer balls along the artefact's x and y"
    )

    @model_validator(mode="after")
    def _not_too_many_balls(self) -> Self:
        if self.balls[0] * self.balls[1] > MOST_BALLS:
            raise ValueError(
                f"{self.balls[0] * self.balls[1]} balls are too many; at most {MOST_BALLS} are"
                " possible"
            )
        return self

    def layout(self) -> BallLayout:
        """Return (columns × rows) balls, row by row."""
        columns, rows = self.balls
        cells = [(row, column) for row in range(rows) for column in range(columns)]
        return _rectangle(cells, (columns, rows), self.size)


class SquareSettings(ArtefactSettings):
    """Balls along the outline of a square, named as those of a grid."""

    kind: Literal["square"] = Field(description="balls along the outline of a square")
    balls: BallsPerSide = Field(description="number of balls per side, corners included")
    size: PositiveLength = Field(description="distance between two neighbouring corner balls")

    def layout(self) -> BallLayout:
        """Return 4 × (balls per side - 1) balls, row by row."""
        last = self.balls - 1
        cells = [
            (row, column)
            for row in range(self.balls)
            for column in (range(self.balls) if row in (0, last) else (0, last))
        ]
        return _rectangle(cells, (self.balls, self.balls), (self.size, self.size))


def _form_of_coordinates(value: object) -> str:
    return "<mapping>" if isinstance(value, dict) else "<list>"


class BallsSettings(ArtefactSettings):
    """Balls at listed co-ordinates."""

    kind: Literal["balls"] = Field(description="balls at listed co-ordinates")
    coordinates: (
        Annotated[
            Annotated[
                tuple[Coordinates, ...], Field(min_length=1, max_length=MOST_BALLS), Tag("<list>")
            ]
            | Annotated[
                dict[Name, Coordinates],
                Field(min_length=1, max_length=MOST_BALLS),
                Tag("<mapping>"),
            ],
            Discriminator(_form_of_coordinates),
        ]
        | None
    ) = Field(
        None,
        description=(
            "2 or 3 co-ordinates per ball, the third 0 if omitted: a list (balls named 1, 2, …) "
            "or name → co-ordinates"
        ),
    )
    file: str | None = Field(
        None,
        description=(
            "CSV file instead of co-ordinates: columns ball, x_mm, y_mm and, if needed, z_mm"
        ),
    )

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.coordinates is None) == (self.file is None):
            raise ValueError(
                'neither or both of "coordinates" and "file" are given; give exactly one'
            )
        return self

    def layout(self) -> BallLayout:
        """Return the balls as listed.

        :raises ValueError: the co-ordinates are still in a file.
        """
        if self.coordinates is None:
            raise ValueError(f"the co-ordinates of the balls are still in {self.file}")
        if isinstance(self.coordinates, dict):
            names, listed = tuple(self.coordinates), tuple(self.coordinates.values())
        else:
            names, listed = (
                tuple(str(i + 1) for i in range(len(self.coordinates))),
                self.coordinates,
            )
        return BallLayout(names, frozen([(*xyz, 0.0)[:3] for xyz in listed]))


class TwoSpheresSettings(ArtefactSettings):
    """Two balls along the artefact's x axis, named 1 and 2."""

    kind: Literal["two_spheres"] = Field(description="two balls, as of a ball bar")
    length: PositiveLength = Field(description="distance between the two balls")

    def layout(self) -> BallLayout:
        """Return two balls; their only pair is in every set."""
        only = ((0, 1),)
        return BallLayout(
            ("1", "2"),
            frozen([(0.0, 0.0, 0.0), (self.length, 0.0, 0.0)]),
            {"corner sides": only, "neighbours": only},
            (0, 1),
        )


class SphereSettings(ArtefactSettings):
    """A single ball, named 1, such as the reference sphere for qualifying probes."""

    kind: Literal["sphere"] = Field(description="a single ball, as the reference sphere of probes")

    def layout(self) -> BallLayout:
        """Return one ball at the origin of its own frame."""
        return BallLayout(("1",), frozen([(0.0, 0.0, 0.0)]))


class BryanGaugeSettings(ArtefactSettings):
    """A ball at the end of a bar that pivots about a fixed ball, which is not read."""

    kind: Literal["bryan_gauge"] = Field(
        description="a ball on a bar that pivots about a fixed ball"
    )
    role: Literal["plate", "length_standard"] = Field(
        "length_standard", description="length_standard: a Bryan gauge has only its radius"
    )
    radius: PositiveLength = Field(description="nominal distance between the two balls")
    directions: DirectionsSettings = Field(  # type: ignore[valid-type,unused-ignore]
        description=f"of the bar at each reading of its ball, named 1, 2, …: {DIRECTIONS}"
    )

    @model_validator(mode="after")
    def _no_plate(self) -> Self:
        if self.role == "plate":
            raise ValueError("a Bryan gauge is a length standard, not a plate; remove its role")
        return self

    def layout(self) -> BallLayout:
        """Return the read points of the ball, about the pivot."""
        centres = self.radius * directions(self.directions)
        return BallLayout(tuple(str(i + 1) for i in range(len(centres))), frozen(centres))


ARTEFACTS: Mapping[str, type[ArtefactSettings]] = {
    "grid": GridSettings,
    "square": SquareSettings,
    "balls": BallsSettings,
    "two_spheres": TwoSpheresSettings,
    "sphere": SphereSettings,
    "bryan_gauge": BryanGaugeSettings,
}

if TYPE_CHECKING:
    AnyArtefactSettings = ArtefactSettings
else:
    AnyArtefactSettings = Annotated[
        Union[tuple(ARTEFACTS.values())],  # noqa: UP007
        OpenKinds("artefacts", ArtefactSettings),
    ]


def _rectangle(
    cells: list[tuple[int, int]], shape: tuple[int, int], size: tuple[float, float]
) -> BallLayout:
    columns, rows = shape
    index = {cell: i for i, cell in enumerate(cells)}
    coordinates = [
        # Multiplied before divided, so that the last ball is exactly at the size.
        (size[0] * column / (columns - 1), size[1] * row / (rows - 1), 0.0)
        for row, column in cells
    ]
    lower_left, lower_right = index[0, 0], index[0, columns - 1]
    upper_left, upper_right = index[rows - 1, 0], index[rows - 1, columns - 1]
    sides = (
        (lower_left, lower_right),
        (upper_left, upper_right),
        (lower_left, upper_left),
        (lower_right, upper_right),
    )
    diagonals = ((lower_left, upper_right), (lower_right, upper_left))
    neighbours = tuple(
        (i, index[neighbour])
        for (row, column), i in index.items()
        for neighbour in ((row, column + 1), (row + 1, column))
        if neighbour in index
    )
    sets = {
        "corner sides": sides,
        "corner diagonals": diagonals,
        "corners": sides + diagonals,
        "neighbours": neighbours,
    }
    if len(cells) == columns * rows:
        # Braces make the net of distances rigid in its plane: upper left to lower right.
        braces = tuple(
            (index[row + 1, column], index[row, column + 1])
            for row in range(rows - 1)
            for column in range(columns - 1)
        )
        every = neighbours + braces + sides + diagonals
        sets["braced"] = tuple(dict.fromkeys((min(pair), max(pair)) for pair in every))
    return BallLayout(
        tuple(f"r{row + 1}c{column + 1}" for row, column in cells),
        frozen(coordinates),
        sets,
        (lower_left, lower_right, upper_left, upper_right),
    )
