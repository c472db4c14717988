"""Rotation matrices from angles, exact at multiples of 90 degrees."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array


def cosine_and_sine(angle: float) -> tuple[float, float]:
    """Return cosine and sine of an angle (rad), exactly 0 or ±1 at multiples of 90 degrees.

    >>> cosine_and_sine(math.pi / 2)
    (0.0, 1.0)
    """
    quarter_turns = round(angle / (math.pi / 2))
    if math.isclose(angle, quarter_turns * (math.pi / 2), rel_tol=1e-15, abs_tol=0.0):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarter_turns % 4]
    return math.cos(angle), math.sin(angle)


def rotation_matrix(angles: Sequence[float]) -> Array:
    """Return the rotation by angles (rad): (3, 3) for three angles, (2, 2) for one.

    Three angles turn about the fixed x axis, then y, then z: Rz(c) Ry(b) Rx(a).

    :raises ValueError: neither one nor three angles.

    >>> rotation_matrix([0.0, 0.0, math.pi / 2]) @ [1.0, 0.0, 0.0]
    array([0., 1., 0.])
    """
    if len(angles) == 1:
        cosine, sine = cosine_and_sine(angles[0])
        return np.array([[cosine, -sine], [sine, cosine]]) + 0.0
    if len(angles) != 3:
        raise ValueError(f"a rotation has one angle or three, not {len(angles)}")
    (ca, sa), (cb, sb), (cc, sc) = (cosine_and_sine(angle) for angle in angles)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, ca, -sa], [0.0, sa, ca]])
    about_y = np.array([[cb, 0.0, sb], [0.0, 1.0, 0.0], [-sb, 0.0, cb]])
    about_z = np.array([[cc, -sc, 0.0], [sc, cc, 0.0], [0.0, 0.0, 1.0]])
    # Adding zero turns every -0.0 into 0.0.
    return about_z @ about_y @ about_x + 0.0
