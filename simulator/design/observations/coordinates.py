"""Calibrated co-ordinates of balls in the frame of their plate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from ballplate.simulator.geometry.ball_layouts import BallLayout
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.number_arrays import Array, Integers
from numpy.typing import NDArray

from ..arrays import Design
from .balls import BallObservations
from .calibration import FAR_FROM_DRAWING, Calibration
from .whitening import CovarianceRoot, at_least_exact

# What balls may be off a plane that they are drawn in, in metres.
HARDLY_FLAT = 1e-3


@dataclass(frozen=True)
class CalibratedCoordinates(BallObservations):
    """Calibrated ball co-ordinates in the artefact's frame; arrays (m,), metres."""

    word: ClassVar[str] = "coordinate"
    scales: ClassVar[bool] = True

    ball: Integers
    axis: Integers
    value: Array
    uncertainty: Array

    @property
    def balls(self) -> Integers:
        return self.ball[:, None]

    @property
    def along(self) -> Integers:
        return self.axis

    def values(self, balls: Array) -> tuple[Array, Array]:
        return balls[..., self.ball, self.axis], np.eye(balls.shape[-1])[self.axis][:, None]

    def name(self, design: Design, k: int) -> str:
        return f"{AXIS_NAMES[self.axis[k]]} of ball {design.ball_label(int(self.ball[k]))}"

    def fixing(self) -> tuple[Integers, Integers, Array]:
        return self.ball, self.axis, self.value


def no_coordinates() -> CalibratedCoordinates:
    """No calibrated co-ordinates."""
    none, empty = np.zeros(0, np.int64), np.zeros(0)
    return CalibratedCoordinates(none, none, empty, empty)


def flat(layout: BallLayout, first: int, uncertainty: float) -> CalibratedCoordinates:
    """Return co-ordinates with nominal ones out of the plane, for an artefact whose balls begin at
    `first` and whose heights no other observation determines.
    """
    count = len(layout.names)
    drawn = layout.coordinates[:, 2]
    balls = first + np.arange(count, dtype=np.int64)
    return CalibratedCoordinates(balls, np.full(count, 2), drawn, np.full(count, uncertainty))


@dataclass(frozen=True, eq=False)
class CoordinateCalibration(Calibration):
    """Calibrated ball co-ordinates in the artefact's frame.

    ``balls``: (k,) indices. ``axes``: the a calibrated axes, 0 to 2. ``values``: (k, a) metres,
    nominal unless ``certified``. ``standard_uncertainties``: (a,) metres, or (k, a) where a file
    states them.
    """

    artefact: str
    balls: NDArray[np.intp]
    axes: tuple[int, ...]
    values: Array
    certified: bool
    standard_uncertainties: Array
    kind: Literal["coordinates"] = "coordinates"
    root: CovarianceRoot | None = None

    def observed(self, first: int) -> CalibratedCoordinates:
        count = len(self.axes)
        shape = (len(self.balls), count)
        return CalibratedCoordinates(
            np.repeat(first + self.balls, count),
            np.tile(np.array(self.axes, np.int64), len(self.balls)),
            self.values.ravel(),
            at_least_exact(np.broadcast_to(self.standard_uncertainties, shape)).ravel(),
        )

    def names(self, layout: BallLayout) -> list[tuple[str, str]]:
        return [(layout.names[ball], AXIS_NAMES[axis]) for ball in self.balls for axis in self.axes]

    def doubt(self, layout: BallLayout) -> str:
        return far_spread(self.values, layout.coordinates[self.balls][:, list(self.axes)])


def far_spread(values: Array, drawn: Array) -> str:
    """Return a fault of certified co-ordinates (m, axes) whose spread is far from nominal;
    possibly empty.

    Their origin may differ from the nominal one.
    """
    # Root mean squares. A plate that is flat as drawn is not quite so as certified.
    spreads, expected = (
        float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean()))
        for points in (values, drawn)
    )
    if abs(spreads - expected) <= FAR_FROM_DRAWING * expected + HARDLY_FLAT:
        return ""
    times = f"{spreads / expected:.3g} times as far apart as in the artefact's drawing"
    return f"the balls of these co-ordinates are {times}; correct one of the two"
