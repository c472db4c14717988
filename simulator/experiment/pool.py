"""What a plan chooses from: candidates with their times, and limits on choosing them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from .model import Calibration, Experiment, Position


@dataclass(frozen=True)
class ChangeTimes:
    """Seconds that go between positions: for another probe, and for another plane or artefact."""

    probe: float
    plane: float


@dataclass(frozen=True, eq=False)
class Candidate:
    """A position, or a calibration item, that a plan may choose.

    `seconds` is what it takes by itself: set-up, readings and changes of probe within it, or the price of a
    calibration item. `plane` names the axis that the artefact stands across, empty where the pose is free and for a
    calibration item. `group` is the entry of the pool that it comes from, empty for positions that are `drawn`, in the
    experiment's own list. `settings` is what an experiment file says of it. `reading_seconds` is what a reading takes.
    """

    name: str
    item: Position | Calibration
    seconds: float
    plane: str
    group: str
    drawn: bool
    settings: Mapping[str, Any]
    reading_seconds: float = 0.0

    @property
    def readings(self) -> int:
        """Readings that it takes, every repeat counted."""
        if not isinstance(self.item, Position):
            return 0
        return sum(len(group.probes) * len(group.balls) * group.repeats for group in self.item.readings)


@dataclass(frozen=True)
class AtMost:
    """A limit: of `members`, indices of candidates, no more than `count`."""

    members: tuple[int, ...]
    count: int


@dataclass(frozen=True, eq=False)
class Pool:
    """Candidates in order, positions of the experiment itself first, and the limits on choosing them.

    `must` are the indices of what has to be chosen. `dropped` tells how many candidates were generated but
    cannot be read, or stand there twice, by the reason.
    """

    candidates: tuple[Candidate, ...]
    changes: ChangeTimes
    must: tuple[int, ...]
    at_most: tuple[AtMost, ...]
    dropped: Mapping[str, int]


def with_chosen(experiment: Experiment, chosen: Sequence[Candidate]) -> Experiment:
    """The experiment with chosen candidates, in their order, as its positions, and as further calibration."""
    items = [candidate.item for candidate in chosen]
    positions = tuple(item for item in items if isinstance(item, Position))
    calibration = tuple(item for item in items if not isinstance(item, Position))
    return placed_only(replace(experiment, positions=positions, calibration=(*experiment.calibration, *calibration)))


def placed_only(experiment: Experiment) -> Experiment:
    """The experiment without its pool, artefacts that no position places and priors about other positions."""
    placed = {position.artefact for position in experiment.positions}
    names = {position.name for position in experiment.positions}
    return replace(
        experiment,
        artefacts={name: one for name, one in experiment.artefacts.items() if name in placed},
        layouts={name: one for name, one in experiment.layouts.items() if name in placed},
        calibration=tuple(one for one in experiment.calibration if one.artefact in placed),
        priors=tuple(one for one in experiment.priors if one.position is None or one.position in names),
        pool=None,
    )
