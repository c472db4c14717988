"""Parts of a design: probes, artefacts, balls, positions, readings and tasks, each with its own
arrays in SI units.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array, Flags, Integers
from ballplate.simulator.inputs.quantities import Target
from ballplate.simulator.inputs.settings import Settings
from pydantic import Field

# Fraction of the volume by which scale readings may be outside: measured offsets of probes are no
# round numbers, and artefacts are not set up just as drawn.
SLIGHTLY = 1e-3


@dataclass(frozen=True, eq=False)
class Volume:
    """The measuring volume: ``lower`` and ``upper`` (d,) in metres."""

    lower: Array
    upper: Array

    @property
    def corners(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The lower and the upper corner, as numbers."""
        return tuple(self.lower.tolist()), tuple(self.upper.tolist())

    @property
    def size(self) -> Array:
        """Lengths (d,) of the sides."""
        return self.upper - self.lower

    @property
    def diagonals(self) -> tuple[Array, Array]:
        """Starts and ends (k, d) of the body diagonals: the first from the lower corner, the others
        from the upper end of x, y and z each; of a plane, its two diagonals.

        >>> Volume(np.zeros(2), np.array([2.0, 1.0])).diagonals[0].tolist()
        [[0.0, 0.0], [2.0, 0.0]]
        """
        d = len(self.lower)
        is_upper = np.eye(d + 1, d, -1, dtype=bool)[: 2 ** (d - 1)]
        return (
            np.where(is_upper, self.upper, self.lower),
            np.where(is_upper, self.lower, self.upper),
        )

    @property
    def of_readings(self) -> tuple[Array, Array]:
        """Limits (d,) of scale readings, a thousandth of the volume outside it."""
        slightly = SLIGHTLY * self.size
        return self.lower - slightly, self.upper + slightly

    def far_outside(self, x: Array) -> Flags:
        """Return a mask (n, d) of co-ordinates outside by more than the volume's size: they are in
        another unit.
        """
        size = float(self.size.max())
        return (x < self.lower - size) | (x > self.upper + size)


@dataclass(frozen=True, eq=False)
class Machine:
    """The machine. ``repeatability``: (d,) standard uncertainty of a reading per co-ordinate, in
    metres.
    """

    volume: Volume
    repeatability: Array

    @property
    def dimension(self) -> int:
        """Number of co-ordinates, 2 or 3."""
        return len(self.volume.lower)


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
    """Balls of all artefacts: the `artefact` (n,) of each, and their locations `places` (n, d) in
    its frame.
    """

    names: tuple[str, ...]
    artefact: Integers
    places: Array

    def of(self, artefact: int) -> Integers:
        """Indices of the balls of an artefact."""
        return np.flatnonzero(self.artefact == artefact)

    def label(self, ball: int, artefacts: tuple[str, ...]) -> str:
        """Return the name of a ball, with its artefact's if there are several."""
        name = self.names[ball]
        return name if len(artefacts) == 1 else f"{artefacts[self.artefact[ball]]}/{name}"


@dataclass(frozen=True)
class Positions:
    """Positions of artefacts: the `artefact` (k,) in each, and its nominal pose, x = R y + o with
    `rotations` (k, d, d) and `origins` (k, d).

    `held` (k, pose size) marks the pose parameters (origin, then rotation about the machine's
    axes) that fix a frame or that turn an artefact of collinear balls about its own axis. `across`
    (k,) is the machine's axis across an artefact read only in its plane, otherwise -1; absent if
    all co-ordinates are read. `switched_off` names positions of the file that are not read.
    """

    names: tuple[str, ...]
    artefact: Integers
    rotations: Array
    origins: Array
    held: Flags
    across: Integers | None = None
    switched_off: tuple[str, ...] = ()


@dataclass(frozen=True)
class Readings:
    """Ball, position, probe and number of repeats of each reading; all arrays (m,).

    `uncertainty` (m, d) is the standard uncertainty of each co-ordinate read once, in metres;
    absent if all have the machine's repeatability. `beside` has further columns for influence
    quantities, values (m,) by name, if any.
    """

    ball: Integers
    position: Integers
    probe: Integers
    repeats: Integers
    uncertainty: Array | None = None
    beside: Mapping[str, Array] | None = None

    def __len__(self) -> int:
        return len(self.ball)

    def select(self, chosen: Flags | Integers) -> Readings:
        """The readings at the given indices."""
        uncertainty = None if self.uncertainty is None else self.uncertainty[chosen]
        beside = self.beside and {name: column[chosen] for name, column in self.beside.items()}
        return Readings(
            self.ball[chosen],
            self.position[chosen],
            self.probe[chosen],
            self.repeats[chosen],
            uncertainty,
            beside,
        )

    def expanded(self) -> Readings:
        """One row for each repeat."""
        chosen = np.repeat(np.arange(len(self)), self.repeats)
        return replace(self.select(chosen), repeats=np.ones(len(chosen), np.int64))


@dataclass(frozen=True)
class UnknownLengths:
    """Lengths of standards without certificates, which are parameters: the `artefact` (m,) of
    each, and its nominal length `drawn` (m,), in metres.
    """

    names: tuple[str, ...]
    artefact: Integers
    drawn: Array

    def of(self, artefact: int) -> Integers:
        """Indices of the unknown lengths of an artefact."""
        return np.flatnonzero(self.artefact == artefact)


@dataclass(frozen=True)
class EvaluationPoints:
    """Scale readings `points` (p, d) whose corrected locations are evaluated, read with
    `probe`.
    """

    points: Array
    probe: int


@dataclass(frozen=True)
class Tasks:
    """Lengths for the machine to measure: `points` (t, 2, d) are scale readings at their ends,
    `probes` (t, 2) the probes there, and `targets` (t,) target uncertainties.
    """

    names: tuple[str, ...]
    points: Array
    probes: Integers
    targets: tuple[Target | None, ...]

    def beside(self, other: Tasks) -> Tasks:
        """Both, one after the other."""
        return Tasks(
            self.names + other.names,
            np.concatenate([self.points, other.points]),
            np.concatenate([self.probes, other.probes]),
            self.targets + other.targets,
        )


@dataclass(frozen=True)
class LengthArrays:
    """Lengths of length standards read in the volume; arrays (m,), metres.

    `first` and `second` index the readings that a length takes part in; `second` is -1 if the
    other end is the pivot of a Bryan gauge, which is not read: the origin of the first reading's
    position. `projected` is true if the difference of the corrected points is projected on the
    standard's nominal direction (m, d) instead of its norm being taken; `with_repeatability` if
    the readings' own noise along that direction adds to `uncertainty`. Lengths of the same
    `certificate`, counted from 0, share that error in all positions. `free` is the number of the
    design's unknown length, -1 if its `value` is known.
    """

    first: Integers
    second: Integers
    value: Array
    uncertainty: Array
    projected: Flags
    direction: Array
    with_repeatability: Flags
    certificate: Integers
    free: Integers | None = None

    @property
    def to_pivot(self) -> Flags:
        """Mask (m,) of lengths from a reading to a pivot."""
        return self.second < 0

    @property
    def is_known(self) -> Flags:
        """Mask (m,) of lengths with a certificate."""
        return np.full(len(self.value), True) if self.free is None else self.free < 0


Distribution = Literal["normal", "uniform", "student t"]


class NoiseSettings(Settings):
    """Distribution of the noise of readings; its standard deviation is their uncertainty."""

    distribution: Distribution = Field(
        "normal", description="normal, uniform or student t; default: normal"
    )
    degrees_of_freedom: float | None = Field(
        None, gt=2, le=1e6, description="of student t; the fewer, the heavier are the tails"
    )
    correlation: float = Field(
        0.0,
        ge=0,
        lt=1,
        description="of the noise along an axis of any two readings in one position; default: 0",
    )


@dataclass(frozen=True)
class Noise:
    """Noise of unit variance: normal, uniform, or of Student's t with `degrees_of_freedom`.

    Readings of a position share a normal component along each axis, of variance `correlation`.
    """

    distribution: Distribution = "normal"
    degrees_of_freedom: float = np.inf
    correlation: float = 0.0

    def draw(
        self,
        generator: np.random.Generator,
        shape: tuple[int, ...],
        position: Integers,
        axis: int,
    ) -> Array:
        """Noise of a `shape` whose `axis` counts readings, made in `position` (m,)."""
        noise = self._independent(generator, shape)
        if not self.correlation:
            return noise
        names, place = np.unique(position, return_inverse=True)
        of_positions = [*shape]
        of_positions[axis] = len(names)
        common = generator.standard_normal(of_positions)
        shared = np.sqrt(self.correlation) * np.take(common, place.ravel(), axis)
        return np.sqrt(1.0 - self.correlation) * noise + shared

    def _independent(self, generator: np.random.Generator, shape: tuple[int, ...]) -> Array:
        if self.distribution == "normal":
            return generator.standard_normal(shape)
        if self.distribution == "uniform":
            return generator.uniform(-np.sqrt(3.0), np.sqrt(3.0), shape)
        nu = self.degrees_of_freedom
        return generator.standard_t(nu, shape) * np.sqrt(1.0 - 2.0 / nu)
