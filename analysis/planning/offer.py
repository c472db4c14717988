"""What a plan may choose from when a campaign goes on: candidates, what is done, and interrupted positions.

A position that was interrupted is offered twice: for completion, as long as the artefact stands there, where neither
its set-up is paid again nor what has been read; and to be set up anew in full. What was read of it counts in any case.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from simulator.experiment.pool import AtMost, Candidate, Pool

from .done import SetUp, next_name, renamed


@dataclass(frozen=True)
class Interrupted:
    """A position that was read in part, by indices of an offer.

    `part` is what has been read, `rest` completes it, None where the artefact does not stand there any more, and
    `again` is a new set-up of the same position. `whole` is the position with all its readings.
    """

    part: int
    rest: int | None
    again: int
    whole: Candidate


@dataclass(frozen=True)
class Offer:
    """Candidates, those of the pool first, and limits on choosing them.

    `done` in the order in which they were read; `must` and `at_least` (of each, one) have to be chosen. `replaced`
    tells by what candidates of the pool that were interrupted may be chosen now.
    """

    candidates: tuple[Candidate, ...]
    done: tuple[int, ...]
    must: tuple[int, ...]
    at_most: tuple[AtMost, ...]
    at_least: tuple[tuple[int, ...], ...]
    interrupted: tuple[Interrupted, ...]
    replaced: dict[int, tuple[int, ...]]

    @property
    def standing(self) -> Interrupted | None:
        """The interrupted position that may be completed."""
        return next((one for one in self.interrupted if one.rest is not None), None)

    def now(self, k: int) -> int:
        """The candidate that stands for one of the pool."""
        return self.replaced.get(k, (k,))[0]


def offer(pool: Pool, taken: Sequence[SetUp] = (), standing: bool = True) -> Offer:
    """What may be chosen from a pool after some set-ups have been read.

    `standing` tells whether the artefact still is where it was read last, so that this position can be completed.
    """
    candidates = list(pool.candidates)
    index: dict[str, int] = {}
    for one in taken:
        index[one.name] = one.base
        if one.name == pool.candidates[one.base].name:
            candidates[one.base] = one.read
        else:
            index[one.name] = len(candidates)
            candidates.append(one.read)
    names = [one.name for one in candidates]
    interrupted: list[Interrupted] = []
    replaced: dict[int, tuple[int, ...]] = {}
    for base in dict.fromkeys(one.base for one in taken):
        own = [one for one in taken if one.base == base]
        complete = [index[one.name] for one in own if one.rest is None]
        if complete:
            replaced[base] = (complete[0],) if candidates[base] is not pool.candidates[base] else (complete[0], base)
            continue
        again = base
        if candidates[base] is not pool.candidates[base]:
            name = next_name(pool.candidates[base].name, names)
            names.append(name)
            again = len(candidates)
            candidates.append(renamed(pool.candidates[base], name))
        replaced[base] = (again,)
        for one in own:
            rest = None
            if standing and one.is_last and one.rest is not None:
                rest = len(candidates)
                candidates.append(one.rest)
                replaced[base] = (rest, again)
            interrupted.append(Interrupted(index[one.name], rest, again, one.whole))
    done = tuple(index[one.name] for one in taken)
    left = [replaced.get(k, (k,)) for k in pool.must]
    return Offer(
        tuple(candidates),
        done,
        tuple(one[0] for one in left if len(one) == 1),
        tuple(AtMost(tuple(m for k in one.members for m in _now(k, replaced)), one.count) for one in pool.at_most),
        tuple(one for one in left if len(one) > 1),
        tuple(interrupted),
        replaced,
    )


def _now(k: int, replaced: dict[int, tuple[int, ...]]) -> tuple[int, ...]:
    return replaced.get(k, (k,))
