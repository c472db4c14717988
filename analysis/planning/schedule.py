"""Schedule of a campaign: the order with the least change-over, and the run sheet."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ballplate.simulator.experiment.model import Candidate, ChangeTimes, Position
from ballplate.simulator.inputs.settings import listing

from .changeover import cheapest, kind_of
from .orders import LEAST_CHANGE_OVER, ReadingOrder, Sequenced, in_order
from .short_names import with_short_name


@dataclass(frozen=True)
class Completion:
    """Missing readings of a position whose artefact is still set up, and the position with all its
    readings.
    """

    rest: Candidate
    whole: Candidate


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

    Without durations in the file it is not `timed`, and all times are zero. An order of least
    change-over takes at most `gap` seconds more than any other.
    """

    steps: tuple[Step, ...]
    calibration: tuple[Candidate, ...]
    timed: bool = True
    changes: ChangeTimes = ChangeTimes(0.0, 0.0)
    gap: float = 0.0

    @property
    def chosen(self) -> tuple[Candidate, ...]:
        """All candidates, positions in the order of the sheet, those left interrupted after the
        others.

        The first position holds the frame of its artefact, which one that was only begun may do
        badly.
        """
        steps = sorted(self.steps, key=lambda step: step.left)
        return (*(step.whole or step.candidate for step in steps), *self.calibration)

    @property
    def first_readings(self) -> dict[str, float]:
        """When the first reading of each position that is to be read begins, in seconds as
        `Step.start` counts.
        """
        todo = [step for step in self.steps if not step.done]
        sequence = tuple((step.candidate, step.probes) for step in todo)
        steps = first_readings(sequence, self.changes)
        return {step.name: start for step, start in zip(todo, steps, strict=True)}

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
    completed: Completion | None = None,
    interrupted: Collection[Candidate] = (),
    names: Mapping[str, str] | None = None,
    order: ReadingOrder = LEAST_CHANGE_OVER,
) -> RunSheet:
    """Return the run sheet of chosen candidates in the cheapest order or another one, completed
    ones first in theirs.

    `done` candidates may be among the chosen ones; they take no more time, and the first remaining
    position needs no change, like any first one. A `completed` position is that first one while
    its artefact is set up; only its missing readings take time. Other `interrupted` positions are
    unchanged. `names` are short names by those of candidates.
    """
    again = set() if completed is None else {completed.whole.name}
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
    first = None if completed is None else completed.rest
    if order.name == "change-over":
        sequence, gap = ordered(positions, changes, before, first)
    else:
        begun, gap = ordered((), changes, before, first)
        sequence = (*begun, *in_order(positions, changes, order))
    steps = []
    elapsed = 0.0
    for k, (candidate, probes) in enumerate(sequence):
        is_done = k < len(before)
        change, words = 0.0, ""
        if k > len(before):
            change, words = change_over(sequence[k - 1], sequence[k], changes)
        seconds = 0.0 if is_done else candidate.seconds
        place, balls, whole = place_words(candidate), ball_words(candidate), None
        if completed is not None and candidate is completed.rest:
            whole = completed.whole
            place = f"as it stands: {place}"
            balls = f"the rest, {candidate.readings} of {whole.readings} readings: {balls}"
        is_left = is_done and candidate.name in interrupted_names
        balls += "; left so" if is_left else ""
        steps.append(
            Step(
                candidate,
                place,
                probes,
                balls,
                words,
                change,
                seconds,
                elapsed,
                is_done,
                whole,
                is_left,
                (names or {}).get((whole or candidate).name, ""),
            )
        )
        elapsed += change + seconds
    return RunSheet(
        tuple(steps),
        tuple(candidate for candidate in chosen if not isinstance(candidate.item, Position)),
        changes=changes,
        gap=gap,
    )


def first_readings(sequence: Sequenced, changes: ChangeTimes) -> list[float]:
    """When the first reading of each position in a sequence begins, in seconds."""
    done_visits, elapsed = [], 0.0
    for k, (candidate, probes) in enumerate(sequence):
        elapsed += change_over(sequence[k - 1], sequence[k], changes)[0] if k else 0.0
        elapsed += candidate.seconds
        seconds_taken = (
            len(probes) - 1
        ) * changes.probe + candidate.readings * candidate.reading_seconds
        done_visits.append(elapsed - min(seconds_taken, candidate.seconds))
    return done_visits


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
    chosen: Sequence[Candidate],
    changes: ChangeTimes,
    done_candidates: Sequence[Candidate] = (),
    first: Candidate | None = None,
) -> tuple[Sequenced, float]:
    """Return positions, `done_candidates` ones first, in the cheapest order, each with the order
    of its probes; and the largest possible saving in seconds of another order.

    Positions of one class keep their given order. One of the remaining may be required as `first`.
    """
    positions = [candidate for candidate in chosen if isinstance(candidate.item, Position)]
    after = first if first is not None else done_candidates[-1] if done_candidates else None
    order = cheapest(
        Counter(map(kind_of, positions)).items(),
        changes,
        None if after is None else kind_of(after),
        is_paid=first is not None,
    )
    visits = [
        (candidate, candidate.item.probes)
        for candidate in done_candidates
        if isinstance(candidate.item, Position)
    ]
    if first is not None:
        visits.append((first, _ending_with(first, order.before)))
    members = {
        kind: iter([candidate for candidate in positions if kind_of(candidate) == kind])
        for kind in set(map(kind_of, positions))
    }
    for visit in order.visits:
        candidate = next(members[visit.kind])
        visits.append((candidate, _sequence(candidate, visit.first, visit.last)))
    return tuple(visits), order.seconds - order.bound


def _ending_with(candidate: Candidate, last: str | None) -> tuple[str, ...]:
    """The probes of a position, the last one last."""
    assert isinstance(candidate.item, Position)
    probes = candidate.item.probes
    return probes if last is None else (*(probe for probe in probes if probe != last), last)


def _sequence(candidate: Candidate, first: str, last: str) -> tuple[str, ...]:
    assert isinstance(candidate.item, Position)
    between = [probe for probe in candidate.item.probes if probe not in (first, last)]
    return (first,) if first == last and not between else (first, *between, last)
