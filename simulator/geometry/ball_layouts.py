"""Balls of an artefact in its own frame, and the keys that all artefacts have.

Each artefact, in `artefacts` or a file of its own, builds on this.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, Self

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.quantity_types import Length, PositiveLength
from ballplate.simulator.inputs.settings import Name, NonEmpty, Settings, listing, nearest, shorten
from numpy.typing import NDArray
from pydantic import Field, model_validator

MOST_BALLS = 40_000
COINCIDENT = 1e-9

Pairs = tuple[tuple[int, int], ...]


class LayoutError(ValueError):
    """A layout that contradicts itself."""


@dataclass(frozen=True, eq=False)
class BallLayout:
    """The balls of an artefact in its own frame.

    ``names``: (n,) texts. ``coordinates``: (n, 3) nominal centres in metres. ``pair_sets``: name
    of a set → pairs of ball indices, without "all". ``corner_set``: indices of the corner balls,
    empty if undefined.

    :raises LayoutError: no balls, names that are not unique or not n, co-ordinates that are not
        finite or not (n, 3), or a set called "all" or with an index outside 0 to n - 1.
    """

    names: tuple[str, ...]
    coordinates: Array
    pair_sets: Mapping[str, Pairs] = field(default_factory=dict)
    corner_set: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        n, shape = len(self.names), np.shape(self.coordinates)
        if n == 0 or shape != (n, 3) or not isinstance(self.coordinates, np.ndarray):
            raise LayoutError(
                f"{n} names for coordinates of shape {shape}; give n names, at least one, and an"
                " array (n, 3) in metres, z too, as frozen makes it"
            )
        twice = [name for name, count in Counter(self.names).items() if count > 1]
        if twice:
            raise LayoutError(f"several balls are named {listing(twice)}; give each its own name")
        if not np.isfinite(self.coordinates).all():
            raise LayoutError("coordinates are not finite; give finite ones in metres")
        if "all" in self.pair_sets:
            raise LayoutError('"all" always is the set of all pairs; leave it out of pair_sets')
        for name, chosen in {**self.pair_sets, "corner_set": self.corner_set}.items():
            index, tail = np.array(chosen), () if name == "corner_set" else (2,)
            if index.size and (
                index.shape[1:] != tail
                or index.dtype.kind != "i"
                or not 0 <= index.min() <= index.max() < n
                or (tail and (index[:, 0] == index[:, 1]).any())
            ):
                content = "pairs of two different indices" if tail else "indices"
                raise LayoutError(f"{name} is not within balls 0 to {n - 1}; give {content}")


def pairs(layout: BallLayout, set_name: str) -> NDArray[np.intp]:
    """Return the ball indices of a named pair set, (m, 2).

    :raises ValueError: the set is undefined for this artefact; the message lists the defined ones.
    """
    if set_name == "all":
        return np.column_stack(np.triu_indices(len(layout.names), k=1))
    if set_name not in layout.pair_sets:
        defined = [*layout.pair_sets, "all"]
        meant = nearest(set_name, defined)
        raise ValueError(
            f'"{shorten(set_name)}" is not defined for this artefact; '
            + (f'did you mean "{meant}"? ' if meant else "")
            + f"choose from: {listing(defined)}, or list pairs of balls"
        )
    return np.array(layout.pair_sets[set_name], dtype=np.intp).reshape(-1, 2)


def corner_balls(layout: BallLayout) -> NDArray[np.intp]:
    """Return the indices of the corner balls, (k,).

    :raises ValueError: the artefact has no corners.
    """
    if not layout.corner_set:
        raise ValueError('"corners" is not defined for this artefact; write all, or list the balls')
    return np.array(layout.corner_set, dtype=np.intp)


def coincident_balls(layout: BallLayout, at_most: int = 3) -> list[tuple[int, int]]:
    """Return pairs of balls less than a nanometre apart, `at_most` or slightly more."""
    coincident: list[tuple[int, int]] = []
    # Projected on a line askew to all usual rows of balls, only coincident balls are equally far.
    along = layout.coordinates @ (0.6139, 0.5243, 0.5901)
    order = np.argsort(along, kind="stable")
    along = along[order]
    for shift in range(1, len(order)):
        near = np.flatnonzero(along[shift:] - along[:-shift] < COINCIDENT)
        if not len(near) or len(coincident) >= at_most:
            break
        first, second = order[near], order[near + shift]
        differences = layout.coordinates[second] - layout.coordinates[first]
        near = np.flatnonzero(np.linalg.norm(differences, axis=1) < COINCIDENT)
        coincident += [
            (int(min(pair)), int(max(pair))) for pair in zip(first[near], second[near], strict=True)
        ]
    return sorted(coincident)


BallNames = NonEmpty[Name]
Coordinates = Annotated[tuple[Length, ...], Field(min_length=2, max_length=3)]
BallsPerSide = Annotated[int, Field(ge=2, le=500)]


class AxesSettings(Settings):
    """Axes in which a plate's co-ordinates are reported: the ball at the origin, and one on x or
    y.
    """

    origin: Name = Field(description="the ball at the origin")
    x: Name | None = Field(
        None, description="the ball on the x axis, on its nominal half; this or y"
    )
    y: Name | None = Field(
        None, description="the ball on the y axis, on its nominal half; this or x"
    )

    @model_validator(mode="after")
    def _two_balls(self) -> Self:
        if (self.x is None) == (self.y is None):
            raise ValueError('neither or both of "x" and "y" are given; name one ball, on one axis')
        if self.origin in (self.x, self.y):
            raise ValueError(
                f'ball "{self.origin}" cannot be the origin and fix an axis too; name another one'
            )
        return self


class ArtefactSettings(Settings):
    """Keys that all artefacts have."""

    kind: str
    role: Literal["plate", "length_standard"] = Field(
        "plate",
        description=(
            "plate: its ball co-ordinates are estimated; length_standard: it has only distances"
        ),
    )
    reads: Literal["in space", "in plane"] = Field(
        "in space",
        description=(
            "in space: every co-ordinate of a ball is read; in plane: only the two in the"
            " artefact's plane, as of holes"
        ),
    )
    flatness: PositiveLength | None = Field(
        None,
        description=(
            "with reads: in plane, standard uncertainty of each hole's co-ordinate out of the plane"
        ),
    )
    axes: AxesSettings | None = Field(
        None,
        description=(
            "axes in which a two-dimensional fit reports the co-ordinates of the balls; default:"
            " from the first ball through the farthest one that nominally lies on its x axis"
        ),
    )

    @model_validator(mode="after")
    def _flat_if_in_plane(self) -> Self:
        if (self.reads == "in plane") != (self.flatness is not None):
            raise ValueError('"reads: in plane" and "flatness" go together; give both or neither')
        return self

    def layout(self) -> BallLayout:
        """Return the balls of the artefact in its own frame."""
        raise NotImplementedError


def frozen(values: Any) -> Array:
    """Return values as a read-only array."""
    array = np.array(values, dtype=float)
    array.setflags(write=False)
    return array


def grid_points(sides: Iterable[Array]) -> Array:
    """Return points (n, d) of a grid with co-ordinates along each of d axes, the last fastest.

    >>> grid_points([np.array([1.0, 2.0]), np.array([3.0, 4.0])]).tolist()
    [[1.0, 3.0], [1.0, 4.0], [2.0, 3.0], [2.0, 4.0]]
    """
    axes = list(sides)
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))


def even_grid(
    lower: Sequence[float] | Array, upper: Sequence[float] | Array, counts: Iterable[int]
) -> Array:
    """Return grid points (n, d), `counts` along each axis, evenly spread between two corners (d,).

    >>> even_grid(np.zeros(2), np.ones(2), (2, 1)).tolist()
    [[0.0, 0.0], [1.0, 0.0]]
    """
    return grid_points(np.linspace(*side) for side in zip(lower, upper, counts, strict=True))
