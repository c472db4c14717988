"""Nominal features of a part file, and patterns of points on them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.simulator.computing import svd
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import Array, ExperimentError, Problems, Trust, read_table

from .fitting import GeometricElement, dot, element, normals_at, represented
from .part import PartFeature
from .part_sections import FEATURES

# Angle between neighbours on an even spiral.
GOLDEN = np.pi * (3 - np.sqrt(5))
# Least height (m) that is none, and cosine.
FLAT = 1e-9

Made = tuple[GeometricElement, Array]
Face = PartFeature | None


def read_feature(
    name: str,
    settings: Any,
    features: Mapping[str, PartFeature],
    problems: Problems,
    folder: Path,
    trust: Trust,
) -> PartFeature | None:
    """Return a feature, or None after reporting its faults; `features` are those above it, and
    tables are read from a folder.
    """
    steps = ("features", name)
    kind = next(kind for kind in FEATURES if kind in settings.stated)
    count, listed = getattr(settings, "points", 1), None
    try:
        if isinstance(count, str):
            rows = read_table(trust.file(folder, count), (), ("x", "y", "z"))
            listed = np.array([row.lengths for row in rows])
        elif np.ndim(count) == 2:
            listed = np.array(count)
        face = features.get(getattr(settings, "on", ""))
        if kind == "fit" and listed is not None:
            nominal, pattern = _fitted(listed, _unit(settings.normal)), listed
        else:
            one = 1 if listed is not None else count
            nominal, pattern = SHAPES[kind](settings, kind, one, face)
    except ExperimentError as error:
        problems.take(error, (*steps, "points"))
        return None
    except ValueError as error:
        problems.add(steps, str(error))
        return None
    found = pattern if listed is None else listed
    nominal = represented(nominal, found.mean(axis=0))
    along = dot(found - nominal.centre, nominal.direction)
    ends = nominal.centre + np.outer([along.min(), along.max()], nominal.direction)
    return PartFeature(name, nominal, found, normals_at(nominal, found), ends, settings.probe)


def _unit(text: str) -> Array:
    """The unit vector (3,) of a direction such as z, z+ or z-."""
    return np.eye(3)[AXIS_NAMES.index(text[0])] * (-1.0 if text.endswith("-") else 1.0)


def _around(axis: str, along: Array, radii: Array, angles: Array) -> Array:
    """Points (n, 3) about an axis through 0, by their places along it, radii and angles."""
    plane = radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.insert(plane, AXIS_NAMES.index(axis), along, axis=1)


def _fitted(points: Array, normal: Array) -> GeometricElement:
    across = svd(points - points.mean(axis=0))[2][-1]
    return element("plane", points.mean(axis=0), across * np.sign(across @ normal))


def _point(settings: Any, kind: str, count: Any, face: Face) -> Made:
    place = np.array(settings.point)
    return element("point", place, normal=_unit(settings.normal)), place[None]


def _plane(settings: Any, kind: str, count: Any, face: Face) -> Made:
    axis = AXIS_NAMES.index(settings.plane[0])
    ends = np.insert(np.array([settings.start, settings.to]), axis, settings.at, axis=1)
    counts = np.insert(np.broadcast_to(count, 2), axis, 1)
    places = [np.linspace(*each) for each in zip(*ends, counts, strict=True)]
    grid = np.stack(np.meshgrid(*places[::-1], indexing="ij"), axis=-1).reshape(-1, 3)
    return element("plane", ends[0], _unit(settings.plane)), grid[:, ::-1]


def _line(settings: Any, kind: str, count: Any, face: Face) -> Made:
    if face is None or face.nominal.kind != "plane":
        raise ValueError(f'"{settings.on}" is no plane above it; name one that it is on')
    axis, normal = AXIS_NAMES.index(settings.line), face.nominal.direction
    if abs(normal[axis]) > FLAT:
        raise ValueError("is across the plane that it is on; give a direction along it")
    ends = np.tile(face.nominal.centre, (2, 1))
    for name, value in settings.at.items():
        ends[:, AXIS_NAMES.index(name)] = value
    ends[:, axis] = settings.start, settings.to
    if np.abs((ends - face.nominal.centre) @ normal).max() > FLAT:
        raise ValueError(f'is not on "{settings.on}"; leave out its place along the normal')
    one = element("line", ends[0], ends[1] - ends[0], normal=normal)
    return one, np.linspace(ends[0], ends[1], count)


def _round(settings: Any, kind: str, count: Any, face: Face) -> Made:
    axis, depths = getattr(settings, kind), np.atleast_1d(settings.depths)
    angles = np.tile(2 * np.pi * np.arange(count) / count, len(depths))
    along, radius = np.repeat(depths, count), settings.diameter / 2
    if settings.helix is not None:
        angles = np.linspace(0.0, 2 * np.pi * settings.helix, count)
        along = np.linspace(depths[0], depths[-1], count)
    place = np.insert(settings.at, AXIS_NAMES.index(axis), 0.0)
    one = element(
        "cylinder" if np.ptp(depths) else "circle",
        place + depths[0] * _unit(axis),
        _unit(axis),
        radius,
        is_inner=kind == "bore",
    )
    return one, place + _around(axis, along, np.full(len(along), radius), angles)


def _arc(settings: Any, kind: str, count: Any, face: Face) -> Made:
    place = np.insert(settings.at, AXIS_NAMES.index(settings.arc), settings.depth)
    one = element("circle", place, _unit(settings.arc), settings.radius, is_inner=settings.inner)
    angles, along = np.linspace(settings.start, settings.to, count), np.zeros(count)
    return one, place + _around(settings.arc, along, np.full(count, settings.radius), angles)


def _cone(settings: Any, kind: str, count: Any, face: Face) -> Made:
    apex, out = np.array(settings.apex), _unit(settings.cone)
    depths, half = np.array(settings.depths), settings.angle / 2
    angles = np.tile(2 * np.pi * np.arange(count) / count, len(depths))
    along = np.repeat(depths, count)
    around = _around(settings.cone[0], along * out.sum(), along * np.tan(half), angles)
    place, radius = apex + depths[0] * out, float(depths[0] * np.tan(half))
    return element("cone", place, out, radius, half, is_inner=settings.inner), apex + around


def _sphere(settings: Any, kind: str, count: Any, face: Face) -> Made:
    """Points are on a spiral from the pole, of a seat the lower one, to the equator, one on each
    zone of the same height.
    """
    centre, radius = np.array(settings.sphere), settings.diameter / 2
    along = np.linspace(-radius if settings.inner else radius, 0.0, count)
    points = _around("z", along, np.sqrt(radius**2 - along**2), GOLDEN * np.arange(count))
    return element("sphere", centre, radius=radius, is_inner=settings.inner), centre + points


SHAPES: dict[str, Callable[[Any, str, Any, Face], Made]] = {
    "point": _point,
    "plane": _plane,
    "line": _line,
    "bore": _round,
    "shaft": _round,
    "arc": _arc,
    "cone": _cone,
    "sphere": _sphere,
}
