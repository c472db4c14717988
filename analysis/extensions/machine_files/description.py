"""A machine as a file describes it, and the resulting error functions at its reference point.

Source: Park, Burdekin and Peggs, sections 3 to 5 and Appendix A.2. A parametric error measured on
another line than that through the reference point contains the rotations of its axis, times the
distance of the lines.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from ballplate.simulator.machines import (
    AXIS_ERRORS,
    ROTATIONS,
    SQUARENESS_ERRORS,
    TRANSLATIONS,
    Arrangement,
    Array,
    AxisError,
    Basis,
    KinematicModel,
    Polynomial,
    SingleFunction,
    Spline,
    TrueMachine,
    carried_vectors,
    error_function,
)

from .curves import Curve, Interpolation, Points
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
        """Return the polynomial at t (m,), as (m, 1).

        >>> PowerSeries((1.0, 0.0, 2.0)).values(np.array([0.5]))
        array([[1.5]])
        """
        return np.asarray(np.polynomial.polynomial.polyval(t, self.coefficients), float)[:, None]


@dataclass(frozen=True)
class Lever:
    """A rotation times the distance of its axis from the reference point: `length` (t - `t0`)
    metres.
    """

    rotation: Combination
    length: float
    t0: float

    def values(self, t: Array) -> Array:
        """Return the product at t (m,), as (m, 1)."""
        return self.length * (t - self.t0)[:, None] * self.rotation.values(t)


@dataclass(frozen=True)
class Combination(SingleFunction):
    """A single function: a weighted sum of functions less a straight line, constant beyond
    `held`.
    """

    parts: tuple[tuple[float, PowerSeries | Curve | Combination | Lever], ...]
    intercept: float = 0.0
    slope: float = 0.0
    held: tuple[float, float] | None = None

    kind: ClassVar[str] = "stated"

    def values(self, t: Array) -> Array:
        """Return the function at t (m,), as (m, 1)."""
        t = t if self.held is None else np.clip(t, *self.held)
        total = -self.intercept - self.slope * t[:, None]
        for factor, part in self.parts:
            total = total + factor * part.values(t)
        return total

    def less(self, intercept: float, slope: float = 0.0) -> Combination:
        """Return the function less another straight line."""
        return replace(self, intercept=self.intercept + intercept, slope=self.slope + slope)


@dataclass(frozen=True)
class ParametricError:
    """An error of an axis, as stated or measured.

    `line` has the positions of the axes on the line of measurement (that of its own axis is
    ignored); ``None`` is the line through the reference point. `probe` is the offset of the
    measured tip or reflector from the point whose position the scales indicate. `on_table`: the
    straightedge was on a table that the axis moves; otherwise a point fixed to the moved part was
    measured. `deviation` is the standard deviation of the random part, along the axis or at
    points.
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
        """The error by its name."""
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
    """A squareness error by its ISO 230-1 name, and the crossing `at` of its two lines of
    measurement.
    """

    name: str
    value: float
    at: Three | None = None
    deviation: float = 0.0


@dataclass(frozen=True)
class AxisTemperature:
    """Expansion (1/K) of an axis at a temperature `deviation` (K) with its `uncertainty` (K)."""

    expansion: float
    deviation: float
    uncertainty: float = 0.0


@dataclass(frozen=True)
class MachineDescription:
    """A machine's arrangement and errors, in metres and radians.

    `arrangement_name` is one of the ten or "". `droop` has phi1 and phi2, in radians per metre of
    arm extension; `probing` is the standard deviation that probing adds to each co-ordinate.
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
        """Return positions along an axis as fractions of it."""
        return np.asarray((position - self.lower[axis]) / (self.upper[axis] - self.lower[axis]))

    @property
    def arm_length(self) -> float:
        """Length of the axis that is an arm, for machines with an arm."""
        axis = DROOP[self.arrangement_name][0]
        return self.upper[axis] - self.lower[axis]


def coupling(machine: MachineDescription, error: ParametricError) -> Array:
    """Return effects of the three rotations of an error's axis on its line of measurement, (3,)
    m/rad.

    The lever is the part of the distance to the line through the reference point that the axis
    moves, plus the probe. Displacements along the axis itself are equal on both lines; their
    effect on a straightedge on a table is added separately.
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
    """Return the error as stated in the file, a function of the fraction of the axis."""
    if isinstance(error.shape, Points):
        return error.shape.curve(
            machine.interpolation, machine.lower[error.axis], machine.upper[error.axis]
        )
    return error.shape


def reference_functions(machine: MachineDescription) -> dict[str, Combination]:
    """Return errors on lines through the reference point, zero there, by ISO 230-1 name.

    Unstated rotations are zero. Beyond the ends of a table the corrected error stays constant.
    """
    functions: dict[str, Combination] = {}
    # Rotations first: displacements on other lines need them.
    for error in sorted(machine.errors, key=lambda error: not error.is_rotation):
        shape = stated_function(machine, error)
        if shape is None:
            continue
        ends = (shape.t[0], shape.t[-1]) if isinstance(shape, Curve) else None
        line_effects = (*_by_rotations(machine, error, functions), *_by_droop(machine, error))
        function = Combination(((1.0, shape), *line_effects), held=ends)
        if error.is_straightness:
            t = (
                np.asarray(shape.t)
                if isinstance(shape, Curve)
                else np.linspace(0.0, 1.0, REDUCTION_POINTS)
            )
            function = function.less(*reference_line(t, function.values(t)[:, 0], error.criterion))
        at_reference = function.values(
            np.atleast_1d(machine.scaled(error.axis, machine.reference[error.axis]))
        )
        functions[error.name] = function.less(float(at_reference[0, 0]))
    return functions


def _by_rotations(
    machine: MachineDescription, error: ParametricError, functions: Mapping[str, Combination]
) -> list[tuple[float, Combination | Lever]]:
    """Return the effects of its axis's rotations on a measured error, with opposite sign."""
    if error.is_rotation:
        return []
    direction = np.eye(3)[error.axis]
    turned = np.cross(np.eye(3), direction)[:, error.error.component]
    length = machine.upper[error.axis] - machine.lower[error.axis]
    t0 = float(machine.scaled(error.axis, machine.reference[error.axis]))
    parts: list[tuple[float, Combination | Lever]] = []
    for letter, factor, lever in zip(ROTATIONS, coupling(machine, error), turned, strict=True):
        rotation = functions.get(f"E{letter}{TRANSLATIONS[error.axis]}")
        if rotation is not None and factor:
            parts.append((-float(factor), rotation))
        if rotation is not None and error.on_table and lever:
            # A table turns the workpiece the other way.
            parts.append((float(lever), Lever(rotation, length, t0)))
    return parts


def _by_droop(
    machine: MachineDescription, error: ParametricError
) -> list[tuple[float, PowerSeries]]:
    """Return the effect of the column's tilt on a measured displacement, with opposite sign."""
    if error.is_rotation or error.line is None or "phi1" not in machine.droop:
        return []
    # Linear along the line, zero on the line through the reference point. The arm's bend is equal
    # on all lines and is added to stated errors.
    tilt = droop_field(machine.arrangement_name, "phi1", 1.0)
    ends = np.array([error.line, error.line])
    ends[:, error.axis] = machine.lower[error.axis], machine.upper[error.axis]
    component = error.error.component
    start, end = (
        machine.droop["phi1"] * tilt.values(ends - np.array(machine.reference))[:, component]
    ).tolist()
    return [(-1.0, PowerSeries((start, end - start)))]


def true_volumetric(machine: MachineDescription) -> TrueMachine:
    """Return the machine as an error model with parameters: 1 per function, and values of the
    fields.
    """
    functions = reference_functions(machine)
    chain = _chain(machine, functions)
    fields = [*_thermal(machine), *_droop(machine)]
    values = [value for _, value in fields]
    model = VolumetricModel(chain, tuple(field for field, _ in fields))
    square = [
        (squareness_field(angle.name), _at_reference(angle, machine, model, values))
        for angle in machine.squareness
    ]
    every = [*square, *fields]
    a = np.array([1.0] * len(chain.parameters) + [value for _, value in every])
    return TrueMachine(VolumetricModel(chain, tuple(field for field, _ in every)), a)


def _chain(machine: MachineDescription, functions: Mapping[str, Basis]) -> KinematicModel:
    error_functions = tuple(error_function(name, basis) for name, basis in functions.items())
    return KinematicModel(
        machine.arrangement, error_functions, machine.lower, machine.upper, origin=machine.reference
    )


def _thermal(machine: MachineDescription) -> list[tuple[Field, float]]:
    return [
        (thermal_field("xyz".index(axis)), state.expansion * state.deviation)
        for axis, state in machine.temperature.items()
    ]


def _droop(machine: MachineDescription) -> list[tuple[Field, float]]:
    if not machine.droop:
        return []
    length = machine.arm_length
    return [
        (droop_field(machine.arrangement_name, name, length), value * length)
        for name, value in machine.droop.items()
    ]


def _at_reference(
    squareness: Squareness, machine: MachineDescription, model: VolumetricModel, values: list[float]
) -> float:
    """Return the squareness error between lines through the reference point."""
    if squareness.at is None:
        return squareness.value
    # Axis rotations and droop tilt the two lines of measurement. The measured angle alpha is a sum
    # of slopes -alpha: that at the reference point, -alpha*, plus the tilts. Displacements tilt
    # neither line: straightness errors have lost their straight line.
    error = SQUARENESS_ERRORS[squareness.name]
    first, second, sign = error.to, error.axis, -error.sign
    a = np.array([float(f.rotation) for f in model.chain.functions] + values)
    a[len(model.chain.functions) :] *= [field.unit == "rad" for field in model.fields]
    tilt = 0.0
    for along, across in ((first, second), (second, first)):
        t = np.linspace(0.0, 1.0, REDUCTION_POINTS)
        x = np.tile(np.asarray(squareness.at), (len(t), 1))
        x[:, along] = machine.lower[along] + t * (machine.upper[along] - machine.lower[along])
        tilted = model.error(x, a, np.zeros_like(x))[:, across]
        tilt += reference_line(x[:, along], tilted, machine.criterion)[1]
    return squareness.value + sign * tilt


def fitted_in_plane(machine: MachineDescription) -> MachineDescription:
    """Return the machine with only the errors that move points of the xy plane within it."""
    return replace(
        machine,
        errors=tuple(error for error in machine.errors if error.error.in_plane),
        squareness=tuple(
            angle for angle in machine.squareness if SQUARENESS_ERRORS[angle.name].in_plane
        ),
        temperature={axis: state for axis, state in machine.temperature.items() if axis != "z"},
        droop={},
    )


def fitted_volumetric(
    machine: MachineDescription, lower: tuple[float, ...], upper: tuple[float, ...], knots: int
) -> VolumetricModel:
    """Return the model that estimates the errors in a file, in a volume from `lower` to `upper`.

    Stated values are not used. Polynomials have the stated numbers of coefficients, fitted splines
    their knots; other tables become cubic splines with `knots` evenly spaced interior knots.
    Functions are zero at the lower corner, straightness errors at both ends, unstated squareness
    errors everywhere. Positioning errors include expansion, and the arm's straightness, if stated,
    its bend phi2; neither is a parameter then. An axis with a temperature has at least a linear
    positioning error.
    """
    expanding = {f"E{axis.upper()}{axis.upper()}" for axis in machine.temperature}
    functions = {}
    for error in machine.errors:
        if error.shape is None:
            continue
        basis: Basis
        if isinstance(error.shape, Points) and error.shape.order:
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
    error_functions = tuple(error_function(name, basis) for name, basis in functions.items())
    fields = [squareness_field(angle.name) for angle in machine.squareness]
    for name in machine.droop:
        axis, _, _ = DROOP[machine.arrangement_name]
        if name == "phi1" or f"EZ{TRANSLATIONS[axis]}" not in functions:
            fields.append(droop_field(machine.arrangement_name, name, upper[axis] - lower[axis]))
    chain = KinematicModel(machine.arrangement, error_functions, lower, upper)
    return VolumetricModel(chain, tuple(fields))
