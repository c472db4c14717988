"""A true machine in the frame of the fitted model: a rigid motion of the frame changes no
measurement.

A machine file states errors relative to its reference point and straight lines, a fitted model
relative to the lower corner and lines of its own. Estimated poses and probe offsets depend on this
frame: compare estimates with a true machine in the same frame only.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from ballplate.simulator.computing import lstsq
from ballplate.simulator.geometry import cross_matrices
from ballplate.simulator.machines import Array, ErrorModel, Parameter, Reported, TrueMachine, Unit

# Number of random points of the comparison, and their largest probe offset in metres.
POINTS, OFFSET = 400, 0.1

_IN_SPACE: tuple[tuple[str, Unit], ...] = (
    ("shift along x", "m"),
    ("shift along y", "m"),
    ("shift along z", "m"),
    ("turn about x", "rad"),
    ("turn about y", "rad"),
    ("turn about z", "rad"),
)
_IN_PLANE: tuple[tuple[str, Unit], ...] = (*_IN_SPACE[:2], _IN_SPACE[-1])


@dataclass(frozen=True)
class FramedModel:
    """The errors of `model` in a shifted and turned frame, with probe offsets as at `corner` (d,).

    e(x, a, p) = m(x, a, p) - (m(corner, a, p) - p) + shift + turn x (x - corner), where m is the
    model's error and the last parameters are shift and turn: six, or three in a plane.
    """

    model: ErrorModel
    corner: tuple[float, ...]

    @property
    def dimension(self) -> int:
        return len(self.corner)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        motions = _IN_SPACE if self.dimension == 3 else _IN_PLANE
        frame = (Parameter(name, unit, name, f"{name} of the frame") for name, unit in motions)
        return (*self.model.parameters, *frame)

    def _at_corner(self, x: Array) -> Array:
        return np.broadcast_to(np.asarray(self.corner), x.shape)

    def error(self, x: Array, a: Array, p: Array) -> Array:
        n, d = len(self.model.parameters), self.dimension
        of_model, shift, turn = a[:n], a[n : n + d], a[n + d :]
        relative = (
            self.model.error(x, of_model, p) - self.model.error(self._at_corner(x), of_model, p) + p
        )
        from_corner = x - self._at_corner(x)
        if d == 2:
            return relative + shift + (_by_turn(from_corner) @ turn)
        return relative + shift + np.cross(turn, from_corner)

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        of_model, corner = a[: len(self.model.parameters)], self._at_corner(x)
        by_model = self.model.jacobian(x, of_model, p) - self.model.jacobian(corner, of_model, p)
        d = self.dimension
        shifts = np.broadcast_to(np.eye(d, dtype=by_model.dtype), (len(x), d, d))
        by_turn = cross_matrices(x - corner) if d == 3 else _by_turn(x - corner)
        return np.concatenate([by_model, shifts, by_turn], axis=2)

    def reported(self) -> Reported:
        """Return the model's report with shift and turn of the frame."""
        of_frame = self.parameters[len(self.model.parameters) :]
        return self.model.reported().beside(Reported.as_is(of_frame))


def _by_turn(v: Array) -> Array:
    """Return the derivative (m, 2, 1) of a turn of v (m, 2) in the plane."""
    return np.stack([-v[:, 1], v[:, 0]], axis=1)[:, :, None]


def in_frame_of(
    fitted: ErrorModel, machine: TrueMachine, lower: tuple[float, ...], upper: tuple[float, ...]
) -> TrueMachine:
    """Return the machine in the frame of a model fitted in the volume from `lower` to `upper`
    (metres).

    Shift and turn minimise the squared distance, over the volume, of the machine to the span of
    the model.
    """
    framed = FramedModel(machine.model, lower)
    generator = np.random.default_rng(np.random.SeedSequence(0))
    x = generator.uniform(lower, upper, (POINTS, len(lower)))
    p = generator.uniform(-OFFSET, OFFSET, x.shape)
    count = len(machine.a)
    a = np.concatenate([machine.a, np.zeros(len(framed.parameters) - count)])
    wanted = framed.error(x, a, p) - p
    by_model = fitted.jacobian(x, np.zeros(len(fitted.parameters)), p)
    by_frame = framed.jacobian(x, a, p)[:, :, count:]
    columns = np.concatenate([by_frame, by_model], axis=2).reshape(wanted.size, -1)
    a[count:] = -lstsq(columns, wanted.ravel(), rcond=None)[0][: len(a) - count]
    return TrueMachine(framed, a)
