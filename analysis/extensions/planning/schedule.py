"""Schedule of a campaign: a short order, and the run sheet."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ballplate.simulator.experiment import Candidate, ChangeTimes, Position
from ballplate.simulator.inputs import listing

from .changeover import Setup, kind_of, short_order
from .set_ups import position_of
from .short_names import with_short_name

# Positions with their probes in order.
Sequenced = Sequence[tuple[Candidate, tuple[str, ...]]]


@dataclass(frozen=True)
class Step:
    """A position of a run sheet: set-up and readings as text, probes in order.

    `change` describes the change before it, of `change_seconds`; `seconds` is its own duration,
    and `start` the begin of its change-over, in seconds from the first position to read. `done`
    positions have neither. A completed position has all readings in `whole` and the missing ones
    in `candidate`; an interrupted one that is not completed is `left`. `short` is the short name
    of a position whose name the pool composed.
    """

    candidate: Candidate
    place: str
    probes: tuple[str, ...]
    balls: str
    change: str
    change_seconds: float
    seconds: float
    start: float
    done: bool
    whole: Candidate | None = None
    left: bool = False
    short: str = ""

    @property
    def position(self) -> Candidate:
        """The position with all its readings, also those taken already."""
        return self.whole or self.candidate

    @property
    def name(self) -> str:
        return self.short or self.position.name

    @property
    def description(self) -> str:
        """Description of the position, empty if the name contains it."""
        item = self.position.item
        assert isinstance(item, Position)
        return item.description if self.name == self.position.name else self.position.name

    @property
    def title(self) -> str:
        """Name and description."""
        return f"{self.name}, {self.description}" if self.description else self.name

    @property
    def artefact(self) -> str:
        return self.candidate.item.artefact

    @property
    def plane(self) -> str:
        return self.candidate.plane

    @property
    def readings(self) -> int:
        return self.candidate.readings


@dataclass(frozen=True)
class RunSheet:
    """Positions in reading order, completed ones first, and items of calibration with their price
    in seconds.

    Without durations in the file it is not `timed`, and all times are zero.
    """

    steps: tuple[Step, ...]
    calibration: tuple[Candidate, ...]
    timed: bool = True

    @property
    def chosen(self) -> tuple[Candidate, ...]:
        """All candidates, positions in the order of the sheet, those left interrupted after the
        others.

        The first position holds the frame of its artefact, which one that was only begun may do
        badly.
        """
        steps = sorted(self.steps, key=lambda step: step.left)
        return (*(step.position for step in steps), *self.calibration)

    def with_names(self, names: Mapping[str, str]) -> RunSheet:
        """Return the sheet with short names by the names of candidates."""
        steps = (replace(step, short=names.get(step.position.name, "")) for step in self.steps)
        return replace(self, steps=tuple(steps))

    @property
    def names(self) -> dict[str, str]:
        """Short names by the names of candidates."""
        return {step.position.name: step.short for step in self.steps if step.short}

    @property
    def written(self) -> tuple[Candidate, ...]:
        """The same under their short names, as an experiment file says them."""
        named = {
            step.position.name: with_short_name(step.position, step.name, step.probes)
            for step in self.steps
        }
        return tuple(named.get(candidate.name, candidate) for candidate in self.chosen)

    @property
    def seconds(self) -> float:
        """Time still needed for positions, changes and calibration."""
        of_positions = sum(step.seconds + step.change_seconds for step in self.steps)
        return of_positions + sum(calibration.seconds for calibration in self.calibration)

    @property
    def hours(self) -> float:
        """The same in hours."""
        return self.seconds / 3600.0


def run_sheet(
    chosen: Sequence[Candidate],
    changes: ChangeTimes,
    done: Sequence[Candidate] = (),
    completed: tuple[Candidate, Candidate] | None = None,
    interrupted: Collection[Candidate] = (),
) -> RunSheet:
    """Return the run sheet of chosen candidates in a short order, completed ones first in theirs.

    `done` candidates may be among the chosen ones; they take no more time, and the first remaining
    position needs no change, like any first one. A `completed` position, by its missing readings
    and with all of them, is that first one while its artefact is set up; only its missing readings
    take time. Other `interrupted` positions are unchanged.
    """
    rest, whole = completed or (None, None)
    again = set() if whole is None else {whole.name}
    before = [
        candidate
        for candidate in done
        if isinstance(candidate.item, Position) and candidate.name not in again
    ]
    earlier = {candidate.name for candidate in before} | again
    interrupted_names = {candidate.name for candidate in interrupted} - again
    positions = [
        candidate
        for candidate in chosen
        if isinstance(candidate.item, Position) and candidate.name not in earlier
    ]
    steps = []
    for step in steps_of(ordered(positions, changes, before, rest), changes, len(before)):
        if whole is not None and step.candidate is rest:
            place = f"as it stands: {step.place}"
            balls = f"the rest, {step.readings} of {whole.readings} readings: {step.balls}"
            step = replace(step, place=place, balls=balls, whole=whole)
        elif step.done and step.candidate.name in interrupted_names:
            step = replace(step, balls=f"{step.balls}; left so", left=True)
        steps.append(step)
    calibration = (item for item in chosen if not isinstance(item.item, Position))
    return RunSheet(tuple(steps), tuple(calibration))


def steps_of(sequence: Sequenced, changes: ChangeTimes, done: int = 0) -> Iterator[Step]:
    """Yield the steps of positions in a sequence, of which the first ones are `done`."""
    elapsed = 0.0
    for k, (candidate, probes) in enumerate(sequence):
        change, words = 0.0, ""
        if k > done:
            change, words = change_over(sequence[k - 1], sequence[k], changes)
        seconds = 0.0 if k < done else candidate.seconds
        place, balls = place_words(candidate), ball_words(candidate)
        yield Step(candidate, place, probes, balls, words, change, seconds, elapsed, k < done)
        elapsed += change + seconds


def change_over(
    from_visit: tuple[Candidate, tuple[str, ...]],
    to_visit: tuple[Candidate, tuple[str, ...]],
    changes: ChangeTimes,
) -> tuple[float, str]:
    """Return the seconds and the description of the change from one position to another."""
    before, after = kind_of(from_visit[0]), kind_of(to_visit[0])
    words = []
    if before.artefact != after.artefact:
        words.append(f"artefact: {after.artefact}")
    if before.plane != after.plane:
        words.append(f"plane: across {after.plane}" if after.plane else "plane: free")
    seconds = changes.plane if words else 0.0
    if from_visit[1][-1] != to_visit[1][0]:
        words.append(f"probe: {to_visit[1][0]}")
        seconds += changes.probe
    return seconds, ", ".join(words)


def place_words(candidate: Candidate) -> str:
    """Return the description of the set-up; lengths are those of the file."""
    settings: Mapping[str, Any] = candidate.settings
    if settings.get("pose") is not None:
        pose = settings["pose"]
        rotation = pose.get("rotation")
        turned = "not turned"
        if rotation is not None:
            several = isinstance(rotation, list | tuple)
            turned = (
                f"turned by {', '.join(map(str, rotation))} about x, y, z"
                if several
                else f"turned by {rotation}"
            )
        return (
            f"origin of the artefact at {_at(dict(zip('xyz', pose['origin'], strict=False)))},"
            f" {turned}"
        )
    plane = settings.get("plane")
    words = []
    if plane is not None:
        words.append(
            f"{'flat' if plane == 'z' else 'upright'}, across {plane}"
            f" at {plane} = {settings['level']}"
        )
    anchor = "corner" if settings.get("corner") is not None else "centre"
    words.append(f"{'lower corner' if anchor == 'corner' else 'centre'} at {_at(settings[anchor])}")
    turns = int(settings.get("quarter_turns") or 0) % 4
    words.append(
        f"turned {90 * turns} deg counter-clockwise seen from +{plane or 'z'}"
        if turns
        else "not turned"
    )
    return "; ".join(words)


def _at(lengths: Mapping[str, str]) -> str:
    return ", ".join(f"{axis} = {lengths[axis]}" for axis in sorted(lengths))


def ball_words(candidate: Candidate) -> str:
    """Return the description of the balls to read, and of the probes of several groups of
    readings.
    """
    assert isinstance(candidate.item, Position)
    groups = candidate.item.readings
    reading_settings: Sequence[Any] = candidate.settings.get("readings") or [candidate.settings]
    words = []
    for k, group in enumerate(groups):
        # Of what is done, other readings may have been taken than the file says.
        is_all = len(reading_settings) == len(groups) and reading_settings[k].get("balls") in (
            None,
            "all",
        )
        text = f"all {len(group.balls)}" if is_all else listing(group.balls, 50)
        text += f", {group.repeats} times each" if group.repeats > 1 else ""
        words.append(f"{text} with {', '.join(group.probes)}" if len(groups) > 1 else text)
    return "; ".join(words)


def ordered(
    positions: Sequence[Candidate],
    changes: ChangeTimes,
    done: Sequence[Candidate] = (),
    first: Candidate | None = None,
) -> Sequenced:
    """Return positions, `done` ones first, in a short order, each with the order of its probes.

    Positions of one class keep their given order. A further one may be required as the `first` of
    the remaining.
    """
    after = first if first is not None else done[-1] if done else None
    by_kind: dict[Setup, list[Candidate]] = {}
    for candidate in positions:
        by_kind.setdefault(kind_of(candidate), []).append(candidate)
    _, order, before = short_order(
        [(kind, len(members)) for kind, members in by_kind.items()],
        changes,
        None if after is None else kind_of(after),
        is_paid=first is not None,
    )
    visits = [(candidate, position_of(candidate).probes) for candidate in done]
    if first is not None:
        visits.append((first, _probes(first, None, before)))
    remaining = {kind: iter(members) for kind, members in by_kind.items()}
    for visit in order:
        candidate = next(remaining[visit.kind])
        visits.append((candidate, _probes(candidate, visit.first, visit.last)))
    return tuple(visits)


def _probes(candidate: Candidate, first: str | None, last: str | None) -> tuple[str, ...]:
    """The probes of a position, `first` and `last` at the ends."""
    probes = position_of(candidate).probes
    return tuple(sorted(probes, key=lambda probe: (probe == last) - (probe == first)))
