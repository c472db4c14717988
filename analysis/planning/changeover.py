"""Order of positions with the least change-over of planes, artefacts and probes.

Going on to another plane or artefact takes `ChangeTimes.plane`; if the last probe of a position is
not the first of the next, `ChangeTimes.probe` comes on top. The probes of a position are read one
after the other in any order, and nothing is changed before the first position. Positions of equal
kind stand together, so that the order of kinds is what is sought: dynamic programming over sets of
kinds (Held and Karp, J. SIAM 10 (1962) 196), with the last probe and the last place as what the
rest depends on. Up to twelve kinds that is exact; of more, only the `MOST_SETS` cheapest sets of
each size are followed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import lru_cache

from ballplate.simulator.experiment.model import Candidate, ChangeTimes, Position

# Sets of kinds that are followed for each size, where there are more than so many kinds.
MOST_EXACT = 12
MOST_SETS = 500


@dataclass(frozen=True)
class Setup:
    """What the change-over depends on: positions of equal kind follow one another without any."""

    artefact: str
    plane: str
    probes: frozenset[str]


@dataclass(frozen=True)
class Visit:
    """A kind in its turn, the first probe that is read with, and the last."""

    kind: Setup
    first: str
    last: str


def kind_of(candidate: Candidate) -> Setup:
    """The kind of a candidate that is a position.

    :raises TypeError: it is an item of calibration.
    """
    if not isinstance(candidate.item, Position):
        raise TypeError(f"{candidate.name} is no position")
    return Setup(candidate.item.artefact, candidate.plane, frozenset(candidate.item.probes))


def changeover(kinds: Collection[Setup], changes: ChangeTimes, first: Setup | None = None) -> float:
    """Least total change-over, in seconds, of positions of these kinds; one listed twice stands for
    two positions.

    A position of the kind `first` comes before all of them.

    >>> down, side = (Setup("plate", "z", frozenset({name})) for name in ("down", "side"))
    >>> changeover([down, side, down], ChangeTimes(probe=120.0, plane=1800.0))
    120.0
    """
    return _least(_counted(kinds), changes, first)


@lru_cache(maxsize=100_000)
def _least(kinds: frozenset[tuple[Setup, int]], changes: ChangeTimes, first: Setup | None) -> float:
    return cheapest(kinds, changes, first, is_paid=True).seconds


def _counted(kinds: Iterable[Setup]) -> frozenset[tuple[Setup, int]]:
    """Kinds with the least number of positions that leaves the same choice of first and last
    probes.

    A position of two probes ends with the one that it has not begun with, two positions end with
    that they have begun with, three are like one. Of more probes, two positions can begin and end
    with any.
    """
    found = []
    for kind, count in Counter(kinds).items():
        probes = len(kind.probes)
        found.append((kind, 1 if probes == 1 else 2 - count % 2 if probes == 2 else min(count, 2)))
    return frozenset(found)


# By what has been visited: by the last probe and the last artefact and plane, the cost so far and
# where it came from.
_Last = tuple[int, int]
_Came = tuple[int, _Last, int, int]
_States = dict[_Last, tuple[float, _Came]]
_NOWHERE: _Came = (0, (-1, -1), -1, -1)
# Weight of what is only to decide between orders that cost the same.
TIE = 1e-9


@dataclass(frozen=True)
class Order:
    """The cheapest order of kinds, what it costs in `seconds`, and the probe that is left from
    before, if any.
    """

    seconds: float
    visits: tuple[Visit, ...]
    before: str | None


def cheapest(
    kinds: Iterable[tuple[Setup, int]],
    changes: ChangeTimes,
    after: Setup | None = None,
    is_paid: bool = False,
) -> Order:
    """The cheapest order of kinds with their numbers of positions.

    It begins after a position of the kind `after`, which may end with any of its probes. Unless
    going on from there `is_paid`, that only decides between orders that cost the same.
    """
    # The order of a set differs from run to run.
    todo = sorted(
        kinds, key=lambda one: (one[0].artefact, one[0].plane, sorted(one[0].probes), one[1])
    )
    every = [kind for kind, _ in todo] + ([] if after is None else [after])
    probe_names = sorted({probe for kind in every for probe in kind.probes})
    places = list(dict.fromkeys((kind.artefact, kind.plane) for kind in every))
    stops = [
        _Stop(
            places.index((kind.artefact, kind.plane)),
            tuple(probe_names.index(probe) for probe in sorted(kind.probes)),
            count,
        )
        for kind, count in todo
    ]
    start: _States = {}
    if after is not None:
        here = places.index((after.artefact, after.plane))
        start = {(probe_names.index(probe), here): (0.0, _NOWHERE) for probe in after.probes}
    # One layer for each number of kinds visited.
    layers: list[dict[int, _States]] = [{0: start}]
    paid = changes if is_paid else ChangeTimes(TIE * changes.probe, TIE * changes.plane)
    for _ in stops:
        found: dict[int, _States] = {}
        for visited, states in layers[-1].items():
            known = _Known(states) if states else None
            for i, stop in enumerate(stops):
                if not visited >> i & 1:
                    _go_on(found.setdefault(visited | 1 << i, {}), stop, i, visited, known, paid)
        if len(todo) > MOST_EXACT and len(found) > MOST_SETS:
            costs = sorted((min(states.values())[0], visited) for visited, states in found.items())
            found = {visited: found[visited] for _, visited in costs[:MOST_SETS]}
        layers.append(found)
        paid = changes
    if not stops:
        return Order(0.0, (), None)
    ((visited, states),) = layers[-1].items()
    last = min(states, key=lambda one: states[one])
    visits: list[Visit] = []
    for layer in reversed(layers[1:]):
        _, (visited, before_that, first, i) = layer[visited][last]
        visits.append(Visit(todo[i][0], probe_names[first], probe_names[last[0]]))
        last = before_that
    visits.reverse()
    seconds = sum(
        _between(one, other, changes) for one, other in zip(visits, visits[1:], strict=False)
    )
    if after is None:
        return Order(seconds, tuple(visits), None)
    probe = probe_names[last[0]]
    if is_paid:
        seconds += _between(Visit(after, probe, probe), visits[0], changes)
    return Order(seconds, tuple(visits), probe)


def _between(one: Visit, other: Visit, changes: ChangeTimes) -> float:
    is_moved = (one.kind.artefact, one.kind.plane) != (other.kind.artefact, other.kind.plane)
    return changes.plane * is_moved + changes.probe * (one.last != other.first)


@dataclass(frozen=True)
class _Stop:
    place: int
    probes: tuple[int, ...]
    count: int


class _Known:
    """The cheapest states of a set of kinds: of all, by place, by probe, and by both."""

    def __init__(self, states: _States) -> None:
        self.both = states
        self.by_place: dict[int, tuple[float, _Last]] = {}
        self.by_probe: dict[int, tuple[float, _Last]] = {}
        for last, (cost, _) in states.items():
            probe, place = last
            if place not in self.by_place or cost < self.by_place[place][0]:
                self.by_place[place] = (cost, last)
            if probe not in self.by_probe or cost < self.by_probe[probe][0]:
                self.by_probe[probe] = (cost, last)
        self.cheapest = min(self.by_place.values())

    def with_any_probe(self, place: int, change: float) -> tuple[float, _Last]:
        """The least cost to be at a place."""
        cost, last = self.cheapest
        return min(self.by_place.get(place, (cost + change, last)), (cost + change, last))

    def with_probe(self, probe: int, place: int, change: float) -> tuple[float, _Last] | None:
        """The least cost to be at a place with a probe, None where that was not the last."""
        if probe not in self.by_probe:
            return None
        cost, last = self.by_probe[probe]
        here = self.both.get((probe, place))
        if here is not None and here[0] <= cost + change:
            return here[0], (probe, place)
        return cost + change, last


def _go_on(
    states: _States, stop: _Stop, i: int, visited: int, known: _Known | None, changes: ChangeTimes
) -> None:
    """Add what going on to a stop leads to, whichever of its probes comes first and last."""
    paid, origin = (
        (0.0, (-1, -1)) if known is None else known.with_any_probe(stop.place, changes.plane)
    )
    for first in stop.probes:
        arrived = (paid + (0.0 if known is None else changes.probe), origin)
        if known is not None:
            free = known.with_probe(first, stop.place, changes.plane)
            arrived = arrived if free is None or arrived[0] < free[0] else free
        for last in stop.probes:
            if _can_end(len(stop.probes), stop.count, first == last):
                old = states.get((last, stop.place))
                if old is None or arrived[0] < old[0]:
                    states[last, stop.place] = (arrived[0], (visited, arrived[1], first, i))


def _can_end(probes: int, count: int, where_begun: bool) -> bool:
    """Whether positions of one kind can end with the probe they have begun with, or with
    another.
    """
    if probes == 1:
        return where_begun
    if probes == 2:
        return where_begun == (count % 2 == 0)
    return count > 1 or not where_begun
