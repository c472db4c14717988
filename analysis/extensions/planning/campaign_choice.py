"""Plan of a campaign: selection from a pool, its distance from the bound, and the value of each
candidate.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from ballplate.results import predict
from ballplate.simulator.computing import (
    EnoughError,
    ProgressStep,
    Report,
    comparable,
    counted,
    in_processes,
    single_threaded,
    unreported,
)
from ballplate.simulator.experiment import AtMost, Candidate, Experiment, Pool, Position
from ballplate.simulator.inputs import ExperimentError, listing, refused

from .bound import Bound, bound
from .constraints import Budget, Constraints, constraints, with_chosen
from .criteria import CriterionName, criterion, is_about_balls, refuse_many_points
from .information import pool_information
from .remaining_candidates import Offer, offer, open_directions
from .schedule import run_sheet
from .search import (
    GAIN,
    Found,
    Losses,
    SelectionProblem,
    improve,
    judged,
    ranked_additions,
    starts,
    value,
)
from .selection import Campaign, CurvePoint, Gain
from .short_names import short_names, stated_names

# Random starts of the search, in a large pool and in a small one.
LARGE_STARTS, SMALL_STARTS = 24, 8
SMALL_POOL, VERY_SMALL_POOL, TINY_POOL = 64, 24, 11

# The best results of a large pool from which the search goes deeper.
BEST_STARTS = 4

# Candidates left out that are told of.
LEFT_OUT = 10

# Points of a curve.
CURVE_POINTS = 8


@dataclass(frozen=True)
class Request:
    """Request for a plan; `curve` adds smaller and larger limits of time."""

    criterion: CriterionName = "U6"
    budget: Budget | None = None
    curve: bool = False
    seed: int = 1


def campaign(
    experiment: Experiment,
    request: Request,
    offered: Offer | None = None,
    earlier: Collection[int] | None = None,
    workers: int = 1,
    report: Report = unreported,
) -> Campaign:
    """Choose from the pool of an experiment.

    `offered` holds the candidates after earlier readings. These readings are kept at no further
    cost, except on a plate that was only begun and is cheaper to leave out than to complete.
    `earlier` are the indices of an earlier choice (by default the experiment's own positions);
    within the same limit the plan is never worse. Without a limit the choice may cost as much as
    these, less completed readings. The result does not depend on the number of `workers`; `report`
    receives each step and its progress.

    :raises ExperimentError: there is no pool or no candidate, or required candidates break the
        limits.
    :raises InternalError: the choice is better than the bound.
    """
    pool = experiment.pool
    if pool is None:
        raise _impossible(
            experiment,
            "pool",
            "missing; add candidates to choose from, or see check --suggest",
        )
    refuse_many_points(experiment, request.criterion)
    offered = offered or offer(pool)
    refusal = None
    result, less = None, offered.without_begun(experiment)
    try:
        result = _campaign(experiment, pool, request, offered, earlier, workers, report)
    except ExperimentError as error:
        if less is offered:
            raise
        refusal = error
    if less is offered:
        assert result is not None
        return result
    try:
        request = replace(
            request, budget=request.budget or (None if result is None else result.budget)
        )
        names = None if earlier is None else [offered.candidates[k].name for k in earlier]
        alternative = _campaign(
            experiment,
            pool,
            request,
            less,
            None if names is None else less.find(names),
            workers,
            report,
        )
    except ExperimentError as error:
        if result is None:
            raise refusal or error from None
        return result
    if result is not None and result.value <= alternative.value * (1 + GAIN):
        return result
    done_names = {position.name for position in alternative.done}
    return replace(
        alternative,
        ignored=tuple(
            offered.candidates[k] for k in offered.done if offered.name(k) not in done_names
        ),
    )


# In one piece: the steps of a campaign in their order, and one result of all of them.
@single_threaded
def _campaign(
    experiment: Experiment,
    pool: Pool,
    request: Request,
    offered: Offer,
    earlier: Collection[int] | None,
    workers: int,
    report: Report,
) -> Campaign:
    candidates, standing = offered.candidates, offered.standing
    whole, completed_by = offered.weighed
    # Drift depends on the order of readings, which follows from the choice.
    steady = replace(
        experiment,
        influences=tuple(kind for kind in experiment.influences if not kind.in_order),
    )

    information = pool_information(
        steady, whole, is_about_balls(request.criterion), completed_by, report
    )
    wanted = criterion(information, experiment, request.criterion)
    drawn_candidates = [
        offered.now(k) for k, candidate in enumerate(pool.candidates) if candidate.drawn
    ]
    drawn = sorted(earlier or drawn_candidates)
    begun = offered.begun(experiment)
    free = constraints(
        candidates,
        pool.changes,
        Budget(),
        offered.must,
        _limits(experiment, pool, offered),
        offered.done,
        (*offered.at_least, *begun.values()),
        None if standing is None else standing.rest,
    )
    reference = sorted({*drawn, *free.must})
    budget = request.budget or _as_drawn(experiment, free, drawn, reference)
    limits = replace(free, budget=budget)
    _refuse_impossible(experiment, limits, candidates)
    problem = SelectionProblem(information, wanted, limits)

    best, relaxed = _search(problem, drawn, request.seed, workers, report)
    if relaxed is not None:
        relaxed.check(request.criterion, best.value)
    _refuse_lacking(experiment, problem, best, begun)
    completed = None
    if standing is not None and standing.rest in best.chosen:
        completed = candidates[standing.rest], standing.whole
    chosen = offered.together(best.chosen)
    left_open = open_directions(offered, information, best.chosen)
    # What no candidate determines may be expected; what the choice alone leaves open is not.
    expected = left_open
    if information.deficiency:
        expected += experiment.expected_rank_deficiency or 0
    _refuse_unusable(experiment, chosen, limits)
    unlimited = replace(problem, constraints=free)
    done_indices = tuple(candidates[k] for k in offered.done)
    interrupted = tuple(candidates[begun.part] for begun in offered.interrupted)
    # In the order in which they will be read, as the first of a plate may hold its frame, on which
    # U1 and U2 depend.
    sheet = run_sheet(chosen, pool.changes, done_indices, completed, interrupted)
    names = short_names(
        (step.position for step in sheet.steps),
        offered.names,
        [candidate.name for candidate in candidates],
        stated_names(experiment),
    )
    sheet = sheet.with_names(names)
    planned = with_chosen(experiment, sheet.written)
    return Campaign(
        experiment,
        pool,
        request.criterion,
        wanted.unit,
        wanted.excluded,
        budget,
        tuple(chosen),
        done_indices,
        limits.spent(best.chosen),
        best.value,
        np.nan if relaxed is None else relaxed.value,
        value(problem, reference) if drawn else None,
        ("chosen before" if earlier else "as drawn")
        + (", with what is kept" if set(reference) - set(drawn) else ""),
        limits.spent(reference) if drawn else None,
        wanted.target,
        _gains(problem, best, candidates, report),
        _left_out(unlimited, best, candidates),
        predict(replace(planned, expected_rank_deficiency=expected or None)),
        sheet,
        tuple(_curve(problem, best, candidates, workers, report)) if request.curve else (),
        completed,
        interrupted,
        left_open,
    )


def _impossible(experiment: Experiment, path: str, text: str) -> ExperimentError:
    return refused(experiment.source, text, path)


def _limits(experiment: Experiment, pool: Pool, offered: Offer) -> list[AtMost]:
    """Limits on the offer; of several certificates of one length, only one counts."""
    at_most = list(offered.at_most)
    for name, artefact in experiment.artefacts.items():
        plate_calibrations = tuple(
            k
            for k, candidate in enumerate(pool.candidates)
            if not isinstance(candidate.item, Position) and candidate.item.artefact == name
        )
        if len(plate_calibrations) > 1 and artefact.role != "plate":
            at_most.append(AtMost(plate_calibrations, 1))
    return at_most


def _refuse_unusable(
    experiment: Experiment, chosen: Sequence[Candidate], limits: Constraints
) -> None:
    """Refuse a choice without positions, or with calibrated balls that no position reads."""
    positions = [one.item for one in chosen if isinstance(one.item, Position)]
    if not positions:
        every = range(limits.count)
        if limits.can_read(every):
            text = f"no choice with {limits.budget} determines anything; add other positions"
            raise _impossible(experiment, "pool", text)
        raise _out_of_reach(experiment, limits, every, "no position can be read")
    for name in {position.artefact for position in positions}:
        plate_positions = [position for position in positions if position.artefact == name]
        read_balls = {ball for position in plate_positions for ball in position.balls.tolist()}
        unread = [
            ball for k, ball in enumerate(experiment.layouts[name].names) if k not in read_balls
        ]
        if unread and experiment.artefacts[name].role == "plate":
            balls = listing(f'"{ball}"' for ball in unread)
            text = (
                f"the best choice leaves {balls} of {name} unread, which no experiment may; keep a"
                " position of all"
            )
            raise _impossible(experiment, "pool.limits.keep", text)


def _refuse_lacking(
    experiment: Experiment,
    problem: SelectionProblem,
    best: Found,
    begun: Mapping[str, tuple[int, ...]],
) -> None:
    """Refuse a choice without what every choice needs."""
    for plate, plates in begun.items():
        if set(plates).isdisjoint(best.chosen):
            text = f'"{plate}" was begun, but no position of its other balls can be read'
            raise _out_of_reach(experiment, problem.constraints, plates, text)
    for members in problem.constraints.at_least:
        if set(members).isdisjoint(best.chosen):
            name = problem.information.candidates[members[0]].name
            text = f'"{name}" has to be chosen, but was interrupted, and cannot be read with'
            raise _impossible(
                experiment, "pool.limits.keep", f"{text} {problem.constraints.budget}; allow more"
            )
    missing = {
        name: placing
        for name, placing in problem.criterion.needed
        if set(placing).isdisjoint(best.chosen)
    }
    if missing:
        names, name = listing(f'"{ball}"' for ball in missing), problem.criterion.name
        raise _out_of_reach(
            experiment,
            problem.constraints,
            [k for placing in missing.values() for k in placing],
            f"{name} includes the distances of {names}, but no position of this artefact can be"
            " read",
            ", keep one, or take the artefact out of the pool",
        )


def _out_of_reach(
    experiment: Experiment,
    limits: Constraints,
    members: Collection[int],
    text: str,
    or_else: str = "",
) -> ExperimentError:
    """Reason why the limits exclude every one of some positions: limits on the choice, or of
    time.
    """
    if limits.forbids(members):
        why = "as limits exclude each; change at_most"
        return _impossible(experiment, "pool.limits", f"{text}, {why}{or_else}")
    return _impossible(experiment, "pool", f"{text} with {limits.budget}; allow more{or_else}")


def _as_drawn(
    experiment: Experiment, free: Constraints, drawn: Sequence[int], reference: Sequence[int]
) -> Budget:
    """The budget that the experiment's own positions need."""
    if not drawn:
        raise _impossible(
            experiment,
            "positions",
            "there are no positions to take the limit from; give --hours or --positions",
        )
    return free.spent(reference).budget


def _refuse_impossible(
    experiment: Experiment, limits: Constraints, candidates: Sequence[Candidate]
) -> None:
    must = limits.must
    if limits.allows(must):
        return
    for limit in limits.at_most:
        members = sorted(must.intersection(limit.members))
        if len(members) > limit.count:
            names = ", ".join(f'"{candidates[k].name}"' for k in members)
            text = (
                f"{names} are required, but at most {limit.count} may be chosen; change one of"
                " the two"
            )
            raise _impossible(experiment, "pool.limits", text)
    text = (
        f"what has to be chosen takes {limits.spent(must).budget}, more than {limits.budget};"
        " allow more, or keep fewer"
    )
    raise _impossible(experiment, "pool.limits.keep", text)


def _search(
    problem: SelectionProblem, drawn: Sequence[int], seed: int, workers: int, report: Report
) -> tuple[Found, Bound | None]:
    """The best selection found, and the bound of all."""
    limits = problem.constraints
    # An interrupted position, which has to be chosen, comes with two ways to go on.
    if limits.count - len(limits.done) <= TINY_POOL + (limits.first is not None):
        return _best_of_all(problem, report), bound(problem)
    is_small = problem.constraints.count <= SMALL_POOL
    first = starts(problem, drawn, SMALL_STARTS if is_small else LARGE_STARTS, seed)
    # In a small pool most selections are met again and again, and one process remembers them.
    shares = [first] if is_small else [[start] for start in first]
    depth = 2 if is_small else 1
    selections: list[Found] = []
    bounds: list[Bound] = []

    def try_all(unit_name: str, tasks: Sequence[tuple[object, ...]]) -> None:
        def report_best(step: ProgressStep) -> None:
            report(replace(step, remark=_best_words(problem, selections), can_end=True))

        outcomes = in_processes(_task, tasks, workers)
        for outcome in counted(outcomes, unit_name, len(tasks), report_best):
            if isinstance(outcome, Bound):
                bounds.append(outcome)
            else:
                selections.extend(outcome or ())

    try:
        try_all(
            "starts of the search",
            [(problem, None, 0), *((problem, share, depth) for share in shares)],
        )
        # Of a selection that is just enough, most of what an exchange passes through is deficient.
        ways = (False, True) if _is_just_enough(problem, _best(selections)) else (False,)
        for by_pivots in ways[1:]:
            tasks = [(problem, share, depth, by_pivots) for share in shares]
            try_all("starts by pivots", tasks)
        if bounds:
            by_weight = np.argsort(-comparable(bounds[0].weights), kind="stable").tolist()
            start = starts(problem, by_weight, 0, seed)[-1]
            selections += [
                improve(problem, start, Losses(problem, by_pivots), depth) for by_pivots in ways
            ]
        if not is_small:
            ordered = sorted(set(selections), key=lambda selection: selection.order)
            deeper = [
                (problem, [selection.chosen], 2, by_pivots)
                for selection in ordered[:BEST_STARTS]
                for by_pivots in ways
            ]
            try_all("deeper searches", deeper)
    except EnoughError:
        # Before the first start there is nothing to go on with.
        if not selections:
            selections.append(improve(problem, first[0], Losses(problem), 0))
    return _best(selections), bounds[0] if bounds else None


def _best(selections: Sequence[Found]) -> Found:
    return min(selections, key=lambda selection: selection.order)


def _best_words(problem: SelectionProblem, selections: Sequence[Found]) -> str:
    """The best selection so far and its cost in words; empty before there is any."""
    if not selections:
        return ""
    best, criterion = _best(selections), problem.criterion
    if not np.isfinite(best.value):
        return "none determines everything yet"
    spent = problem.constraints.spent(best.chosen)
    value = f"{1e6 * best.value:.4g} µm" if criterion.unit == "m" else f"{best.value:.4g}"
    return f"best {criterion.name} {value}, {spent.budget}"


@single_threaded
def _best_of_all(problem: SelectionProblem, report: Report) -> Found:
    """The best of all selections of a pool that has few."""
    limits, losses = problem.constraints, Losses(problem)
    members = [k for k in range(limits.count) if k not in limits.done]
    every = (
        limits.done.union(chosen)
        for size in range(len(members) + 1)
        for chosen in combinations(members, size)
    )
    tried = counted(every, "selections", 2 ** len(members), report)
    best = min(
        (chosen for chosen in tried if limits.allows(chosen)),
        key=lambda selection: (losses.of(selection), sorted(selection)),
    )
    return judged(problem, best)


def _is_just_enough(problem: SelectionProblem, best: Found) -> bool:
    """True if some candidate of the selection cannot be removed without a rank deficiency."""
    chosen = frozenset(best.chosen)
    return any(
        not np.isfinite(value(problem, chosen - {k})) for k in chosen - problem.constraints.must
    )


@single_threaded
def _task(
    problem: SelectionProblem,
    from_: Sequence[Collection[int]] | None,
    at_once: int,
    by_pivots: bool = False,
) -> list[Found] | Bound | None:
    if from_ is None:
        return bound(problem)
    losses = Losses(problem, by_pivots)
    thorough = problem.constraints.count <= VERY_SMALL_POOL
    return [improve(problem, start, losses, at_once, thorough) for start in from_]


def _gains(
    problem: SelectionProblem, best: Found, candidates: Sequence[Candidate], report: Report
) -> tuple[Gain, ...]:
    """Return the effect of each chosen candidate on the criterion, largest first, required ones
    included.
    """
    free = replace(problem, constraints=replace(problem.constraints, at_least=()))
    new = [k for k in best.chosen if k not in problem.constraints.done]
    gains = [
        Gain(candidates[k], value(free, set(best.chosen) - {k}), best.value)
        for k in counted(new, "gains", len(new), report)
    ]
    return tuple(sorted(gains, key=lambda gain: -float(comparable(gain.without))))


def _left_out(
    problem: SelectionProblem, best: Found, candidates: Sequence[Candidate]
) -> tuple[Gain, ...]:
    """Return the effect of each remaining candidate on the criterion, largest first."""
    ranked = ranked_additions(problem, best.chosen)
    return tuple(Gain(candidates[k], best.value, after) for k, after in ranked[:LEFT_OUT])


def _curve(
    problem: SelectionProblem,
    best: Found,
    candidates: Sequence[Candidate],
    workers: int,
    report: Report,
) -> list[CurvePoint]:
    """The best selections found for smaller and larger budgets, with their bounds, from the
    smallest on.
    """
    budgets = _budgets(problem)
    tasks = [
        (replace(problem, constraints=replace(problem.constraints, budget=b)), best)
        for b in budgets
    ]
    points = []
    results = counted(
        in_processes(_curve_point, tasks, workers), "budgets of the curve", len(tasks), report
    )
    for budget, result in zip(budgets, results, strict=True):
        if result is None:
            continue
        best_so_far, relaxed = result
        if np.isfinite(best_so_far.value):
            names = tuple(candidates[k] for k in best_so_far.chosen)
            points.append(
                CurvePoint(
                    budget,
                    problem.constraints.spent(best_so_far.chosen),
                    names,
                    best_so_far.value,
                    relaxed,
                )
            )
    return points


@single_threaded
def _curve_point(problem: SelectionProblem, best: Found) -> tuple[Found, float] | None:
    if not problem.constraints.allows(problem.constraints.must):
        return None
    without = comparable([value(problem, set(best.chosen) - {k}) for k in best.chosen])
    generous = [best.chosen[k] for k in np.argsort(-without, kind="stable")]
    losses = Losses(problem)
    selections = [improve(problem, start, losses, 1) for start in starts(problem, generous, 0, 1)]
    best_selection = min(selections, key=lambda selection: selection.order)
    relaxed = bound(problem) if np.isfinite(best_selection.value) else None
    if relaxed is not None:
        relaxed.check(
            f"{problem.criterion.name} for {problem.constraints.budget}", best_selection.value
        )
    return best_selection, np.nan if relaxed is None else relaxed.value


def _budgets(problem: SelectionProblem) -> list[Budget]:
    """Limits of time from small to somewhat above the requested one."""
    budget = problem.constraints.budget
    factors = np.linspace(0.25, 1.5, CURVE_POINTS)
    if budget.positions is not None and budget.seconds is None and budget.readings is None:
        most = max(budget.positions + 2, round(1.5 * budget.positions))
        return [Budget(positions=k) for k in range(1, most + 1)]
    budgets = []
    for factor in factors:
        positions = None if budget.positions is None else max(round(budget.positions * factor), 1)
        readings = None if budget.readings is None else round(budget.readings * factor)
        budgets.append(
            Budget(None if budget.seconds is None else budget.seconds * factor, readings, positions)
        )
    budgets = list(dict.fromkeys([*budgets, budget]))
    return sorted(
        budgets,
        key=lambda budget: (
            budget.seconds or 0.0,
            budget.readings or 0,
            budget.positions or 0,
        ),
    )
