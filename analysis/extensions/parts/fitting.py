"""Fits of geometrical elements to points by orthogonal distances: least squares and minimum zone.

The elements are those of A. B. Forbes, Least-squares best-fit geometric elements, NPL Report
DITC 140/89, and ISO 10360-6.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from ballplate.simulator.computing import pinv
from ballplate.simulator.inputs import Array, listed
from numpy.typing import ArrayLike

Kind = Literal["point", "line", "plane", "circle", "sphere", "cylinder", "cone"]
MOST_STEPS, ZONE_STEPS = 20, 4
# Singular values below this part of the largest are zero.
UNDETERMINED = 1e-9
STRAIGHT = ("point", "line", "plane")
WITH_AXIS = ("cylinder", "cone")
# What a fit changes: displacements along three axes, turns about them, radius and half-angle.
CHANGED = {
    "point": [2],
    "line": [2, 4],
    "plane": [2, 3, 4],
    "circle": [0, 1, 6],
    "sphere": [0, 1, 2, 6],
    "cylinder": [0, 1, 3, 4, 6],
    "cone": [0, 1, 3, 4, 6, 7],
}
WORDS = np.repeat(["position", "direction", "radius", "angle"], [3, 3, 1, 1])


@dataclass(frozen=True, eq=False)
class GeometricElement:
    """A geometrical element, or a batch of them in leading dimensions.

    ``centre`` (..., 3) is a point of it, or of its axis; ``direction`` (..., 3) the unit vector
    along a line, normal to a plane (away from the material) or circle, or along an axis; ``radius``
    (...) is at ``centre``, 0 without any; ``half_angle`` (...) is that of a cone that opens along
    ``direction``; ``normal`` (..., 3) is the unit vector away from the material along which points
    of a line or a point are measured. The material surrounds an element that ``is_inner``.
    """

    kind: Kind
    centre: Array
    direction: Array
    radius: Array
    half_angle: Array
    normal: Array
    is_inner: bool = False


def element(
    kind: Kind,
    centre: ArrayLike,
    direction: ArrayLike = (0.0, 0.0, 1.0),
    radius: float = 0.0,
    half_angle: float = 0.0,
    normal: ArrayLike = (0.0, 0.0, 1.0),
    is_inner: bool = False,
) -> GeometricElement:
    """Return one element; lengths in m, the half-angle in rad, directions of any length."""
    place, along, size, opening, out = (
        np.asarray(value, dtype=float) for value in (centre, direction, radius, half_angle, normal)
    )
    return GeometricElement(kind, place, unit(along), size, opening, unit(out), is_inner)


def unit(vectors: Array) -> Array:
    """Return vectors (..., 3) scaled to the length 1."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def frame(direction: Array) -> Array:
    """Return two unit vectors (..., 2, 3) across similar directions (..., 3) that depend smoothly
    on them, right-handed with them.
    """
    axis = np.eye(3)[np.abs(direction.reshape(-1, 3).mean(axis=0)).argmin()]
    first = unit(axis - dot(direction, axis)[..., None] * direction)
    return np.stack([first, np.cross(direction, first)], axis=-2)


def dot(one: Array, other: Array) -> Array:
    """Return the scalar products of vectors (..., 3)."""
    return np.asarray((one * other).sum(axis=-1))


def outward(elements: GeometricElement) -> Array:
    """Return the direction (..., 3) away from the material of a plane, a line or a point."""
    return elements.normal if elements.kind in ("point", "line") else elements.direction


def represented(elements: GeometricElement, places: Array) -> GeometricElement:
    """Return the same elements with centres at their points, or those of their axes, next to places
    (..., 3).
    """
    if elements.kind not in ("line", "plane", *WITH_AXIS):
        return elements
    across = dot(places - elements.centre, elements.direction)
    along = across[..., None] * elements.direction
    if elements.kind == "plane":
        return replace(elements, centre=places - along)
    radius = elements.radius + across * np.tan(elements.half_angle)
    return replace(elements, centre=elements.centre + along, radius=radius)


def offset(elements: GeometricElement, amount: float) -> GeometricElement:
    """Return elements moved by an amount in m away from the material."""
    if elements.kind in STRAIGHT:
        return replace(elements, centre=elements.centre + amount * outward(elements))
    change = (-amount if elements.is_inner else amount) / np.cos(elements.half_angle)
    return replace(elements, radius=elements.radius + change)


def distances(elements: GeometricElement, points: Array) -> Array:
    """Return distances (..., n) of points (..., n, 3) from elements, positive outside the material;
    those from a circle are in its plane.
    """
    return _measured(elements, points)[0]


def normals_at(elements: GeometricElement, points: Array) -> Array:
    """Return the unit normals (..., n, 3) away from the material at points (..., n, 3)."""
    return _measured(elements, points)[1]


def fit(nominal: GeometricElement, points: Array) -> tuple[GeometricElement, Array]:
    """Fit elements to a batch of points (b, n, 3) by least squares from a nominal start, in steps
    of Gauss and Newton.

    A line is fitted in the plane of its direction and its normal, a circle in its nominal plane,
    and a point is moved along its normal. Returns the elements, each represented at the centroid of
    its points, and the residuals (b, n), positive outside the material.
    """
    elements, size = represented(nominal, points.mean(axis=1)), _size(points)
    middle = points.mean(axis=0)
    # The derivatives at the mean of the batch bring all near to their places at once.
    jacobian = _jacobian(represented(nominal, middle.mean(axis=0)), middle, size)[None]
    for _ in range(MOST_STEPS):
        inverse = pinv(jacobian.mean(axis=0))
        every = np.broadcast_to(jacobian, (*points.shape[:2], jacobian.shape[2]))
        gradient = np.einsum("bnp,bn->bp", every, distances(elements, points))
        step = -gradient @ (inverse @ inverse.T)
        elements = _moved(elements, step, size)
        # The next step is smaller by the ratio of the residuals to the size.
        if len(jacobian) == len(points) and np.abs(step).max() < 1e-9 * size:
            break
        jacobian = _jacobian(elements, points, size)
    elements = represented(elements, points.mean(axis=1))
    return elements, distances(elements, points)


def fit_zone(nominal: GeometricElement, points: Array) -> tuple[GeometricElement, Array]:
    """Fit elements to a batch of points (b, n, 3) such that the largest distance is least, which is
    the minimum zone: successive linear programmes from the least-squares fit.

    Returns the same as `fit`.
    """
    elements, residuals = fit(nominal, points)
    size = _size(points)
    for _ in range(ZONE_STEPS):
        step, _ = least_largest(_jacobian(elements, points, size), residuals)
        there = distances(_moved(elements, step, size), points)
        step[np.ptp(there, axis=1) > np.ptp(residuals, axis=1)] = 0.0
        elements = represented(_moved(elements, step, size), points.mean(axis=1))
        residuals = distances(elements, points)
    return elements, residuals


def least_largest(jacobian: Array, residuals: Array) -> tuple[Array, Array]:
    """Return steps (b, p) after which the largest of residuals (b, n) that change by derivatives
    (b, n, p) are least, and these (b,): one linear programme.
    """
    from scipy.optimize import linprog
    from scipy.sparse import block_diag

    ones = np.ones((*residuals.shape, 1))
    sides = np.block([[jacobian, -ones], [-jacobian, -ones]])
    # In micrometres, beside which the tolerances of the solver are small.
    answer = linprog(
        np.tile(np.eye(sides.shape[2])[-1], len(sides)),
        block_diag(sides),
        1e6 * np.concatenate([-residuals, residuals], axis=1).ravel(),
        bounds=(None, None),
    )
    found = 1e-6 * answer.x.reshape(len(sides), -1)
    return found[:, :-1], found[:, -1]


def undetermined(nominal: GeometricElement, points: Array) -> str:
    """Return what of an element points (n, 3) do not determine, in words; empty if they determine
    all of it.

    >>> undetermined(element("plane", [0, 0, 0]), np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]]))
    'its points do not determine the direction of the plane; add some elsewhere'
    """
    near = represented(nominal, points.mean(axis=0))
    jacobian = _jacobian(near, points, _size(points[None]))
    seen = np.diag(pinv(jacobian, rcond=UNDETERMINED) @ jacobian)
    what = WORDS[CHANGED[nominal.kind]][seen < 1 - UNDETERMINED].tolist()
    if not what:
        return ""
    words = listed(list(dict.fromkeys(what)))
    return f"its points do not determine the {words} of the {nominal.kind}; add some elsewhere"


def _size(points: Array) -> float:
    """Largest standard deviation (m) of a coordinate of a batch of points (b, n, 3)."""
    return float(points.std(axis=1).max()) or 1.0


def _measured(elements: GeometricElement, points: Array) -> tuple[Array, Array, Array]:
    """Return distances (..., n), their gradients (..., n, 3), and their derivatives (..., n, 2) by
    the radius and the half-angle.
    """
    away = points - elements.centre[..., None, :]
    direction = elements.direction[..., None, :]
    if elements.kind in STRAIGHT:
        out = np.broadcast_to(outward(elements)[..., None, :], away.shape)
        return dot(away, out), out, np.zeros((*away.shape[:-1], 2))
    along = dot(away, direction)
    across = away if elements.kind == "sphere" else away - along[..., None] * direction
    distance = np.linalg.norm(across, axis=-1)
    sign = -1 if elements.is_inner else 1
    cos, sin = (sign * of(elements.half_angle)[..., None] for of in (np.cos, np.sin))
    gradient = (cos / distance)[..., None] * across - sin[..., None] * direction
    beyond = distance - elements.radius[..., None]
    by_shape = np.stack([-cos + 0.0 * along, -beyond * sin - along * cos], axis=-1)
    return beyond * cos - along * sin, gradient, by_shape


def _jacobian(elements: GeometricElement, points: Array, size: float) -> Array:
    """Return derivatives (..., n, p) of distances by what a fit changes, see `_moved`."""
    away = points - elements.centre[..., None, :]
    _, gradient, by_shape = _measured(elements, points)
    along = np.swapaxes(_axes(elements), -1, -2)
    by_motion = -gradient @ along, -np.cross(away, gradient) @ along / size
    columns = np.concatenate([*by_motion, by_shape / [1.0, size]], axis=-1)
    return np.asarray(columns[..., CHANGED[elements.kind]])


def _axes(elements: GeometricElement) -> Array:
    """Return the unit vectors (..., 3, 3) along and about which elements are moved."""
    third = outward(elements)
    first = elements.direction if elements.kind == "line" else frame(third)[..., 0, :]
    return np.stack([first, np.cross(third, first), third], axis=-2)


def _moved(elements: GeometricElement, step: Array, size: float) -> GeometricElement:
    """Return elements changed by steps (..., p), turns being multiplied by the size (m)."""
    steps = np.zeros((*step.shape[:-1], 8))
    steps[..., CHANGED[elements.kind]] = step
    axes = _axes(elements)
    shift, turn = (np.einsum("...i,...ij->...j", steps[..., k : k + 3], axes) for k in (0, 3))
    direction, normal = (
        unit(vectors + np.cross(turn / size, vectors))
        for vectors in (elements.direction, elements.normal)
    )
    return replace(
        elements,
        centre=elements.centre + shift,
        direction=direction,
        radius=elements.radius + steps[..., 6],
        half_angle=elements.half_angle + steps[..., 7] / size,
        normal=normal,
    )
