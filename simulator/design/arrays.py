"""A laid-out experiment: every ball, position, probe, reading and calibration item as arrays in SI
units.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..experiment.model import Machine
from ..machines.protocol import Array, ErrorModel, Integers
from .joint_lengths import LengthWhitening, length_whitening
from .objects import (
    Artefacts,
    Balls,
    EvaluationPoints,
    Positions,
    Probes,
    Tasks,
    UnknownLengths,
)
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

    `model` is the error model whose parameters are estimated. Balls and positions of length
    standards stand in the same lists as those of plates: balls and poses of plates are parameters,
    and the pivots of Bryan gauges, the origins of their positions.
    """

    model: ErrorModel
    machine: Machine
    probes: Probes
    artefacts: Artefacts
    balls: Balls
    positions: Positions
    readings: Readings
    distances: CalibratedDistances
    coordinates: CalibratedCoordinates
    lengths: Lengths
    unknown_lengths: UnknownLengths
    evaluation: EvaluationPoints
    tasks: Tasks
    priors: Priors = field(default_factory=no_priors)

    @property
    def dimension(self) -> int:
        return len(self.machine.repeatability)

    @cached_property
    def plate_readings(self) -> Integers:
        """Indices of the readings of plates, whose balls and poses are parameters."""
        return np.flatnonzero(self.artefacts.is_plate[self.balls.artefact[self.readings.ball]])

    @cached_property
    def plate_balls(self) -> Integers:
        """Indices of the balls that are parameters."""
        return np.flatnonzero(self.artefacts.is_plate[self.balls.artefact])

    @cached_property
    def plate_positions(self) -> Integers:
        """Indices of the positions of plates."""
        return np.flatnonzero(self.artefacts.is_plate[self.positions.artefact])

    @cached_property
    def gauge_positions(self) -> Integers:
        """Indices of the positions of Bryan gauges."""
        return np.flatnonzero(self.artefacts.is_gauge[self.positions.artefact])

    @cached_property
    def posed_positions(self) -> Integers:
        """Indices of the positions whose poses, or pivots, are parameters."""
        return np.sort(np.concatenate([self.plate_positions, self.gauge_positions]))

    @cached_property
    def length_whitening(self) -> LengthWhitening:
        """What makes uncorrelated observations of unit variance of the lengths of standards."""
        given, readings = self.lengths, self.readings
        noise = reading_uncertainties(self, readings) / np.sqrt(readings.repeats)[:, None]
        standard = self.balls.artefact[readings.ball[given.first]]
        count = len(self.probes.names)
        place = readings.position[given.first] * count + readings.probe[given.first]
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
        return (
            self.dimension * len(self.plate_balls)
            + int((~self.positions.held[self.posed_positions]).sum())
            + len(self.model.parameters)
            + int(self.probes.free.sum())
            + len(self.unknown_lengths.names)
        )

    def ball_label(self, ball: int) -> str:
        """Name of a ball, with its artefact's where there are several."""
        if len(self.artefacts.names) == 1:
            return self.balls.names[ball]
        return f"{self.artefacts.names[self.balls.artefact[ball]]}/{self.balls.names[ball]}"


@dataclass(frozen=True)
class State:
    """Values of all parameters: `balls` (n, d), `rotations` (k, d, d), `origins` (k, d), `a`
    (parameters,), offsets of the `probes` (l, d) and unknown `lengths`.
    """

    balls: Array
    rotations: Array
    origins: Array
    a: Array
    probes: Array
    lengths: Array


def reading_uncertainties(design: Design, readings: Readings) -> Array:
    """Standard uncertainties (m, d) of each co-ordinate of a single one of each reading's repeats,
    in metres.
    """
    if readings.uncertainty is not None:
        return readings.uncertainty
    return np.broadcast_to(design.machine.repeatability, (len(readings), design.dimension))


def nominal_state(design: Design) -> State:
    """The design as drawn, on a machine without errors."""
    return State(
        design.balls.places,
        design.positions.rotations,
        design.positions.origins,
        np.zeros(len(design.model.parameters)),
        design.probes.offsets,
        design.unknown_lengths.drawn,
    )


def locations(design: Design, state: State, readings: Readings) -> Array:
    """True positions (m, d) of the balls that are read, T(y, t) in metres."""
    turned = np.einsum("mij,mj->mi", state.rotations[readings.position], state.balls[readings.ball])
    return np.asarray(turned + state.origins[readings.position])
