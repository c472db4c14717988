"""The kinematic error model: 18 functions of one variable on a chain of axes, and perhaps three
squareness errors.

Sources: NPL Report CISE 15/98, section 2.2; Park, Burdekin and Peggs, Appendix A. Rotations are
right-handed about the machine's axes (ISO 230-1: EAX, EBX, ECX about X, Y, Z as the X axis moves),
of opposite sign to those of the NPL report.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from .arrangement import AXES, Arrangement
from .bases import Basis, Polynomial, Quoted
from .error_names import AXIS_ERRORS, SQUARENESS_ERRORS, AxisError, SquarenessError
from .protocol import Array, Line, Parameter, Reported, Unit
from .rigid_chain import RigidChain

# Straightness held at zero at the far end, so that the frame's axes are those of the machine: the x
# axis gives the direction of x, and the plane of the x and y axes is the xy plane (NPL section
# 2.4.1).
HELD_AT_FAR_END = ("EYX", "EZX", "EZY")


@dataclass(frozen=True)
class Slope:
    """The one function `rise` t: the straight part of a straightness error, by its angle."""

    rise: float

    @property
    def zero_at_one(self) -> bool:
        return False

    @property
    def size(self) -> int:
        return 1

    def values(self, t: Array) -> Array:
        """The line at t (m,), as (m, 1)."""
        return self.rise * t[:, None]

    def interior(self) -> Basis:
        raise TypeError("a slope has no part that vanishes at both ends")

    def quoted(self, variable: str = "t") -> Quoted:
        """The angle as it is."""
        return Quoted(("",), np.eye(1))

    def quoted_whole(self, variable: str = "t") -> Quoted:
        raise TypeError("a slope is a single function")


@dataclass(frozen=True)
class ErrorFunction:
    """One of the 18 functions, or a squareness error, with the functions it is made of."""

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
        """Along what (0 to 2) it displaces, or about what it turns."""
        error = self.error
        return error.to if isinstance(error, SquarenessError) else error.component

    @property
    def rotation(self) -> bool:
        """Whether it turns what the axis carries."""
        return isinstance(self.error, AxisError) and self.error.is_rotation

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of its coefficients; a squareness error is its own only one."""
        if isinstance(self.error, SquarenessError):
            return (self.name,)
        return tuple(f"{self.name}[{k + 1}]" for k in range(self.basis.size))


@dataclass(frozen=True)
class KinematicModel:
    """e(x, a, p) of a chain of axes; `full_rotations` multiplies rotation matrices out.

    `lower` and `upper` (3,) bound the volume in metres: the error functions depend on the position
    along their axis scaled to [0, 1], and the chain starts from `origin` (3,), by default the lower
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
        found = []
        for function in self.functions:
            grid = np.linspace(0.0, 1.0, 65)
            peaks = np.abs(function.basis.values(grid)).max(axis=0, initial=0.0)
            arm = float(span.max()) if function.rotation else 1.0
            error = function.error
            found += [
                Parameter(name, error.unit, error.name, error.meaning, arm * peak)
                for name, peak in zip(function.parameter_names, peaks, strict=True)
            ]
        return tuple(found)

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Indices of each function's coefficients in a."""
        found, start = {}, 0
        for function in self.functions:
            found[function.name] = slice(start, start + function.basis.size)
            start += function.basis.size
        return found

    def scaled(self, x: Array) -> Array:
        """Positions x (m, 3) scaled to [0, 1] over the volume."""
        lower = np.asarray(self.lower)
        return (x - lower) / (np.asarray(self.upper) - lower)

    def _bases(self, x: Array) -> dict[tuple[int, Basis], Array]:
        t = self.scaled(x)
        different = {(f.axis, f.basis) for f in self.functions}
        return {(axis, basis): basis.values(t[:, axis]) for axis, basis in different}

    def _motions(
        self, bases: dict[tuple[int, Basis], Array], a: Array, m: int
    ) -> tuple[Array, Array]:
        """Displacement and rotation of every axis, each (m, 3 axes, 3 components)."""
        translation, rotation = np.zeros((m, 3, 3), a.dtype), np.zeros((m, 3, 3), a.dtype)
        for f in self.functions:
            target = rotation if f.rotation else translation
            # A straightness error and a squareness error displace alike.
            target[:, f.axis, f.component] += bases[f.axis, f.basis] @ a[self.slices[f.name]]
        return translation, rotation

    def motions(self, x: Array, a: Array) -> tuple[Array, Array]:
        """Displacement and rotation of every axis at positions x (m, 3), each (m, 3 axes, 3
        components).
        """
        return self._motions(self._bases(x), a, len(x))

    def error(self, x: Array, a: Array, p: Array) -> Array:
        translation, rotation = self.motions(x, a)
        from_origin = x - np.asarray(self.lower if self.origin is None else self.origin)
        if self.full_rotations:
            return RigidChain(self.arrangement, from_origin, translation, rotation, p).error()
        carried = carried_vectors(self.arrangement, from_origin, p)
        moved = translation.sum(axis=1) + p
        for axis, (sign, vector) in enumerate(carried):
            moved = moved + sign * _crossed(rotation[:, axis], vector)
        return np.asarray(moved)

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        bases = self._bases(x)
        from_origin = x - np.asarray(self.lower if self.origin is None else self.origin)
        if self.full_rotations:
            translation, rotation = self._motions(bases, a, len(x))
            by_translation, by_rotation = RigidChain(
                self.arrangement, from_origin, translation, rotation, p
            ).sensitivities()
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
                one, other = (f.component + 1) % 3, (f.component + 2) % 3
                result[:, one, columns] = values * (-sign * vector[:, other, None])
                result[:, other, columns] = values * (sign * vector[:, one, None])
            else:
                result[:, f.component, columns] = values
        return result

    def lines(self, function: str, t: Array) -> tuple[Line, ...]:
        """The function along its axis; a squareness error is the same everywhere."""
        return tuple(
            Line("", np.ones((len(t), 1)))
            if isinstance(f.error, SquarenessError)
            else Line("", f.basis.values(t), f.axis)
            for f in self.functions
            if f.name == function
        )

    def reported(self) -> Reported:
        """Monomial coefficients on [0, 1], the form in which NPL section 6 quotes U3, or
        coefficients of B-splines.
        """
        return self._reported

    @cached_property
    def _reported(self) -> Reported:
        quoted = [f.basis.quoted() for f in self.functions]
        names: list[str] = []
        units: list[Unit] = []
        matrix = np.zeros((sum(len(q.names) for q in quoted), len(self.parameters)))
        for f, q in zip(self.functions, quoted, strict=True):
            matrix[len(names) : len(names) + len(q.names), self.slices[f.name]] = q.matrix
            names += [f"{f.name} {name}".rstrip() for name in q.names]
            units += [f.error.unit] * len(q.names)
        return Reported(tuple(names), tuple(units), matrix)


def error_function(name: str, basis: Basis) -> ErrorFunction:
    """One of the 18 functions by its ISO 230-1 name.

    >>> found = error_function("ECX", Polynomial(3))
    >>> found.axis, found.component, found.rotation
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
    """The model with polynomials of the stated numbers of coefficients, constants included.

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
    own: tuple[tuple[str, Basis | None], ...] = (),
    squareness: bool = False,
) -> KinematicModel:
    """The model with functions of the two families for its positional and its rotational errors.

    `own` has families of single functions by ISO 230-1 name, None for one that there is not. All
    18 functions vanish at the lower corner, and the three straightness functions EYX, EZX and EZY
    at the far end too. With `squareness` all six straightness functions do, and the three
    squareness errors are parameters besides: the 21-parameter form, which can do the same where
    the families contain t.
    """
    families = dict(own)
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
    """The model with those errors only that move points of the plane of x and y within it."""
    return replace(model, functions=tuple(f for f in model.functions if f.error.in_plane))


def carried_vectors(arrangement: Arrangement, x: Array, p: Array) -> list[tuple[float, Array]]:
    """For each axis the sign of its rotation's effect and the vector (m, 3) it carries.

    On the probe's side: what follows in the chain, and the probe offset. On the workpiece's side:
    the whole of x + p less the displacements of the axes between this one and the workpiece.
    """
    found: dict[str, tuple[float, Array]] = {}
    for side, sign in ((arrangement.probe_side, 1.0), (arrangement.workpiece_side, -1.0)):
        for place, axis in enumerate(side):
            beyond = np.array([name in side[place + 1 :] for name in AXES])
            vector = x * beyond + p if sign > 0 else x * ~beyond + p
            found[axis] = (sign, vector)
    return [found[axis] for axis in AXES]


def _crossed(v: Array, w: Array) -> Array:
    """v x w, both (m, 3): as np.cross has it, without its general ways, which take far longer."""
    found = np.empty(v.shape, np.result_type(v, w))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        found[:, i] = v[:, j] * w[:, k] - v[:, k] * w[:, j]
    return found
