"""Search for the cheapest repairs of a deficient design.

Every reported set of changes has been applied to the experiment, and the rank of the resulting
design computed in full; every member is necessary.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from ballplate.rank import independent_mixture
from ballplate.results import Prediction, predict
from ballplate.simulator.computing import Report, comparable, counted, single_threaded, unreported
from ballplate.simulator.experiment import Experiment, placed_only, seconds_of
from ballplate.simulator.machines import Array
from ballplate.uncertainty import OFFSET_TRIAL, PairSummary, lengths_with_offsets

from .changes import EFFORT, Change, ChangeKind, apply_all, go_together, is_inside
from .covering import covering_set
from .judging import Examined, Judged, examine, judge, removed, work
from .offers import allowed, offers
from .scale import scale_certificate
from .screening import rank_of, seen_by
from .written import Edit, edits

# Changes that are made together.
ChangeSet = tuple[Change, ...]

# Repairs told, of different kinds.
MOST_TOLD = 3
# Repairs of single directions told.
MOST_PARTIAL = 4
# Equally cheap repairs of a kind whose U6 with uncertain offsets is compared.
MOST_COMPARED = 12
# Changes in a set: as many as directions are open, within bounds.
FEWEST_TOGETHER, MOST_TOGETHER = 3, 6
# Judgements of a kind: as many as this amount of work allows, within bounds.
WORK, FEWEST, MOST = 5e6, 12, 80
# A smallest singular value below this fraction of what it was is a repair in name only.
FAINT = 0.01


@dataclass(frozen=True, eq=False)
class Repair:
    """Changes that determine every parameter, with the prediction of the changed design.

    They take `readings` and `seconds` more. `loosened` are the lengths, U6, if probe offsets that
    the file holds exact have a standard uncertainty of `OFFSET_TRIAL` and the lengths remain
    determined. `removes` are the indices, from 0, of the determined directions. `weak` counts
    directions still weakly determined, `worst` is the effect of one standard deviation along the
    weakest on corrected points, in metres. `smallest` is the smallest singular value; `is_faint`
    is true if it is far below those of the design before. `edits` are the changes of the file.
    """

    changes: ChangeSet
    deficiency: int
    removes: tuple[int, ...]
    weak: int
    worst: float
    smallest: float
    is_faint: bool
    prediction: Prediction | None
    edits: tuple[Edit, ...]
    readings: int
    seconds: float
    loosened: PairSummary | None

    @property
    def rests_on_offsets(self) -> bool:
        """True if scale then rests on probe offsets that are held exact."""
        scale = None if self.prediction is None else self.prediction.scale
        return scale is not None and scale.rests_on_offsets

    @property
    def order(self) -> tuple[bool, float, float]:
        """Sort key: first repairs in more than name, then by U6 with uncertain offsets, then by
        time.
        """
        u6 = inf if self.loosened is None else self.loosened.total / self.loosened.count
        return bool(self.weak) or self.is_faint, float(comparable(u6)), self.seconds


@dataclass(frozen=True)
class Repairs:
    """Result of a search: `complete` repairs, and `partial` ones of single directions."""

    complete: tuple[Repair, ...]
    partial: tuple[Repair, ...]


@single_threaded
def repairs(
    experiment: Experiment, most: int = MOST_TOLD, report: Report = unreported
) -> Repairs | None:
    """Return at most `most` repairs of an experiment's design, or None if no direction is
    undetermined or weak.
    """
    base = examine(experiment)
    if base.judged.is_cured:
        return None
    return _Search(base, most).run(report)


def effort(change: Change) -> float:
    """The cost of a change, comparable among additions of all kinds."""
    return EFFORT.get(change.kind, 1.0) * max(change.cost, 1e-9)


class _Search:
    """One search, with the changes judged."""

    def __init__(self, base: Examined, most: int) -> None:
        self.most = most
        self.base = base
        self.before = base.judged
        self.judged: dict[frozenset[Change], Judged | None] = {}
        self.seen: dict[Change, Array] = {}
        self.ranks: dict[Change, int] = {}
        self.together = int(np.clip(self.before.deficiency, FEWEST_TOGETHER, MOST_TOGETHER))
        self.at_most = int(np.clip(WORK / work(base), FEWEST, MOST))

    def run(self, report: Report) -> Repairs:
        candidates = offers(self.base.experiment)
        self.seen = seen_by(
            self.base, [change for changes in candidates.values() for change in changes]
        )
        self.ranks = {change: rank_of([effect]) for change, effect in self.seen.items()}
        best: dict[ChangeKind, ChangeSet] = {}
        singles = []
        steps = counted(candidates.items(), "kinds of changes", len(candidates), report)
        for kind, changes in steps:
            sound = sum(self.is_sound(self.judge(change)) for change in best.values())
            if sound >= self.most:
                break
            whole, part = self.singles(kind, changes)
            singles += [*whole, *part]
            possible: list[ChangeSet] = [
                (change,) for change in whole if not self.judge((change,)).deficiency
            ]
            together = self.set_of_additions(changes) if self.is_worth_more(possible) else ()
            possible += [together] if together else []
            if possible:
                best[kind] = self.best_of(possible)
        for together in self.mixed(candidates, best):
            best[max(change.kind for change in together)] = together
        order = sorted(best, key=lambda kind: (not self.is_sound(self.judge(best[kind])), kind))
        repairs = [self.told(best[kind]) for kind in order if self.helps(best[kind])]
        complete = self.ranked(repairs)
        is_single = any(
            len(change.changes) == 1 and not change.weak and not change.is_faint
            for change in complete
        )
        partial = () if is_single else self.of_single_directions(singles)
        return Repairs(complete, partial)

    def ranked(self, repairs: Sequence[Repair]) -> tuple[Repair, ...]:
        """Return the best repairs first; if even scale of the best rests on probe offsets, that
        with an additional calibrated distance precedes it.
        """
        order = sorted(repairs, key=lambda repair: repair.order)
        if order and order[0].rests_on_offsets and self.base.experiment.pool is None:
            assert order[0].prediction is not None
            changed = apply_all(order[0].changes, self.base.experiment)
            certificate = scale_certificate(changed, order[0].prediction.scale)
            if certificate is not None and certificate.change is not None:
                with_length = self.told((*order[0].changes, certificate.change))
                order = sorted([with_length, *order], key=lambda repair: repair.order)
        return tuple(order[: self.most])

    def is_worth_more(self, possible: Sequence[ChangeSet]) -> bool:
        """True if several changes of a class may be better than the best one."""
        cheapest = min(map(self.preference, possible), default=None)
        return cheapest is None or cheapest[0] or cheapest[1] > 1.0

    def mixed(
        self,
        offered: Mapping[ChangeKind, Sequence[Change]],
        best: Mapping[ChangeKind, ChangeSet],
    ) -> Iterator[ChangeSet]:
        """Return sets of changes of several kinds if no kind is enough: additions first, then
        moves, then both.
        """
        if any(self.is_sound(self.judge(changes)) for changes in best.values()):
            return
        together = self.set_of_additions([change for kind in offered for change in offered[kind]])
        if together:
            yield together
            if self.is_sound(self.judge(together)):
                return
        every = [change for kind in offered for change in self.thinned(self.useful(offered[kind]))]
        together = self.greedy(offered[ChangeKind.MOVE]) or self.greedy(every)
        if together:
            yield together

    def useful(self, changes: Sequence[Change]) -> list[Change]:
        """Return changes, without those that add only known directions."""
        return [change for change in changes if change not in self.seen or self.ranks[change]]

    def is_faint(self, after: Judged) -> bool:
        """True if a former null direction is so weakly determined that it cannot count as
        known.
        """
        return self.before.deficiency > 0 and after.smallest < FAINT * self.before.smallest

    def is_sound(self, after: Judged) -> bool:
        """True if changes repair the design in more than name."""
        return after.is_cured and not self.is_faint(after)

    def helps(self, changes: ChangeSet) -> bool:
        """True if changes give full rank, or fewer weak directions."""
        after = self.judge(changes)
        return after.deficiency < self.before.deficiency or after.weak < self.before.weak

    def judge(self, changes: Sequence[Change]) -> Judged:
        """Return the rank after changes, from memory if known; that of the design before if they
        are impossible.
        """
        key = frozenset(changes)
        if key not in self.judged:
            self.judged[key] = judge(self.base.experiment, changes)
        return self.judged[key] or self.before

    def preference(self, changes: ChangeSet) -> tuple[bool, float, int, float]:
        """Sort key: repairs without weak directions first, then the cheapest, then the least
        uncertain.
        """
        after = self.judge(changes)
        return (
            not self.is_sound(after),
            sum(change.cost for change in changes),
            len(changes),
            float(comparable(after.spread)),
        )

    def best_of(self, possible: Sequence[ChangeSet]) -> ChangeSet:
        """Of the cheapest repairs of a kind that with the smallest U6 with uncertain offsets."""
        order = sorted(possible, key=self.preference)
        equal = [
            repair
            for repair in order
            if self.preference(repair)[:3] == self.preference(order[0])[:3]
        ]
        return min(equal[:MOST_COMPARED], key=self.loosened) if len(equal) > 1 else order[0]

    def loosened(self, changes: ChangeSet) -> float:
        """Average U6 of changes where exact offsets are uncertain."""
        lengths = _loosened(apply_all(changes, self.base.experiment))
        return inf if lengths is None else float(comparable(lengths.total / lengths.count))

    def thinned(self, changes: Sequence[Change]) -> list[Change]:
        """Return as many as can be judged, evenly spread."""
        if len(changes) <= self.at_most:
            return list(changes)
        return [changes[k] for k in np.linspace(0, len(changes) - 1, self.at_most).astype(int)]

    def singles(
        self, kind: ChangeKind, changes: Sequence[Change]
    ) -> tuple[list[Change], list[Change]]:
        """Changes that may suffice, judged one at a time, and additions that remove some of the
        null directions.
        """
        useful = self.useful(changes)
        k = self.before.deficiency
        whole = [change for change in useful if change not in self.seen or self.ranks[change] == k]
        part = [change for change in useful if change in self.seen and self.ranks[change] < k]
        judged = self.cheapest(whole) if kind == ChangeKind.POOL else self.thinned(whole)
        for change in judged:
            self.judge((change,))
        return judged, part

    def cheapest(self, changes: Sequence[Change]) -> list[Change]:
        """Return a list in order of cost, up to the first that cures."""
        tried = []
        for change in changes[: self.at_most]:
            tried.append(change)
            if self.is_sound(self.judge((change,))):
                break
        return tried

    def set_of_additions(self, changes: Sequence[Change]) -> ChangeSet:
        """Return several additions that together determine every direction; possibly empty."""
        additions = [change for change in changes if change in self.seen and self.ranks[change]]
        together = covering_set(additions, self.seen, effort, self.may_be)
        return together if len(together) > 1 and not self.judge(together).deficiency else ()

    def may_be(self, changes: Sequence[Change]) -> bool:
        """True if changes are compatible, within the pool's limits and within the volume."""
        experiment = self.base.experiment
        pool = experiment.pool
        chosen = tuple(change.candidate for change in changes if change.candidate >= 0)
        if not go_together(changes) or pool is not None and not allowed(pool, chosen):
            return False
        # Each alone stays inside; a further probe may not where the position is moved as well.
        if not {ChangeKind.MOVE, ChangeKind.READ_MORE} <= {change.kind for change in changes}:
            return True
        changed, volume = apply_all(changes, experiment), experiment.machine.volume
        return all(
            is_inside(position, changed.layouts[position.artefact], volume, changed.probes)
            for position in changed.positions
        )

    def greedy(self, changes: Sequence[Change]) -> ChangeSet:
        """A set that is built up of the change that helps most each time, less what can be left out
        of it.
        """
        built: ChangeSet = ()
        after = self.before
        while not after.is_cured and len(built) < self.together:
            possible = [(*built, change) for change in changes if self.may_be((*built, change))]
            best = min(possible, key=lambda change: self.judge(change).order, default=())
            if not best or self.judge(best).order >= after.order:
                break
            gain = after.deficiency - self.judge(best).deficiency
            built, after = best, self.judge(best)
            if after.deficiency > gain * (self.together - len(built)):
                # Later changes help less than the first.
                break
        if after.deficiency or not self.helps(built):
            return ()
        for change in built:
            without = tuple(rival for rival in built if rival is not change)
            remaining = self.judge(without) if without else self.before
            if (remaining.deficiency, remaining.weak) <= (after.deficiency, after.weak):
                built, after = without, remaining
        return built

    def of_single_directions(self, singles: Sequence[Change]) -> tuple[Repair, ...]:
        """Return, for each null direction, the cheapest single change that determines it."""
        if not self.before.deficiency:
            return ()
        open_errors = self.open_errors()
        order = self.thinned(sorted(singles, key=lambda change: (change.kind, change.cost)))
        by_change = {}
        for k in range(self.before.deficiency):
            for change in order:
                after = self.judge((change,))
                if 0 < after.deficiency < self.before.deficiency:
                    gone = removed(open_errors, after.open_errors)
                    if k in gone:
                        by_change[change] = gone
                        break
        return tuple(
            self.told((change,), gone) for change, gone in list(by_change.items())[:MOST_PARTIAL]
        )

    def open_errors(self) -> Array:
        """Machine errors of the null directions, in the reported form."""
        return self.before.open_errors @ independent_mixture(self.base.at)

    def told(self, changes: ChangeSet, removes: tuple[int, ...] | None = None) -> Repair:
        """A repair with the prediction of the changed design."""
        experiment = self.base.experiment
        changed = apply_all(changes, experiment)
        after = self.judge(changes)
        planned = predict(placed_only(changed)) if removes is None else None
        if planned is not None and planned.verdict.deficiency != after.deficiency:
            raise AssertionError("two computations of one design's rank differ")
        gone = tuple(range(self.before.deficiency)) if removes is None else removes
        return Repair(
            changes,
            after.deficiency,
            gone,
            after.weak,
            after.worst,
            after.smallest,
            self.is_faint(after),
            planned,
            edits(experiment, changed),
            sum(position.count for position in changed.positions)
            - sum(position.count for position in experiment.positions),
            _seconds_more(experiment, changes),
            _loosened(changed) if removes is None else None,
        )


def _loosened(experiment: Experiment) -> PairSummary | None:
    return lengths_with_offsets(placed_only(experiment), OFFSET_TRIAL)


def _seconds_more(experiment: Experiment, changes: Sequence[Change]) -> float:
    """Return the time of changes in seconds: stated in the pool, or as usual."""
    seconds = sum(change.cost for change in changes if change.kind == ChangeKind.POOL)
    additions = [change for change in changes if change.kind != ChangeKind.POOL]
    before = {place.name: seconds_of(place) for place in experiment.positions}
    for place in apply_all(additions, experiment).positions:
        seconds += seconds_of(place) - before.get(place.name, 0.0)
    return seconds
