"""Fingerprints of readings, by which campaigns with common readings are detected."""

from __future__ import annotations

import hashlib
from itertools import pairwise

import numpy as np

from .observed_readings import ObservedReadings

# Hexadecimal digits of a position's fingerprint.
DIGITS = 16


def position_fingerprints(observed: ObservedReadings) -> dict[str, str]:
    """Return the beginning of the SHA-256 of each position's readings, by its name.

    Hashed are balls, probes and scale readings, independently of the order and form of tables and
    of the positions' names.
    """
    design, readings = observed.design, observed.design.readings
    balls = np.array(design.balls.names)[readings.ball]
    probes = np.array(design.probes.names)[readings.probe]
    order = np.lexsort((*observed.x.T[::-1], probes, balls, readings.position))
    position = readings.position[order]
    starts = np.flatnonzero(np.diff(position, prepend=-1)).tolist()
    fingerprints = {}
    for start, end in pairwise([*starts, len(order)]):
        rows = order[start:end]
        digest = hashlib.sha256("\n".join([*balls[rows], *probes[rows]]).encode())
        digest.update(np.ascontiguousarray(observed.x[rows], "<f8").tobytes())
        fingerprints[design.positions.names[int(position[start])]] = digest.hexdigest()[:DIGITS]
    return fingerprints


def fingerprint(observed: ObservedReadings) -> str:
    """Return the SHA-256 of all readings."""
    parts = sorted(position_fingerprints(observed).values())
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()
