"""Co-ordinates of a plate's balls in the plate's own axes, with standard uncertainties."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from ballplate.presentation.formatting import Data
from ballplate.simulator.computing.numerics import blank
from ballplate.simulator.estimation.covariance import MICROMETRE
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.geometry.ball_layouts import AxesSettings, BallLayout
from ballplate.simulator.inputs.number_arrays import Array

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


@dataclass(frozen=True, eq=False)
class PlateCoordinates:
    """A plate in the axes that two of its balls define: `coordinates` and `standard_uncertainties`
    (n, 2), metres.

    Co-ordinates that define the axes are exact; undetermined ones are NaN, with their
    uncertainties.
    """

    artefact: str
    axes: PlateAxes
    names: tuple[str, ...]
    coordinates: Array
    standard_uncertainties: Array

    @property
    def words(self) -> str:
        """The balls that define the axes."""
        return axes_words(self.axes, self.names)


def axes_of_plates(experiment: Experiment) -> Mapping[str, PlateAxes]:
    """Return the axes of each plate of a two-dimensional experiment, except single balls."""
    if experiment.dimension != 2:
        return {}
    axes_by_plate = {
        name: plate_axes(experiment.layouts[name], settings.axes)
        for name, settings in experiment.artefacts.items()
        if settings.role == "plate"
    }
    return {name: axes for name, axes in axes_by_plate.items() if axes is not None}


def plate_coordinates(
    experiment: Experiment, at: Linearisation, sigma: float = 1.0
) -> tuple[PlateCoordinates, ...]:
    """Return the balls of every plate of a two-dimensional experiment in the plate's own axes.

    With c the co-ordinates there, Q the rotation into the axes and the x axis fixed by ball b, to
    first order

        dc_j = Q (dy_j - dy_o) + g_j (Q (dy_b - dy_o))_y / c_bx,  g_j = (c_jy, -c_jx)

    and for the y axis of opposite sign. `sigma` multiplies all stated uncertainties.
    """
    design, plates = at.design, []
    for artefact, axes in axes_of_plates(experiment).items():
        balls = design.balls.of(design.artefacts.names.index(artefact))
        coordinates, rotation = in_plate_axes(at.state.balls[balls], axes)
        across = 1 - axes.axis
        n = len(balls)
        # A co-ordinate in the plate's axes depends on its own ball, on that at the origin and on
        # that which the axis goes through. The part of errors that balls have in common is added up
        # before it is squared. The parts of the three balls alone are independent.
        weights = _weights(coordinates, axes)
        common, ball_root = rotation @ at.balls.common[balls], rotation @ at.balls.own[balls]
        moved = common + sum(weight @ common[k] for k, weight in weights.items())
        as_drawn, turn = in_plate_axes(at.as_drawn.state.balls[balls], axes)
        null = turn @ at.ball_null[balls]
        moved_null = null + sum(weight @ null[k] for k, weight in _weights(as_drawn, axes).items())
        variance = (moved**2).sum(axis=2)
        for k, weight in weights.items():
            # A defining ball moves itself, too.
            is_defining = np.arange(n) == k
            variance += (
                (weight + np.eye(2) * is_defining[:, None, None]) @ ball_root[k]
            ) ** 2 @ np.ones(2)
        is_free = ~np.isin(np.arange(n), list(weights))
        variance[is_free] += (ball_root[is_free] ** 2).sum(axis=2)
        uncertainty = blank(np.sqrt(variance), moved_null, np.full(variance.shape, MICROMETRE))
        uncertainty[axes.origin] = uncertainty[axes.ball, across] = 0.0
        names = tuple(design.balls.names[ball] for ball in balls)
        values = np.where(np.isnan(uncertainty), np.nan, coordinates)
        plates.append(PlateCoordinates(artefact, axes, names, values, sigma * uncertainty))
    return tuple(plates)


def _weights(coordinates: Array, axes: PlateAxes) -> dict[int, Array]:
    """Return how each co-ordinate (n, 2) follows the ball on the axis and that at the origin (n, 2,
    2).
    """
    across, length = 1 - axes.axis, coordinates[axes.ball, axes.axis]
    if axes.axis == 1:
        length = -length
    by_ball = np.zeros((len(coordinates), 2, 2))
    by_ball[:, 0, across], by_ball[:, 1, across] = (
        coordinates[:, 1] / length,
        -coordinates[:, 0] / length,
    )
    return {axes.ball: by_ball, axes.origin: -np.eye(2) - by_ball}


# Balls of a plate in a table.
MOST_BALLS = 100


def plate_table(plate: PlateCoordinates, named: bool) -> list[str]:
    """Return a plate's co-ordinates in its own axes as lines of text, of up to `MOST_BALLS`."""
    from ballplate.presentation.table_columns import table_lines

    title = "co-ordinates of the balls in the plate's own axes"
    lines = [f"{plate.artefact + ': ' if named else ''}{title} ({plate.words})"]
    (x, y), (u, v) = (
        array[:MOST_BALLS].T for array in (plate.coordinates, plate.standard_uncertainties)
    )
    columns = {
        "ball": list(plate.names[:MOST_BALLS]),
        "x, mm": (x, u),
        "y, mm": (y, v),
        "standard uncertainty of x, µm": (u, 3),
        "of y, µm": (v, 3),
    }
    omitted = len(plate.names) - MOST_BALLS
    more = [f"({omitted} balls more in --json)"] if omitted > 0 else []
    return [*lines, *table_lines(columns), *more]


def plate_data(plate: PlateCoordinates) -> Data:
    """Return a plate's co-ordinates in its own axes as plain data in metres."""
    axes = plate.axes
    return {
        "axes": {"origin": plate.names[axes.origin], "xy"[axes.axis]: plate.names[axes.ball]},
        "balls": coordinates_data(plate.names, plate.coordinates, plate.standard_uncertainties),
    }


def coordinates_data(names: Sequence[str], values: Array, u: Array | None = None) -> Data:
    """Return co-ordinates (n, 2) by balls and axes, with their standard uncertainties."""
    keys = ("value",) if u is None else ("value", "standard_uncertainty")
    rows = np.stack([array for array in (values, u) if array is not None], axis=2)
    return {
        name: {
            axis: {**dict(zip(keys, cell, strict=True)), "unit": "m"}
            for axis, cell in zip("xy", row, strict=True)
        }
        for name, row in zip(names, rows.tolist(), strict=True)
    }
