"""Readings that two campaigns have in common: what was read once is compared with itself."""

from __future__ import annotations

import hashlib
from itertools import pairwise

import numpy as np

from ..inputs.settings import listing
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


def same_positions(first: ObservedReadings, second: ObservedReadings) -> tuple[str, ...]:
    """Positions of the second campaign whose readings are to the last digit those of a position of
    the first.
    """
    known = set(position_fingerprints(first).values())
    return tuple(name for name, one in position_fingerprints(second).items() if one in known)


def is_one_campaign(first: ObservedReadings, second: ObservedReadings) -> bool:
    """Whether all that one of two campaigns read is among the readings of the other."""
    counts = [len(np.unique(one.design.readings.position)) for one in (first, second)]
    return len(same_positions(first, second)) >= min(counts)


def read_once_words(positions: tuple[str, ...]) -> str:
    """What is to be said of positions whose readings two campaigns have in common.

    >>> read_once_words(("low", "high")).partition(":")[0]
    'readings are the same in both campaigns in low, high'
    """
    return (
        f"readings are the same in both campaigns in {listing(positions)}: the campaigns are less"
        " different than two that are independent, and a change may be missed"
    )
