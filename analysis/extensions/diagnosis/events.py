"""Events as groups of patterns: one cause in any direction."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from ballplate.simulator.design import CalibratedDistances
from ballplate.simulator.machines import Integers

from .bias_patterns import Patterns

# Kinds with one pattern per axis of a subject.
BY_AXIS: tuple[str, ...] = ("reading", "end", "ball", "moved", "probe")
# Largest number of certified distances of one ball in a group.
MOST_DISTANCES = 12

# What is assumed of kinds of patterns that act on more than an observation or event.
ASSUMED = {
    "probe": "tips",
    "scale": "certificates",
    "expansion": "temperature of artefacts",
}

SLIP: tuple[str, ...] = ("shift", "turn")


def event_groups(biases: Patterns) -> list[Integers]:
    """Return all events to search as arrays (g, q) of patterns: single ones, and patterns of one
    cause.
    """
    groups = [np.flatnonzero(biases.kind != "moved")[:, None]]
    for kind in BY_AXIS:
        groups += _by_subject(biases, kind)
    groups += _by_ball(biases)
    shift, turn = (_by_start(biases, kind) for kind in SLIP)
    if len(shift):
        groups += [shift, np.concatenate([shift, turn], axis=1)]
    expansion = biases.of_kind("expansion")
    artefact = biases.design.positions.artefact[biases.subject[expansion]]
    pairs = [
        expansion[[i, j]]
        for i, j in combinations(range(len(expansion)), 2)
        if artefact[i] == artefact[j]
    ]
    if pairs:
        groups.append(np.array(pairs))
    return groups


def _by_ball(biases: Patterns) -> list[Integers]:
    """Return groups of all certified distances of one ball, by size of the group."""
    columns = biases.of_kind("distance")
    ends = biases.design.of(CalibratedDistances).first, biases.design.of(CalibratedDistances).second
    first, second = (end[biases.subject[columns]] for end in ends)
    by_width: dict[int, list[Integers]] = {}
    for ball in np.unique([first, second]).tolist():
        own_columns = columns[(first == ball) | (second == ball)]
        if 1 < len(own_columns) <= MOST_DISTANCES:
            by_width.setdefault(len(own_columns), []).append(own_columns)
    return [np.array(by_width[width]) for width in sorted(by_width)]


def _by_subject(biases: Patterns, kind: str) -> Iterator[Integers]:
    """Return groups of the patterns of each subject, by number of axes."""
    columns = biases.of_kind(kind)
    _, start, count = np.unique(biases.subject[columns], return_index=True, return_counts=True)
    for q in np.unique(count[count > 1]):
        yield columns[start[count == q][:, None] + np.arange(q)]


def _by_start(biases: Patterns, kind: str) -> Integers:
    """Return patterns (starts, q) of the slips of each start."""
    columns = biases.of_kind(kind)
    if not len(columns):
        return np.zeros((0, 1), np.int64)
    _, count = np.unique(biases.start[columns], return_counts=True)
    assert (count == count[0]).all()
    return columns.reshape(-1, int(count[0]))


@dataclass(frozen=True)
class Cause:
    """Cause of patterns: `kind` (theirs, or "slip"), `subjects` as in `BiasPatterns`, first
    reading after a slip or -1.
    """

    kind: str
    subjects: tuple[int, ...]
    start: int = -1


def cause(biases: Patterns, columns: Integers) -> Cause:
    """Return the cause of some patterns."""
    kind = str(biases.kind[columns[0]])
    subjects = tuple(sorted({int(biases.subject[k]) for k in columns}))
    return Cause("slip" if kind in SLIP else kind, subjects, int(biases.start[columns[0]]))


def all_directions(biases: Patterns, columns: Integers) -> Integers:
    """Return all patterns of the cause of some."""
    kind: str = biases.kind[columns[0]]
    if kind not in (*BY_AXIS, *SLIP):
        return columns
    common_cause = cause(biases, columns)
    candidates = biases.of_kind(*(SLIP if kind in SLIP else (kind,)))
    return candidates[
        (biases.subject[candidates] == common_cause.subjects[0])
        & (biases.start[candidates] == common_cause.start)
    ]
