"""Candidates for the continuation of a campaign: remaining, completed and interrupted positions.

An interrupted position is offered twice: for completion while its artefact is still set up, at the
cost of the missing readings alone, and for a new set-up in full. Its existing readings count in
both.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from ballplate.simulator.experiment import AtMost, Candidate, Experiment, Pool, Position

from .information import Information
from .set_ups import REST, SetUp, base_name, next_name, renamed


@dataclass(frozen=True)
class Interrupted:
    """A position that was read in part, by indices of an offer.

    `part` has the readings taken, `rest` completes it (absent if the artefact has been removed),
    and `again` is a new set-up. `whole` is the position with all its readings.
    """

    part: int
    rest: int | None
    again: int
    whole: Candidate


@dataclass(frozen=True)
class Offer:
    """Candidates, those of the pool first, and limits on choosing them.

    `done` follows the order of reading; `must` and one of each `at_least` are required. `replaced`
    maps interrupted candidates of the pool to those that may be chosen instead. `names` are short
    names of an earlier plan, by those of candidates.
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
        return next(
            (
                interrupted_position
                for interrupted_position in self.interrupted
                if interrupted_position.rest is not None
            ),
            None,
        )

    @property
    def weighed(self) -> tuple[list[Candidate], dict[int, int]]:
        """Return candidates for evaluation, with completions in full, and the indices of these
        completions.
        """
        candidates, completed = list(self.candidates), {}
        for interrupted_position in self.interrupted:
            if interrupted_position.rest is not None:
                candidates[interrupted_position.rest] = interrupted_position.whole
                completed[interrupted_position.rest] = interrupted_position.part
        return candidates, completed

    def together(self, chosen: Sequence[int]) -> list[Candidate]:
        """Chosen candidates in order, a position that is completed as one, those left interrupted
        at the end.
        """
        by_index = {k: self.candidates[k] for k in chosen}
        for interrupted_position in self.interrupted:
            part = by_index.pop(interrupted_position.part)
            if interrupted_position.rest is not None and interrupted_position.rest in by_index:
                del by_index[interrupted_position.rest]
                by_index[interrupted_position.part] = interrupted_position.whole
            else:
                by_index[len(self.candidates) + interrupted_position.part] = part
        return [by_index[k] for k in sorted(by_index)]

    def begun(self, experiment: Experiment) -> dict[str, tuple[int, ...]]:
        """Return plates that were read in part only, and the candidates that read all their other
        balls.
        """
        balls: dict[str, set[int]] = {}
        for k in self.done:
            balls.setdefault(self.candidates[k].item.artefact, set()).update(
                _balls(self.candidates[k])
            )
        begun_by = {}
        for name in dict.fromkeys(
            self.candidates[candidate.part].item.artefact for candidate in self.interrupted
        ):
            unread = set(range(len(experiment.layouts[name].names))) - balls[name]
            if unread and experiment.artefacts[name].role == "plate":
                begun_by[name] = tuple(
                    k
                    for k, candidate in enumerate(self.candidates)
                    if k not in self.done
                    and candidate.item.artefact == name
                    and unread <= _balls(candidate)
                )
        return begun_by

    def without_begun(self, experiment: Experiment) -> Offer:
        """Return the offer without the partial readings of plates that were only begun."""
        plates = self.begun(experiment)
        if not plates:
            return self
        set_ups = [
            set_up
            for set_up in self.taken
            if set_up.rest is None or set_up.read.item.artefact not in plates
        ]
        return offer(self.pool, set_ups, self.is_standing, self.names)

    def find(self, names: Sequence[str]) -> list[int]:
        """Candidates by name, or those of the pool that they go back to."""
        index = {candidate.name: k for k, candidate in enumerate(self.candidates)}
        bases = [index.get(name, index.get(base_name(name.removeprefix(REST)))) for name in names]
        return sorted({k for k in bases if k is not None})

    def name(self, k: int) -> str:
        """Name of a candidate."""
        return self.candidates[k].name

    def now(self, k: int) -> int:
        """Return the candidate that represents one of the pool."""
        return self.replaced.get(k, (k,))[0]


def offer(
    pool: Pool,
    set_ups: Sequence[SetUp] = (),
    standing: bool = True,
    known_names: Mapping[str, str] | None = None,
) -> Offer:
    """Return the choices of a pool after some set-ups have been read.

    `standing` is true if the artefact is still where it was read last, so that this position can
    be completed; `known_names` are short names of an earlier plan.
    """
    candidates = list(pool.candidates)
    index: dict[str, int] = {}
    for set_up in set_ups:
        index[set_up.name] = set_up.base
        if set_up.name == pool.candidates[set_up.base].name:
            candidates[set_up.base] = set_up.read
        else:
            index[set_up.name] = len(candidates)
            candidates.append(set_up.read)
    names = [candidate.name for candidate in candidates]
    interrupted: list[Interrupted] = []
    replaced: dict[int, tuple[int, ...]] = {}
    for base in dict.fromkeys(set_up.base for set_up in set_ups):
        of_base = [set_up for set_up in set_ups if set_up.base == base]
        complete = [index[candidate.name] for candidate in of_base if candidate.rest is None]
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
        for candidate in of_base:
            rest_index = None
            if standing and candidate.is_last and candidate.rest is not None:
                rest_index = len(candidates)
                candidates.append(candidate.rest)
                replaced[base] = (rest_index, again)
            interrupted.append(
                Interrupted(index[candidate.name], rest_index, again, candidate.whole)
            )
    done_indices = tuple(index[set_up.name] for set_up in set_ups)
    must = [replaced.get(k, (k,)) for k in pool.must]
    return Offer(
        tuple(candidates),
        done_indices,
        tuple(indices[0] for indices in must if len(indices) == 1),
        tuple(
            AtMost(tuple(m for k in limit.members for m in replaced.get(k, (k,))), limit.count)
            for limit in pool.at_most
        ),
        tuple(indices for indices in must if len(indices) > 1),
        tuple(interrupted),
        replaced,
        pool,
        tuple(set_ups),
        standing,
        known_names or {},
    )


def open_directions(offered: Offer, information: Information, chosen: Collection[int]) -> int:
    """Return the number of undetermined directions that interrupted, uncompleted positions have in
    their own poses and lengths.

    No other parameter depends on these: a pose read in too few balls, or the unknown length of a
    standard without a reading.
    """
    unfinished = [
        interrupted_position
        for interrupted_position in offered.interrupted
        if interrupted_position.rest is None or interrupted_position.rest not in chosen
    ]
    ranks, design = information.pose_ranks, information.drawn.design
    poses = sum(
        max(ranks[interrupted_position.again] - ranks[interrupted_position.part], 0)
        for interrupted_position in unfinished
    )
    placed = {
        offered.candidates[interrupted_position.part].item.artefact
        for interrupted_position in unfinished
    }
    read_artefacts = {
        offered.candidates[k].item.artefact for k in chosen if information.has_rows[k]
    }
    standards = [design.artefacts.names[k] for k in design.unknown_lengths.artefact]
    return poses + sum(name in placed - read_artefacts for name in standards)


def _balls(candidate: Candidate) -> set[int]:
    return set(candidate.item.balls.tolist()) if isinstance(candidate.item, Position) else set()
