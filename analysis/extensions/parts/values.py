"""Dimensions of fitted features: values, and their derivatives by the touched points.

The members of a dimension are smooth functions of the points; its value is their combination, such
as a range. Sizes are those of ISO 14405-1, zones those of ISO 1101.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from ballplate.simulator.computing import pinv
from ballplate.simulator.inputs import Array, listed

from .datums import in_datums, sensed
from .fitting import (
    CHANGED,
    STRAIGHT,
    WITH_AXIS,
    GeometricElement,
    distances,
    dot,
    fit,
    fit_zone,
    frame,
    undetermined as open_parameters,
)
from .part import FORMS, Dimension, Workpiece

Fits = Mapping[str, tuple[GeometricElement, Array]]
# Part of a feature's extent, or m and rad, by which points are displaced for derivatives.
STEP = 1e-6


def fitted(part: Workpiece, dimension: Dimension, points: Mapping[str, Array]) -> Fits:
    """Return fits to batches of points (b, n, 3) by the names of the features that a dimension
    uses.
    """
    return {
        name: (fit_zone if dimension.zone and name in dimension.features else fit)(
            part.features[name].nominal, points[name]
        )
        for name in dimension.used
    }


def members(part: Workpiece, dimension: Dimension, fits: Fits) -> Array:
    """Return the members (b, k) of a dimension in m or rad from fits of its features and datums.

    They are: of a size, distance or angle its deviation from nominal; of a form the residuals; of
    the orientation of a plane the deviations of its points along the zone; of that of an axis its
    tilt times its length; of a position the components of the deviation of each end of an axis, of
    a centre, or of each point of a plane. Points count where they nominally are along surfaces.
    """
    elements = [fits[name][0] for name in dimension.features]
    if dimension.kind in FORMS:
        return fits[dimension.features[0]][1]
    if dimension.datums:
        return _in_zone(part, dimension, fits)
    nominal = [part.features[name].nominal for name in dimension.features]
    return (size(dimension.kind, nominal, elements) - dimension.nominal)[..., None]


def size(
    kind: str, nominal: Sequence[GeometricElement], found: Sequence[GeometricElement]
) -> Array:
    """Return diameters, radii, distances or angles (...) of elements, in m or rad."""
    if kind in ("diameter", "radius"):
        return found[0].radius * (2 if kind == "diameter" else 1)
    return (_distance if kind == "distance" else _angle)(nominal, found)


def combine(dimension: Dimension, members: Array) -> Array:
    """Return the values (b,) of a dimension in m or rad from its members (b, k)."""
    if dimension.components == 0:
        return np.asarray(np.ptp(members, axis=1))
    if dimension.components is None:
        return members[:, 0]
    vectors = members.reshape(len(members), -1, dimension.components)
    largest: Array = np.linalg.norm(vectors, axis=2).max(axis=1)
    return largest * 2 if dimension.kind == "position" else largest


def weights(part: Workpiece, dimension: Dimension) -> dict[str, Array]:
    """Return the derivatives (k, n) of the members of a dimension by the displacement of each point
    of a feature along its normal away from the material, by the name of the feature.

    They are central differences of least-squares fits, also where the minimum zone is asked for,
    which has no derivative at a perfect form.
    """
    smooth, derivatives = replace(dimension, zone=False), {}
    for name in dimension.used:
        moved, n = part.features[name], len(part.features[name].points)
        step = STEP * (float(np.ptp(moved.points, axis=0).max()) or 1.0)
        steps = step * np.concatenate([np.eye(n), -np.eye(n)])
        points = {other: part.features[other].points[None] for other in dimension.used}
        points[name] = moved.points + steps[:, :, None] * moved.normals
        found = members(part, smooth, fitted(part, smooth, points))
        derivatives[name] = (found[:n] - found[n:]).T / (2 * step)
    return derivatives


def undetermined(part: Workpiece, dimension: Dimension) -> str:
    """Return what the points or the datums of a dimension leave open, in words, or an empty text.

    Datums leave open what changes a position although the whole part is moved.
    """
    for name in dimension.used:
        feature = part.features[name]
        if text := open_parameters(feature.nominal, feature.points):
            return f"{name}: {text}"
        if dimension.kind in FORMS and len(feature.points) <= len(CHANGED[feature.nominal.kind]):
            return f"{name}: {len(feature.points)} points fit any form; add some"
    if dimension.kind != "position":
        return ""
    motions = STEP * np.eye(7)[:, None, :6]
    points = {
        name: (x := part.features[name].points) + motions[..., :3] + np.cross(motions[..., 3:], x)
        for name in dimension.used
    }
    found = members(part, dimension, fitted(part, dimension, points))
    if np.abs(found - found[6]).max() < 1e-4 * STEP:
        return ""
    return f"{listed(list(dimension.datums))} leave motions of it open; add a datum that fixes them"


def _distance(nominal: Sequence[GeometricElement], found: Sequence[GeometricElement]) -> Array:
    between = found[1].centre - found[0].centre
    planes = [
        np.sign(dot(nominal[1].centre - nominal[0].centre, one.direction))
        * dot(between, element.direction)
        for one, element in zip(nominal, found, strict=True)
        if one.kind == "plane"
    ]
    if planes:
        return np.mean(planes, axis=0)
    axes = [one.direction for one in nominal if one.kind not in ("sphere", "point")]
    directions = np.reshape(axes, (-1, 3))
    across = np.eye(3) - pinv(directions, rcond=1e-9) @ directions
    return np.asarray(np.linalg.norm(between @ across, axis=-1))


def _angle(nominal: Sequence[GeometricElement], found: Sequence[GeometricElement]) -> Array:
    """Angle in the material between planes, the smaller one between others."""
    (first, second), count = found, sum(one.kind == "plane" for one in nominal)
    sign = -1 if count == 2 or dot(nominal[0].direction, nominal[1].direction) < 0 else 1
    crossed = np.linalg.norm(np.cross(first.direction, second.direction), axis=-1)
    angle = np.arctan2(crossed, sign * dot(first.direction, second.direction))
    return np.asarray(np.pi / 2 - angle if count == 1 else angle)


def _in_zone(part: Workpiece, dimension: Dimension, fits: Fits) -> Array:
    (name,) = dimension.features
    feature, (element, residuals) = part.features[name], fits[name]
    nominal, is_position = feature.nominal, dimension.kind == "position"
    # Turns that datums leave open are free in an orientation, and follow the feature.
    datums = dimension.datums if is_position else (*dimension.datums, name)
    seen = in_datums(
        [part.features[datum].nominal for datum in datums],
        [fits[datum][0] for datum in datums],
        element,
    )
    if nominal.kind == "plane" or is_position and nominal.kind in STRAIGHT:
        heights = residuals - distances(seen, feature.points)
        # An orientation does not sense what all of its points have in common.
        return heights if is_position else heights - heights.mean(axis=-1, keepdims=True)
    if not is_position:
        length = float(np.linalg.norm(np.subtract(*feature.ends)))
        return length * seen.direction @ frame(nominal.direction).T
    along = sensed(nominal).T
    if nominal.kind not in WITH_AXIS:
        return (seen.centre - nominal.centre) @ along
    slope = seen.direction / dot(seen.direction, nominal.direction)[..., None]
    away = [seen.centre - end for end in feature.ends]
    ends = [one - dot(one, nominal.direction)[..., None] * slope for one in away]
    return np.concatenate([end @ along for end in ends], axis=1)
