"""Co-ordinates of a plate's balls in the plate's own axes, with standard uncertainties."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing.numerics import blank
from ballplate.simulator.estimation.covariance import MICROMETRE
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.geometry.axes import PlateAxes, axes_words, in_plate_axes, plate_axes
from ballplate.simulator.machines.protocol import Array


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
