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
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# How much longer the way over a place may be than the way past it, for the place to lie on the
# profile.
DETOUR = 0.05


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
        tangents = np.zeros(len(self._points), complex)
        for first, last in self.features:
            tangents[first : last + 1] = self._tangents(first, last)
        normals = 1j * tangents / np.abs(tangents)
        # The material is on the side of the axis.
        if (normals.imag * self.places[:, 0]).sum() < 0:
            normals = -normals
        return np.stack([normals.imag, normals.real], axis=1)

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


def _curvatures(points: Complex) -> Array:
    """Signed curvature (m,) of the circle through each point and its neighbours; at the ends, that
    of the next.
    """
    one, two = np.diff(points)[:-1], np.diff(points)[1:]
    inner = 2.0 * (np.conj(one) * two).imag / (np.abs(one) * np.abs(two) * np.abs(one + two))
    return np.concatenate([inner[:1], inner, inner[-1:]])


def along(
    places: Array,
    labels: Sequence[str],
    boundaries: Array,
    start: Array | None = None,
    end: Array | None = None,
) -> tuple[Profile, Array, Array]:
    """The profile over nominal places (m, 2), and indices in it of the places (m,) and of the
    boundaries (n,).

    A feature ends where the labels of neighbouring places differ, and at every one of the
    `boundaries` (n, 2), which lie between places or are places themselves. `start` and `end` (2,)
    are places before the first and after the last.

    :raises NotOnProfileError: a boundary that is far from the way between neighbouring places; its
        argument is the boundary's index.
    """
    found = [*places]
    own = [*range(len(places))]
    marks = [*labels]
    where: list[int] = []
    for k, boundary in enumerate(boundaries):
        same = np.flatnonzero((np.array(found) == boundary).all(axis=1))
        if len(same):
            where.append(int(same[0]))
            continue
        at = _between(np.array(found), boundary)
        if at is None:
            raise NotOnProfileError(k)
        found.insert(at, boundary)
        marks.insert(at, "")
        own = [index + (index >= at) for index in own]
        where = [index + (index >= at) for index in where] + [at]
    if start is not None:
        found.insert(0, start)
        marks.insert(0, marks[0])
        own, where = [index + 1 for index in own], [index + 1 for index in where]
    if end is not None:
        found.append(end)
        marks.append(marks[-1])
    edges = set(where) - {0, len(found) - 1}
    features, first = [], 0
    for k in range(1, len(found)):
        if k in edges:
            features.append((first, k))
            first = k
        elif marks[k] != marks[k - 1] and k - 1 not in edges:
            features.append((first, k - 1))
            first = k
    features.append((first, len(found) - 1))
    return (
        Profile(np.array(found), tuple(features)),
        np.array(own, dtype=int),
        np.array(where, dtype=int),
    )


def _between(places: Array, boundary: Array) -> int | None:
    """Index before which a place stands, where it lengthens the way least; None where that is
    much.
    """
    if len(places) < 2:
        return None
    before = np.hypot(*(places[:-1] - boundary).T)
    after = np.hypot(*(places[1:] - boundary).T)
    direct = np.hypot(*np.diff(places, axis=0).T)
    detour = before + after - direct
    best = int(np.argmin(detour))
    return None if detour[best] > DETOUR * direct[best] else best + 1
