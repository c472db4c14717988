"""The random part of a machine file's errors.

Source: Park, Burdekin and Peggs, section 5. Errors within a bandwidth differ at each approach of a
point, as probing does in each co-ordinate; errors of squareness and temperature last.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.machines import Array, ErrorFunction, KinematicModel, error_function

from .curves import Points
from .description import Combination, MachineDescription, PowerSeries
from .volumetric import VolumetricModel, squareness_field, thermal_field

# The name of random errors that are of no axis.
PROBING = "probing"


@dataclass(frozen=True, eq=False)
class RandomPart:
    """Random errors: `approach` has a parameter per function that is drawn at each approach of a
    point, with `deviations` along its axis, `lasting` one per error that is common to all points,
    with `sizes` (l,). `probing` is the standard deviation in each co-ordinate of an approach.
    """

    approach: VolumetricModel
    deviations: tuple[float | Points, ...]
    lasting: VolumetricModel
    sizes: Array
    probing: float

    @property
    def names(self) -> tuple[list[str], list[str]]:
        """The errors that columns of both `random_roots` are of."""
        approach, lasting = (
            [one.function for one in model.parameters] for model in (self.approach, self.lasting)
        )
        return [*approach, *[PROBING] * 3], lasting

    @property
    def meanings(self) -> dict[str, str]:
        """The meanings of all errors by their names; empty for a machine without a random part."""
        parameters = *self.approach.parameters, *self.lasting.parameters
        meanings = {one.function: one.meaning for one in parameters}
        return meanings | ({PROBING: "in each co-ordinate"} if self.probing else {})


def random_part(machine: MachineDescription) -> RandomPart:
    """Return the random part of a machine's errors."""
    random = [error for error in machine.errors if error.deviation is not None]
    constant = Combination(((1.0, PowerSeries((1.0,))),))
    functions = tuple(error_function(error.name, constant) for error in random)
    lasting = [
        (squareness_field(field.name), field.deviation)
        for field in machine.squareness
        if field.deviation
    ]
    lasting += [
        (thermal_field(AXIS_NAMES.index(axis)), abs(state.expansion) * state.uncertainty)
        for axis, state in machine.temperature.items()
        if state.uncertainty
    ]

    def chain(functions: tuple[ErrorFunction, ...]) -> KinematicModel:
        return KinematicModel(
            machine.arrangement, functions, machine.lower, machine.upper, origin=machine.reference
        )

    return RandomPart(
        VolumetricModel(chain(functions), ()),
        tuple(error.deviation for error in random if error.deviation is not None),
        VolumetricModel(chain(()), tuple(field for field, _ in lasting)),
        np.array([size for _, size in lasting]),
        machine.probing,
    )


def random_roots(random: RandomPart, x: Array, p: Array) -> tuple[Array, Array]:
    """Return sensitivities times standard deviations, in metres, at scale readings x (m, 3) with
    probe offsets p (m, 3): (m, 3, k) of errors drawn at each approach, the last three those of
    probing, and (m, 3, l) of lasting ones.
    """
    columns = random.approach.jacobian(x, np.zeros(len(random.deviations)), p)
    for k, function in enumerate(random.approach.chain.functions):
        columns[:, :, k] *= deviations_at(random.deviations[k], x[:, function.axis])[:, None]
    probing = np.broadcast_to(random.probing * np.eye(3), (len(x), 3, 3))
    lasting = random.lasting.jacobian(x, np.zeros(len(random.sizes)), p)
    return np.concatenate([columns, probing], axis=2), lasting * random.sizes


def deviations_at(deviation: float | Points, positions: Array) -> Array:
    """Return a standard deviation at positions (m,) along its axis."""
    if isinstance(deviation, Points):
        return np.interp(positions, deviation.positions, deviation.values)
    return np.full(len(positions), deviation)
