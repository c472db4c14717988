"""A short order of positions: one with little change-over of planes, artefacts and probes.

A *place* is a plane of one artefact. Changing it takes `ChangeTimes.plane`; if the last probe of a
position is not the first of the next, `ChangeTimes.probe` is added. The probes of a position are
read in any order, and the first position needs no change. From every start, the position that
needs the least change follows; the shortest of these orders is taken.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise, permutations

from ballplate.simulator.experiment import Candidate, ChangeTimes, Position


@dataclass(frozen=True)
class Setup:
    """Properties of a position that determine its change-over."""

    artefact: str
    plane: str
    probes: frozenset[str]


@dataclass(frozen=True)
class Visit:
    """A position of a kind in its turn, the first probe that it is read with, and the last."""

    kind: Setup
    first: str
    last: str


def kind_of(candidate: Candidate) -> Setup:
    """Return the change-over class of a candidate that is a position.

    :raises TypeError: it is an item of calibration.
    """
    if not isinstance(candidate.item, Position):
        raise TypeError(f"{candidate.name} is no position")
    return Setup(candidate.item.artefact, candidate.plane, frozenset(candidate.item.probes))


def changeover(kinds: Collection[Setup], changes: ChangeTimes, first: Setup | None = None) -> float:
    """Return the change-over of a short order, in seconds, of positions of these classes; an entry
    listed twice is two positions.

    A position of class `first` precedes all others.

    >>> down, side = (Setup("plate", "z", frozenset({name})) for name in ("down", "side"))
    >>> changeover([down, side, down], ChangeTimes(probe=120.0, plane=1800.0))
    120.0
    """
    # The order reads a kind in one piece; with one or two probes, an even number of positions
    # begins and ends with the same probe.
    counted = {
        kind: count if len(kind.probes) > 2 else 2 - count % 2
        for kind, count in Counter(kinds).items()
    }
    return short_order(counted.items(), changes, first, is_paid=True)[0]


def short_order(
    kinds: Iterable[tuple[Setup, int]],
    changes: ChangeTimes,
    after: Setup | None = None,
    is_paid: bool = False,
) -> tuple[float, tuple[Visit, ...], str | None]:
    """Return the seconds and visits of a short order of positions, of kinds with their numbers, and
    an optional probe left from an earlier position.

    It begins after a position of the kind `after`, which may end with any of its probes. Unless
    going on from there `is_paid`, that only decides between orders that cost the same.
    """
    return _order(frozenset(kinds), changes, after, is_paid)


@lru_cache(maxsize=100_000)
def _order(
    kinds: frozenset[tuple[Setup, int]], changes: ChangeTimes, after: Setup | None, is_paid: bool
) -> tuple[float, tuple[Visit, ...], str | None]:
    # The order of a set differs from run to run.
    todo = sorted(kinds, key=lambda item: (item[0].artefact, item[0].plane, sorted(item[0].probes)))
    before: list[Visit | None] = [None]
    if after is not None:
        before = [Visit(after, name, name) for name in sorted(after.probes)]
    orders = []
    for start in (visit for kind, _ in todo for visit in _visits(kind)):
        visits = _followed(start, dict(todo), changes)
        seconds = sum(_between(changes, *pair) for pair in pairwise(visits))
        for earlier in before:
            begun = 0.0 if earlier is None else _between(changes, earlier, start)
            left = None if earlier is None else earlier.last
            orders.append((seconds + begun * is_paid, begun, visits, left))
    if not orders:
        return 0.0, (), None
    seconds, _, visits, left = min(orders, key=lambda order: order[:2])
    return seconds, tuple(visits), left


def _followed(start: Visit, todo: dict[Setup, int], changes: ChangeTimes) -> list[Visit]:
    """Return a start and what follows it: each time what needs the least change, rather of the
    same kind.
    """
    visits = [start]
    todo[start.kind] -= 1
    while any(todo.values()):
        here = visits[-1]
        visits.append(
            min(
                (visit for kind, count in todo.items() if count for visit in _visits(kind)),
                key=lambda visit: (_between(changes, here, visit), visit.kind != here.kind),
            )
        )
        todo[visits[-1].kind] -= 1
    return visits


@lru_cache
def _visits(kind: Setup) -> tuple[Visit, ...]:
    """Return a position of a kind with every first and last probe."""
    names = sorted(kind.probes)
    ends = permutations(names if len(names) > 1 else 2 * names, 2)
    return tuple(Visit(kind, first, last) for first, last in dict.fromkeys(ends))


def _between(changes: ChangeTimes, from_visit: Visit, to_visit: Visit) -> float:
    before, after = from_visit.kind, to_visit.kind
    is_moved = (before.artefact, before.plane) != (after.artefact, after.plane)
    return changes.plane * is_moved + changes.probe * (from_visit.last != to_visit.first)
