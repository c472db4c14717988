"""A machine of three axes seen in a plane of its x and y: an error model of two dimensions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .protocol import Array, ErrorModel, HasLines, Line, Parameter, Reported


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
