"""The profile of a turned part through nominal points: arc length along it, and normals to its
surface.

Between neighbouring points of a feature the profile is an arc with the curvature of circles through
three of them, so that points on a circle or a line give both exactly. A feature is a run of points;
neighbouring features may share the place between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from ballplate.simulator.machines import Array
from numpy.typing import NDArray

Complex = NDArray[np.complex128]

# How much longer the way over a place may be than the way past it, for the place to lie on the
# profile.
DETOUR = 0.05
# The same of a corner, which may be sharp and nearer to one of the two places.
CORNER_DETOUR = 1.0


class NotOnProfileError(ValueError):
    """A place is not on the profile."""


@dataclass(frozen=True)
class Profile:
    """Nominal `places` (m, 2) as radius and axial co-ordinate in metres, in order along the
    surface.

    `features` are first and last index of each run; a place in two runs is their common boundary.
    """

    places: Array
    features: tuple[tuple[int, int], ...]

    @cached_property
    def _points(self) -> Complex:
        return self.places[:, 1] + 1j * self.places[:, 0]

    @cached_property
    def lengths(self) -> Array:
        """Arc length (m,) of each place from the first; between features without a common place,
        along the chord.
        """
        steps = np.abs(np.diff(self._points))
        for first, last in self.features:
            if last - first >= 2:
                curvature = _curvatures(self._points[first : last + 1])
                bend = np.clip(
                    0.25 * steps[first:last] * (curvature[1:] + curvature[:-1]), -1.0, 1.0
                )
                bend[bend == 0.0] = 1e-300
                steps[first:last] *= np.arcsin(bend) / bend
        return np.concatenate([[0.0], np.cumsum(steps)])

    @cached_property
    def normals(self) -> Array:
        """Unit normals (m, 2), radius and axial co-ordinate, that point out of the material.

        The normal of a feature of one point is square to the line to the nearer of its neighbours,
        to which it may be tangent.
        """
        return _as_pairs(self._outward * self._turned)

    @cached_property
    def _turned(self) -> Complex:
        """Unit tangents (m,) turned to the left."""
        tangents = np.zeros(len(self._points), complex)
        for first, last in self.features:
            tangents[first : last + 1] = self._tangents(first, last)
        return 1j * tangents / np.abs(tangents)

    @cached_property
    def _outward(self) -> float:
        """1 if a tangent that is turned to the left points out of the material, otherwise -1: the
        axis is on the side of the material.
        """
        return -1.0 if (self._turned.imag * self.places[:, 0]).sum() < 0 else 1.0

    def beside(self, place: Array) -> tuple[Array, Array]:
        """Unit normals out of the material and unit tangents along the profile, each (2, 2), of the
        features before and after a place (2,) that they share.

        :raises NotOnProfileError: no two features of several places share it.
        """
        candidates = []
        for first, last in self.features:
            for index, sign in ((last, -1), (first, 0)):
                if last > first and (self.places[index] == place).all():
                    candidates.append(self._tangents(first, last)[sign])
        if len(candidates) != 2:
            raise NotOnProfileError
        tangents: Complex = np.array(candidates)
        tangents /= np.abs(tangents)
        return _as_pairs(self._outward * 1j * tangents), _as_pairs(tangents)

    def _tangents(self, first: int, last: int) -> Complex:
        points = self._points
        if first == last:
            if len(points) == 1:
                return np.ones(1, complex)
            steps = np.diff(points[max(first - 1, 0) : last + 2])
            return steps[np.argmin(np.abs(steps))][None]
        chords = np.diff(points[first : last + 1])
        chords /= np.abs(chords)
        if last - first == 1:
            return np.repeat(chords, 2)
        # Between a chord and the tangent at either of its ends lies half the angle of the arc.
        steps = np.abs(np.diff(points[first : last + 1]))
        bends = 0.5 * _curvatures(points[first : last + 1]) * np.append(steps, steps[-1])
        turns = np.exp(1j * np.arcsin(np.clip(bends, -1.0, 1.0)))
        return np.append(chords / turns[:-1], chords[-1] * turns[-1])


def _as_pairs(numbers: Complex) -> Array:
    """Radius and axial co-ordinate (m, 2) of complex numbers (m,)."""
    return np.stack([numbers.imag, numbers.real], axis=1)


def _curvatures(points: Complex) -> Array:
    """Signed curvature (m,) of the circle through each point and its neighbours; at the ends, that
    of the next.
    """
    steps, two = np.diff(points)[:-1], np.diff(points)[1:]
    inner = 2.0 * (np.conj(steps) * two).imag / (np.abs(steps) * np.abs(two) * np.abs(steps + two))
    return np.concatenate([inner[:1], inner, inner[-1:]])


def along(
    places: Array,
    labels: Sequence[str],
    boundaries: Array,
    start: Array | None = None,
    end: Array | None = None,
    corners: int = 0,
) -> tuple[Profile, Array, Array]:
    """The profile over nominal places (m, 2), and indices in it of the places (m,) and of the
    boundaries (n,).

    A feature ends where the labels of neighbouring places differ, and at every one of the
    `boundaries` (n, 2), which lie between places or are places themselves; the way bends by any
    angle at the last of them, as many as there are `corners`. `start` and `end` (2,)
    are places before the first and after the last.

    :raises NotOnProfileError: a boundary that is far from the way between neighbouring places; its
        argument is the boundary's index.
    """
    points_along = [*places]
    indices = [*range(len(places))]
    marks = [*labels]
    where = []
    for k, boundary in enumerate(boundaries):
        same = np.flatnonzero((np.array(points_along) == boundary).all(axis=1))
        if len(same):
            where.append(int(same[0]))
            continue
        is_corner = k >= len(boundaries) - corners
        insertion = _between(
            np.array(points_along), boundary, CORNER_DETOUR if is_corner else DETOUR
        )
        if insertion is None:
            raise NotOnProfileError(k)
        points_along.insert(insertion, boundary)
        marks.insert(insertion, "")
        indices = [index + (index >= insertion) for index in indices]
        where = [index + (index >= insertion) for index in where] + [insertion]
    if start is not None:
        points_along.insert(0, start)
        marks.insert(0, marks[0])
        indices, where = [index + 1 for index in indices], [index + 1 for index in where]
    if end is not None:
        points_along.append(end)
        marks.append(marks[-1])
    edges = set(where) - {0, len(points_along) - 1}
    features, first = [], 0
    for k in range(1, len(points_along)):
        if k in edges:
            features.append((first, k))
            first = k
        elif marks[k] != marks[k - 1] and k - 1 not in edges:
            features.append((first, k - 1))
            first = k
    features.append((first, len(points_along) - 1))
    return (
        Profile(np.array(points_along), tuple(features)),
        np.array(indices, dtype=int),
        np.array(where, dtype=int),
    )


def _between(places: Array, boundary: Array, most: float) -> int | None:
    """Index before which a place stands, where it lengthens the way least; None where that is more
    than `most` of it.
    """
    if len(places) < 2:
        return None
    before = np.hypot(*(places[:-1] - boundary).T)
    after = np.hypot(*(places[1:] - boundary).T)
    direct = np.hypot(*np.diff(places, axis=0).T)
    detour = before + after - direct
    best = int(np.argmin(detour))
    return None if detour[best] > most * direct[best] else best + 1
