"""Rigid motions: parameters, small rotations as vectors, best fits of two point sets, and of a
sphere to points.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from ballplate.simulator.computing.numerics import lstsq, svd
from ballplate.simulator.inputs.number_arrays import Array

AXIS_NAMES = ("x", "y", "z")

# Extent of points across their line, as a fraction of that along it, above which they are in none.
ACROSS = 1e-6


def cross_matrices(v: Array) -> Array:
    """Return matrices (m, 3, 3) whose product with a small rotation is rotation x v.

    >>> cross_matrices(np.array([[1.0, 2.0, 3.0]]))[0].tolist()
    [[0.0, 3.0, -2.0], [-3.0, 0.0, 1.0], [2.0, -1.0, 0.0]]
    """
    matrix = np.zeros((len(v), 3, 3), v.dtype)
    matrix[:, 0, 1], matrix[:, 0, 2] = v[:, 2], -v[:, 1]
    matrix[:, 1, 0], matrix[:, 1, 2] = -v[:, 2], v[:, 0]
    matrix[:, 2, 0], matrix[:, 2, 1] = v[:, 1], -v[:, 0]
    return matrix


def rotation_from_vector(vector: Array) -> Array:
    """Return rotations (m, d, d) by `vector`: (m, 3) about an axis in space, (m, 1) in the plane.

    >>> rotation_from_vector(np.array([[np.pi / 2]])).round(12).tolist()
    [[[0.0, -1.0], [1.0, 0.0]]]
    """
    if vector.shape[1] == 1:
        c, s = np.cos(vector[:, 0]), np.sin(vector[:, 0])
        return np.stack([np.stack([c, -s], axis=1), np.stack([s, c], axis=1)], axis=1)
    angle = np.linalg.norm(vector, axis=1)
    # sin(t)/t and (1 - cos t)/t^2, both smooth at 0, where np.sinc is exact.
    first = np.sinc(angle / np.pi)[:, None, None]
    second = (0.5 * np.sinc(angle / (2 * np.pi)) ** 2)[:, None, None]
    cross = cross_matrices(-vector)
    return np.eye(3) + first * cross + second * (cross @ cross)


def vector_from_rotation(rotation: Array) -> Array:
    """Invert `rotation_from_vector` for turns below pi: (m, 3) or (m, 1) from (m, d, d).

    >>> vector_from_rotation(rotation_from_vector(np.array([[0.1, -0.2, 0.3]]))).round(12).tolist()
    [[0.1, -0.2, 0.3]]
    """
    if rotation.shape[1] == 2:
        return np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])[:, None]
    # The antisymmetric part is 2 sin(t) times the axis, and the trace 1 + 2 cos(t). Both together
    # give the angle to full accuracy: near 0 the cosine has no digits of it, near a right angle the
    # sine.
    double_sine = np.stack(
        [
            rotation[:, 2, 1] - rotation[:, 1, 2],
            rotation[:, 0, 2] - rotation[:, 2, 0],
            rotation[:, 1, 0] - rotation[:, 0, 1],
        ],
        axis=1,
    )
    sine = 0.5 * np.linalg.norm(double_sine, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(rotation, axis1=1, axis2=2) - 1.0))
    return 0.5 * double_sine / np.sinc(angle / np.pi)[:, None]


def vector_rate(vector: Array) -> Array:
    """Return the derivative (m, q, q) of `vector_from_rotation` by a small turn about the
    machine's axes.
    """
    m, q = vector.shape
    if q == 1:
        return np.ones((m, 1, 1))
    angle = np.linalg.norm(vector, axis=1)
    half = 0.5 * np.where(angle > 1e-4, angle, 1e-4)
    # (1 - (t/2) cot(t/2)) / t^2, which is 1/12 for small t.
    second = np.where(angle > 1e-4, (1.0 - half / np.tan(half)) / (4.0 * half**2), 1.0 / 12.0)
    cross = cross_matrices(-vector)
    return np.eye(3) - 0.5 * cross + second[:, None, None] * (cross @ cross)


def fit_motion(source: Array, target: Array) -> tuple[Array, Array]:
    """Return rotation (d, d) and origin (d,) that bring points `source` (n, d) closest to `target`
    (n, d).

    Points in a plane determine the rotation in space. Points on a line leave the turn about it
    undetermined; one such rotation is returned.
    """
    centre_source, centre_target = source.mean(axis=0), target.mean(axis=0)
    u, _, vh = svd((target - centre_target).T @ (source - centre_source))
    # The last sign makes the rotation proper, also if all points lie in a plane.
    sign = np.ones(source.shape[1])
    sign[-1] = np.sign(np.linalg.det(u @ vh))
    rotation = (u * sign) @ vh
    return rotation, centre_target - rotation @ centre_source


def fixes_pose(points: Array) -> bool:
    """Return True if points (n, d) fix a motion: in space three that are not collinear.

    >>> fixes_pose(np.array([[0.0, 0.0], [1.0, 0.0]])), fixes_pose(np.zeros((1, 3)))
    (True, False)
    """
    n, d = points.shape
    if n < d:
        return False
    extent = svd(points - points.mean(axis=0), compute_uv=False)
    return bool(extent[d - 2] > ACROSS * extent[0])


def rigid_motions(points: Array) -> Array:
    """Return displacements (n, d, m) of points (n, d) by unit shifts and by unit turns about z, x
    and y, in this order, to first order.
    """
    n, d = points.shape
    motions = np.zeros((n, d, d * (d + 1) // 2))
    motions[:, range(d), range(d)] = 1.0
    # In this order the turn about z is the first, in space as in the plane.
    planes = [(0, 1), (1, 2), (2, 0)] if d == 3 else [(0, 1)]
    for column, (i, j) in enumerate(planes, start=d):
        motions[:, i, column], motions[:, j, column] = -points[:, j], points[:, i]
    return motions


def without_rigid_motion(points: Array, errors: Array) -> Array:
    """Return errors (n, d, r) less the small rigid motion of points (n, d) in each column."""
    n, d = points.shape
    if n == 0 or errors.shape[2] == 0:
        return errors

    # A rigid motion changes no distance to first order. The remainder is small if distances are
    # well determined, so that differences formed from it keep their digits.
    motions = rigid_motions(points)
    basis, sizes, _ = svd(motions.reshape(n * d, -1), full_matrices=False)
    basis = basis[:, sizes > 1e-12 * sizes.max()]
    flat = errors.reshape(n * d, -1)
    # The second pass subtracts what rounding left of a large motion in the first.
    for _ in range(2):
        flat = flat - basis @ (basis.T @ flat)
    return flat.reshape(errors.shape)


def pose_size(dimension: int) -> int:
    """Return the number of parameters of a rigid motion: 6 in space, 3 in the plane."""
    return dimension * (dimension + 1) // 2


def pose_parameter_names(dimension: int) -> tuple[str, ...]:
    """Return the names of a pose's parameters in order.

    >>> pose_parameter_names(2)
    ('origin x', 'origin y', 'rotation z')
    """
    axes = AXIS_NAMES[:dimension]
    turns = axes if dimension == 3 else ("z",)
    return tuple(f"origin {axis}" for axis in axes) + tuple(f"rotation {axis}" for axis in turns)


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


# Directions of the centre that points show by less than this fraction of what they show best are
# left alone: a machine's errors and noise bend a plane by less.
FLAT = 1e-3


def fit_sphere(points: Array, near: Array) -> tuple[Array, float]:
    """Centre (d,) and radius of the sphere, in two dimensions the circle, through points (m, d).

    The squares |x - c|^2 - r^2 are minimised, which is linear in c and |c|^2 - r^2. Where the
    points lie in a plane or on a line, the centre stays where `near` is across it.
    """
    middle = points.mean(axis=0)
    local = points - middle
    half = 0.5 * ((local**2).sum(axis=1) - (local**2).sum(axis=1).mean())
    start = near - middle
    move = lstsq(local, half - local @ start, rcond=FLAT)[0]
    centre = start + move
    return middle + centre, float(np.sqrt(((local - centre) ** 2).sum(axis=1).mean()))
