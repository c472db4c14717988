"""Candidates for the continuation of a campaign: those left, those done, and interrupted
positions.

A position that was interrupted is offered twice: for completion, as long as the artefact stands
there, where neither its set-up is paid again nor what has been read; and to be set up anew in full.
What was read of it counts in any case.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from ballplate.simulator.experiment.model import AtMost, Candidate, Experiment, Pool, Position

from .information import Information
from .positions_read import REST, SetUp, base_name, next_name, renamed


@dataclass(frozen=True)
class Interrupted:
    """A position that was read in part, by indices of an offer.

    `part` is what has been read, `rest` completes it, None where the artefact does not stand there
    any more, and `again` is a new set-up of the same position. `whole` is the position with all its
    readings.
    """

    part: int
    rest: int | None
    again: int
    whole: Candidate


@dataclass(frozen=True)
class Offer:
    """Candidates, those of the pool first, and limits on choosing them.

    `done` in the order in which they were read; `must` and `at_least` (of each, one) have to be
    chosen. `replaced` tells by what candidates of the pool that were interrupted may be chosen now.
    `names` are short names of an earlier plan, by those of candidates.
    """

    candidates: tuple[Candidate, ...]
    done: tuple[int, ...]
    must: tuple[int, ...]
    at_most: tuple[AtMost, ...]
    at_least: tuple[tuple[int, ...], ...]
    interrupted: tuple[Interrupted, ...]
    replaced: dict[int, tuple[int, ...]]
    pool: Pool
    taken: tuple[SetUp, ...]
    is_standing: bool
    names: Mapping[str, str] = field(default_factory=dict)

    @property
    def standing(self) -> Interrupted | None:
        """The interrupted position that may be completed."""
        return next((one for one in self.interrupted if one.rest is not None), None)

    @property
    def weighed(self) -> tuple[list[Candidate], dict[int, int]]:
        """Candidates as they are weighed: what completes another with all its readings, and which
        that is.
        """
        candidates, completed = list(self.candidates), {}
        for one in self.interrupted:
            if one.rest is not None:
                candidates[one.rest] = one.whole
                completed[one.rest] = one.part
        return candidates, completed

    def together(self, chosen: Sequence[int]) -> list[Candidate]:
        """Chosen candidates in order, a position that is completed as one, those left interrupted
        at the end.
        """
        found = {k: self.candidates[k] for k in chosen}
        for one in self.interrupted:
            part = found.pop(one.part)
            if one.rest is not None and one.rest in found:
                del found[one.rest]
                found[one.part] = one.whole
            else:
                found[len(self.candidates) + one.part] = part
        return [found[k] for k in sorted(found)]

    def begun(self, experiment: Experiment) -> dict[str, tuple[int, ...]]:
        """Plates of which some balls alone have been read, and the candidates that read all the
        others.
        """
        balls: dict[str, set[int]] = {}
        for k in self.done:
            balls.setdefault(self.candidates[k].item.artefact, set()).update(
                _balls(self.candidates[k])
            )
        found = {}
        for name in dict.fromkeys(
            self.candidates[one.part].item.artefact for one in self.interrupted
        ):
            unread = set(range(len(experiment.layouts[name].names))) - balls[name]
            if unread and experiment.artefacts[name].role == "plate":
                found[name] = tuple(
                    k
                    for k, one in enumerate(self.candidates)
                    if k not in self.done and one.item.artefact == name and unread <= _balls(one)
                )
        return found

    def without_begun(self, experiment: Experiment) -> Offer:
        """The offer as if nothing had been read in part of plates that were only begun."""
        plates = self.begun(experiment)
        if not plates:
            return self
        left = [
            one for one in self.taken if one.rest is None or one.read.item.artefact not in plates
        ]
        return offer(self.pool, left, self.is_standing, self.names)

    def find(self, names: Sequence[str]) -> list[int]:
        """Candidates by name, or those of the pool that they go back to."""
        index = {one.name: k for k, one in enumerate(self.candidates)}
        bases = [index.get(name, index.get(base_name(name.removeprefix(REST)))) for name in names]
        return sorted({k for k in bases if k is not None})

    def name(self, k: int) -> str:
        """Name of a candidate."""
        return self.candidates[k].name

    def now(self, k: int) -> int:
        """The candidate that stands for one of the pool."""
        return self.replaced.get(k, (k,))[0]


def offer(
    pool: Pool,
    taken: Sequence[SetUp] = (),
    standing: bool = True,
    known: Mapping[str, str] | None = None,
) -> Offer:
    """What may be chosen from a pool after some set-ups have been read.

    `standing` states whether the artefact still is where it was read last, so that this position
    can be completed; `known` are short names of an earlier plan.
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
            replaced[base] = (
                (complete[0],)
                if candidates[base] is not pool.candidates[base]
                else (complete[0], base)
            )
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
        tuple(
            AtMost(tuple(m for k in one.members for m in replaced.get(k, (k,))), one.count)
            for one in pool.at_most
        ),
        tuple(one for one in left if len(one) > 1),
        tuple(interrupted),
        replaced,
        pool,
        tuple(taken),
        standing,
        known or {},
    )


def open_directions(offered: Offer, information: Information, chosen: Collection[int]) -> int:
    """What interrupted positions that are not completed leave undetermined of their own poses and
    lengths.

    These are parameters that nothing else depends on: of a pose that too few balls were read in,
    and the unknown length of a standard of which no length was read.
    """
    left = [one for one in offered.interrupted if one.rest is None or one.rest not in chosen]
    ranks, design = information.pose_ranks, information.drawn.design
    poses = sum(max(ranks[one.again] - ranks[one.part], 0) for one in left)
    placed = {offered.candidates[one.part].item.artefact for one in left}
    told = {offered.candidates[k].item.artefact for k in chosen if information.has_rows[k]}
    standards = [design.artefacts.names[k] for k in design.unknown_lengths.artefact]
    return poses + sum(name in placed - told for name in standards)


def _balls(candidate: Candidate) -> set[int]:
    return set(candidate.item.balls.tolist()) if isinstance(candidate.item, Position) else set()
