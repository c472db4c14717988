"""Parts of a design: probes, artefacts, balls, positions and tasks, each with its own arrays in
SI units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..inputs.quantities import Target
from ..machines.protocol import Array, Integers

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Probes:
    """Probes with their `offsets` (l, d); `free` (l, d) marks the offsets that are parameters."""

    names: tuple[str, ...]
    offsets: Array
    free: Flags


@dataclass(frozen=True)
class Artefacts:
    """Artefacts, `is_plate` marking plates, and `is_gauge` Bryan gauges, which turn about a pivot;
    the others are length standards, too.
    """

    names: tuple[str, ...]
    is_plate: Flags
    is_gauge: Flags

    @property
    def plates(self) -> Integers:
        """Indices of the plates."""
        return np.flatnonzero(self.is_plate)


@dataclass(frozen=True)
class Balls:
    """Balls of all artefacts: the `artefact` (n,) of each, and their `places` (n, d) in its
    frame.
    """

    names: tuple[str, ...]
    artefact: Integers
    places: Array

    def of(self, artefact: int) -> Integers:
        """Indices of the balls of an artefact."""
        return np.flatnonzero(self.artefact == artefact)


@dataclass(frozen=True)
class Positions:
    """Positions of artefacts: the `artefact` (k,) that stands in each, and its nominal pose, x = R
    y + o with `rotations` (k, d, d) and `origins` (k, d).

    `held` (k, pose size) marks the pose parameters (origin, then rotation about the machine's axes)
    that fix a frame or that turn an artefact of collinear balls about its own axis.
    """

    names: tuple[str, ...]
    artefact: Integers
    rotations: Array
    origins: Array
    held: Flags


@dataclass(frozen=True)
class UnknownLengths:
    """Lengths of standards without certificates, which are parameters: the `artefact` (m,) of each,
    and what it is `drawn` with (m,), in metres.
    """

    names: tuple[str, ...]
    artefact: Integers
    drawn: Array

    def of(self, artefact: int) -> Integers:
        """Indices of the unknown lengths of an artefact."""
        return np.flatnonzero(self.artefact == artefact)


@dataclass(frozen=True)
class EvaluationPoints:
    """Scale readings `points` (p, d) whose corrected places are evaluated, read with `probe`."""

    points: Array
    probe: int


@dataclass(frozen=True)
class Tasks:
    """Lengths that the machine is to measure: `points` (t, 2, d) are what the scales say at their
    ends, `probes` (t, 2) what measures there, and `targets` (t,) what uncertainties are to be
    within.
    """

    names: tuple[str, ...]
    points: Array
    probes: Integers
    targets: tuple[Target | None, ...]
