"""Volumetric errors: the chain of axes with squareness, thermal expansion and the droop of an arm.

Source: Park, Burdekin and Peggs, section 5.1 and Appendix A.1, which prints the sum for ten
arrangements. To the errors of the kinematic model it adds fields, each a coefficient times a
polynomial of the position relative to the reference point.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.machines import (
    ERRORS,
    SQUARENESS_ERRORS,
    Array,
    KinematicModel,
    Line,
    Parameter,
    Reported,
    Unit,
)

# Component, factor and exponents of x, y and z.
Term = tuple[int, float, tuple[int, int, int]]


@dataclass(frozen=True)
class Field:
    """An error that is a coefficient times a polynomial of the position relative to the reference
    point.
    """

    name: str
    unit: Unit
    meaning: str
    terms: tuple[Term, ...]

    def values(self, x: Array) -> Array:
        """Return the displacement (m, 3) per unit of the coefficient, at x (m, 3) from the
        reference point.
        """
        displacement = np.zeros(x.shape, x.dtype)
        for component, factor, exponents in self.terms:
            displacement[:, component] += factor * np.prod(x ** np.array(exponents), axis=1)
        return displacement


SQUARENESS: dict[str, tuple[Term, ...]] = {
    "EC0Y": ((1, -1.0, (1, 0, 0)),),
    "EB0Z": ((0, 1.0, (0, 0, 1)),),
    "EA0Z": ((1, -1.0, (0, 0, 1)),),
}
"""Displacements by squareness errors: of Y to X about Z, of Z to X about Y, of Z to Y about X.

In the document's symbols alpha = EC0Y, beta1 = -EB0Z and beta2 = EA0Z. Its equations hold the Y
axis and let X turn by -alpha, where ISO 230-1 holds X: the same angle in frames that are turned to
one another.
"""

# The arm's own axis, and the components in which the column's tilt and the arm's bend show, with
# the printed signs.
DROOP: dict[str, tuple[int, tuple[int, float], tuple[int, float]]] = {
    "MH1": (0, (0, 1.0), (2, -0.5)),
    "MH2": (1, (1, 1.0), (2, 0.5)),
}


def squareness_field(name: str) -> Field:
    """Return a squareness error by its ISO 230-1 name, in radians."""
    return Field(name, "rad", SQUARENESS_ERRORS[name].meaning, SQUARENESS[name])


def thermal_field(axis: int) -> Field:
    """Return the expansion of an axis; its coefficient is expansion times temperature
    deviation.
    """
    exponents = int(axis == 0), int(axis == 1), int(axis == 2)
    meaning = f"thermal expansion along {AXIS_NAMES[axis]}"
    return Field(f"thermal {AXIS_NAMES[axis]}", "1", meaning, ((axis, 1.0, exponents),))


def droop_field(arrangement: str, name: str, length: float) -> Field:
    """Return the droop of an arm; its coefficient is the angle phi1 or phi2 at the extension
    `length`.

    As printed: MH1 has phi1 x z in X and -phi2 x^2 / 2 in Z, MH2 has phi1 y z in Y and +phi2 y^2 /
    2 in Z. An arm that sinks on extension has phi1 > 0 in both, phi2 > 0 in MH1, but phi2 < 0 in
    MH2: the printed phi2 y is a right-handed rotation about X, which lifts points at +y.
    """
    axis, tilt, bend = DROOP[arrangement]
    along = [int(k == axis) for k in range(3)]
    if name == "phi1":
        exponents = (along[0], along[1], 1)
        return Field(
            "phi1",
            "rad",
            "tilt of the column by the arm",
            ((tilt[0], tilt[1] / length, exponents),),
        )
    squared = (2 * along[0], 2 * along[1], 0)
    return Field("phi2", "rad", "bend of the arm", ((bend[0], bend[1] / length, squared),))


@dataclass(frozen=True)
class VolumetricModel:
    """e(x, a, p) of a chain of axes plus fields; a has the chain's parameters, then one per
    field.
    """

    chain: KinematicModel
    fields: tuple[Field, ...]

    @property
    def dimension(self) -> int:
        return 3

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        corners = np.array(list(product(*zip(self.chain.lower, self.chain.upper, strict=True))))
        of_fields = []
        for field in self.fields:
            effect = float(np.abs(field.values(self._from_origin(corners))).max())
            of_fields.append(Parameter(field.name, field.unit, field.name, field.meaning, effect))
        return (*self.chain.parameters, *of_fields)

    def _from_origin(self, x: Array) -> Array:
        return x - np.asarray(self.chain.lower if self.chain.origin is None else self.chain.origin)

    def error(self, x: Array, a: Array, p: Array) -> Array:
        n = len(self.chain.parameters)
        total = self.chain.error(x, a[:n], p)
        for field, value in zip(self.fields, a[n:], strict=True):
            total = total + value * field.values(self._from_origin(x))
        return total

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        n = len(self.chain.parameters)
        by_chain = self.chain.jacobian(x, a[:n], p)
        by_fields = [field.values(self._from_origin(x))[:, :, None] for field in self.fields]
        return np.concatenate([by_chain, *by_fields], axis=2)

    def lines(self, function: str, t: Array) -> tuple[Line, ...]:
        """Return an axis's function along it; a field's coefficient is constant."""
        if any(field.name == function for field in self.fields):
            return (Line("", np.ones((len(t), 1))),)
        return self.chain.lines(function, t)

    def reported(self) -> Reported:
        """Return functions as the kinematic model reports them, and the coefficients of the
        fields.
        """
        of_fields = self.parameters[len(self.chain.parameters) :]
        return self.chain.reported().beside(Reported.as_is(of_fields))


def meaning(name: str) -> str:
    """Return the description of an axis or squareness error.

    >>> meaning("EC0Y"), meaning("EXX")
    ('squareness of Y to X', 'positioning error of X')
    """
    return ERRORS[name].meaning
