"""A machine as a file describes it, and the error functions at its reference point that follow.

Source: Park, Burdekin and Peggs, sections 3 to 5 and Appendix A.2. A parametric error measured on
some line differs from that on the line through the reference point by its axis's rotations, times
what separates the two lines.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from .arrangement import Arrangement
from .bases import Basis, Polynomial, Spline
from .curves import Curve, Interpolation, Points, SingleFunction, SmoothedPoints
from .error_names import AXIS_ERRORS, ROTATIONS, SQUARENESS_ERRORS, TRANSLATIONS, AxisError
from .kinematic import KinematicModel, carried_vectors, error_function
from .protocol import Array, TrueMachine
from .straightness import Criterion, reference_line
from .volumetric import DROOP, Field, VolumetricModel, droop_field, squareness_field, thermal_field

# Points at which a straightness error given as a polynomial is compared with a straight line.
REDUCTION_POINTS = 101

Three = tuple[float, float, float]


@dataclass(frozen=True)
class PowerSeries:
    """A polynomial of t, constant first, in metres or radians."""

    coefficients: tuple[float, ...]

    def values(self, t: Array) -> Array:
        """The polynomial at t (m,), as (m, 1).

        >>> PowerSeries((1.0, 0.0, 2.0)).values(np.array([0.5]))
        array([[1.5]])
        """
        return np.asarray(np.polynomial.polynomial.polyval(t, self.coefficients), float)[:, None]


@dataclass(frozen=True)
class Lever:
    """A rotation times the distance of its axis from the reference point, in metres: `length` (t -
    `t0`).
    """

    rotation: Combination
    length: float
    t0: float

    def values(self, t: Array) -> Array:
        """The product at t (m,), as (m, 1)."""
        return self.length * (t - self.t0)[:, None] * self.rotation.values(t)


@dataclass(frozen=True)
class Combination(SingleFunction):
    """A single function: a sum of multiples of others, less a straight line; beyond the ends `held`
    it is constant.
    """

    parts: tuple[tuple[float, PowerSeries | Curve | Combination | Lever], ...]
    intercept: float = 0.0
    slope: float = 0.0
    held: tuple[float, float] | None = None

    kind: ClassVar[str] = "stated"

    def values(self, t: Array) -> Array:
        """The function at t (m,), as (m, 1)."""
        t = t if self.held is None else np.clip(t, *self.held)
        found = -self.intercept - self.slope * t[:, None]
        for factor, part in self.parts:
            found = found + factor * part.values(t)
        return found

    def less(self, intercept: float, slope: float = 0.0) -> Combination:
        """The function less another straight line."""
        return replace(self, intercept=self.intercept + intercept, slope=self.slope + slope)


@dataclass(frozen=True)
class ParametricError:
    """An error of an axis, as stated or measured.

    `line` has the positions of the axes on the line of measurement, its own axis's without meaning,
    and `probe` the offset of what was measured, a tip or a reflector, from the machine's own point
    that the scales tell; None for the line through the reference point. `on_table` says that a
    table, which the axis moves, held the straightedge; otherwise a point fixed to what the axis
    moves was followed. `deviation` is the standard deviation of the random part, along the axis or
    at points of it.
    """

    name: str
    shape: PowerSeries | Points | None = None
    line: Three | None = None
    probe: Three = (0.0, 0.0, 0.0)
    criterion: Criterion = "end points"
    deviation: float | Points | None = None
    on_table: bool = False

    @property
    def error(self) -> AxisError:
        """What the name stands for."""
        return AXIS_ERRORS[self.name]

    @property
    def axis(self) -> int:
        return self.error.axis

    @property
    def is_rotation(self) -> bool:
        return self.error.is_rotation

    @property
    def is_straightness(self) -> bool:
        return self.error.is_straightness


@dataclass(frozen=True)
class Squareness:
    """A squareness error by its ISO 230-1 name, and where the two lines cross on which it was
    measured.
    """

    name: str
    value: float
    at: Three | None = None
    deviation: float = 0.0


@dataclass(frozen=True)
class AxisTemperature:
    """Expansion (1/K) of an axis whose temperature is off by `deviation` (K), known to
    `uncertainty` (K).
    """

    expansion: float
    deviation: float
    uncertainty: float = 0.0


@dataclass(frozen=True)
class MachineDescription:
    """A machine's arrangement and errors, in metres and radians.

    `arrangement_name` is one of the ten or "". `droop` has phi1 and phi2, in radians for each metre
    that the arm is moved out; `probing` is the standard deviation of each co-ordinate that probing
    adds.
    """

    title: str
    arrangement_name: str
    arrangement: Arrangement
    lower: Three
    upper: Three
    reference: Three
    probe: Three = (0.0, 0.0, 0.0)
    interpolation: Interpolation = "linear"
    criterion: Criterion = "end points"
    errors: tuple[ParametricError, ...] = ()
    squareness: tuple[Squareness, ...] = ()
    temperature: Mapping[str, AxisTemperature] = field(default_factory=dict)
    droop: Mapping[str, float] = field(default_factory=dict)
    probing: float = 0.0

    def scaled(self, axis: int, position: Array | float) -> Array:
        """Positions along an axis as fractions of it."""
        return np.asarray((position - self.lower[axis]) / (self.upper[axis] - self.lower[axis]))

    @property
    def arm_length(self) -> float:
        """Length of the axis that is an arm, for machines that have one."""
        axis = DROOP[self.arrangement_name][0]
        return self.upper[axis] - self.lower[axis]


def random_part(machine: MachineDescription) -> tuple[str, ...]:
    """What of a machine is random, in words: bandwidths, uncertain temperatures, and probing."""

    def is_random(deviation: float | Points | None) -> bool:
        return any(deviation.values) if isinstance(deviation, Points) else bool(deviation)

    stated: list[tuple[str, float | Points | None]] = [
        (one.name, one.deviation) for one in machine.errors
    ]
    stated += [(one.name, one.deviation) for one in machine.squareness]
    bandwidths = [name for name, deviation in stated if is_random(deviation)]
    uncertain = [
        axis for axis, one in machine.temperature.items() if one.uncertainty and one.expansion
    ]
    return (
        *(f"bandwidth of {name}" for name in bandwidths),
        *(f"uncertain temperature of {axis}" for axis in uncertain),
        *(["probing"] if machine.probing else []),
    )


def coupling(machine: MachineDescription, error: ParametricError) -> Array:
    """What the three rotations of an error's axis add to it on its line of measurement, (3,) in
    metres per radian.

    The rotation turns what the axis carries of the distance to the line through the reference
    point, and the probe. Displacements along the axis itself count on both lines alike; what they
    do to a straightedge on a table comes in addition.
    """
    offset = np.zeros((1, 3))
    if error.line is not None:
        offset[0] = np.subtract(error.line, machine.reference)
        offset[0, error.axis] = 0.0
    sign, vector = carried_vectors(machine.arrangement, offset, np.array([error.probe]))[error.axis]
    return sign * np.cross(np.eye(3), vector)[:, error.error.component]


def stated_function(
    machine: MachineDescription, error: ParametricError
) -> PowerSeries | Curve | None:
    """The error as stated in the file, a function of the fraction of the axis."""
    if isinstance(error.shape, Points):
        return error.shape.curve(
            machine.interpolation, machine.lower[error.axis], machine.upper[error.axis]
        )
    return error.shape


def reference_functions(machine: MachineDescription) -> dict[str, Combination]:
    """Errors on lines through the reference point, zero there, by ISO 230-1 name.

    Rotations first, as displacements measured elsewhere need them; then straightness errors lose
    their straight line. Where a rotation is not stated it counts as zero. Beyond the ends of a
    table what is left there goes on.
    """
    found: dict[str, Combination] = {}
    for error in sorted(machine.errors, key=lambda one: not one.is_rotation):
        shape = stated_function(machine, error)
        if shape is None:
            continue
        held = (shape.t[0], shape.t[-1]) if isinstance(shape, Curve) else None
        elsewhere = (*_by_rotations(machine, error, found), *_by_droop(machine, error))
        function = Combination(((1.0, shape), *elsewhere), held=held)
        if error.is_straightness:
            t = (
                np.asarray(shape.t)
                if isinstance(shape, Curve)
                else np.linspace(0.0, 1.0, REDUCTION_POINTS)
            )
            function = function.less(*reference_line(t, function.values(t)[:, 0], error.criterion))
        at_reference = machine.scaled(error.axis, machine.reference[error.axis])
        found[error.name] = function.less(float(function.values(np.atleast_1d(at_reference))[0, 0]))
    return found


def _by_rotations(
    machine: MachineDescription, error: ParametricError, known: Mapping[str, Combination]
) -> list[tuple[float, Combination | Lever]]:
    """What the rotations of its axis have added to an error where it was measured, with the
    opposite sign.
    """
    if error.is_rotation:
        return []
    own = np.eye(3)[error.axis]
    turned = np.cross(np.eye(3), own)[:, error.error.component]
    length = machine.upper[error.axis] - machine.lower[error.axis]
    t0 = float(machine.scaled(error.axis, machine.reference[error.axis]))
    parts: list[tuple[float, Combination | Lever]] = []
    for letter, factor, lever in zip(ROTATIONS, coupling(machine, error), turned, strict=True):
        rotation = known.get(f"E{letter}{TRANSLATIONS[error.axis]}")
        if rotation is not None and factor:
            parts.append((-float(factor), rotation))
        if rotation is not None and error.on_table and lever:
            # A table turns the workpiece the other way.
            parts.append((float(lever), Lever(rotation, length, t0)))
    return parts


def _by_droop(
    machine: MachineDescription, error: ParametricError
) -> list[tuple[float, PowerSeries]]:
    """What the tilt of the column has added to a displacement where it was measured, with the
    opposite sign.

    It is linear along the line, and zero on the one through the reference point. The bend of the
    arm is the same on all lines: it counts besides what is stated.
    """
    if error.is_rotation or error.line is None or "phi1" not in machine.droop:
        return []
    tilt = droop_field(machine.arrangement_name, "phi1", 1.0)
    ends = np.array([error.line, error.line])
    ends[:, error.axis] = machine.lower[error.axis], machine.upper[error.axis]
    component = error.error.component
    start, end = (
        machine.droop["phi1"] * tilt.values(ends - np.array(machine.reference))[:, component]
    ).tolist()
    return [(-1.0, PowerSeries((start, end - start)))]


def true_volumetric(machine: MachineDescription) -> TrueMachine:
    """The machine as an error model with its parameters: 1 for each function, and the numbers of
    the fields.
    """
    functions = reference_functions(machine)
    chain = _chain(machine, functions)
    fields = [*_thermal(machine), *_droop(machine)]
    values = [value for _, value in fields]
    model = VolumetricModel(chain, tuple(one for one, _ in fields))
    square = [
        (squareness_field(one.name), _at_reference(one, machine, model, values))
        for one in machine.squareness
    ]
    every = [*square, *fields]
    a = np.array([1.0] * len(chain.parameters) + [value for _, value in every])
    return TrueMachine(VolumetricModel(chain, tuple(one for one, _ in every)), a)


def _chain(machine: MachineDescription, functions: Mapping[str, Basis]) -> KinematicModel:
    found = tuple(error_function(name, function) for name, function in functions.items())
    return KinematicModel(
        machine.arrangement, found, machine.lower, machine.upper, origin=machine.reference
    )


def _thermal(machine: MachineDescription) -> list[tuple[Field, float]]:
    known = machine.temperature
    return [
        (thermal_field("xyz".index(axis)), known[axis].expansion * known[axis].deviation)
        for axis in known
    ]


def _droop(machine: MachineDescription) -> list[tuple[Field, float]]:
    if not machine.droop:
        return []
    length = machine.arm_length
    return [
        (droop_field(machine.arrangement_name, which, length), value * length)
        for which, value in machine.droop.items()
    ]


def _at_reference(
    squareness: Squareness, machine: MachineDescription, model: VolumetricModel, values: list[float]
) -> float:
    """The squareness error between lines through the reference point.

    Rotations of the axes, and the droop, tilt the two lines of measurement: the angle alpha that is
    measured between them shows as a sum of slopes -alpha, which is the sum at the reference point,
    -alpha*, plus the tilts. Displacements tilt nothing, as straightness errors have lost their
    straight line.
    """
    if squareness.at is None:
        return squareness.value
    error = SQUARENESS_ERRORS[squareness.name]
    first, second, sign = error.to, error.axis, -error.sign
    a = np.array([float(f.rotation) for f in model.chain.functions] + values)
    a[len(model.chain.functions) :] *= [one.unit == "rad" for one in model.fields]
    tilt = 0.0
    for along, across in ((first, second), (second, first)):
        t = np.linspace(0.0, 1.0, REDUCTION_POINTS)
        x = np.tile(np.asarray(squareness.at), (len(t), 1))
        x[:, along] = machine.lower[along] + t * (machine.upper[along] - machine.lower[along])
        tilted = model.error(x, a, np.zeros_like(x))[:, across]
        tilt += reference_line(x[:, along], tilted, machine.criterion)[1]
    return squareness.value + sign * tilt


def fitted_in_plane(machine: MachineDescription) -> MachineDescription:
    """The machine with those errors only that move points of the plane of x and y within it."""
    return replace(
        machine,
        errors=tuple(one for one in machine.errors if one.error.in_plane),
        squareness=tuple(one for one in machine.squareness if SQUARENESS_ERRORS[one.name].in_plane),
        temperature={axis: one for axis, one in machine.temperature.items() if axis != "z"},
        droop={},
    )


def fitted_volumetric(
    machine: MachineDescription, lower: tuple[float, ...], upper: tuple[float, ...], knots: int
) -> VolumetricModel:
    """The error model that estimates what the file states, in a volume from `lower` to `upper`;
    values are not used.

    Polynomials have the stated numbers of coefficients, and fitted splines their knots; other
    tables become cubic splines with so many interior `knots`, evenly spaced. The frame is that of
    the equations: functions are zero at the lower corner, straightness errors at both ends;
    squareness errors that are not stated are zero. Expansion is part of the positioning errors, and
    the arm's bend phi2 of its straightness where that is stated; neither is a parameter then. An
    axis with a temperature has a positioning error that is linear at least.
    """
    expanding = {f"E{axis.upper()}{axis.upper()}" for axis in machine.temperature}
    functions: dict[str, Basis] = {}
    for error in machine.errors:
        if error.shape is None:
            continue
        basis: Basis
        if isinstance(error.shape, SmoothedPoints):
            low, high = lower[error.axis], upper[error.axis]
            inside = [knot for knot in error.shape.knots if low < knot < high]
            basis = Polynomial(error.shape.order)
            if inside:
                scaled = tuple((knot - low) / (high - low) for knot in inside)
                basis = Spline(error.shape.order, scaled)
        elif isinstance(error.shape, Points):
            basis = Spline(4, tuple((np.arange(1, knots + 1) / (knots + 1)).tolist()))
        else:
            basis = Polynomial(
                max(len(error.shape.coefficients), 2 if error.name in expanding else 1)
            )
        basis = basis.interior() if error.is_straightness else basis
        if basis.size:
            functions[error.name] = basis
    functions |= {name: Polynomial(2) for name in sorted(expanding) if name not in functions}
    found = tuple(error_function(name, basis) for name, basis in functions.items())
    fields = [squareness_field(one.name) for one in machine.squareness]
    for which in machine.droop:
        axis, _, _ = DROOP[machine.arrangement_name]
        if which == "phi1" or f"EZ{TRANSLATIONS[axis]}" not in functions:
            fields.append(droop_field(machine.arrangement_name, which, upper[axis] - lower[axis]))
    return VolumetricModel(KinematicModel(machine.arrangement, found, lower, upper), tuple(fields))
