"""Observations as arrays: readings, calibrated distances, co-ordinates and lengths, and priors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..machines.protocol import Array, Integers


@dataclass(frozen=True)
class Readings:
    """Which ball is read in which position with which probe, and how often; all arrays (m,).

    `uncertainty` (m, d) is the standard uncertainty of each co-ordinate read once, in metres; None
    where all have the machine's repeatability.
    """

    ball: Integers
    position: Integers
    probe: Integers
    repeats: Integers
    uncertainty: Array | None = None

    def __len__(self) -> int:
        return len(self.ball)

    def select(self, chosen: NDArray[np.bool_] | Integers) -> Readings:
        """The readings at the given indices."""
        uncertainty = None if self.uncertainty is None else self.uncertainty[chosen]
        return Readings(
            self.ball[chosen],
            self.position[chosen],
            self.probe[chosen],
            self.repeats[chosen],
            uncertainty,
        )

    def expanded(self) -> Readings:
        """One row for each repeat."""
        chosen = np.repeat(np.arange(len(self)), self.repeats)
        return replace(self.select(chosen), repeats=np.ones(len(chosen), np.int64))


@dataclass(frozen=True)
class CalibratedDistances:
    """Calibrated distances between two balls of an artefact; arrays (m,), lengths in metres.

    `dimensions` is 2 where only the first two co-ordinates of the artefact's frame count.
    """

    first: Integers
    second: Integers
    dimensions: Integers
    value: Array
    uncertainty: Array

    def __len__(self) -> int:
        return len(self.first)


@dataclass(frozen=True)
class CalibratedCoordinates:
    """Calibrated ball co-ordinates in the artefact's frame; arrays (m,), metres."""

    ball: Integers
    axis: Integers
    value: Array
    uncertainty: Array

    def __len__(self) -> int:
        return len(self.ball)


@dataclass(frozen=True)
class Lengths:
    """Lengths of length standards read in the volume; arrays (m,), metres.

    `first` and `second` index the readings that a length takes part in; `second` is -1 where the
    other end is the pivot of a Bryan gauge, which is not read: the origin of the first reading's
    position. `projected` says whether the difference of the corrected points is projected on the
    standard's nominal direction (m, d) instead of its norm being taken; `with_repeatability`
    whether the readings' own scatter along that direction adds to `uncertainty`. Lengths of the
    same `certificate`, counted from 0, share that error wherever they are read. `free` is the
    number of the design's unknown length that a length is, -1 where its `value` is known.
    """

    first: Integers
    second: Integers
    value: Array
    uncertainty: Array
    projected: NDArray[np.bool_]
    direction: Array
    with_repeatability: NDArray[np.bool_]
    certificate: Integers
    free: Integers | None = None

    def __len__(self) -> int:
        return len(self.first)

    @property
    def to_pivot(self) -> NDArray[np.bool_]:
        """Which lengths (m,) are from a reading to a pivot."""
        return self.second < 0

    def select(self, chosen: NDArray[np.bool_] | Integers) -> Lengths:
        """The lengths at the given indices."""
        values: dict[str, Any] = {
            name: None if v is None else v[chosen] for name, v in vars(self).items()
        }
        return Lengths(**values)


@dataclass(frozen=True)
class Priors:
    """Prior knowledge of shared parameters; arrays (m,), metres, radians or ratios.

    Each row is about a pose parameter (`position` and `component`, by place among origin and
    rotation), about a probe offset (`probe` and `component`), or about a linear function of the
    model's parameters, `by_model` (m, n); indices that do not apply are -1. Origins and offsets are
    stated as co-ordinates, pose angles as deviations from the nominal pose.
    """

    names: tuple[str, ...]
    position: Integers
    probe: Integers
    component: Integers
    by_model: Array
    value: Array
    uncertainty: Array

    def __len__(self) -> int:
        return len(self.names)


def no_priors() -> Priors:
    """No prior knowledge."""
    none, empty = np.zeros(0, np.int64), np.zeros(0)
    return Priors((), none, none, none, np.zeros((0, 0)), empty, empty)
