"""Order of positions with the least change-over of planes, artefacts and probes.

A *place* is a plane of one artefact. Changing it takes `ChangeTimes.plane`; if the last probe of a
position is not the first of the next, `ChangeTimes.probe` is added. The probes of a position are
read in any order, and the first position needs no change.

Within a place, positions are edges of a graph of probes, from their first to their last probe, and
a change of probe is a further edge: the fewest that complete one route follow from the nodes of
odd degree and the connected components (Euler). Places are ordered by dynamic programming over
sets (Held and Karp, J. SIAM 10 (1962) 196). This is exact for any number of positions unless
returning to a place pays: a second visit costs `plane` and saves at most two changes of probe. If
`plane` is shorter, sets of positions are enumerated up to `MOST_POSITIONS`; beyond, and beyond
`MOST_PLACES`, the order is approximate, with a lower bound.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from itertools import combinations, permutations

import numpy as np
from ballplate.simulator.experiment.model import Candidate, ChangeTimes, Position
from ballplate.simulator.machines.protocol import Array, Integers

# Positions of which all sets are gone through, and places; of more places only so many sets of each
# size are followed.
MOST_POSITIONS, MOST_PLACES, MOST_SETS = 12, 12, 500


@dataclass(frozen=True)
class Setup:
    """Properties of a position that determine its change-over."""

    artefact: str
    plane: str
    probes: frozenset[str]


@dataclass(frozen=True)
class Visit:
    """A position of a kind in its turn, the first probe that is read with, and the last."""

    kind: Setup
    first: str
    last: str


@dataclass(frozen=True)
class Order:
    """The cheapest order found, its `seconds`, the lower `bound` of all orders, and an optional
    probe left from an earlier position.
    """

    seconds: float
    bound: float
    visits: tuple[Visit, ...]
    before: str | None


def kind_of(candidate: Candidate) -> Setup:
    """Return the change-over class of a candidate that is a position.

    :raises TypeError: it is an item of calibration.
    """
    if not isinstance(candidate.item, Position):
        raise TypeError(f"{candidate.name} is no position")
    return Setup(candidate.item.artefact, candidate.plane, frozenset(candidate.item.probes))


def changeover(kinds: Collection[Setup], changes: ChangeTimes, first: Setup | None = None) -> float:
    """Return the least total change-over, in seconds, of positions of these classes; an entry
    listed twice is two positions.

    A position of class `first` precedes all others.

    >>> down, side = (Setup("plate", "z", frozenset({name})) for name in ("down", "side"))
    >>> changeover([down, side, down], ChangeTimes(probe=120.0, plane=1800.0))
    120.0
    """
    counted = frozenset(
        (kind, _enough(len(kind.probes), count, _comes_back(changes)))
        for kind, count in Counter(kinds).items()
    )
    return _least(counted, changes, first)


@lru_cache(maxsize=100_000)
def _least(kinds: frozenset[tuple[Setup, int]], changes: ChangeTimes, first: Setup | None) -> float:
    return _task(kinds, changes, first, is_paid=True).seconds


def _comes_back(changes: ChangeTimes) -> bool:
    """True if returning to a place may save changes of probe."""
    return 0.0 < changes.plane <= 2.0 * changes.probe


def _enough(probes: int, count: int, comes_back: bool) -> int:
    """Return the number of positions of a class beyond which the cost no longer depends on the
    number.

    Positions of one probe are read together. Of two probes, two positions in one place return to
    the first probe. Of more, a limited number connects and pairs all probes; others return or make
    a detour.
    """
    if probes == 1:
        return 1
    if comes_back:
        return count
    return 2 - count % 2 if probes == 2 else min(count, probes - 1 + probes // 2)


# Sets of probes, each with the number of positions that are read with it.
_Content = tuple[tuple[tuple[int, ...], int], ...]
# A position: place, set of probes, first and last probe.
_Step = tuple[int, tuple[int, ...], int, int]
# The connected part that each probe belongs to, -1 where nothing is read with it, and the probes of
# odd degree as binary digits.
_Graph = tuple[tuple[int, ...], int]
# Weight of what is only to decide between orders that cost the same.
TIE = 1e-9


def cheapest(
    kinds: Iterable[tuple[Setup, int]],
    changes: ChangeTimes,
    after: Setup | None = None,
    is_paid: bool = False,
) -> Order:
    """The cheapest order of positions, of kinds with their numbers.

    It begins after a position of the kind `after`, which may end with any of its probes. Unless
    going on from there `is_paid`, that only decides between orders that cost the same.
    """
    task = _task(kinds, changes, after, is_paid)
    visits = tuple(task.visits())
    seconds = sum(map(partial(_between, changes), visits, visits[1:]))
    before = None
    if after is not None and visits:
        begun = visits[0].first
        before = begun if begun in after.probes else min(after.probes)
        if is_paid:
            seconds += _between(changes, Visit(after, before, before), visits[0])
    return Order(seconds, seconds if task.is_exact else min(task.bound, seconds), visits, before)


def _between(changes: ChangeTimes, from_visit: Visit, to_visit: Visit) -> float:
    is_moved = (from_visit.kind.artefact, from_visit.kind.plane) != (
        to_visit.kind.artefact,
        to_visit.kind.plane,
    )
    return changes.plane * is_moved + changes.probe * (from_visit.last != to_visit.first)


def _task(
    kinds: Iterable[tuple[Setup, int]], changes: ChangeTimes, after: Setup | None, is_paid: bool
) -> _Task:
    # The order of a set differs from run to run.
    todo = sorted(
        kinds,
        key=lambda candidate_kind: (
            candidate_kind[0].artefact,
            candidate_kind[0].plane,
            sorted(candidate_kind[0].probes),
        ),
    )
    every = [kind for kind, _ in todo] + ([] if after is None else [after])
    names = tuple(sorted({probe for kind in every for probe in kind.probes}))
    members: dict[tuple[str, str], dict[tuple[int, ...], list[Setup]]] = {}
    for kind, count in todo:
        probes = tuple(k for k, name in enumerate(names) if name in kind.probes)
        probe_sets = members.setdefault(_place(kind, changes), {})
        probe_sets.setdefault(probes, []).extend([kind] * count)
    begin, entry = np.zeros(len(names)), np.zeros(len(members))
    if after is not None:
        weight = 1.0 if is_paid else TIE
        begin += [weight * changes.probe * (name not in after.probes) for name in names]
        here = _place(after, changes)
        entry += [weight * changes.plane * (place != here) for place in members]
    return _Task(names, tuple(members.values()), changes, begin, entry)


def _place(kind: Setup, changes: ChangeTimes) -> tuple[str, str]:
    """Artefact and plane, alike where changing them takes no time."""
    return (kind.artefact, kind.plane) if changes.plane else ("", "")


@dataclass(frozen=True, eq=False)
class _Task:
    """Classes of positions by place and by sets of probes (indices of `names`), with the cost to
    `begin` with a probe (probe,) and of `entry` into a place (place,).
    """

    names: tuple[str, ...]
    members: tuple[dict[tuple[int, ...], list[Setup]], ...]
    changes: ChangeTimes
    begin: Array
    entry: Array

    @cached_property
    def contents(self) -> list[_Content]:
        """Positions to read in each place."""
        return [
            tuple((some, len(kinds)) for some, kinds in member.items()) for member in self.members
        ]

    @cached_property
    def positions(self) -> list[tuple[int, tuple[int, ...]]]:
        """Place and probes of each position; those of one probe, read together, occur once."""
        return [
            (place, probes)
            for place, content in enumerate(self.contents)
            for probes, count in content
            for _ in range(_enough(len(probes), count, comes_back=True))
        ]

    @cached_property
    def comes_back(self) -> bool:
        """True if an order that returns to a place may be the cheapest."""
        is_possible = len(self.contents) > 1 and _comes_back(self.changes)
        return is_possible and self.by_places > self.bound

    @property
    def is_small(self) -> bool:
        return len(self.positions) <= MOST_POSITIONS

    @property
    def is_exact(self) -> bool:
        """True if no order is cheaper than the best one found."""
        return self.is_small if self.comes_back else len(self.contents) <= MOST_PLACES

    @cached_property
    def bound(self) -> float:
        """Lower bound in seconds: for changes of probe, all places are one."""
        together: Counter[tuple[int, ...]] = Counter()
        for content in self.contents:
            together.update(dict(content))
        changed = _probe_changes(tuple(sorted(together.items())), len(self.names))
        least = float((self.begin[:, None] + self.changes.probe * changed).min(initial=np.inf))
        # The first place may be the one where it begins.
        return least + self.changes.plane * (len(self.contents) - 1) + float(self.entry.min())

    @property
    def seconds(self) -> float:
        """Cost of the best order, in seconds."""
        if not self.contents:
            return 0.0
        is_single = self.comes_back and self.is_small
        return float(self.by_positions[0][-1].min()) if is_single else self.by_places

    @cached_property
    def within(self) -> list[Array]:
        """Cost within each place by arriving and leaving probe, (probe, probe)."""
        size = len(self.names)
        every = [_probe_changes(content, size) for content in self.contents]
        return [np.asarray(self.changes.probe * changed, float) for changed in every]

    @cached_property
    def ahead(self) -> dict[int, Array]:
        """Least remaining cost by the set of places to come (binary digits) after leaving another
        place with each probe, if each place is visited once.
        """
        layer = costs = {0: np.zeros(len(self.names))}
        for _ in self.contents[1:]:
            following: dict[int, Array] = {}
            for remaining, later in layer.items():
                for k, within in enumerate(self.within):
                    if not remaining >> k & 1:
                        cost = self.changes.plane + (within + later).min(axis=1)
                        known_cost = following.get(remaining | 1 << k, cost)
                        following[remaining | 1 << k] = np.minimum(known_cost, cost)
            layer = following
            if len(self.contents) > MOST_PLACES:
                order = sorted(
                    layer, key=lambda places_left: (layer[places_left].min(), places_left)
                )
                layer = {remaining: layer[remaining] for remaining in order[:MOST_SETS]}
            costs = costs | layer
        return costs

    def next_place(self, remaining: int, begin: Array, entry: Array) -> tuple[float, int, int, int]:
        """Return the least cost of the remaining places, the next place, and its first and last
        probes.
        """
        options = []
        for k, within in enumerate(self.within):
            later = self.ahead.get(remaining & ~(1 << k))
            if remaining >> k & 1 and later is not None:
                cost = entry[k] + begin[:, None] + within + later
                first, last = divmod(int(cost.argmin()), len(begin))
                options.append((float(cost.min()), k, first, last))
        return min(options)

    @cached_property
    def by_places(self) -> float:
        """Least cost if each place is visited once."""
        return self.next_place((1 << len(self.contents)) - 1, self.begin, self.entry)[0]

    @cached_property
    def by_positions(self) -> tuple[Array, Array]:
        """Least cost by the set of positions read, to end in a place with a probe and begin there
        with the next, (sets, places x probes).
        """
        size, count = len(self.names), len(self.positions)
        ended = np.full((1 << count, len(self.contents) * size), np.inf)
        reached = ended.copy()
        reached[0] = (self.begin + self.entry[:, None]).ravel()
        sets = np.arange(1 << count)
        sizes = np.array([subset.bit_count() for subset in range(1 << count)])
        for size_taken in range(count + 1):
            sets_of_size = sets[sizes == size_taken]
            if size_taken:
                reached[sets_of_size] = (ended[sets_of_size, :, None] + self.between).min(axis=1)
            for k, (place, probes) in enumerate(self.positions):
                before = sets_of_size[sets_of_size >> k & 1 == 0]
                for first, last in _ends(probes):
                    end, after = place * size + last, before | 1 << k
                    cost = reached[before, place * size + first]
                    ended[after, end] = np.minimum(ended[after, end], cost)
        return ended, reached

    @cached_property
    def between(self) -> Array:
        """Cost from each place and probe to every other."""
        place, probe = np.divmod(np.arange(len(self.contents) * len(self.names)), len(self.names))
        return self.changes.plane * (place[:, None] != place) + self.changes.probe * (
            probe[:, None] != probe
        )

    def visits(self) -> Iterator[Visit]:
        """The positions of the best order one by one."""
        if not self.contents:
            return
        is_single = self.comes_back and self.is_small
        unvisited = [
            {probes: [*kinds] for probes, kinds in member.items()} for member in self.members
        ]
        for place, probes, first, last in self.traced() if is_single else self.followed():
            kinds = unvisited[place][probes]
            # Of one probe, all are read together.
            for _ in range(len(kinds) if is_single and len(probes) == 1 else 1):
                yield Visit(kinds.pop(0), self.names[first], self.names[last])

    def followed(self) -> Iterator[_Step]:
        """Best order that visits each place once."""
        todo, begin, entry = (1 << len(self.contents)) - 1, self.begin, self.entry
        while todo:
            _, place, first, last = self.next_place(todo, begin, entry)
            for step in _route(self.contents[place], first, last, len(begin)):
                yield place, *step
            todo &= ~(1 << place)
            begin = np.where(np.arange(len(begin)) == last, 0.0, np.inf)
            entry = np.full(len(entry), self.changes.plane)

    def traced(self) -> Iterator[_Step]:
        """The best order of single positions, found from its end."""
        ended, reached = self.by_positions
        size, last_end, steps = len(self.names), len(ended) - 1, []
        index = int(ended[last_end].argmin())
        while last_end:
            k, first = next(
                (k, first)
                for k, (place, probes) in enumerate(self.positions)
                for first, last in _ends(probes)
                if last_end >> k & 1
                and place * size + last == index
                and reached[last_end & ~(1 << k), place * size + first] == ended[last_end, index]
            )
            place, probes = self.positions[k]
            steps.append((place, probes, first, index % size))
            last_end &= ~(1 << k)
            index = int((ended[last_end] + self.between[:, place * size + first]).argmin())
        yield from reversed(steps)


def _route(
    content: _Content, probe: int, last: int, size: int
) -> Iterator[tuple[tuple[int, ...], int, int]]:
    """Return positions in one place, between an arriving and a leaving probe, with the fewest
    changes; among equal orders, those that keep a set of probes.
    """
    todo, before = dict(content), None
    while todo:
        options = []
        for probes in todo:
            fewer = {some: count - (some == probes) for some, count in todo.items()}
            following = tuple((some, count) for some, count in sorted(fewer.items()) if count)
            ahead = _probe_changes(following, size)[:, last]
            options += [
                (int(probe != first) + int(ahead[end]), probes != before, probes, first, end)
                for first, end in _ends(probes)
            ]
        *_, before, first, probe = min(options)
        todo = {some: count - (some == before) for some, count in todo.items()}
        todo = {some: count for some, count in todo.items() if count}
        yield before, first, probe


def _ends(probes: tuple[int, ...]) -> list[tuple[int, int]]:
    """First and last probe that a position can be read with."""
    return list(permutations(probes, 2)) or [(probes[0], probes[0])]


@lru_cache(maxsize=100_000)
def _probe_changes(content: _Content, size: int) -> Integers:
    """Return the fewest changes of probe between an arriving and a leaving probe (size, size)
    while these positions are read.
    """
    graphs = {((-1,) * size, 0)}
    for probes, count in content:
        pairs = list(combinations(probes, 2)) or [(probes[0], probes[0])]
        for _ in range(_enough(len(probes), count, comes_back=False)):
            graphs = {_joined(graph, *pair) for graph in graphs for pair in pairs}
    changes = np.empty((size, size), np.int64)
    for first in range(size):
        for last in range(first, size):
            # What comes next leads from the last probe back to the first.
            least = min(_missing(_joined(graph, first, last)) for graph in graphs)
            changes[first, last] = changes[last, first] = least
    return changes


def _joined(graph: _Graph, first: int, second: int) -> _Graph:
    """A graph with an edge more."""
    parts, odd = graph
    new, old = sorted(parts[k] if parts[k] >= 0 else k for k in (first, second))
    joined = tuple(
        new if k in (first, second) or part == old else part for k, part in enumerate(parts)
    )
    return joined, odd ^ 1 << first ^ 1 << second


def _missing(graph: _Graph) -> int:
    """Return the fewest edges that complete one closed route through a graph: all probes of odd
    degree paired, all components connected.
    """
    parts, odd = graph
    ends = Counter({part: 0 for part in parts if part >= 0})
    for k, part in enumerate(parts):
        ends[part] += odd >> k & 1
    ends.pop(-1, None)
    return sum(ends.values()) // 2 if len(ends) == 1 else sum(max(1, n // 2) for n in ends.values())
