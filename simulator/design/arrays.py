"""A laid-out experiment: every ball, position, probe, reading and calibration item as arrays in SI
units.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..inputs.quantities import Target
from ..machines.protocol import Array, ErrorModel, Integers
from .joint_lengths import LengthWhitening, length_whitening
from .observations import (
    CalibratedCoordinates,
    CalibratedDistances,
    Lengths,
    Priors,
    Readings,
    no_priors,
)


@dataclass(frozen=True)
class Design:
    """What an experiment consists of, in SI units and integer indices.

    Shapes: `repeatability` (d,), `probes` (l, d), `balls` (n, d) in the frame of their artefact,
    `rotations` (k, d, d) and `origins` (k, d) with x = R y + o for nominal poses, `held` (k, pose
    size) marking the pose parameters (origin, then rotation about the machine's axes) that fix a
    frame or that turn an artefact of collinear balls about its own axis. Balls and positions of
    length standards stand in the same lists; `is_plate` (artefacts,) tells which artefacts are
    plates, whose balls and poses are parameters, and `is_gauge` which are Bryan gauges, whose
    pivots are: the origins of their positions. `free_offsets` (l, d) marks the probe offsets that
    are parameters, None where none is. `length_names` and `drawn_lengths` (in metres) are those of
    length standards without certificates, which are parameters. `task_points` (t, 2, d) are what
    the scales say at the ends of the lengths that the machine is to measure, `task_probes` (t, 2)
    what measures there, and `task_targets` (t,) what uncertainties are to be within.
    """

    model: ErrorModel
    lower: Array
    upper: Array
    repeatability: Array
    probe_names: tuple[str, ...]
    probes: Array
    artefact_names: tuple[str, ...]
    is_plate: NDArray[np.bool_]
    ball_names: tuple[str, ...]
    ball_artefact: Integers
    balls: Array
    position_names: tuple[str, ...]
    position_artefact: Integers
    rotations: Array
    origins: Array
    held: NDArray[np.bool_]
    readings: Readings
    distances: CalibratedDistances
    coordinates: CalibratedCoordinates
    lengths: Lengths
    points: Array = field(default_factory=lambda: np.zeros((0, 3)))
    point_probe: int = 0
    priors: Priors = field(default_factory=no_priors)
    free_offsets: NDArray[np.bool_] | None = None
    is_gauge: NDArray[np.bool_] | None = None
    length_names: tuple[str, ...] = ()
    drawn_lengths: Array = field(default_factory=lambda: np.zeros(0))
    task_names: tuple[str, ...] = ()
    task_points: Array = field(default_factory=lambda: np.zeros((0, 2, 3)))
    task_probes: Integers = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    task_targets: tuple[Target | None, ...] = ()

    @property
    def dimension(self) -> int:
        return len(self.repeatability)

    @cached_property
    def plate_readings(self) -> Integers:
        """Indices of the readings of plates, whose balls and poses are parameters."""
        return np.flatnonzero(self.is_plate[self.ball_artefact[self.readings.ball]])

    @cached_property
    def plate_balls(self) -> Integers:
        """Indices of the balls that are parameters."""
        return np.flatnonzero(self.is_plate[self.ball_artefact])

    @cached_property
    def gauge_positions(self) -> Integers:
        """Indices of the positions of Bryan gauges."""
        gauges = np.zeros_like(self.is_plate) if self.is_gauge is None else self.is_gauge
        return np.flatnonzero(gauges[self.position_artefact])

    @cached_property
    def posed_positions(self) -> Integers:
        """Indices of the positions whose poses, or pivots, are parameters."""
        of_plates = np.flatnonzero(self.is_plate[self.position_artefact])
        return np.sort(np.concatenate([of_plates, self.gauge_positions]))

    @cached_property
    def length_whitening(self) -> LengthWhitening:
        """What makes uncorrelated observations of unit variance of the lengths of standards."""
        given, readings = self.lengths, self.readings
        noise = reading_uncertainties(self, readings) / np.sqrt(readings.repeats)[:, None]
        standard = self.ball_artefact[readings.ball[given.first]]
        place = readings.position[given.first] * len(self.probe_names) + readings.probe[given.first]
        return length_whitening(given, noise, standard, place)

    @property
    def observations(self) -> int:
        """Number of scalar observations: co-ordinates of all readings of plates, and calibration
        items.

        Of lengths that are read together only those count that do not follow from the others.
        """
        count = int(self.readings.repeats[self.plate_readings].sum())
        calibration = len(self.distances) + len(self.coordinates) + len(self.length_whitening)
        return self.dimension * count + calibration + len(self.priors)

    @property
    def parameter_count(self) -> int:
        """Number of free parameters: balls, poses less what is held, machine errors, probe offsets,
        unknown lengths.
        """
        poses = int((~self.held[self.posed_positions]).sum())
        offsets = 0 if self.free_offsets is None else int(self.free_offsets.sum())
        lengths = len(self.length_names)
        return (
            self.dimension * len(self.plate_balls)
            + poses
            + len(self.model.parameters)
            + offsets
            + lengths
        )

    def ball_label(self, ball: int) -> str:
        """Name of a ball, with its artefact's where there are several."""
        if len(self.artefact_names) == 1:
            return self.ball_names[ball]
        return f"{self.artefact_names[self.ball_artefact[ball]]}/{self.ball_names[ball]}"


@dataclass(frozen=True)
class State:
    """Values of all parameters: `balls` (n, d), `rotations` (k, d, d), `origins` (k, d), `a`
    (parameters,).

    `probes` (l, d) are the probe offsets, and `lengths` the unknown lengths, None where they are
    those of the design.
    """

    balls: Array
    rotations: Array
    origins: Array
    a: Array
    probes: Array | None = None
    lengths: Array | None = None


def unknown_lengths(design: Design, state: State) -> Array:
    """Lengths of standards without certificates at `state`, in metres."""
    return design.drawn_lengths if state.lengths is None else state.lengths


def probe_offsets(design: Design, state: State) -> Array:
    """Offsets (l, d) of all probes at `state`."""
    return design.probes if state.probes is None else state.probes


def reading_uncertainties(design: Design, readings: Readings) -> Array:
    """Standard uncertainties (m, d) of each co-ordinate of a single one of each reading's repeats,
    in metres.
    """
    if readings.uncertainty is not None:
        return readings.uncertainty
    return np.broadcast_to(design.repeatability, (len(readings), design.dimension))


def nominal_state(design: Design) -> State:
    """The design as drawn, on a machine without errors."""
    return State(
        design.balls, design.rotations, design.origins, np.zeros(len(design.model.parameters))
    )


def locations(design: Design, state: State, readings: Readings) -> Array:
    """True positions (m, d) of the balls that are read, T(y, t) in metres."""
    turned = np.einsum("mij,mj->mi", state.rotations[readings.position], state.balls[readings.ball])
    return np.asarray(turned + state.origins[readings.position])
