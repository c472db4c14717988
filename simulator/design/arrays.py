"""A laid-out experiment: every ball, position, probe, reading and calibration item as arrays in SI
units.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Self, TypeVar, cast

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array, Flags, Integers
from ballplate.simulator.machines.protocol import ErrorModel, Unit

from .influence_quantities import DesignParts, Influence, InfluenceParameter
from .objects import (
    Artefacts,
    Balls,
    EvaluationPoints,
    Machine,
    Noise,
    Positions,
    Probes,
    Readings as Readings,
    Tasks,
    UnknownLengths,
)
from .state import Replicates, State

Made = TypeVar("Made")
Kind = TypeVar("Kind", bound="Observations")


@dataclass(frozen=True)
class Design:
    """Arrays of an experiment, in SI units and integer indices.

    `model` is the error model whose parameters are estimated. Balls and positions of length
    standards are in the same lists as those of plates: balls and poses of plates are parameters,
    and the pivots of Bryan gauges, the origins of their positions. `observations` are all others
    than readings of plates, one object per class, in the order of their rows. `sections` are
    entries of the file under keys that extensions provide.
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
    sections: Mapping[str, Any] = field(default_factory=dict)

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

    # What is made is kept in the instance and is no field: `replace` makes a design without it,
    # so that nothing made for one design is used for a changed one.
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
        """Number of scalar observations: co-ordinates of all readings of plates, values of
        calibrations, priors and all else that is observed.

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


def measured(design: Design, readings: Readings) -> Flags:
    """Return a mask (m, d) of the co-ordinates read: all except those across artefacts that are
    read in their plane.
    """
    shape = (len(readings), design.dimension)
    if design.positions.across is None:
        return np.broadcast_to(True, shape)
    return np.arange(shape[1]) != design.positions.across[readings.position][:, None]


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
        """The observations of all parts, of this kind, together; kinds with other fields than
        arrays (m, ...) override it.
        """
        # Fields are joined in the order of their declaration, in which the class takes them.
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
        """Return the weights (m,) of rows, reciprocals of standard uncertainties; a row of weight
        zero is omitted.
        """
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
