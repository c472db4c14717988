"""Volumetric errors of a described machine: on a grid, along a line, and in lengths.

Source: Park, Burdekin and Peggs, section 5. An error is where the tip is, less where the scales
say: the correction to be added to a reading, opposite in sign to the error of indication. Random
parts are standard deviations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from ballplate.simulator.design import Volume
from ballplate.simulator.machines import Array, Parameter, TrueMachine

from ..machine_files import (
    MachineDescription,
    ParametricError,
    Points,
    RandomPart,
    deviations_at,
    random_part,
    random_roots,
    reference_functions,
    true_volumetric,
)
from .map_places import MapPlaces
from .realisations import Draws, Realisations

# Points of a grid or a line: each takes half a kilobyte.
MOST_POINTS = 200_000

# Points along an axis at which a parametric error is told.
ALONG = 101


@dataclass(frozen=True, eq=False)
class VolumetricErrors:
    """Errors (m, d) at scale readings `points` (m, d), with standard `uncertainties` (m, d), in
    metres: systematic errors of a machine file with the deviations of their random part, or
    estimates of a map, NaN where undetermined.
    """

    points: Array
    errors: Array
    uncertainties: Array

    @property
    def resultant(self) -> Array:
        """Length (m,) of the error, NaN if a co-ordinate is undetermined."""
        return np.linalg.norm(self.errors, axis=1)


@dataclass(frozen=True, eq=False)
class LengthErrors:
    """Errors (m,) of distances from `starts` to `ends` (m, d): true distances less those that the
    scales say, with standard `uncertainties` (m,), as for points.
    """

    starts: Array
    ends: Array
    nominal: Array
    errors: Array
    uncertainties: Array


@dataclass(frozen=True)
class Volumetric:
    """A machine with what its errors are computed by, made once; errors other than `only` one are
    zero.
    """

    machine: MachineDescription
    only: str = ""

    @property
    def volume(self) -> Volume:
        """The measuring volume."""
        return Volume(np.array(self.machine.lower), np.array(self.machine.upper))

    @cached_property
    def truth(self) -> TrueMachine:
        """The systematic errors as an error model."""
        truth = true_volumetric(self.machine)
        return replace(truth, a=truth.a * self._counted(truth.model.parameters))

    def _counted(self, parameters: Sequence[Parameter]) -> Array:
        return np.array([self.only in ("", one.function) for one in parameters], float)

    @cached_property
    def random(self) -> RandomPart:
        """The random part of the errors."""
        return random_part(self.machine)

    @property
    def errors_by_name(self) -> dict[str, str]:
        """The meanings of all errors by their names."""
        systematic = {one.function: one.meaning for one in self.truth.model.parameters}
        return systematic | self.random.meanings

    @property
    def numbers(self) -> list[tuple[Parameter, float]]:
        """Errors that are no functions, with their values."""
        every = zip(self.truth.model.parameters, self.truth.a.tolist(), strict=True)
        names = {error.name for error in self.machine.errors}
        return [(parameter, value) for parameter, value in every if parameter.function not in names]

    def systematic(self, points: Array) -> Array:
        """Return systematic errors (m, 3) at scale readings (m, 3)."""
        probe = np.broadcast_to(self.machine.probe, points.shape)
        return self.truth.model.error(points, self.truth.a, probe) - probe

    def random_roots(self, points: Array) -> tuple[Array, Array]:
        """Return sensitivities times deviations: (m, 3, k) per approach, and (m, 3, l) lasting."""
        probe = np.broadcast_to(self.machine.probe, points.shape)
        approach, lasting = (
            root * np.array([self.only in ("", name) for name in names], float)
            for root, names in zip(
                random_roots(self.random, points, probe), self.random.names, strict=True
            )
        )
        return approach, lasting

    def errors(self, points: Array) -> VolumetricErrors:
        """Return errors at scale readings (m, 3); random parts add in quadrature."""
        drawn, lasting = self.random_roots(points)
        deviation = np.sqrt((drawn**2).sum(axis=2) + (lasting**2).sum(axis=2))
        return VolumetricErrors(points, self.systematic(points), deviation)

    def lengths(self, starts: Array, ends: Array) -> LengthErrors:
        """Return errors of distances between points (m, 3).

        The two ends are separate approaches with independent draws, even of a function with the
        same position at both. Errors of squareness and temperature are common to both.
        """
        nominal = np.linalg.norm(ends - starts, axis=1)
        direction = (ends - starts) / nominal[:, None]
        error = length_errors(starts, ends, self.systematic(ends) - self.systematic(starts))
        drawn_first, lasting_first = self.random_roots(starts)
        drawn_last, lasting_last = self.random_roots(ends)
        along = [
            np.einsum("mi,mik->mk", direction, array)
            for array in (drawn_first, drawn_last, lasting_last - lasting_first)
        ]
        deviation = np.sqrt(sum((array**2).sum(axis=1) for array in along))
        return LengthErrors(starts, ends, nominal, error, deviation)


def length_errors(starts: Array, ends: Array, moved: Array) -> Array:
    """Return the increase of distances (m,) between points (m, d) if the ends have `moved` (m, d)
    against the starts.
    """
    difference = ends - starts
    # |d + m| - |d| without the difference of two long lengths.
    return (2.0 * (difference * moved).sum(axis=1) + (moved**2).sum(axis=1)) / (
        np.linalg.norm(difference + moved, axis=1) + np.linalg.norm(difference, axis=1)
    )


def drawn_machine_errors(built: Volumetric, places: MapPlaces, draws: Draws) -> Realisations:
    """Return errors with a drawn random part: lasting errors once for all points, those of an
    approach at each point and each end of a length.
    """
    draws.ensure_possible(places.points)
    (drawn, lasting), (first, at_start), (last, at_end) = (
        built.random_roots(array) for array in (places.points, places.starts, places.ends)
    )
    (steady, *anew) = draws.normal(
        lasting.shape[2:], *((len(array), array.shape[2]) for array in (drawn, first, last))
    )

    def moved(approach: Array, constant: Array, normal: Array) -> Array:
        return np.einsum("mik,nmk->nmi", approach, normal) + np.einsum(
            "mik,nk->nmi", constant, steady
        )

    errors = built.systematic(places.points) + moved(drawn, lasting, anew[0])
    starts = built.systematic(places.starts) + moved(first, at_start, anew[1])
    ends = built.systematic(places.ends) + moved(last, at_end, anew[2])
    lengths = [length_errors(places.starts, places.ends, array) for array in ends - starts]
    return Realisations(draws, errors, np.array(lengths).reshape(draws.count, -1))


@dataclass(frozen=True, eq=False)
class AlongAxis:
    """A parametric error along its axis, at the reference point, and its deviation.

    `values` are None for a purely random error; `measured` has the positions and values of a table.
    """

    error: ParametricError
    positions: Array
    values: Array | None
    deviation: Array | None
    measured: Points | None

    @property
    def unit(self) -> Literal["rad", "m"]:
        return "rad" if self.error.is_rotation else "m"


def along_axes(machine: MachineDescription, count: int = ALONG) -> list[AlongAxis]:
    """All parametric errors that the machine has, at a number of positions and the points of
    tables.
    """
    functions = reference_functions(machine)
    curves = []
    for error in machine.errors:
        positions = np.linspace(machine.lower[error.axis], machine.upper[error.axis], count)
        table = error.shape if isinstance(error.shape, Points) else None
        if table is not None:
            positions = np.union1d(
                positions, [x for x in table.positions if positions[0] <= x <= positions[-1]]
            )
        t = machine.scaled(error.axis, positions)
        deviation = error.deviation
        curves.append(
            AlongAxis(
                error,
                positions,
                functions[error.name].values(t)[:, 0] if error.name in functions else None,
                None if deviation is None else deviations_at(deviation, positions),
                table,
            )
        )
    return curves
