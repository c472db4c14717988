"""The rigid motions of a chain of axes multiplied out: NPL Report CISE 15/98, equation (8)."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.number_arrays import Array

from .arrangement import Arrangement


def _plane_rotation(angle: Array, about: int, derivative: bool = False) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.zeros((len(angle), 3, 3), angle.dtype)
    i, j = (about + 1) % 3, (about + 2) % 3
    if derivative:
        c, s = -s, c
    else:
        matrix[:, about, about] = 1.0
    matrix[:, i, i], matrix[:, i, j], matrix[:, j, i], matrix[:, j, j] = c, -s, s, c
    return matrix


def rotation_and_derivatives(angles: Array) -> tuple[Array, list[Array]]:
    """Return Rz Ry Rx for angles (m, 3), and its three derivatives, each (m, 3, 3)."""
    plain = [_plane_rotation(angles[:, k], k) for k in range(3)]
    derivatives = []
    for k in range(3):
        factors = list(plain)
        factors[k] = _plane_rotation(angles[:, k], k, derivative=True)
        derivatives.append(factors[2] @ factors[1] @ factors[0])
    return plain[2] @ plain[1] @ plain[0], derivatives


def rigid_chain(
    arrangement: Arrangement, x: Array, translation: Array, rotation: Array, p: Array
) -> tuple[Array, list[Array], list[Array]]:
    """Return the rigid-body product of all axes: the positions (m, 3) of the probe's tip in the
    frame of the table, and their derivatives by each axis's translation and rotation, by axis (m,
    3, 3).
    """
    m = len(x)
    dtype = np.result_type(x, translation, p)
    by_translation = [np.zeros((0,))] * 3
    by_rotation = [np.zeros((0,))] * 3

    def step(axis: int) -> Array:
        displaced = translation[:, axis].astype(dtype, copy=True)
        displaced[:, axis] += x[:, axis]
        return displaced

    def turned(matrix: Array, vector: Array) -> Array:
        return np.einsum("mij,mj->mi", matrix, vector)

    # From the tip to the base of the probe's side: every axis turns what it carries, then adds its
    # own displacement and error. A derivative by the angles of an axis is found in that axis's
    # frame. The rotations of all axes nearer to the base then turn it into the frame of the base.
    tip = p.astype(dtype, copy=True)
    on_probe_side = [AXIS_NAMES.index(name) for name in arrangement.probe_side]
    for axis in reversed(on_probe_side):
        matrix, derivatives = rotation_and_derivatives(rotation[:, axis])
        by_rotation[axis] = np.stack([turned(d, tip) for d in derivatives], axis=2)
        tip = step(axis) + turned(matrix, tip)
    prefix = np.broadcast_to(np.eye(3, dtype=dtype), (m, 3, 3))
    for axis in on_probe_side:
        by_translation[axis] = prefix
        by_rotation[axis] = prefix @ by_rotation[axis]
        prefix = prefix @ rotation_and_derivatives(rotation[:, axis])[0]

    # The table moves the other way: going outwards, undo each axis's displacement, then its
    # rotation.
    passed = list(on_probe_side)
    for name in arrangement.workpiece_side:
        axis = AXIS_NAMES.index(name)
        matrix, derivatives = rotation_and_derivatives(rotation[:, axis])
        back = matrix.transpose(0, 2, 1)
        outside = tip + step(axis)
        by_translation[axis] = np.broadcast_to(np.eye(3, dtype=dtype), (m, 3, 3))
        by_rotation[axis] = np.zeros((m, 3, 3), dtype)
        # All derivatives so far are of vectors that this axis turns back.
        for earlier in [*passed, axis]:
            by_translation[earlier] = back @ by_translation[earlier]
            by_rotation[earlier] = back @ by_rotation[earlier]
        by_rotation[axis] = np.stack(
            [turned(d.transpose(0, 2, 1), outside) for d in derivatives], axis=2
        )
        tip = turned(back, outside)
        passed.append(axis)
    return tip, by_translation, by_rotation
