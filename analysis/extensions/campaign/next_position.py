"""Judgement of a running campaign: target met or not, and the next position to read."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from ballplate.extensions.requirements.goals import Goal, check_goal, judge
from ballplate.results import FEW, Fit, PlannedUncertainty, check, fit as fit_observed
from ballplate.simulator.computing import Report, counted, single_threaded, unreported
from ballplate.simulator.estimation import Linearisation, linearise
from ballplate.simulator.experiment import Experiment, Pool, Position, lay_out, placed_only
from ballplate.simulator.inputs import listing, refused
from ballplate.simulator.readings import ObservedReadings, Source, read_readings
from ballplate.uncertainty import uncertainties

from ..machine_files import with_sigmas
from .next_result import NextStep, Offered
from .positions_read import groups_taken

# One-sided level of the bound of sigma where it comes from few degrees of freedom.
CONFIDENCE = 0.95

# Of more positions than this the best are found by lengths between so many points first, and so
# many of them are looked at closely.
MOST_OFFERED, RANKED_BY, KEPT = 60, 40, 12

# A position to be read next, the number of its readings, and the experiment with it.
Addition = tuple[str, int, Experiment]


@dataclass(frozen=True)
class ReadPosition:
    """A position with readings; `whole` has all planned readings, `position` the available ones."""

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
    """Judge the readings of an experiment's or pool's positions, and find the best next position.

    Uncertainties are as stated, or larger if residuals show
    it.

    :raises ExperimentError: a file is wrong, or names a position that is none.
    :raises GoalError: a goal about what the experiment does not have.
    """
    possible = possible_positions(experiment)
    first = _observed(with_positions(experiment, list(possible.values())), sources)
    names = _names_in_order(first, sources)
    chosen = with_positions(experiment, [possible[name] for name in names])
    observed = _observed(chosen, sources)
    positions_read = list(_positions_read(chosen, observed))
    fit, why = _fitted(chosen, observed)
    step = NextStep(
        experiment.label,
        experiment.title,
        goal,
        tuple(names),
        {read.position.name: read.missing for read in positions_read if read.missing > 0},
        observed,
        fit,
        why,
    )
    check_goal(goal, _planned(chosen, goal, 1.0))
    sigma = 1.0
    if fit is not None:
        linearisation = fit.functions.at
        sigma, bound = sigmas(fit)
        if fit.campaigns is not None:
            experiment = with_sigmas(experiment, fit.campaigns.ratios)
        judged = judge(goal, _uncertainty(linearisation, experiment, goal, sigma))
        is_sure = (
            math.isfinite(bound)
            and judge(goal, _uncertainty(linearisation, experiment, goal, bound)).is_met
        )
        suspected = tuple(found.words for found in fit.diagnosis.findings) if fit.diagnosis else ()
        step = replace(
            step,
            sigma=sigma,
            bound=bound,
            now=judged,
            is_sure=is_sure,
            suspected=suspected,
            qualifications=check(chosen, observed.design).qualifications,
        )
    if step.is_met:
        return step
    additions = list(_additions(experiment, possible, positions_read))
    if len(additions) > MOST_OFFERED:
        points = experiment.evaluation.points[:RANKED_BY]
        fewer = replace(experiment, evaluation=replace(experiment.evaluation, points=points))
        ranked = _judged(
            _additions(fewer, possible, positions_read), len(additions), goal, sigma, report
        )
        best = {offer.name for offer in ranked[:KEPT]} | set(step.missing)
        additions = [addition for addition in additions if addition[0] in best]
    offered = _judged(additions, len(additions), goal, sigma, report)
    # What nothing can be estimated without comes first.
    offered.sort(key=lambda offer: fit is None and offer.name not in step.missing)
    return replace(step, offered=tuple(offered))


def _judged(
    additions: Iterable[Addition], count: int, goal: Goal, sigma: float, report: Report
) -> list[Offered]:
    """Return judgements of possible next positions, the best first."""
    offered = []
    for name, readings, more in counted(additions, "positions to come", count, report):
        planned = _planned(more, goal, sigma)
        offered.append(Offered(name, readings, judge(goal, planned), planned))
    return sorted(offered, key=lambda offer: offer.order)


def sigmas(fit: Fit) -> tuple[float, float]:
    """Return the factor of the stated uncertainties: the root of S^2 over its degrees of freedom,
    at least 1, and its 95 % upper limit, infinite without degrees of freedom.
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
    candidates = (candidate.item for candidate in pool if isinstance(candidate.item, Position))
    positions = {position.name: position for position in (*experiment.positions, *candidates)}
    if not positions:
        raise refused(experiment.source, "has neither positions nor a pool", "positions")
    return positions


def with_positions(experiment: Experiment, positions: Sequence[Position]) -> Experiment:
    """The experiment with these positions alone, and what belongs to them."""
    chosen = placed_only(replace(experiment, positions=tuple(positions)))
    # What the rest leaves open is nothing that the file has to expect.
    return replace(chosen, expected_rank_deficiency=None)


def _observed(experiment: Experiment, sources: Sequence[Source]) -> ObservedReadings:
    return read_readings(
        sources, lay_out(experiment), every_ball=False, settings=experiment.readings
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


def _positions_read(experiment: Experiment, observed: ObservedReadings) -> Iterator[ReadPosition]:
    design = observed.design
    for k, position in enumerate(experiment.positions):
        groups = groups_taken(design, k, experiment, position)
        yield ReadPosition(replace(position, readings=groups), position)


def _fitted(experiment: Experiment, observed: ObservedReadings) -> tuple[Fit | None, str]:
    """Return the fit of the readings, or its failure reason."""
    design = observed.design
    unread = np.setdiff1d(design.plate_balls, design.readings.ball)
    if len(unread):
        balls = listing(design.ball_label(int(ball)) for ball in unread)
        return None, f"balls not read yet: {balls}"
    fitted = fit_observed(experiment, observed)
    if not fitted.converged:
        return None, fitted.complaint
    return fitted, ""


def _symbols(goal: Goal) -> set[str]:
    more = {"lengths": "U6", "quantity": goal.symbol.split()[0]}.get(goal.kind, goal.kind)
    return {"U6", more}


def _uncertainty(
    linearisation: Linearisation, experiment: Experiment, goal: Goal, sigma: float
) -> PlannedUncertainty:
    target = experiment.target_uncertainty
    return PlannedUncertainty(
        linearisation.deficiency, uncertainties(linearisation, sigma, target, _symbols(goal))
    )


def _planned(experiment: Experiment, goal: Goal, sigma: float) -> PlannedUncertainty:
    return _uncertainty(linearise(lay_out(experiment)), experiment, goal, sigma)


def _additions(
    experiment: Experiment, possible: Mapping[str, Position], read_positions: Sequence[ReadPosition]
) -> Iterator[Addition]:
    """Yield possible next positions: name, number of readings, and the experiment with all earlier
    readings and the position.

    Interrupted positions may be completed. Of a limited group, none is on offer once the limit is
    reached.
    """
    by_name = {earlier.position.name: earlier for earlier in read_positions}
    closed = set() if experiment.pool is None else _closed(experiment.pool, set(by_name))
    for name, position in possible.items():
        if name in closed and name not in by_name:
            continue
        count, positions = position.count, [earlier.position for earlier in read_positions]
        if name in by_name:
            count = by_name[name].missing
            positions = [
                earlier.whole if earlier.position.name == name else earlier.position
                for earlier in read_positions
            ]
        else:
            positions.append(position)
        if count > 0:
            yield name, count, with_positions(experiment, positions)


def _closed(pool: Pool, names_read: set[str]) -> set[str]:
    """Return candidates of groups whose limit is reached."""
    closed = set()
    for limit in pool.at_most:
        members = {pool.candidates[k].name for k in limit.members}
        if len(members & names_read) >= limit.count:
            closed |= members
    return closed
