"""The search for repairs of a design: what moves positions, what reads more, and certificates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

from ballplate.extensions.drafting.strategies import as_drafted
from ballplate.presentation import number
from ballplate.results import Prediction, predict
from ballplate.simulator.computing import Report, counted, single_threaded, unreported
from ballplate.simulator.experiment import Experiment, placed_only
from ballplate.simulator.inputs import ExperimentError, yaml_text
from ballplate.uncertainty import OFFSET_TRIAL, exact_offsets, lengths_with_offsets

from .candidates import candidates
from .changes import ChangeKind, changed
from .repairs import Repair, Repairs
from .search import ChangePool, Losses, Members, best_set, change_pool, mean_target
from .written import edits

# A design is improved if U6 is lower than this fraction of what it was.
IMPROVED = 0.95
NOTHING_FOUND = "no changes were found that determine everything"


@dataclass(frozen=True, eq=False)
class _Search:
    """A search for repairs of an experiment, with its pool."""

    experiment: Experiment
    base: Prediction
    loosened: float
    target: float
    pool: ChangePool

    @cached_property
    def predictions(self) -> dict[Members, Prediction | None]:
        """Predictions so far."""
        return {}

    def predicted(self, members: Members) -> Prediction | None:
        """Return the prediction of a changed design; None if it contradicts other statements."""
        if members not in self.predictions:
            after = changed(self.experiment, self.pool.of(members))
            try:
                self.predictions[members] = predict(placed_only(after))
            except ExperimentError:
                self.predictions[members] = None
        return self.predictions[members]

    def is_sound(self, members: Members) -> bool:
        """True if changes leave no direction undetermined, or weakly determined."""
        planned = self.predicted(members)
        return planned is not None and not planned.verdict.deficiency and not planned.verdict.weak

    def of_kinds(self, kinds: Sequence[ChangeKind]) -> Members:
        """Return the set of changes of some kinds that meets the target with the least effort, or
        else determines every direction, or else as much as possible.
        """
        losses = Losses(self.pool.problem)
        members, is_enough = best_set(self.pool, kinds, self.is_sound, losses)
        if not is_enough and (self.base.verdict.deficiency or self.base.verdict.weak):
            free = replace(self.pool, limit=inf)
            sound, is_enough = best_set(free, kinds, self.is_sound, losses)
            members = sound if is_enough else members
        return members

    def repair(self, members: Members) -> Repair | None:
        """Return the repair by a set of changes, if it is one."""
        planned = self.predicted(members) if members else None
        if planned is None:
            return None
        changes = self.pool.of(members)
        after, before = changed(self.experiment, changes), self.experiment
        repair = Repair(
            changes,
            planned,
            loosened(after),
            self.target,
            edits(before, after),
            sum(place.count for place in after.positions)
            - sum(place.count for place in before.positions),
            sum(change.seconds for change in changes),
        )
        was, now = self.base.verdict, planned.verdict
        helps = (
            now.deficiency < was.deficiency
            or now.deficiency == was.deficiency
            and (len(now.weak) < len(was.weak) or repair.loosened < IMPROVED * self.loosened)
        )
        return repair if helps else None


@single_threaded
def repairs(experiment: Experiment, report: Report = unreported) -> Repairs:
    """Return repairs of an experiment's design, none if it determines everything, nothing weakly,
    and meets its target on average.

    First what moves positions, then what reads more, and certificates where both are not enough.
    """
    base, target = predict(placed_only(experiment)), mean_target(experiment)
    u6 = loosened(experiment)
    is_sound = not base.verdict.deficiency and not base.verdict.weak
    if is_sound and not u6 > target:
        return Repairs()
    try:
        pool = change_pool(experiment, candidates(experiment))
    except ExperimentError as error:
        return Repairs((), f"no changes were searched for: {error.messages[0].text}")
    if pool is None:
        return Repairs((), NOTHING_FOUND)
    search = _Search(experiment, base, u6, target, pool)
    found: list[Repair] = []
    kinds: tuple[ChangeKind, ...] = ()
    for kind in counted(ChangeKind, "kinds of changes", len(ChangeKind), report):
        is_met = any(not any(repair.order) for repair in found)
        if kind is ChangeKind.CERTIFICATE and is_met:
            continue
        kinds = (kind,) if is_met else (*kinds, kind)
        repair = search.repair(search.of_kinds(kinds))
        if repair is not None and all(repair.edits != other.edits for other in found):
            found.append(repair)
    if not found:
        return Repairs((), NOTHING_FOUND)
    return Repairs(tuple(sorted(found, key=lambda repair: repair.order)))


def loosened(experiment: Experiment) -> float:
    """Return the average U6, in metres, where exact probe offsets are uncertain; infinite if
    undetermined.
    """
    lengths = lengths_with_offsets(placed_only(experiment), OFFSET_TRIAL)
    return inf if lengths is None else lengths.total / lengths.count


def suggested(experiment: Experiment, prediction: Prediction, report: Report) -> Repairs:
    """Return suggestions for an experiment with its pool, whose design has this prediction."""
    # Without the pool, which would be made anew with each strategy.
    placed = prediction.experiment or placed_only(experiment)
    return replace(repairs(experiment, report), strategy=tuple(better_strategy(placed)))


def better_strategy(experiment: Experiment) -> Iterator[str]:
    """Yield lines on the longest simple strategy of no more positions and readings, if lengths are
    less uncertain with it; none otherwise.
    """
    found = as_drafted(experiment)
    if found is None:
        return
    positions, drafted = found
    before, after = loosened(experiment), loosened(drafted)
    if not after < IMPROVED * before:
        return
    own = "undetermined" if before == inf else f"{number(1e6 * before)} µm"
    if exact_offsets(experiment):
        own += f", both with {1e6 * OFFSET_TRIAL:g} µm on the exact probe offsets"
    yield (
        f"strategy: with the {len(positions)} positions of a simple strategy average U6 would be"
        f" {number(1e6 * after)} µm instead of {own}; a plan may do better still"
    )
    yield "strategy, in the file: positions:"
    for position in positions:
        yield f"strategy, in the file: - {yaml_text(position, flow_style=True).strip()}"
