"""Calibrated distances between balls of a plate, or of a length standard, and radii of gauges."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np
from ballplate.simulator.geometry.ball_layouts import BallLayout
from ballplate.simulator.inputs.number_arrays import Array, Integers
from ballplate.simulator.inputs.quantities import LengthFunction
from ballplate.simulator.machines.protocol import ErrorModel
from numpy.typing import NDArray

from ..arrays import Design, Words
from ..state import State
from .balls import BallObservations
from .calibration import Calibration, CertifiedValue
from .whitening import CovarianceRoot, at_least_exact


@dataclass(frozen=True)
class CalibratedDistances(BallObservations):
    """Calibrated distances between two balls of an artefact; arrays (m,), lengths in metres.

    `dimensions` is 2 where only the first two co-ordinates of the artefact's frame count.
    """

    word: ClassVar[str] = "distance"
    scales: ClassVar[bool] = True
    words: ClassVar[Words] = Words("certified", "long", "short")

    first: Integers
    second: Integers
    dimensions: Integers
    value: Array
    uncertainty: Array

    @property
    def balls(self) -> Integers:
        return np.stack([self.first, self.second], axis=1)

    def values(self, balls: Array) -> tuple[Array, Array]:
        difference = balls[..., self.first, :] - balls[..., self.second, :]
        difference = difference * (np.arange(balls.shape[-1]) < self.dimensions[:, None])
        length = np.sqrt((difference**2).sum(axis=-1))
        along = difference / length[..., None]
        return length, np.stack([along, -along], axis=-2)

    def name(self, design: Design, k: int) -> str:
        first, second = int(self.first[k]), int(self.second[k])
        return f"distance {design.ball_label(first)} to {design.balls.names[second]}"


def no_distances() -> CalibratedDistances:
    """No calibrated distances."""
    none, empty = np.zeros(0, np.int64), np.zeros(0)
    return CalibratedDistances(none, none, none, empty, empty)


@dataclass(frozen=True, eq=False)
class DistanceCalibration(Calibration):
    """Calibrated distances of an artefact.

    ``pairs``: (m, 2) ball indices. ``dimensions``: 3 in space, 2 in the artefact's x and y.
    ``values``: (m,) metres, nominal unless ``certified``. ``standard_uncertainties``: (m,) metres,
    the function ``standard_uncertainty`` at the nominal distances, unless a file states them.
    ``form`` and ``repeatability`` matter for length standards only.
    """

    artefact: str
    pairs: NDArray[np.intp]
    dimensions: Literal[2, 3]
    values: Array
    certified: bool
    standard_uncertainty: LengthFunction | None
    standard_uncertainties: Array
    form: Literal["distance", "projection"]
    repeatability: Literal["included", "ignored"]
    kind: Literal["distances"] = "distances"
    root: CovarianceRoot | None = None

    are_lengths: ClassVar[bool] = True

    def observed(self, first: int) -> CalibratedDistances:
        ends = np.asarray(self.pairs + first, np.int64)
        dimensions = np.full(len(ends), self.dimensions)
        return CalibratedDistances(
            ends[:, 0],
            ends[:, 1],
            dimensions,
            self.values,
            at_least_exact(self.standard_uncertainties),
        )

    def names(self, layout: BallLayout) -> list[tuple[str, str]]:
        return [(layout.names[i], layout.names[j]) for i, j in self.pairs]

    def times_as_uncertain(self, factor: float) -> DistanceCalibration:
        old = self.standard_uncertainty
        new = None if old is None else LengthFunction(factor * old.constant, factor * old.slope)
        scaled = super().times_as_uncertain(factor) if old is None else self
        return replace(
            scaled,
            standard_uncertainty=new,
            standard_uncertainties=factor * self.standard_uncertainties,
        )


@dataclass(frozen=True, eq=False)
class RadiusCalibration(Calibration):
    """The calibrated radius of a Bryan gauge: ``value`` and ``standard_uncertainty`` in metres."""

    artefact: str
    value: float
    standard_uncertainty: float
    kind: Literal["radius"] = "radius"

    @property
    def size(self) -> int:
        return 1

    def certified_values(self, layout: BallLayout) -> Iterator[CertifiedValue]:
        drawn = float(np.sqrt((layout.coordinates[0] ** 2).sum()))
        yield CertifiedValue(
            "", self.artefact, "radius", self.value, self.standard_uncertainty, drawn=drawn
        )

    def true_values(self, design: Design, truth: State, model: ErrorModel, first: int) -> Array:
        return np.sqrt((truth.balls[first : first + 1] ** 2).sum(axis=1))

    def with_values(self, values: Array) -> RadiusCalibration:
        return replace(self, value=float(values[0]))
