"""A campaign as it is measured: whether the target is met by what has been read, and what to read
next.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from ballplate.extensions.requirements.goals import Goal, check_goal, judge
from ballplate.gross_errors import diagnosis_words
from ballplate.planning import groups_taken
from ballplate.results import FEW, Fit, PlannedUncertainty, with_sigmas
from ballplate.results import fit as fit_observed
from ballplate.simulator.computing import Report, counted, single_threaded, unreported
from ballplate.simulator.estimation import Linearisation, linearise
from ballplate.simulator.experiment import Experiment, Pool, Position, lay_out, placed_only
from ballplate.simulator.inputs import listing, refused
from ballplate.simulator.readings import ObservedReadings, Source, read_readings
from ballplate.uncertainty import uncertainties

from .next_result import NextStep, Offered

# One-sided level of the bound of sigma where it comes from few degrees of freedom.
CONFIDENCE = 0.95

# Of more positions than this the best are found by lengths between so many points first, and so
# many of them are looked at closely.
MOST_OFFERED, RANKED_BY, KEPT = 60, 40, 12

# A position to be read next, the number of its readings, and the experiment with it.
Addition = tuple[str, int, Experiment]


@dataclass(frozen=True)
class ReadPosition:
    """Positions of which something has been read, in the order in which they were first; `whole`
    are all their planned readings, `position` those that were taken.
    """

    position: Position
    whole: Position

    @property
    def missing(self) -> int:
        return self.whole.count - self.position.count


@single_threaded
def next_step(
    experiment: Experiment,
    sources: Sequence[Source],
    goal: Goal,
    report: Report = unreported,
) -> NextStep:
    """Judge what has been read so far of an experiment's positions, or of its pool's, and find the
    position that is best read next.

    Positions that were read again count as they were read last. Uncertainties are as stated, or
    larger where the residuals show so.

    :raises ExperimentError: a file is wrong, or names a position that is none.
    :raises GoalError: a goal about what the experiment does not have.
    """
    possible = possible_positions(experiment)
    first = _observed(with_positions(experiment, list(possible.values())), sources)
    names = _names_in_order(first, sources)
    chosen = with_positions(experiment, [possible[name] for name in names])
    observed = _observed(chosen, sources)
    read = list(_read(chosen, observed))
    fit, why = _fitted(chosen, observed)
    found = NextStep(
        experiment.label,
        experiment.title,
        goal,
        tuple(names),
        {one.position.name: one.missing for one in read if one.missing > 0},
        observed,
        fit,
        why,
    )
    check_goal(goal, _planned(chosen, goal, 1.0))
    sigma = 1.0
    if fit is not None:
        at = fit.functions.at
        sigma, bound = sigmas(fit)
        if fit.campaigns is not None:
            experiment = with_sigmas(experiment, fit.campaigns.ratios)
        judged = judge(goal, _uncertainty(at, experiment, goal, sigma))
        is_sure = (
            math.isfinite(bound) and judge(goal, _uncertainty(at, experiment, goal, bound)).is_met
        )
        suspected = tuple(diagnosis_words(fit.diagnosis, observed.marks))
        found = replace(
            found, sigma=sigma, bound=bound, now=judged, is_sure=is_sure, suspected=suspected
        )
    if found.is_met:
        return found
    additions = list(_additions(experiment, possible, read))
    if len(additions) > MOST_OFFERED:
        points = experiment.evaluation.points[:RANKED_BY]
        fewer = replace(experiment, evaluation=replace(experiment.evaluation, points=points))
        ranked = _judged(_additions(fewer, possible, read), len(additions), goal, sigma, report)
        best = {one.name for one in ranked[:KEPT]} | set(found.missing)
        additions = [one for one in additions if one[0] in best]
    offered = _judged(additions, len(additions), goal, sigma, report)
    # What nothing can be estimated without comes first.
    offered.sort(key=lambda one: fit is None and one.name not in found.missing)
    return replace(found, offered=tuple(offered))


def _judged(
    additions: Iterable[Addition], count: int, goal: Goal, sigma: float, report: Report
) -> list[Offered]:
    """What positions to be read next achieve, the best first."""
    offered = []
    for name, readings, more in counted(additions, "positions to come", count, report):
        planned = _planned(more, goal, sigma)
        offered.append(Offered(name, readings, judge(goal, planned), planned))
    return sorted(offered, key=lambda one: one.order)


def sigmas(fit: Fit) -> tuple[float, float]:
    """What multiplies the stated uncertainties: the root of S^2 over its degrees of freedom where
    that is above 1, and the bound that it keeps to with 95 % where these are few.

    Without any degree of freedom nothing is known of the scatter, and the bound is infinite.
    """
    from scipy.special import chdtri

    freedom, squares = fit.sum_freedom, fit.sum_of_squares
    if freedom <= 0:
        return 1.0, math.inf
    sigma = max(1.0, math.sqrt(squares / freedom))
    if freedom >= FEW:
        return sigma, sigma
    return sigma, max(sigma, math.sqrt(squares / float(chdtri(freedom, CONFIDENCE))))


def possible_positions(experiment: Experiment) -> dict[str, Position]:
    """All positions that may be read, by name: the file's own, then those of its pool."""
    pool = () if experiment.pool is None else experiment.pool.candidates
    candidates = (one.item for one in pool if isinstance(one.item, Position))
    found = {one.name: one for one in (*experiment.positions, *candidates)}
    if not found:
        raise refused(experiment.source, "has no positions and no pool of them", "positions")
    return found


def with_positions(experiment: Experiment, positions: Sequence[Position]) -> Experiment:
    """The experiment with these positions alone, and what belongs to them."""
    found = placed_only(replace(experiment, positions=tuple(positions)))
    # What the rest leaves open is nothing that the file has to expect.
    return replace(found, expected_rank_deficiency=None)


def _observed(experiment: Experiment, sources: Sequence[Source]) -> ObservedReadings:
    return read_readings(
        sources,
        lay_out(experiment),
        every_ball=False,
        settings=experiment.readings,
        last_count=True,
    )


def _names_in_order(observed: ObservedReadings, sources: Sequence[Source]) -> list[str]:
    """Names of positions that have readings, in the order in which these began."""
    place = {str(source): k for k, source in enumerate(sources)}
    begun: dict[str, tuple[int, int]] = {}
    names = observed.design.positions.names
    for k, mark in zip(observed.design.readings.position.tolist(), observed.marks, strict=True):
        here = place.get(mark.file, 0), mark.line
        begun[names[k]] = min(here, begun.get(names[k], here))
    return sorted(begun, key=lambda name: begun[name])


def _read(experiment: Experiment, observed: ObservedReadings) -> Iterator[ReadPosition]:
    design = observed.design
    for k, position in enumerate(experiment.positions):
        taken = groups_taken(design, k, experiment, position)
        yield ReadPosition(replace(position, readings=taken), position)


def _fitted(experiment: Experiment, observed: ObservedReadings) -> tuple[Fit | None, str]:
    """The fit of what has been read, or why there is none."""
    design = observed.design
    unread = np.setdiff1d(design.plate_balls, design.readings.ball)
    if len(unread):
        balls = listing(design.ball_label(int(ball)) for ball in unread)
        return None, f"balls not read yet: {balls}"
    found = fit_observed(experiment, observed)
    if not found.converged:
        return None, found.complaint
    return found, ""


def _symbols(goal: Goal) -> set[str]:
    more = {"tasks": "tasks", "quantity": goal.symbol.split()[0]}.get(goal.kind, "U6")
    return {"U6", more}


def _uncertainty(
    at: Linearisation, experiment: Experiment, goal: Goal, sigma: float
) -> PlannedUncertainty:
    target = experiment.target_uncertainty
    return PlannedUncertainty(at.deficiency, uncertainties(at, sigma, target, _symbols(goal)))


def _planned(experiment: Experiment, goal: Goal, sigma: float) -> PlannedUncertainty:
    return _uncertainty(linearise(lay_out(experiment)), experiment, goal, sigma)


def _additions(
    experiment: Experiment, possible: Mapping[str, Position], read: Sequence[ReadPosition]
) -> Iterator[Addition]:
    """Positions that can be read next, by name with the number of their readings, and the
    experiment with what has been read and each.

    What was interrupted may be completed. Of candidates of which only some may be read, none is
    offered when as many have been.
    """
    taken = {one.position.name: one for one in read}
    closed = set() if experiment.pool is None else _closed(experiment.pool, set(taken))
    for name, position in possible.items():
        if name in closed and name not in taken:
            continue
        count, positions = position.count, [one.position for one in read]
        if name in taken:
            count = taken[name].missing
            positions = [one.whole if one.position.name == name else one.position for one in read]
        else:
            positions.append(position)
        if count > 0:
            yield name, count, with_positions(experiment, positions)


def _closed(pool: Pool, taken: set[str]) -> set[str]:
    """Candidates of groups of which as many have been read as may be."""
    found: set[str] = set()
    for limit in pool.at_most:
        members = {pool.candidates[k].name for k in limit.members}
        if len(members & taken) >= limit.count:
            found |= members
    return found
