"""Datum frames: the motion of a part that its measured datums fix, in their order (ISO 5459)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from ballplate.simulator.computing import pinv
from ballplate.simulator.geometry import rotation_from_vector
from ballplate.simulator.inputs import Array

from .fitting import STRAIGHT, GeometricElement, frame, outward

# Directions closer than this are parallel.
PARALLEL = 1e-9
# Each step leaves of the motion a part as small as the turns of datums against each other.
STEPS = 4


def sensed(nominal: GeometricElement) -> Array:
    """Return the unit vectors (k, 3) along which the location of an element is measured."""
    if nominal.kind in STRAIGHT:
        return outward(nominal)[None]
    return np.eye(3) if nominal.kind == "sphere" else frame(nominal.direction)


def in_datums(
    nominal: Sequence[GeometricElement],
    measured: Sequence[GeometricElement],
    element: GeometricElement,
) -> GeometricElement:
    """Return a measured element, a batch, in the frame of measured datums by their nominal ones.

    Each datum fixes, of what those before it leave open, first turns by its direction, and then
    displacements and turns by its location, a plane by its mean distance.
    """
    elements = [*measured, element]
    for _ in range(STEPS):
        motion, free = np.zeros((1, 6)), np.eye(6)
        for one, found in zip(nominal, elements, strict=False):
            for rows, deviation in _conditions(one, found):
                reached = rows @ free
                reached[np.abs(reached) < PARALLEL] = 0.0
                inverse = pinv(reached, rcond=PARALLEL)
                motion = motion - (deviation + motion @ rows.T) @ inverse.T
                free = free - inverse @ reached
        elements = [_turned(one, motion) for one in elements]
    return elements[-1]


def _conditions(
    nominal: GeometricElement, found: GeometricElement
) -> Iterator[tuple[Array, Array]]:
    """Yield deviations (b, k) of the direction and of the location of an element, with their
    derivatives (k, 6) by turns and displacements.
    """
    if nominal.kind not in ("point", "circle", "sphere"):
        across = frame(nominal.direction)
        turns = np.cross(nominal.direction, across)
        yield np.concatenate([turns, 0 * turns], axis=1), found.direction @ across.T
    along = sensed(nominal)
    turns = np.cross(nominal.centre, along)
    yield np.concatenate([turns, along], axis=1), (found.centre - nominal.centre) @ along.T


def _turned(elements: GeometricElement, motion: Array) -> GeometricElement:
    rotation = rotation_from_vector(motion[:, :3])
    centre, direction, normal = (
        (rotation @ vectors[..., None])[..., 0]
        for vectors in (elements.centre, elements.direction, elements.normal)
    )
    return replace(elements, centre=centre + motion[:, 3:], direction=direction, normal=normal)
