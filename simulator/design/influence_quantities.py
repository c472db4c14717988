"""Influence quantities: what an influence provides, its kinds, and checks of its derivatives.

A reading obeys T(x, a, p) = R y + o + s(e) + noise, where s is linear in the influence parameters
e about their stated values. The derivatives of s by poses, balls and readings are neglected: they
are smaller than those of R y by the ratio of s to the co-ordinates, 1e-4 at most.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array, Integers
from ballplate.simulator.inputs.settings import listing
from ballplate.simulator.inputs.units import Units
from ballplate.simulator.machines.protocol import Unit

from .objects import Artefacts, Balls, Machine, Positions, Probes, Readings


@dataclass(frozen=True)
class InfluenceParameter:
    """A parameter of an influence quantity: `value` with its standard `uncertainty`, both in
    `unit`.

    An uncertainty of zero makes it a constant, an infinite one a free parameter. `effect` is the
    largest displacement of readings by one unit, in metres. `position` is the index of its only
    position, -1 for several. Parameters of the same `component` are values drawn from one
    distribution, whose variance can be estimated from them.
    """

    name: str
    unit: Unit
    value: float
    uncertainty: float
    effect: float
    position: int = -1
    component: str = ""


@dataclass(frozen=True)
class DesignParts:
    """Parts of a design that an influence quantity is laid out for; `readings` are the planned
    ones. File names are relative to `folder`.
    """

    machine: Machine
    probes: Probes
    artefacts: Artefacts
    balls: Balls
    positions: Positions
    readings: Readings
    folder: Path


@dataclass(frozen=True)
class Disturbed:
    """Disturbed readings (m,).

    `ball`, `position` and `probe` are indices (m,), `x` (m, d) the scale readings, `places` (m, d)
    the balls in their artefact's frame, `rotations` (m, d, d) from there into the machine's axes,
    and `offsets` (m, d) of the probes' tips, all in metres. `beside` has further columns (m,) by
    name, `order` included.
    """

    ball: Integers
    position: Integers
    probe: Integers
    x: Array
    places: Array
    rotations: Array
    offsets: Array
    beside: Mapping[str, Array]

    @property
    def arms(self) -> Array:
        """Locations (m, d) of the balls about the origin of their artefact, along the machine's
        axes.
        """
        return np.einsum("mij,mj->mi", self.rotations, self.places)

    def column(self, name: str) -> Array:
        """Return values (m,) of a column, NaN for readings without one."""
        return self.beside.get(name, np.full(len(self.ball), np.nan))


class Influence(ABC):
    """An influence quantity laid out for a design; a frozen dataclass of arrays."""

    @property
    def columns(self) -> Units:
        """Columns of a file of readings that it uses, with the permitted units of each; the values
        of a reading are a `column` of `Disturbed`.
        """
        return {}

    def in_sequence(self, readings: Readings) -> Mapping[str, Array]:
        """Further columns (m,) of all readings, in the order in which they are made."""
        return {}

    @property
    @abstractmethod
    def parameters(self) -> tuple[InfluenceParameter, ...]:
        """Its parameters (p,), constants among them."""

    @abstractmethod
    def shifts(self, at: Disturbed) -> tuple[Array, Array]:
        """Return the shifts of the locations of readings at the stated values (m, d), and their
        derivative by the parameters (m, d, p), in metres.
        """


# Readings by which a kind is checked. More than there are axes, so that axes are not taken for
# them.
FEW = 7


def few(count: int) -> Integers:
    """Return a few indices spread over `count` readings."""
    return np.unique(np.linspace(0, max(count - 1, 0), min(count, FEW)).astype(np.int64))


def wrong_of_parameters(parameters: tuple[InfluenceParameter, ...], positions: int) -> str:
    """Return faults of parameters for `positions` positions; possibly empty."""
    return next(iter(_of_parameters(parameters, positions)), "")


def _of_parameters(parameters: tuple[InfluenceParameter, ...], positions: int) -> Iterator[str]:
    units = get_args(Unit)
    for parameter in parameters:
        words = f'parameter "{parameter.name}"'
        if not parameter.name:
            yield "a parameter has no name; give one"
        if parameter.unit not in units:
            yield f'{words} has the unit "{parameter.unit}"; give one of {listing(units)}'
        if not np.isfinite(parameter.value):
            yield f"{words} has the value {parameter.value}; give a finite one"
        if not parameter.uncertainty >= 0.0:
            yield (
                f"{words} has the uncertainty {parameter.uncertainty:g}; give 0 for a constant,"
                " inf where"
                " nothing is known, or a positive number"
            )
        if not (np.isfinite(parameter.effect) and parameter.effect > 0.0):
            yield (
                f"{words} has the effect {parameter.effect:g}; give what a unit of it moves"
                " readings by"
                " where it does most, a positive number of metres"
            )
        if not -1 <= parameter.position < positions:
            yield (
                f"{words} is of position {parameter.position}; give an index below {positions}, or"
                " -1"
                " where it is of several"
            )


def wrong_of_shifts(influence: Influence, at: Disturbed) -> str:
    """Return faults of the shapes and numbers of shifts at readings `at`; possibly empty."""
    m, d, p = *at.x.shape, len(influence.parameters)
    shift, derivative = influence.shifts(at)
    for array, shape, description in (
        (shift, (m, d), "shifts"),
        (derivative, (m, d, p), "the derivative of shifts"),
    ):
        if np.shape(array) != shape:
            return (
                f"{description} of {m} readings has the shape {np.shape(array)}; it must be {shape}"
            )
        if not np.isfinite(array).all():
            return f"{description} has values that are not finite"
    return ""
