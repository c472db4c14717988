"""Orders in which chosen positions can be read: the least change-over, or one that keeps drift from
looking like errors of the machine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Literal

import numpy as np
from ballplate.simulator.experiment.model import Candidate, ChangeTimes, Position

from .changeover import Setup, cheapest, kind_of

OrderName = Literal["change-over", "mirrored", "blocks", "least-drift"]
ORDERS: Mapping[OrderName, str] = {
    "change-over": "least change-over",
    "mirrored": "mirrored",
    "blocks": "random in blocks",
    "least-drift": "least effect of drift",
}


@dataclass(frozen=True)
class ReadingOrder:
    """An order by name; `seed` is that of random ones, and `sequence` are the names of positions,
    with their probes in order, of one that was searched for.
    """

    name: OrderName = "change-over"
    seed: int = 1
    sequence: tuple[tuple[str, tuple[str, ...]], ...] = ()


LEAST_CHANGE_OVER = ReadingOrder()

# Positions with their probes in order.
Sequenced = tuple[tuple[Candidate, tuple[str, ...]], ...]


def in_order(
    candidates: Sequence[Candidate], changes: ChangeTimes, order: ReadingOrder
) -> Sequenced:
    """Return positions mirrored or random in blocks, their probes in the cheapest order, or all in
    a stated sequence.

    A mirrored order passes through the classes of positions with the least change-over, reads half
    of each, and returns with the other half; single positions are in the middle. A block has one
    position of each remaining class, in random order.
    """
    if order.sequence:
        by_name = {candidate.name: candidate for candidate in candidates}
        return tuple((by_name[name], probes) for name, probes in order.sequence)
    kinds: dict[Setup, list[Candidate]] = {}
    for candidate in candidates:
        kinds.setdefault(kind_of(candidate), []).append(candidate)
    if order.name == "blocks":
        return with_probes(_blocks(list(kinds.values()), order.seed), changes)
    visits = cheapest([(kind, len(some)) for kind, some in kinds.items()], changes).visits
    groups = [kinds[kind] for kind in dict.fromkeys(visit.kind for visit in visits)]
    return with_probes(_mirrored(groups), changes)


def _mirrored(groups: Sequence[Sequence[Candidate]]) -> list[Candidate]:
    """A half of each group, those of one in the middle, the other halves backwards."""
    there: list[Candidate] = []
    back: list[Candidate] = []
    longer_there = True
    for some in groups:
        if len(some) == 1:
            continue
        half = len(some) // 2
        # Of odd numbers, the one more is read going there and coming back by turns.
        if len(some) % 2:
            half += longer_there
            longer_there = not longer_there
        there += some[:half]
        back = [*some[half:], *back]
    return [*there, *(some[0] for some in groups if len(some) == 1), *back]


def _blocks(groups: Sequence[Sequence[Candidate]], seed: int) -> list[Candidate]:
    """Blocks of one of each group that is left, in random order; so is the order in a group."""
    generator = np.random.default_rng(np.random.SeedSequence(seed))
    mixed = [[some[k] for k in generator.permutation(len(some))] for some in groups]
    blocks = []
    for block in zip_longest(*mixed):
        here = [candidate for candidate in block if candidate is not None]
        blocks += [here[k] for k in generator.permutation(len(here))]
    return blocks


def with_probes(sequence: Sequence[Candidate], changes: ChangeTimes) -> Sequenced:
    """Positions in this order, each with the order of its probes that leaves the fewest changes
    between positions.
    """
    # By the last probe: what it cost, and the orders of probes so far.
    states: dict[str, tuple[float, tuple[tuple[str, ...], ...]]] = {}
    for k, candidate in enumerate(sequence):
        assert isinstance(candidate.item, Position)
        probes = candidate.item.probes
        cheapest: dict[str, tuple[float, tuple[tuple[str, ...], ...]]] = {}
        for first in probes:
            before = min(
                (
                    (cost + changes.probe * (last != first), n, orders)
                    for n, (last, (cost, orders)) in enumerate(states.items())
                ),
                default=(0.0, 0, ()),
            )
            for last in probes:
                if (first == last) != (len(probes) == 1):
                    continue
                between = tuple(probe for probe in probes if probe not in (first, last))
                probe_order = (first,) if len(probes) == 1 else (first, *between, last)
                if k == 0 or last not in cheapest or before[0] < cheapest[last][0]:
                    cheapest[last] = (before[0], (*before[2], probe_order))
        states = cheapest
    _, orders = min(states.values(), key=lambda state: state[0], default=(0.0, ()))
    return tuple(zip(sequence, orders, strict=True))
