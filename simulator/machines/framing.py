"""A true machine in the frame of the fitted model: a rigid motion of the frame changes nothing that
is measured.

A machine file tells its errors from its reference point and its own straight lines, a fitted model
from the lower corner of the volume and from lines of its own. Poses are told from that frame and
offsets of probes as they are there, so that estimates can be compared with a true machine in the
same frame only.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..geometry.motions import cross_matrices
from .protocol import Array, ErrorModel, Parameter, Reported, TrueMachine, Unit

# Points at which the two are compared, at random in the volume, and largest probe offset there, in
# metres.
POINTS, OFFSET = 400, 0.1

_MOTIONS: tuple[tuple[str, Unit], ...] = (
    ("shift along x", "m"),
    ("shift along y", "m"),
    ("shift along z", "m"),
    ("turn about x", "rad"),
    ("turn about y", "rad"),
    ("turn about z", "rad"),
)


@dataclass(frozen=True)
class FramedModel:
    """The errors of `model` in a frame that is shifted and turned, with offsets of probes as at
    `corner` (3,).

    e(x, a, p) = m(x, a, p) - (m(corner, a, p) - p) + shift + turn x (x - corner), where m is the
    model's error and the last six parameters are the shift and the turn.
    """

    model: ErrorModel
    corner: tuple[float, ...]

    @property
    def dimension(self) -> int:
        return 3

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        frame = (Parameter(name, unit, name, f"{name} of the frame") for name, unit in _MOTIONS)
        return (*self.model.parameters, *frame)

    def _at_corner(self, x: Array) -> Array:
        return np.broadcast_to(np.asarray(self.corner), x.shape)

    def error(self, x: Array, a: Array, p: Array) -> Array:
        own, shift, turn = a[:-6], a[-6:-3], a[-3:]
        found = self.model.error(x, own, p) - self.model.error(self._at_corner(x), own, p) + p
        return found + shift + np.cross(turn, x - self._at_corner(x))

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        own, corner = a[:-6], self._at_corner(x)
        by_own = self.model.jacobian(x, own, p) - self.model.jacobian(corner, own, p)
        shifts = np.broadcast_to(np.eye(3, dtype=by_own.dtype), (len(x), 3, 3))
        return np.concatenate([by_own, shifts, cross_matrices(x - corner)], axis=2)

    def reported(self) -> Reported:
        """As the model reports itself, with the frame's shift and turn."""
        return self.model.reported().beside(Reported.as_is(self.parameters[-6:]))


def in_frame_of(
    fitted: ErrorModel, machine: TrueMachine, lower: tuple[float, ...], upper: tuple[float, ...]
) -> TrueMachine:
    """The machine in the frame of a model that is fitted in the volume from `lower` to `upper`, in
    metres.

    That is where the machine comes nearest, by least squares over the volume, to what the model can
    be: exactly the model's own frame if the model can follow the machine.
    """
    framed = FramedModel(machine.model, lower)
    generator = np.random.default_rng(np.random.SeedSequence(0))
    x = generator.uniform(lower, upper, (POINTS, 3))
    p = generator.uniform(-OFFSET, OFFSET, (POINTS, 3))
    a = np.concatenate([machine.a, np.zeros(6)])
    wanted = framed.error(x, a, p) - p
    by_model = fitted.jacobian(x, np.zeros(len(fitted.parameters)), p)
    by_frame = framed.jacobian(x, a, p)[:, :, -6:]
    columns = np.concatenate([by_frame, by_model], axis=2).reshape(wanted.size, -1)
    a[-6:] = -np.linalg.lstsq(columns, wanted.ravel(), rcond=None)[0][:6]
    return TrueMachine(framed, a)
