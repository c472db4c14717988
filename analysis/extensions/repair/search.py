"""Sets of changes that meet a target, judged by the information of a plan.

A change is a candidate whose matrix is what it adds to the information of the present design: that
of the position as it would be, less that of the position as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.computing import comparable, eigh
from ballplate.simulator.experiment import AtMost, Candidate, ChangeTimes, Experiment, Position
from ballplate.simulator.geometry import even_grid
from ballplate.simulator.inputs import ExperimentError
from ballplate.simulator.machines import Array, Integers
from ballplate.uncertainty import OFFSET_TRIAL, with_offsets

from ..planning import (
    Budget,
    Constraints,
    Frames,
    Losses,
    SelectionProblem,
    criterion,
    pool_information,
)
from .changes import Change, ChangeKind

# Effort of a calibrated value, in seconds of laboratory time.
VALUE = 600.0
# Changes in a set.
MOST_TOGETHER = 6
# Sets that are extended: the first and later best ones, and the cheapest ones; extensions of each.
FIRST, BEST, CHEAPEST, EXTENSIONS = 32, 12, 6, 8
# Another change is worth while where it lowers U6 to less than this fraction.
WORTHWHILE = 0.95
# Sets of a size that are judged in full.
MOST_JUDGED = 8
# Evaluation points of the search, and along each axis where the file has none.
MOST_POINTS, NODES = 200, 3
# Binary digits to which criteria, which lose some by the ridge, and efforts are compared.
COMPARED = 24

# Information below this fraction of that of the whole pool, and U6 of deficient designs, in metres.
UNDETERMINED, LARGE = 1e-10, 1e9

Members = frozenset[int]


@dataclass(frozen=True, eq=False)
class ChangePool:
    """Changes of an experiment with the `problem` of choosing among them.

    The criterion is U6 where exact probe offsets, except one, have a standard uncertainty of
    `OFFSET_TRIAL`; `limit` is its target.
    """

    changes: tuple[Change, ...]
    problem: SelectionProblem
    limit: float

    def effort(self, members: Iterable[int]) -> float:
        """Return the laboratory time of changes in seconds, with that of calibrated values."""
        chosen = [self.changes[k] for k in sorted(members)]
        seconds = sum(change.seconds + VALUE * change.values for change in chosen)
        return float(comparable(seconds, COMPARED))

    def of(self, members: Iterable[int]) -> tuple[Change, ...]:
        """Return changes by their indices, in order."""
        return tuple(self.changes[k] for k in sorted(members))


def change_pool(experiment: Experiment, changes: Sequence[Change]) -> ChangePool | None:
    """Return the pool of changes of an experiment, unless they determine no distance.

    :raises ExperimentError: a plan cannot weigh it.
    """
    tips = {change.probe.name: change.probe for change in changes if change.probe is not None}
    # All offsets are as uncertain as those that a repair is judged with.
    loose = with_offsets(replace(experiment, probes={**experiment.probes, **tips}), OFFSET_TRIAL)
    # Drift depends on the order of readings, which changes do not state.
    influences = tuple(kind for kind in experiment.influences if not kind.in_order)
    evaluation = replace(experiment.evaluation, points=_points(experiment))
    steady = replace(loose, influences=influences, evaluation=evaluation)

    own = [Candidate(place.name, place, 0.0, "", "", True, {}) for place in experiment.positions]
    offered = []
    for k, change in enumerate(changes):
        item = change.item
        if isinstance(item, Position):
            item = replace(item, name=f"change {k} of {item.name}")
        offered.append(Candidate(f"change {k}", item, change.seconds, "", "", False, {}))
    whole = pool_information(steady, [*own, *offered])
    count, indices = len(own), {candidate.name: k for k, candidate in enumerate(own)}
    matrices = whole.matrices[count:].copy()
    for k, change in enumerate(changes):
        if isinstance(change.item, Position) and change.item.name in indices:
            matrices[k] -= whole.matrices[indices[change.item.name]]
    information = replace(
        whole,
        candidates=tuple(offered),
        base=whole.base + whole.matrices[:count].sum(axis=0),
        matrices=matrices,
        frames=_frames(whole.frames, count),
    )
    try:
        wanted = criterion(information, steady, "U6")
    except ExperimentError:
        return None
    # Only what excludes each other is limited.
    n = len(changes)
    none = np.zeros(n, np.int64)
    seconds = np.array([change.seconds for change in changes])
    exclusions = tuple(_exclusions(experiment, changes))
    limits = Constraints(
        Budget(),
        seconds,
        none,
        none,
        (None,) * n,
        ChangeTimes(0.0, 0.0),
        frozenset(),
        exclusions,
    )
    problem = SelectionProblem(information, wanted, limits)
    return ChangePool(tuple(changes), problem, mean_target(experiment))


def mean_target(experiment: Experiment) -> float:
    """Return the target standard uncertainty of U6 on average, in metres; infinite without one."""
    target, points = experiment.target_uncertainty, _points(experiment)
    if target is None:
        return np.inf
    first, second = np.triu_indices(len(points), 1)
    return float(target.at(np.linalg.norm(points[first] - points[second], axis=1)).mean())


def _points(experiment: Experiment) -> Array:
    """Return evaluation points (n, d): at most `MOST_POINTS`, or a grid if the file has none."""
    points = experiment.evaluation.points
    if len(points) < 2:
        volume = experiment.machine.volume
        points = even_grid(*volume.corners, [NODES] * experiment.dimension)
    return points[np.unique(np.linspace(0, len(points) - 1, MOST_POINTS).astype(int))]


def _frames(frames: Frames, count: int) -> Frames:
    """Return frames of a pool without its first candidates, which are always chosen."""
    fixed = {k - count: part for k, part in frames.fixed.items()}
    artefacts = tuple(
        (frozenset(k - count for k in placing), held)
        for placing, held in frames.artefacts
        if min(placing, default=count) >= count
    )
    return replace(frames, fixed=fixed, artefacts=artefacts)


def _exclusions(experiment: Experiment, changes: Sequence[Change]) -> list[AtMost]:
    """Return the limits on sets: one change of a subject, and those of the pool."""
    by_subject: dict[str, list[int]] = {}
    for k, change in enumerate(changes):
        by_subject.setdefault(change.subject, []).append(k)
    limits = [AtMost(tuple(members), 1) for members in by_subject.values()]
    pool = experiment.pool
    if pool is None:
        return limits
    for limit in pool.at_most:
        drawn = sum(pool.candidates[k].drawn for k in limit.members)
        members = [k for k, change in enumerate(changes) if change.candidate in limit.members]
        limits.append(AtMost(tuple(members), max(limit.count - drawn, 0)))
    return limits


def best_set(
    pool: ChangePool,
    kinds: Collection[ChangeKind],
    is_enough: Callable[[Members], bool],
    losses: Losses,
) -> tuple[Members, bool]:
    """Return the set of changes of some kinds that is enough with the least effort, of equal ones
    the smallest and least uncertain; otherwise the least uncertain one that was found, and False.

    `losses` are those of sets of these kinds. Sets grow by one change; of those of a size the best
    and the cheapest ones are extended.
    """
    allowed = np.array([k for k, change in enumerate(pool.changes) if change.kind in kinds], int)
    least, chosen, best = np.inf, frozenset[int](), frozenset[int]()
    level: list[Members] = [best] if can_determine(pool, allowed) else []
    for size in range(1, MOST_TOGETHER + 1):
        larger = {
            members | {k}
            for members in level
            for k in _extensions(pool, members, allowed, losses, least)
        }
        # Of those alike but for rounding the first.
        order = sorted(
            larger, key=lambda one: (float(comparable(losses.of(one), COMPARED)), sorted(one))
        )
        if not order:
            break
        best_by_effort: dict[float, Members] = {}
        for members in order:
            if losses.of(members) <= pool.limit:
                best_by_effort.setdefault(pool.effort(members), members)
        for effort in sorted(best_by_effort)[:MOST_JUDGED]:
            if is_enough(best_by_effort[effort]):
                least, chosen = effort, best_by_effort[effort]
                break
        gain = losses.of(order[0]) / losses.of(best)
        best = min(best, order[0], key=losses.of)
        if gain > WORTHWHILE and size > 1 and losses.of(best) < LARGE:
            break
        cheapest = sorted(order, key=pool.effort)[:CHEAPEST]
        level = list(dict.fromkeys([*order[: FIRST if size == 1 else BEST], *cheapest]))
    if not chosen:
        return best, False
    for k in sorted(chosen):
        without = chosen - {k}
        if without and losses.of(without) <= pool.limit and is_enough(without):
            chosen = without
    return chosen, True


def can_determine(pool: ChangePool, allowed: Integers) -> bool:
    """True unless every set of allowed changes leaves something undetermined.

    The mean information of the designs with one change each has the rank of all of them together.
    """
    if not len(allowed):
        return False
    information = pool.problem.information
    mean = information.of(()) + information.matrices[allowed].mean(axis=0)
    return bool(eigh(mean)[0].min() > UNDETERMINED)


def _extensions(
    pool: ChangePool, members: Members, allowed: Integers, losses: Losses, least: float
) -> list[int]:
    """Return the changes that extend a set best with less than the `least` effort so far; of the
    empty set all.
    """
    possible = np.intersect1d(pool.problem.constraints.additions(members), allowed)
    cheap = [k for k in possible.tolist() if pool.effort((*members, k)) < least]
    if not members or not cheap:
        return cheap
    added, tangents = losses.sieved(members, np.array(cheap))
    return added[np.argsort(comparable(tangents), kind="stable")[:EXTENSIONS]].tolist()
