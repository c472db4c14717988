"""Fingerprints of readings, by which two campaigns are found to have some in common."""

from __future__ import annotations

import hashlib
from itertools import pairwise

import numpy as np

from .observed_readings import ObservedReadings

# Hexadecimal digits of a position's fingerprint.
DIGITS = 16


def position_fingerprints(observed: ObservedReadings) -> dict[str, str]:
    """Beginnings of the SHA-256 of what the readings of each position say, by its name: balls,
    probes and scale readings, in whatever order and form tables have them, and whatever positions
    are called.
    """
    design, readings = observed.design, observed.design.readings
    balls = np.array(design.balls.names)[readings.ball]
    probes = np.array(design.probes.names)[readings.probe]
    order = np.lexsort((*observed.x.T[::-1], probes, balls, readings.position))
    position = readings.position[order]
    starts = np.flatnonzero(np.diff(position, prepend=-1)).tolist()
    found = {}
    for start, end in pairwise([*starts, len(order)]):
        rows = order[start:end]
        digest = hashlib.sha256("\n".join([*balls[rows], *probes[rows]]).encode())
        digest.update(np.ascontiguousarray(observed.x[rows], "<f8").tobytes())
        found[design.positions.names[int(position[start])]] = digest.hexdigest()[:DIGITS]
    return found


def fingerprint(observed: ObservedReadings) -> str:
    """SHA-256 of what all readings say."""
    parts = sorted(position_fingerprints(observed).values())
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()
