"""Variance components of a fit: estimates, their uncertainties and verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from ballplate.extensions.reliability.remainders import leftover, too_many_entries
from ballplate.presentation import Data, Result, picked, table_lines
from ballplate.results import Grouping
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import Design
from ballplate.simulator.estimation import Linearisation
from ballplate.simulator.machines import Array, Integers

from .observation_groups import ObservationGroup, groups_of
from .restricted_likelihood import (
    SMALLEST,
    GroupSums,
    Whitened,
    at_ratios,
    degrees_of_freedom,
    estimated_ratios,
    group_sums,
)

LARGER, SMALLER, AS_STATED = "larger than stated", "smaller than stated", "agrees with stated"

# Chance that a table of readings that scatter as stated calls any of its groups larger or smaller.
FALSE_ALARM = 0.05

# Chance that an interval does not hold its ratio.
OUTSIDE = 0.05

# Groups with fewer degrees of freedom have no estimate: its standard deviation would be larger than
# itself.
LEAST_FREEDOM = 1.0

# Entries of the matrices of all groups, of eight bytes each, of which there are several copies.
MOST_ENTRIES = 20_000_000


@dataclass(frozen=True)
class VarianceComponent:
    """The variance of a group of `observations` as a `ratio` to the stated one.

    `redundancy` is the number of its observations less those absorbed by the estimate;
    `standard_uncertainty` is that of the ratio, and `lower` and `upper` are the ends of an
    interval of 95 %. All are NaN if `verdict` states that it cannot be estimated, and the ratio
    counts as 1.
    """

    name: str
    observations: int
    redundancy: float
    ratio: float
    standard_uncertainty: float
    lower: float
    upper: float
    verdict: str

    @property
    def is_estimated(self) -> bool:
        return not np.isnan(self.ratio)


@dataclass(frozen=True, repr=False)
class VarianceComponents(Result):
    """Variance components of the groups that `by` makes of all observations of a fit."""

    label: str
    title: str
    by: Grouping
    groups: tuple[VarianceComponent, ...]

    def headline(self) -> str:
        count = sum(group.is_estimated for group in self.groups)
        larger = [group.name for group in self.groups if group.verdict == LARGER]
        words = f"{count} of {len(self.groups)} variance components estimated"
        return f"{words}; {LARGER}: {', '.join(larger)}" if larger else words

    def lines(self) -> list[str]:
        columns = {f"variance by {self.by}": "name", **COLUMNS, "": "verdict"}
        return table_lines(columns, self.groups)

    def rows(self) -> list[Data]:
        """One row for each group."""
        names = ("observations", "redundancy", *RATIO, "verdict")
        return [{"group": group.name, **picked(group, *names)} for group in self.groups]

    def data(self) -> Data:
        return {"by": self.by, "false_alarm": FALSE_ALARM, "groups": self.rows()}


RATIO = ("ratio", "standard_uncertainty", "lower", "upper")
COLUMNS = {
    "observations": "observations",
    "redundancy": ("redundancy", "{:.2f}".format),
    "ratio to stated": ("ratio", 3),
    "standard uncertainty": ("standard_uncertainty", 3),
    "95 % from": ("lower", 3),
    "to": ("upper", 3),
}


def too_many_groups(design: Design, groups: Sequence[ObservationGroup]) -> str:
    """Why variance components take too much memory; otherwise empty."""
    entries = len(groups) * design.parameter_count**2
    if entries <= MOST_ENTRIES:
        return too_many_entries(design)
    return (
        f"{len(groups)} groups of observations of {design.parameter_count} parameters are too many"
        " for variance components; choose a grouping with fewer"
    )


@dataclass(frozen=True)
class Estimated:
    """Estimated `ratios` (g,) of `groups`; without an estimate (not `free`) they are 1, and
    `reasons` states why.
    """

    groups: tuple[ObservationGroup, ...]
    sums: GroupSums
    ratios: Array
    free: Integers
    reasons: tuple[str, ...]


def told_apart(sums: GroupSums, groups: tuple[ObservationGroup, ...]) -> Estimated:
    """REML estimates of the variances that the design tells apart."""
    free, reasons = _told_apart(sums, [group.name for group in groups])
    return Estimated(groups, sums, estimated_ratios(sums, free), free, reasons)


def _told_apart(sums: GroupSums, names: Sequence[str]) -> tuple[Integers, tuple[str, ...]]:
    """Return groups whose variances the design distinguishes, at stated values, and the reasons
    for the others.
    """
    at_unit_ratios = at_ratios(sums, np.ones(len(sums.counts)))
    reasons = [""] * len(names)
    free = list(range(len(names)))
    for k, redundancy in enumerate(at_unit_ratios.redundancies.tolist()):
        if redundancy < LEAST_FREEDOM:
            reasons[k] = "cannot be estimated: too little redundancy"
            free.remove(k)
    while free:
        information = at_unit_ratios.information[np.ix_(free, free)]
        freedom = degrees_of_freedom(information)
        # The last of those that are equally poor, so that rounding does not choose.
        worst = int(np.flatnonzero(freedom <= freedom.min() + 1e-6)[-1])
        if freedom[worst] >= LEAST_FREEDOM:
            break
        common = information[worst] / np.sqrt(np.diagonal(information))
        common[worst] = -np.inf
        confounded = names[free[int(np.argmax(np.round(common, 6)))]]
        reasons[free[worst]] = f"confounded with {confounded}"
        del free[worst]
    return np.array(free, np.int64), tuple(reasons)


@single_threaded
def variance_components(
    label: str, title: str, linearisation: Linearisation, x: Array, by: Grouping
) -> VarianceComponents:
    """Variance components of a fit to scale readings x (readings, d), which has converged.

    :raises ValueError: there are too many groups or observations for the memory.
    """
    groups = groups_of(linearisation.design, by)
    reason = too_many_groups(linearisation.design, groups)
    if reason:
        raise ValueError(reason)
    estimated = told_apart(group_sums(leftover(linearisation, x, 0), groups), groups)
    return VarianceComponents(label, title, by, tuple(judged(estimated)))


def judged(estimated: Estimated) -> list[VarianceComponent]:
    """Estimates with their uncertainties and verdicts."""
    at_estimates = at_ratios(estimated.sums, estimated.ratios)
    freedom = degrees_of_freedom(at_estimates.information[np.ix_(estimated.free, estimated.free)])
    whitened = Whitened(estimated.sums, estimated.ratios, estimated.free)
    at_unit_ratios = at_ratios(estimated.sums, np.ones(len(estimated.groups)))
    result = []
    limit = 0.5 * FALSE_ALARM / max(len(estimated.free), 1)
    for k, group in enumerate(estimated.groups):
        place = np.flatnonzero(estimated.free == k)
        facts = group.name, len(group.rows), float(at_unit_ratios.redundancies[k])
        if not len(place):
            nothing = (np.nan,) * 4
            result.append(VarianceComponent(*facts, *nothing, estimated.reasons[k]))
            continue
        test = whitened.test_of(int(place[0]))
        chance = test.chance(1.0)
        verdict = LARGER if chance < limit else SMALLER if chance > 1.0 - limit else AS_STATED
        # At the bound there is no scatter but what others explain.
        ratio = float(estimated.ratios[k]) if estimated.ratios[k] > SMALLEST else 0.0
        spread = ratio * float(np.sqrt(2.0 / freedom[place[0]])) if ratio else np.nan
        ends = test.end(0.5 * OUTSIDE), test.end(1.0 - 0.5 * OUTSIDE)
        result.append(VarianceComponent(*facts, ratio, spread, *ends, verdict))
    return result
