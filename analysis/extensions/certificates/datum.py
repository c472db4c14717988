"""Datum of an artefact: what its co-ordinates are relative to, in two and three dimensions.

A network without a frame of its own is turned and shifted until its co-ordinates meet conditions,
one for each freedom of a rigid motion; displacements follow by the S-transformation (W. Baarda,
*S-transformations and criterion matrices*, 1973).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from ballplate.results import PlateAxes, axes_words, plate_axes
from ballplate.simulator.computing import lstsq
from ballplate.simulator.design import Flags
from ballplate.simulator.geometry import BallLayout, fit_motion, rigid_motions, without_rigid_motion
from ballplate.simulator.inputs import hint
from ballplate.simulator.machines import Array

# A ball nearer to the line of two others than this fraction of how far it is along fixes no plane.
IN_LINE = 1e-3


@dataclass(frozen=True)
class Datum:
    """Axes by balls: those of `axes` and, in space, the ball `plane` that lies in the xy plane; of
    balls in line there is none. Without axes all balls together lie as closely as possible where
    they are drawn.
    """

    axes: PlateAxes | None
    plane: int | None = None

    def words(self, names: Sequence[str]) -> str:
        """What defines the axes, as text."""
        if self.axes is None:
            return "all balls as close as possible to their nominal co-ordinates (least squares)"
        definition = axes_words(self.axes, tuple(names))
        return (
            definition
            if self.plane is None
            else f"{definition}, xy plane through ball {names[self.plane]}"
        )


def chosen_datum(
    layout: BallLayout, dimension: int, chosen: Sequence[str], axes_stated: PlateAxes | None = None
) -> Datum:
    """The datum that names choose: none for that of the layout, "all", or as many balls as there
    are dimensions, first the origin, then one on an axis, then one in the xy plane.

    The axis is the one that the second ball is drawn along. `axes_stated` are the axes that an
    experiment chooses, if it does.

    :raises ValueError: there is no such ball, another number of them, or they are in line; the
        layout has fewer than two balls.
    """
    names, drawn = layout.names, layout.coordinates
    if len(names) < 2:
        raise ValueError(
            "a single ball has no axes and no lengths; choose a plate of two balls or more"
        )
    if list(chosen) == ["all"]:
        return Datum(None)
    if not chosen:
        axes = axes_stated or plate_axes(layout)
        if axes is None or axes.ball == axes.origin:
            raise ValueError("its balls are drawn above one another; no x or y axis goes through")
        return Datum(axes, _farthest_from(drawn, axes) if dimension == 3 else None)
    if len(chosen) != dimension or len(set(chosen)) != len(chosen):
        needed = "the origin, one on an axis" + (" and one in the xy plane" * (dimension == 3))
        raise ValueError(f"{', '.join(chosen)}: name {dimension} different balls, {needed}, or all")
    for name in chosen:
        if name not in names:
            raise ValueError(f'no ball "{name}"; {hint(name, names)}')
    origin, ball, *further_balls = (names.index(name) for name in chosen)
    along = drawn[ball, :2] - drawn[origin, :2]
    if not along.any():
        raise ValueError(f"{chosen[0]} and {chosen[1]} are drawn above one another; name others")
    axis = int(np.abs(along).argmax())
    axes = PlateAxes(origin, ball, axis, -1.0 if along[axis] < 0.0 else 1.0)
    plane = further_balls[0] if further_balls else None
    if plane is not None and not _is_apart(drawn, axes)[plane]:
        raise ValueError(f"{', '.join(chosen)} are in line; name three balls that are not")
    return Datum(axes, plane)


def _is_apart(drawn: Array, axes: PlateAxes) -> Flags:
    """Which balls (n,) are off the line of the two on an axis."""
    across, along = _across(drawn, axes)
    return across > IN_LINE * np.maximum(along, across)


def _across(drawn: Array, axes: PlateAxes) -> tuple[Array, Array]:
    """Distances (n,) of balls from the line of the two on an axis, and from the origin."""
    moved = drawn - drawn[axes.origin]
    unit = moved[axes.ball] / np.linalg.norm(moved[axes.ball])
    return np.linalg.norm(moved - np.outer(moved @ unit, unit), axis=1), np.linalg.norm(
        moved, axis=1
    )


def _farthest_from(drawn: Array, axes: PlateAxes) -> int | None:
    """The first of the balls farthest from the line of the two on an axis; None where all are on
    it.
    """
    if not _is_apart(drawn, axes).any():
        return None
    # Of equal ones the first, whatever rounding makes of them.
    across = _across(drawn, axes)[0]
    return int(np.flatnonzero(across > across.max() * (1.0 - 1e-9))[0])


def in_datum(balls: Array, datum: Datum, drawn: Array) -> tuple[Array, Array]:
    """Co-ordinates (n, d) of balls (n, d) in a datum, and the rotation (d, d) that they are turned
    by. `drawn` (n, d) are where the layout has them, whose z axis tells which side is up.

    >>> square = np.array([[0.0, 0, 0], [2.0, 0, 0], [0.0, 3.0, 0]])
    >>> moved = square[:, [1, 2, 0]] + 5.0
    >>> in_datum(moved, Datum(PlateAxes(0, 1, 0), 2), square)[0].tolist()
    [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]]
    """
    axes, d = datum.axes, balls.shape[1]
    if axes is None:
        rotation, shift = fit_motion(balls, drawn)
        return balls @ rotation.T + shift, rotation
    moved = balls - balls[axes.origin]
    along = axes.sign * moved[axes.ball] / np.linalg.norm(moved[axes.ball])
    if d == 2:
        across = np.array([-along[1], along[0]])
        rotation = np.array([along, across] if axes.axis == 0 else [-across, along])
    else:
        normal = np.cross(along, _in_plane(moved, along, datum, drawn))
        normal /= np.linalg.norm(normal)
        across = np.cross(normal, along)
        rotation = np.array([along, across, normal] if axes.axis == 0 else [-across, along, normal])
    turned = moved @ rotation.T
    # Zero by definition.
    turned.ravel()[_conditions(datum, d)] = 0.0
    return turned, rotation


def _in_plane(moved: Array, along: Array, datum: Datum, drawn: Array) -> Array:
    """A direction in the xy plane, on the side of the axis that makes z point as it is drawn."""
    if datum.plane is None:
        # Balls in line: any plane through them.
        return np.eye(3)[int(np.abs(along).argmin())]
    axes = datum.axes
    assert axes is not None
    as_drawn = drawn - drawn[axes.origin]
    normal = np.cross(axes.sign * as_drawn[axes.ball], as_drawn[datum.plane])
    return -moved[datum.plane] if normal[2] < 0.0 else moved[datum.plane]


def _conditions(datum: Datum, d: int) -> list[int]:
    """Indices among all co-ordinates of those that are zero by definition."""
    axes = datum.axes
    assert axes is not None
    conditions = [d * axes.origin + axis for axis in range(d)]
    conditions += [d * axes.ball + axis for axis in range(d) if axis != axes.axis]
    return conditions if datum.plane is None else [*conditions, d * datum.plane + 2]


def relative_to(datum: Datum, coordinates: Array, displacements: Array) -> Array:
    """Small displacements (n, d, r) of balls at `coordinates` (n, d), all in a datum's axes, as
    they are there: less the rigid motion that keeps the datum's conditions.
    """
    if datum.axes is None:
        return without_rigid_motion(coordinates, displacements)
    n, d, r = displacements.shape
    motions = rigid_motions(coordinates).reshape(n * d, -1)
    flat = displacements.reshape(n * d, r)
    rows = _conditions(datum, d)
    # Of balls in line the turn about it moves none, and is left alone.
    moved = lstsq(motions[rows], flat[rows], rcond=1e-10)[0]
    result = flat - motions @ moved
    result[rows] = 0.0
    return result.reshape(n, d, r)
