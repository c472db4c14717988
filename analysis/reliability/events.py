"""Events as groups of patterns: one cause, in whatever direction, and the readings, balls or positions that it is about."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from simulator.design import Integers

from .patterns import Kind, Patterns

# Kinds whose patterns come one for each axis, of one subject together.
BY_AXIS: tuple[Kind, ...] = ("reading", "ball", "moved", "probe")


@dataclass(frozen=True)
class Groups:
    """Events of one sort: each a row of `index` (g, q), the columns of its patterns."""

    index: Integers


def event_groups(given: Patterns) -> list[Groups]:
    """All events that are looked for: single patterns, and groups of what one cause may do."""
    found = [Groups(np.flatnonzero(given.kind != "moved")[:, None])]
    for kind in BY_AXIS:
        found += _by_subject(given, kind)
    shift, turn = (_by_start(given, kind) for kind in ("shift", "turn"))
    if len(shift):
        found += [Groups(shift), Groups(np.concatenate([shift, turn], axis=1))]
    expansion = given.of_kind("expansion")
    artefact = given.design.position_artefact[given.subject[expansion]]
    pairs = [
        expansion[[i, j]] for i, j in combinations(range(len(expansion)), 2) if artefact[i] == artefact[j]
    ]
    if pairs:
        found.append(Groups(np.array(pairs)))
    return found


def _by_subject(given: Patterns, kind: Kind) -> Iterator[Groups]:
    """Groups of the patterns of each subject, those of as many axes together."""
    columns = given.of_kind(kind)
    _, start, count = np.unique(given.subject[columns], return_index=True, return_counts=True)
    for q in np.unique(count[count > 1]):
        yield Groups(columns[start[count == q][:, None] + np.arange(q)])


def _by_start(given: Patterns, kind: Kind) -> Integers:
    """Patterns (starts, q) of the slips of each start."""
    columns = given.of_kind(kind)
    if not len(columns):
        return np.zeros((0, 1), np.int64)
    _, count = np.unique(given.start[columns], return_counts=True)
    assert (count == count[0]).all()
    return columns.reshape(-1, int(count[0]))


def cause(given: Patterns, columns: Integers) -> tuple[str, tuple[int, ...], int]:
    """Which cause patterns are of: the kind, what it is about, and the first reading after a slip or -1."""
    kind = str(given.kind[columns[0]])
    subjects = tuple(sorted({int(given.subject[k]) for k in columns}))
    return ("slip" if kind in ("shift", "turn") else kind), subjects, int(given.start[columns[0]])


def whole(given: Patterns, columns: Integers) -> Integers:
    """All patterns of the cause that `columns` are of."""
    kind, subjects, start = cause(given, columns)
    if kind == "expansion" or given.kind[columns[0]] not in (*BY_AXIS, "shift", "turn"):
        return columns
    kinds: tuple[Kind, ...] = ("shift", "turn") if kind == "slip" else (given.kind[columns[0]],)
    same = given.of_kind(*kinds)
    return same[(given.subject[same] == subjects[0]) & (given.start[same] == start)]
