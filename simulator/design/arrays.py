"""A laid-out experiment: every ball, position, probe, reading and calibration item as arrays in SI
units.
"""

from __future__ import annotations

import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Self, TypeVar, cast

import numpy as np
from ballplate.simulator.inputs.extensions import UnusableError
from ballplate.simulator.machines.protocol import Array, ErrorModel, Integers, Unit

from .influence_quantities import DesignParts, Disturbed, Influence, InfluenceParameter
from .noise import Noise
from .objects import (
    Artefacts,
    Balls,
    EvaluationPoints,
    Flags,
    Machine,
    Positions,
    Probes,
    Readings as Readings,
    Tasks,
    UnknownLengths,
)

Made = TypeVar("Made")
Kind = TypeVar("Kind", bound="Observations")


@dataclass(frozen=True)
class Design:
    """Arrays of an experiment, in SI units and integer indices.

    `model` is the error model whose parameters are estimated. Balls and positions of length
    standards are in the same lists as those of plates: balls and poses of plates are parameters,
    and the pivots of Bryan gauges, the origins of their positions. `observations` are all others
    than readings of plates, one object per class, in the order of their rows.
    """

    model: ErrorModel
    machine: Machine
    probes: Probes
    artefacts: Artefacts
    balls: Balls
    positions: Positions
    readings: Readings
    observations: tuple[Observations, ...]
    unknown_lengths: UnknownLengths
    evaluation: EvaluationPoints
    tasks: Tasks
    influences: tuple[Influence, ...] = ()
    noise: Noise = Noise()

    @property
    def dimension(self) -> int:
        return len(self.machine.repeatability)

    def parts(self, folder: Path) -> DesignParts:
        """Return what influence quantities are laid out for, with the folder of file names."""
        return DesignParts(
            self.machine,
            self.probes,
            self.artefacts,
            self.balls,
            self.positions,
            self.readings,
            folder,
        )

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
    def _made(self) -> dict[Callable[[Design], Any], Any]:
        return {}

    def once(self, make: Callable[[Design], Made]) -> Made:
        """Return the result of `make` for the design, computed once."""
        if make not in self._made:
            self._made[make] = make(self)
        return cast(Made, self._made[make])

    def of(self, kind: type[Kind]) -> Kind:
        """The observations of a kind."""
        return next(
            observation for observation in self.observations if isinstance(observation, kind)
        )

    def observed(self, *changed: Observations) -> Design:
        """The design with other observations of some kinds."""
        by_kind = {type(observation): observation for observation in changed}
        return replace(
            self,
            observations=tuple(
                by_kind.get(type(observation), observation) for observation in self.observations
            ),
        )

    @cached_property
    def tied_balls(self) -> Integers:
        """Indices of the balls of plates that observations tie to others."""
        ends = [
            observation.balls.ravel()
            for observation in self.observations
            if observation.balls.shape[1] > 1
        ]
        return np.unique(np.concatenate([np.zeros(0, np.int64), *ends]))

    @property
    def observation_count(self) -> int:
        """Number of scalar observations: co-ordinates of all readings of plates, and calibration
        items.

        Of lengths that are read together only those count that do not follow from the others.
        """
        readings = self.readings.select(self.plate_readings)
        count = int((readings.repeats[:, None] * measured(self, readings)).sum())
        return count + sum(observation.count(self) for observation in self.observations)

    @property
    def parameter_count(self) -> int:
        """Number of free parameters: balls, poses less held parameters, machine errors, probe
        offsets, unknown lengths, influence quantities.
        """
        return (
            self.dimension * len(self.plate_balls)
            + int((~self.positions.held[self.posed_positions]).sum())
            + len(self.model.parameters)
            + int(self.probes.free.sum())
            + len(self.unknown_lengths.names)
            + len(self.influence_parameters)
        )

    @cached_property
    def influence_parameters(self) -> tuple[InfluenceParameter, ...]:
        """The parameters of all influence quantities, less constants."""
        every = [parameter for influence in self.influences for parameter in influence.parameters]
        return tuple(parameter for parameter in every if parameter.uncertainty)

    @cached_property
    def influence_values(self) -> Array:
        """Their stated values (p,)."""
        return np.array([parameter.value for parameter in self.influence_parameters], float)

    def ball_label(self, ball: int) -> str:
        """Return the name of a ball, with its artefact's if there are several."""
        return self.balls.label(ball, self.artefacts.names)


@dataclass(frozen=True)
class State:
    """Values of all parameters: `balls` (n, d), `rotations` (k, d, d), `origins` (k, d), `a`
    (parameters,), offsets of the `probes` (l, d), unknown `lengths` and `influences` (p,).
    """

    balls: Array
    rotations: Array
    origins: Array
    a: Array
    probes: Array
    lengths: Array
    influences: Array = field(default_factory=lambda: np.zeros(0))


def reading_uncertainties(design: Design, readings: Readings) -> Array:
    """Standard uncertainties (m, d) of each co-ordinate of a single one of each reading's repeats,
    in metres.
    """
    if readings.uncertainty is not None:
        return readings.uncertainty
    return np.broadcast_to(design.machine.repeatability, (len(readings), design.dimension))


def measured(design: Design, readings: Readings) -> Flags:
    """Return a mask (m, d) of the co-ordinates read: all except those across artefacts that are
    read in their plane.
    """
    shape = (len(readings), design.dimension)
    if design.positions.across is None:
        return np.broadcast_to(True, shape)
    return np.arange(shape[1]) != design.positions.across[readings.position][:, None]


def reading_noise(design: Design, readings: Readings) -> Array:
    """Standard uncertainties (m, d) of the mean of each reading's repeats, in metres."""
    times = np.sqrt(readings.repeats)[:, None]
    return reading_uncertainties(design, readings) / times


def nominal_state(design: Design) -> State:
    """The design nominal, on a machine without errors."""
    return State(
        design.balls.places,
        design.positions.rotations,
        design.positions.origins,
        np.zeros(len(design.model.parameters)),
        design.probes.offsets,
        design.unknown_lengths.drawn,
        design.influence_values,
    )


def locations(design: Design, state: State, readings: Readings) -> Array:
    """True positions (m, d) of the balls that are read, T(y, t) in metres."""
    turned = np.einsum("mij,mj->mi", state.rotations[readings.position], state.balls[readings.ball])
    return turned + state.origins[readings.position]


class UnmatchedReadingsError(ValueError):
    """Scale readings that are not those of the readings they are joined to."""


def ensure_rows(design: Design, readings: Readings, x: Array) -> None:
    """Refuse scale readings without one row (d,) for each reading, and readings of balls that are
    not in their positions.

    :raises UnmatchedReadingsError: there are some.
    """
    if x.shape != (len(readings), design.dimension):
        raise UnmatchedReadingsError("there is not one scale reading for each reading")
    of_ball, of_position = design.balls.artefact, design.positions.artefact
    if (of_ball[readings.ball] != of_position[readings.position]).any():
        raise UnmatchedReadingsError("readings of balls that are not in their positions")


def in_sequence(readings: Readings, influences: tuple[Influence, ...]) -> Readings:
    """Return all readings in the order of reading, with the further columns that influence
    quantities need.
    """
    if not influences:
        return readings
    order = np.arange(len(readings), dtype=float)
    ordered = replace(readings, beside={**(readings.beside or {}), "order": order})
    for influence in influences:
        ordered = replace(
            ordered, beside={**(ordered.beside or {}), **influence.in_sequence(ordered)}
        )
    return ordered


def disturbed_readings(state: State, readings: Readings, x: Array) -> Disturbed:
    """Readings where the scales say `x` (m, d), in metres, as influence quantities see them."""
    return Disturbed(
        readings.ball,
        readings.position,
        readings.probe,
        x,
        state.balls[readings.ball],
        state.rotations[readings.position],
        state.probes[readings.probe],
        readings.beside or {},
    )


def influence_shifts(
    design: Design, state: State, readings: Readings, x: Array
) -> tuple[Array, Array]:
    """Return the effect of influence quantities on the locations of readings (m, d), and its
    derivative by their parameters (m, d, p), at scale readings `x` (m, d); metres.
    """
    disturbed = disturbed_readings(state, readings, x)
    shift, parts = np.zeros(x.shape), [np.zeros((*x.shape, 0))]
    for influence in design.influences:
        try:
            shifts, derivative = influence.shifts(disturbed)
        except MemoryError:
            raise
        except Exception as error:
            from ballplate.simulator.inputs.own_code import error_text, own_frame

            frames = traceback.extract_tb(error.__traceback__)
            user_frame = own_frame(error) or next(
                (f for f in frames[::-1] if f.name == "shifts"), None
            )
            text = (
                f"shifts of {type(influence).__name__} has failed: {error_text(error, user_frame)}"
            )
            raise UnusableError(text) from error
        shift += shifts
        varies = np.array(
            [parameter.uncertainty != 0.0 for parameter in influence.parameters], bool
        )
        parts.append(derivative[:, :, varies])
    by_parameter = np.concatenate(parts, axis=2)
    return shift + by_parameter @ (state.influences - design.influence_values), by_parameter


@dataclass(frozen=True)
class Rows:
    """Whitened rows (m,) of observations at a state.

    `residual` (m,), `by_shared` (m, s) the derivative by the shared parameters, if they
    contribute, and `by_ball` (m, k, d) that by the `balls` (m, k) of the observations.
    """

    residual: Array
    by_shared: Array | None
    by_ball: Array


@dataclass(frozen=True)
class Words:
    """Wording of a gross error in observations: "certified 3 um too high; check the
    certificate".
    """

    verb: str = "certified"
    more: str = "high"
    less: str = "low"
    cure: str = "check the certificate"


class Observations(ABC):
    """All observations (m,) of one class in a design; a frozen dataclass of arrays.

    `word` names one of them. If `scales`, values are lengths that share one ratio if the scale of
    their certificate has an error; if `is_joint`, a row is a combination of several values.
    `words` describe a gross error. Values are in `measured_in`, unless `unit` gives a unit for
    each.
    """

    word: ClassVar[str]
    measured_in: ClassVar[Unit] = "m"
    scales: ClassVar[bool] = False
    is_joint: ClassVar[bool] = False
    words: ClassVar[Words] = Words()
    value: Array
    uncertainty: Array

    def __len__(self) -> int:
        return len(self.value)

    @classmethod
    def joined(cls, parts: Sequence[Observations]) -> Self:
        """The observations of all parts, of this kind, together."""
        columns = zip(*(vars(part).values() for part in parts), strict=True)
        return cls(*(np.concatenate(column) for column in columns))

    @property
    def balls(self) -> Integers:
        """Balls (rows, k) of each row; k may be 0.

        Rows of one ball are eliminated with it; balls linked by rows are kept to the end.
        """
        return np.zeros((len(self), 0), np.int64)

    @property
    def along(self) -> Integers:
        """The axis (m,) that each is along, -1 without one."""
        return np.full(len(self), -1)

    @property
    def is_exact(self) -> Flags:
        """Mask (m,) of values without uncertainty."""
        return np.full(len(self), False)

    def count(self, design: Design) -> int:
        """Number of independent rows."""
        return len(self)

    @abstractmethod
    def rows(self, design: Design, state: State, x: Array | None) -> Rows:
        """Whitened rows at `state`, with scale readings `x` (readings, d) or error-free ones."""

    @abstractmethod
    def name(self, design: Design, k: int) -> str:
        """Return the name of an observation in a metrologist's words."""

    @abstractmethod
    def true_values(self, design: Design, truth: State, model: ErrorModel) -> Array:
        """Values (m,) where balls, poses and the machine are `truth`, whose error model is
        `model`.
        """

    def unit(self, design: Design, k: int) -> Unit:
        """The unit of a value."""
        return self.measured_in

    def errors(self, generator: np.random.Generator, count: int) -> Array:
        """Random errors (count, m) of the values."""
        return self.uncertainty * generator.standard_normal((count, len(self)))

    def weights(self, design: Design, state: State) -> Array:
        """Return the weights of rows, by the reciprocal of a length; zero weights are omitted."""
        return 1.0 / self.uncertainty

    def alike(self, design: Design, state: State) -> Self:
        """The same observations with weights of about one each."""
        return self.given(uncertainty=np.ones(len(self)))

    def given(self, **changed: Array) -> Self:
        """The same observations with other values or uncertainties (m,)."""
        return cast(Self, replace(cast(Any, self), **changed))

    def whitened(self, rows: Array) -> Array:
        """Return changes (m, ...) of the values in uncorrelated rows (count, ...) of unit
        variance.
        """
        return rows / self.uncertainty.reshape(-1, *[1] * (rows.ndim - 1))

    def scaled(self) -> Array:
        """Return the change of the values (m,), per ratio, from a scale error of their
        certificate.
        """
        return self.value if self.scales else np.zeros(len(self))

    def loosened(self, least: float) -> Self:
        """Return the same with standard uncertainties of at least `least`, if smaller ones
        represent zero.
        """
        return self

    def fixing(self) -> tuple[Integers, Integers, Array]:
        """Return balls and axes (f,) whose values fix an artefact's frame, along its axes, and the
        co-ordinates (f,).
        """
        none = np.zeros(0, np.int64)
        return none, none, np.zeros(0)

    def started(self, design: Design, x: Array, state: State) -> State:
        """Return starting values with the information of these observations."""
        return state

    def as_read(self, design: Design, x: Array) -> Design:
        """Return the design with probe offsets from readings, for observations that determine them
        far better than nominal values.
        """
        return design

    def reread(self, design: Design, place: Integers) -> Self:
        """Return the same for readings at other locations (readings,)."""
        return self

    def add_misfit(self, rows: Rows, errors: Array, at: Replicates) -> None:
        """Add the contribution to S^2 of replicates and its gradient, with errors (b, m) of their
        true values.

        Linear about the `rows` at the start; nonlinear observations override it.
        """
        if not len(self):
            return
        residual = rows.residual - errors / self.uncertainty
        if rows.by_shared is not None:
            residual = residual + at.shared @ rows.by_shared.T
        for ball, slope in zip(self.balls.T, rows.by_ball.swapaxes(0, 1), strict=True):
            residual = residual + np.einsum("md,bdm->bm", slope, at.balls[:, :, ball])
        at.squares[:] += (residual**2).sum(axis=1)
        if rows.by_shared is not None:
            at.by_shared[:] += residual @ rows.by_shared
        at.pull(self.balls, residual[:, :, None, None] * rows.by_ball)


@dataclass(frozen=True)
class Replicates:
    """Differences of b replicates from the estimate `start` of readings without noise, which are
    of the `truth`.

    `balls` (b, d, n) and `shared` (b, s) are the sums of their steps. Observations add to their
    S^2, `squares` (b,), and to half its gradient, `by_ball` (b, d, n) and `by_shared` (b, s).
    `offsets` (l, d) are the columns of probe offsets, -1 for held ones.
    """

    start: State
    truth: State
    balls: Array
    shared: Array
    squares: Array
    by_ball: Array
    by_shared: Array
    offsets: Integers

    def pull(self, balls: Integers, forces: Array) -> None:
        """Add forces (b, m, k, d) on the `balls` (m, k) of observations to the gradient."""
        for ball, force in zip(balls.T, forces.transpose(2, 1, 0, 3), strict=True):
            # A ball may take part in several.
            order = np.argsort(ball, kind="stable")
            pulled, start = np.unique(ball[order], return_index=True)
            self.by_ball[:, :, pulled] += np.add.reduceat(force[order], start).transpose(1, 2, 0)
