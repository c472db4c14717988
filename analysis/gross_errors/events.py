"""Events as groups of patterns: one cause in any direction."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.machines.protocol import Integers

from .bias_patterns import Patterns

# Kinds whose patterns come one for each axis, of one subject together.
BY_AXIS: tuple[str, ...] = ("reading", "end", "ball", "moved", "probe")
# Certified distances of one ball that are looked at together, at the most.
MOST_DISTANCES = 12

SLIP: tuple[str, ...] = ("shift", "turn")


def event_groups(given: Patterns) -> list[Integers]:
    """All events that are looked for, as arrays (g, q) of patterns: single ones, and what one cause
    may do together.
    """
    found = [np.flatnonzero(given.kind != "moved")[:, None]]
    for kind in BY_AXIS:
        found += _by_subject(given, kind)
    found += _by_ball(given)
    shift, turn = (_by_start(given, kind) for kind in SLIP)
    if len(shift):
        found += [shift, np.concatenate([shift, turn], axis=1)]
    expansion = given.of_kind("expansion")
    artefact = given.design.positions.artefact[given.subject[expansion]]
    pairs = [
        expansion[[i, j]]
        for i, j in combinations(range(len(expansion)), 2)
        if artefact[i] == artefact[j]
    ]
    if pairs:
        found.append(np.array(pairs))
    return found


def _by_ball(given: Patterns) -> list[Integers]:
    """Groups of all certified distances of one ball, of balls with as many together."""
    columns = given.of_kind("distance")
    ends = given.design.of(CalibratedDistances).first, given.design.of(CalibratedDistances).second
    first, second = (end[given.subject[columns]] for end in ends)
    by_width: dict[int, list[Integers]] = {}
    for ball in np.unique([first, second]).tolist():
        mine = columns[(first == ball) | (second == ball)]
        if 1 < len(mine) <= MOST_DISTANCES:
            by_width.setdefault(len(mine), []).append(mine)
    return [np.array(by_width[width]) for width in sorted(by_width)]


def _by_subject(given: Patterns, kind: str) -> Iterator[Integers]:
    """Groups of the patterns of each subject, those of as many axes together."""
    columns = given.of_kind(kind)
    _, start, count = np.unique(given.subject[columns], return_index=True, return_counts=True)
    for q in np.unique(count[count > 1]):
        yield columns[start[count == q][:, None] + np.arange(q)]


def _by_start(given: Patterns, kind: str) -> Integers:
    """Patterns (starts, q) of the slips of each start."""
    columns = given.of_kind(kind)
    if not len(columns):
        return np.zeros((0, 1), np.int64)
    _, count = np.unique(given.start[columns], return_counts=True)
    assert (count == count[0]).all()
    return columns.reshape(-1, int(count[0]))


@dataclass(frozen=True)
class Cause:
    """What patterns come of: a `kind` (that of the patterns, or "slip"), its `subjects`, what is
    wrong as in `patterns.Block`, and the first reading after a slip, or -1.
    """

    kind: str
    subjects: tuple[int, ...]
    start: int = -1


def cause(given: Patterns, columns: Integers) -> Cause:
    """Which cause some patterns are of."""
    kind = str(given.kind[columns[0]])
    subjects = tuple(sorted({int(given.subject[k]) for k in columns}))
    return Cause("slip" if kind in SLIP else kind, subjects, int(given.start[columns[0]]))


def whole(given: Patterns, columns: Integers) -> Integers:
    """All patterns of the cause that `columns` are of."""
    kind: str = given.kind[columns[0]]
    if kind not in (*BY_AXIS, *SLIP):
        return columns
    found = cause(given, columns)
    same = given.of_kind(*(SLIP if kind in SLIP else (kind,)))
    return same[(given.subject[same] == found.subjects[0]) & (given.start[same] == found.start)]
