"""Parameters that all candidates of a pool together leave undetermined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from ballplate.planning import Information
from ballplate.presentation import Data
from ballplate.rank import Verdict, changed_names
from ballplate.results import check
from ballplate.simulator.computing import comparable, eigh
from ballplate.simulator.experiment import Candidate, Experiment, Position, with_chosen
from ballplate.simulator.inputs import ExperimentError, listing

# Names of errors that are told.
MOST_NAMES = 8

# Positions that stand for all of a pool.
MOST_SPANNING = 16

# What a design with candidates may fail with.
UNTOLD = (ExperimentError, np.linalg.LinAlgError)

# In units of what the whole pool knows: what is not known; and what a few candidates are to know of
# everything, as a part of their fair share.
FAINT, EVEN = 1e-9, 0.1


@dataclass(frozen=True, eq=False)
class PoolGap:
    """Directions that all `candidates` of a pool leave undetermined, by the `verdict` of a design
    with a subset that leaves the same.
    """

    candidates: int
    verdict: Verdict

    @property
    def words(self) -> str:
        """Undetermined directions, by the names of the errors."""
        null = self.verdict.null
        names = dict.fromkeys(name for direction in null for name in changed_names(direction))
        count = "one direction" if len(null) == 1 else f"{len(null)} directions"
        return (
            f"even all {self.candidates} candidates together leave {count} undetermined"
            f" ({listing(names, MOST_NAMES)})"
        )

    @property
    def remedy(self) -> str:
        """Text of the cure."""
        if self.verdict.as_expected:
            return "the file expects that"
        return (
            "add candidates that determine them; ballplate check --suggest proposes changes of a"
            " design without a pool"
        )

    def to_dict(self) -> Data:
        return {
            "deficiency": self.verdict.deficiency,
            "undetermined": [str(direction) for direction in self.verdict.null],
        }

    def refusing(self, error: ExperimentError) -> ExperimentError:
        """Return an error of the pool with its undetermined directions and their cure."""
        text = f"{self.words}; {self.remedy}"
        return ExperimentError(
            replace(message, text=f"{message.text}; {text}") for message in error.messages
        )


def pool_gap(
    experiment: Experiment, candidates: Sequence[Candidate], information: Information
) -> PoolGap | None:
    """Return the directions that the candidates of a pool (the first in `information`) leave
    undetermined together, if both computations agree.

    A few candidates with the rank of all represent all: they leave the same directions
    undetermined. The rank computed from the few must equal that of the pool.
    """
    open_count = information.deficiency + information.balls_open
    # Words beside a plan, which is as good without them: nothing wrong with them is a reason to
    # withhold it.
    try:
        few = spanning(information, candidates)
        design = with_chosen(experiment, [candidates[k] for k in few])
        judged = check(design).verdict if few else None
    except UNTOLD:
        return None
    if judged is None or judged.deficiency != open_count + sum(
        information.pose_open[k] for k in few
    ):
        return None
    return PoolGap(len(candidates), judged)


def spanning(information: Information, candidates: Sequence[Candidate]) -> tuple[int, ...]:
    """Return a few candidates, in order, with the rank of the pool; empty if `MOST_SPANNING`
    positions are too few.

    These are all certificates, positions with a partly undetermined pose, and enough others to
    read every ball that the pool reads; each further one adds most to the least known direction.
    """
    count = len(candidates)
    unread = {
        k: _balls(candidate)
        for k, candidate in enumerate(candidates)
        if isinstance(candidate.item, Position)
    }
    places = set(unread)
    few = [k for k in range(count) if k not in places or information.pose_open[k]]
    _take(unread, [k for k in few if k in places])
    while any(unread.values()):
        best = max(unread, key=lambda k: len(unread[k]))
        few.append(best)
        _take(unread, [best])
    flat = information.matrices[:count].reshape(count, -1)
    while True:
        values, directions = eigh(information.of(few))
        smallest_value, shared_places = values.min(initial=1.0), places.intersection(few)
        is_even = smallest_value > EVEN * len(few) / count
        if is_even or shared_places == places or len(shared_places) >= MOST_SPANNING:
            return (
                tuple(sorted(few))
                if smallest_value > FAINT and len(shared_places) <= MOST_SPANNING
                else ()
            )
        scaled = directions / (values.clip(0.0) + FAINT)
        gains = comparable(flat @ (scaled @ directions.T).ravel())
        few.append(max(places - shared_places, key=lambda k: (gains[k], -k)))


def _balls(candidate: Candidate) -> set[tuple[str, int]]:
    assert isinstance(candidate.item, Position)
    return {(candidate.item.artefact, ball) for ball in candidate.item.balls.tolist()}


def _take(unread: dict[int, set[tuple[str, int]]], members: Sequence[int]) -> None:
    """Count as read what candidates read."""
    read_balls = {ball for k in members for ball in unread[k]}
    for balls in unread.values():
        balls -= read_balls
