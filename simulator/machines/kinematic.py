"""The kinematic error model: 18 functions of one variable on a chain of axes, optionally 3
squareness errors.

Sources: NPL Report CISE 15/98, section 2.2; Park, Burdekin and Peggs, Appendix A. Rotations are
right-handed about the machine's axes (ISO 230-1: EAX, EBX, ECX about X, Y, Z as the X axis moves),
of opposite sign to the NPL report.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import ClassVar

import numpy as np
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.number_arrays import Array

from .arrangement import AXIS_ERRORS, SQUARENESS_ERRORS, Arrangement, AxisError, SquarenessError
from .bases import Basis, Polynomial, Quoted, SingleFunction
from .protocol import ErrorModel, HasLines, Line, Parameter, Reported

# Straightness held at zero at the far end, so that the frame's axes are those of the machine: the x
# axis gives the direction of x, and the plane of the x and y axes is the xy plane (NPL section
# 2.4.1).
HELD_AT_FAR_END = ("EYX", "EZX", "EZY")


@dataclass(frozen=True)
class Slope(SingleFunction):
    """The function `rise` t: the straight part of a straightness error, by its angle."""

    rise: float

    kind: ClassVar[str] = "straight"

    def values(self, t: Array) -> Array:
        """Return the line at t (m,), as (m, 1)."""
        return self.rise * t[:, None]

    def quoted(self, variable: str = "t") -> Quoted:
        """Return the angle unchanged."""
        return Quoted(("",), np.eye(1))


@dataclass(frozen=True)
class ErrorFunction:
    """One of the 18 functions, or a squareness error, with its basis."""

    error: AxisError | SquarenessError
    basis: Basis

    @property
    def name(self) -> str:
        return self.error.name

    @property
    def axis(self) -> int:
        """The axis (0 to 2) that moves."""
        return self.error.axis

    @property
    def component(self) -> int:
        """The direction of a displacement (0 to 2), or the axis of a rotation."""
        error = self.error
        return error.to if isinstance(error, SquarenessError) else error.component

    @property
    def rotation(self) -> bool:
        """True for a rotation."""
        return isinstance(self.error, AxisError) and self.error.is_rotation

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of its coefficients; a squareness error has its own name."""
        if isinstance(self.error, SquarenessError):
            return (self.name,)
        return tuple(f"{self.name}[{k + 1}]" for k in range(self.basis.size))


@dataclass(frozen=True)
class KinematicModel:
    """e(x, a, p) of a chain of axes; `full_rotations` multiplies rotation matrices out.

    `lower` and `upper` (3,) bound the volume in metres: error functions depend on the position
    along their axis scaled to [0, 1]. The chain starts from `origin` (3,), by default the lower
    corner.
    """

    arrangement: Arrangement
    functions: tuple[ErrorFunction, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    full_rotations: bool = False
    origin: tuple[float, ...] | None = None

    @property
    def dimension(self) -> int:
        return 3

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        span = np.subtract(self.upper, self.lower)
        parameters = []
        for function in self.functions:
            # The effect of a coefficient on points: the peak of its function, and for a rotation
            # the longest arm in the volume. It scales parameters when rank and steps are judged,
            # and needs no accuracy.
            grid = np.linspace(0.0, 1.0, 65)
            peaks = np.abs(function.basis.values(grid)).max(axis=0, initial=0.0)
            arm = float(span.max()) if function.rotation else 1.0
            error = function.error
            parameters += [
                Parameter(name, error.unit, error.name, error.meaning, arm * peak)
                for name, peak in zip(function.parameter_names, peaks, strict=True)
            ]
        return tuple(parameters)

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Indices of each function's coefficients in a."""
        slices, start = {}, 0
        for function in self.functions:
            slices[function.name] = slice(start, start + function.basis.size)
            start += function.basis.size
        return slices

    def scaled(self, x: Array) -> Array:
        """Return positions x (m, 3) scaled to [0, 1] over the volume."""
        lower = np.asarray(self.lower)
        return (x - lower) / (np.asarray(self.upper) - lower)

    def _bases(self, x: Array) -> dict[tuple[int, Basis], Array]:
        t = self.scaled(x)
        different = {(f.axis, f.basis) for f in self.functions}
        return {(axis, basis): basis.values(t[:, axis]) for axis, basis in different}

    def _motions(
        self, bases: dict[tuple[int, Basis], Array], a: Array, m: int
    ) -> tuple[Array, Array]:
        """Return displacement and rotation of every axis, each (m, 3 axes, 3 components)."""
        translation, rotation = np.zeros((m, 3, 3), a.dtype), np.zeros((m, 3, 3), a.dtype)
        for f in self.functions:
            target = rotation if f.rotation else translation
            # A straightness and a squareness error share a component.
            target[:, f.axis, f.component] += bases[f.axis, f.basis] @ a[self.slices[f.name]]
        return translation, rotation

    def motions(self, x: Array, a: Array) -> tuple[Array, Array]:
        """Return displacement and rotation of every axis at x (m, 3), each (m, 3 axes, 3
        components).
        """
        return self._motions(self._bases(x), a, len(x))

    def error(self, x: Array, a: Array, p: Array) -> Array:
        translation, rotation = self.motions(x, a)
        from_origin = x - np.asarray(self.lower if self.origin is None else self.origin)
        if self.full_rotations:
            from ._rigid_chain import rigid_chain

            return (
                rigid_chain(self.arrangement, from_origin, translation, rotation, p)[0]
                - from_origin
            )
        # NPL Report CISE 15/98, equation (10): products of errors are neglected, so that the
        # rotations of axes add up, each crosswise with what its axis carries.
        carried = carried_vectors(self.arrangement, from_origin, p)
        moved = translation.sum(axis=1) + p
        for axis, (sign, vector) in enumerate(carried):
            moved = moved + sign * _crossed(rotation[:, axis], vector)
        return np.asarray(moved)

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        bases = self._bases(x)
        from_origin = x - np.asarray(self.lower if self.origin is None else self.origin)
        if self.full_rotations:
            from ._rigid_chain import rigid_chain

            translation, rotation = self._motions(bases, a, len(x))
            _, by_translation, by_rotation = rigid_chain(
                self.arrangement, from_origin, translation, rotation, p
            )
        else:
            carried = carried_vectors(self.arrangement, from_origin, p)
        result = np.zeros((len(x), 3, len(self.parameters)), np.result_type(x, a, p, float))
        for f in self.functions:
            values, columns = bases[f.axis, f.basis], self.slices[f.name]
            if self.full_rotations:
                source = by_rotation if f.rotation else by_translation
                for row in range(3):
                    direction = source[f.axis][:, row, f.component]
                    if direction.any():
                        np.multiply(values, direction[:, None], out=result[:, row, columns])
            elif f.rotation:
                # The unit vector of the component times the carried one, crosswise.
                sign, vector = carried[f.axis]
                first, second = (f.component + 1) % 3, (f.component + 2) % 3
                result[:, first, columns] = values * (-sign * vector[:, second, None])
                result[:, second, columns] = values * (sign * vector[:, first, None])
            else:
                result[:, f.component, columns] = values
        return result

    def lines(self, function: str, t: Array) -> tuple[Line, ...]:
        """Return the function along its axis; a squareness error is constant."""
        return tuple(
            Line("", np.ones((len(t), 1)))
            if isinstance(f.error, SquarenessError)
            else Line("", f.basis.values(t), f.axis)
            for f in self.functions
            if f.name == function
        )

    def reported(self) -> Reported:
        """Return monomial coefficients on [0, 1], as NPL section 6 quotes U3, or those of
        B-splines.
        """
        return self._reported

    @cached_property
    def _reported(self) -> Reported:
        quoted = [f.basis.quoted() for f in self.functions]
        names: list[str] = []
        units = []
        matrix = np.zeros((sum(len(q.names) for q in quoted), len(self.parameters)))
        for f, q in zip(self.functions, quoted, strict=True):
            matrix[len(names) : len(names) + len(q.names), self.slices[f.name]] = q.matrix
            names += [f"{f.name} {name}".rstrip() for name in q.names]
            units += [f.error.unit] * len(q.names)
        return Reported(tuple(names), tuple(units), matrix)


def error_function(name: str, basis: Basis) -> ErrorFunction:
    """Return one of the 18 functions by its ISO 230-1 name.

    >>> yaw = error_function("ECX", Polynomial(3))
    >>> yaw.axis, yaw.component, yaw.rotation
    (0, 2, True)
    """
    return ErrorFunction(AXIS_ERRORS[name], basis)


def kinematic_model(
    arrangement: Arrangement,
    position_coefficients: int,
    rotation_coefficients: int,
    lower: tuple[float, ...],
    upper: tuple[float, ...],
    full_rotations: bool = False,
) -> KinematicModel:
    """Return the model with polynomials of the stated numbers of coefficients, constants included.

    These are NDEL and NEPS of NPL Report CISE 15/98.

    >>> from .arrangement import ARRANGEMENTS
    >>> len(kinematic_model(ARRANGEMENTS["MB2"], 5, 5, (0, 0, 0), (1, 1, 1)).parameters)
    69
    """
    position, rotation = Polynomial(position_coefficients), Polynomial(rotation_coefficients)
    return kinematic_model_of(arrangement, position, rotation, lower, upper, full_rotations)


@lru_cache(maxsize=16)
def kinematic_model_of(
    arrangement: Arrangement,
    position: Basis,
    rotation: Basis,
    lower: tuple[float, ...],
    upper: tuple[float, ...],
    full_rotations: bool = False,
    single_families: tuple[tuple[str, Basis | None], ...] = (),
    squareness: bool = False,
) -> KinematicModel:
    """Return the model with functions of two families, for positional and rotational errors.

    `single_families` has families of single functions by ISO 230-1 name, ``None`` to omit one. All
    18 functions vanish at the lower corner; EYX, EZX and EZY (straightness) at the far end also.
    With `squareness` all six straightness functions do, and three squareness errors are
    parameters: the 21-parameter form, equivalent if the families contain t.
    """
    # Conditions on the functions fix the frame (NPL section 2.4.1). They remove exactly what no
    # reading distinguishes: the displacements at 0, a turn of the frame in three of the six linear
    # terms, and constant rotations, which turn the probe, and the axes mounted on an axis as linear
    # terms of their straightnesses do.
    families = dict(single_families)
    functions = []
    for is_rotation, family in ((False, position), (True, rotation)):
        for error in AXIS_ERRORS.values():
            basis = families.get(error.name, family)
            if error.is_rotation == is_rotation and basis is not None:
                is_held = error.is_straightness if squareness else error.name in HELD_AT_FAR_END
                functions.append(ErrorFunction(error, basis.interior() if is_held else basis))
    span = np.subtract(upper, lower)
    if squareness:
        functions += [
            ErrorFunction(error, Slope(error.sign * float(span[error.axis])))
            for error in SQUARENESS_ERRORS.values()
        ]
    return KinematicModel(arrangement, tuple(functions), lower, upper, full_rotations)


def in_plane(model: KinematicModel) -> KinematicModel:
    """Return the model with only the errors that move points of the xy plane within it."""
    return replace(model, functions=tuple(f for f in model.functions if f.error.in_plane))


def carried_vectors(arrangement: Arrangement, x: Array, p: Array) -> list[tuple[float, Array]]:
    """Return per axis the sign of its rotation's effect and the vector (m, 3) that it turns.

    On the probe's side: the chain beyond the axis, and the probe offset. On the workpiece's side:
    x + p less the displacements of the axes between this axis and the workpiece.
    """
    by_axis = {}
    for side, sign in ((arrangement.probe_side, 1.0), (arrangement.workpiece_side, -1.0)):
        for index, axis in enumerate(side):
            beyond = np.array([name in side[index + 1 :] for name in AXIS_NAMES])
            vector = x * beyond + p if sign > 0 else x * ~beyond + p
            by_axis[axis] = (sign, vector)
    return [by_axis[axis] for axis in AXIS_NAMES]


def _crossed(v: Array, w: Array) -> Array:
    """Return v x w, both (m, 3)."""
    # The generality of np.cross costs most of its time.
    product = np.empty(v.shape, np.result_type(v, w))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        product[:, i] = v[:, j] * w[:, k] - v[:, k] * w[:, j]
    return product


@dataclass(frozen=True)
class PlaneModel:
    """The errors in x and y of a three-dimensional model, with its z axis at `z` metres throughout.

    Offsets of probes are those in the plane.
    """

    spatial: ErrorModel
    z: float

    @property
    def dimension(self) -> int:
        return 2

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.spatial.parameters

    def error(self, x: Array, a: Array, p: Array) -> Array:
        return self.spatial.error(_with_z(x, self.z), a, _with_z(p, 0.0))[:, :2]

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        spatial = self.spatial.jacobian(_with_z(x, self.z), a, _with_z(p, 0.0))
        return np.ascontiguousarray(spatial[:, :2])

    def lines(self, function: str, t: Array) -> tuple[Line, ...]:
        """Return the function as the three-dimensional model shows it."""
        assert isinstance(self.spatial, HasLines)
        return self.spatial.lines(function, t)

    def reported(self) -> Reported:
        return self.spatial.reported()


def in_space(
    lower: tuple[float, ...], upper: tuple[float, ...]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the corners of a volume; a plane volume becomes equally high and wide, from z = 0.

    >>> in_space((0.0, 0.5), (1.0, 2.5))
    ((0.0, 0.5, 0.0), (1.0, 2.5, 2.0))
    """
    if len(lower) == 3:
        return lower, upper
    height = max(end - start for start, end in zip(lower, upper, strict=True))
    return (*lower, 0.0), (*upper, height)


def _with_z(x: Array, z: float) -> Array:
    return np.column_stack([x, np.full(len(x), z)])
