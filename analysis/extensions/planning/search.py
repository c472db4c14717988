"""Selections by local search: a greedy start, then exchanges while one lowers the criterion.

An exchange adds one matrix to that of the remaining selection and factors the sum. A position read
with a whole plate changes about half of the relevant directions, and an update of that rank costs
as much as a new factor. Small matrices and a sieve keep a step cheap: only candidates with the
best tangents of the criterion at the present selection are evaluated in full.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from ballplate.simulator.computing import comparable, eigh, eigvalsh, scipy_linalg, single_threaded
from ballplate.simulator.machines import Array, Integers

from .constraints import Constraints
from .criteria import Criterion
from .information import Information

# Below this fraction of the whole pool's information a direction counts as undetermined.
UNDETERMINED = 1e-10

# What is added to the information of selections while they are compared, so that deficient ones
# compare as well, and what counts in place of the information of undetermined directions.
RIDGE = 1e-13

# Above every criterion.
LARGE = 1e12

# Candidates that are left at each exchange by the slope of the criterion, and of these by its
# tangent; all of them are evaluated in full in pools no larger than this.
SLOPED = 64
SIEVED = 5
SMALL_POOL = 24

# Matrices factored at once.
AT_ONCE = 64

# A relative gain below this is rounding.
GAIN = 1e-9

# Binary digits, of the order of that gain, in which criteria are compared: of equal selections the
# first is taken.
COMPARED = 33


@dataclass(frozen=True)
class SelectionProblem:
    """Candidates, criterion and limits of a selection."""

    information: Information
    criterion: Criterion
    constraints: Constraints

    @cached_property
    def limits(self) -> Constraints:
        """Constraints, with those that the criterion adds."""
        needed = tuple(placing for _, placing in self.criterion.needed)
        return replace(self.constraints, at_least=(*self.constraints.at_least, *needed))

    @property
    def counted(self) -> slice:
        """The last z, which remain after elimination of balls and which the criterion concerns."""
        return slice(None) if self.criterion.about_balls else self.information.shared

    def lacking(self, chosen: Collection[int]) -> list[tuple[int, ...]]:
        """Return required sets of candidates without a chosen member."""
        return [at_least for at_least in self.limits.at_least if set(at_least).isdisjoint(chosen)]

    def value(self, root: Array) -> float:
        """The criterion where root root' is the covariance of all z."""
        return self.criterion.value(root[self.counted, self.counted])

    def tangent(self, root: Array, *power: float) -> tuple[float, float, Array]:
        """Return the criterion's tangent, with a square root H of the derivative by the covariance
        of the counted z, H H', as its second part.
        """
        smooth, value, weight = self.criterion.tangent(root[self.counted, self.counted], *power)
        scale, directions = eigh(weight)
        return smooth, value, directions * np.sqrt(np.maximum(scale, 0.0))


@dataclass(frozen=True)
class Found:
    """A selection: sorted indices of candidates, and the criterion, infinite if deficient; then
    `lack` compares the undetermined directions.
    """

    chosen: tuple[int, ...]
    value: float
    lack: float = 0.0

    @property
    def order(self) -> tuple[float, float, tuple[int, ...]]:
        """The better, the smaller; equal ones by the order of candidates."""
        return float(comparable(self.value, COMPARED)), self.lack, self.chosen


def full_root(information: Array) -> Array | None:
    """Return the upper triangular root R of the covariance R R' of all z from their information
    (z, z), unless deficient.
    """
    try:
        factor = np.asarray(np.linalg.cholesky(information), float)
    except np.linalg.LinAlgError:
        return None
    if (np.diagonal(factor) ** 2).min() < UNDETERMINED:
        return None
    inverse = _inverse(factor)
    return None if _is_deficient(inverse) else inverse.T


def value(problem: SelectionProblem, chosen: Collection[int]) -> float:
    """Criterion of a selection, infinite if it leaves something undetermined, or lacks what every
    choice needs.
    """
    if problem.lacking(chosen):
        return np.inf
    root = full_root(problem.information.of(chosen))
    return np.inf if root is None else problem.value(root)


def _inverse(triangle: Array) -> Array:
    inverse: Array = scipy_linalg().lapack.dtrtri(triangle, lower=1)[0]
    return inverse


def _is_deficient(inverse: Array) -> bool:
    """True if a direction is undetermined, by the sum of all variances from the inverse (z, z) of
    a Cholesky factor.

    A small pivot is sufficient but not necessary: of a null vector whose last components are
    small, rounding or the ridge is divided by their squares, and spread over several pivots.
    """
    return bool(np.vdot(inverse, inverse) > 1.0 / UNDETERMINED)


class Losses:
    """Loss of selections, each computed once: the criterion, or a larger value for deficient ones.

    With `by_pivots` a selection counts as deficient by a small pivot alone. Some deficient ones
    then have the criterion that the ridge gives them: not a verdict, but a path between selections
    that are just sufficient.
    """

    def __init__(self, problem: SelectionProblem, by_pivots: bool = False) -> None:
        self._problem = problem
        self.by_pivots = by_pivots
        self._known: dict[frozenset[int], float] = {}
        self._sieved: dict[frozenset[int], tuple[Integers, Array]] = {}

    def sieved(self, members: frozenset[int], added: Integers) -> tuple[Integers, Array]:
        """Candidates that may be the best to add to a selection, and the tangent with each."""
        losses_sieved = self._sieved.get(members)
        if losses_sieved is None:
            information = self._problem.information.of(members)
            losses_sieved = _sieve(self._problem, information, added, self.by_pivots)
            self._sieved[members] = losses_sieved
        return losses_sieved

    def of(self, members: frozenset[int]) -> float:
        loss = self._known.get(members)
        if loss is None:
            information = self._problem.information.of(members)
            lacking = LARGE * 2 * len(self._problem.lacking(members))
            # By the same root as the value, so that no selection counts here that has none.
            root = _ridged_root(information) if self.by_pivots else full_root(information)
            if root is None:
                # Deficient selections compare, too, so that a search can begin with none: each
                # lacking set counts more than any number of undetermined directions.
                loss = lacking + _in_place(information)
            else:
                loss = lacking or self._problem.value(root)
            loss = float(comparable(loss, COMPARED))
            self._known[members] = loss
        return loss


def _ridged_root(information: Array) -> Array | None:
    """Return a square root of the inverse of information (z, z) with the ridge, unless a pivot is
    small.
    """
    factor = np.asarray(np.linalg.cholesky(_ridged(information)), float)
    return None if (np.diagonal(factor) ** 2).min() < UNDETERMINED else _inverse(factor).T


def _in_place(information: Array) -> float:
    """Return the substitute loss of deficient information (z, z).

    It falls with the determinant, so that candidates that determine most directions, and those
    best, come first.
    """
    scale = _scale(information)
    root = np.sqrt(scale)
    sizes = eigvalsh(information / (root[:, None] * root))
    # What is undetermined is rounding.
    logarithms = np.log(np.where(sizes < UNDETERMINED, RIDGE, sizes)) + np.log(scale)
    return float(LARGE * (1.0 + logarithms.mean() / np.log(RIDGE)))


def _scale(information: Array) -> Array:
    """Return the reference of rounding for each of the z of information (..., z, z): 1, or more
    next to exact values.
    """
    return np.maximum(np.diagonal(information, axis1=-2, axis2=-1), 1.0)


def _ridged(information: Array) -> Array:
    """Return information (..., z, z) with the ridge, which makes it positive definite."""
    return information + RIDGE * _scale(information)[..., None] * np.eye(information.shape[-1])


def _sieve(
    problem: SelectionProblem, information: Array, added: Integers, by_pivots: bool = False
) -> tuple[Integers, Array]:
    """Return the candidates that may be the best addition to `information`, and the criterion's
    tangent with each.

    The first sieve is the slope of the criterion as a little of every candidate is added, the
    second its tangent with each candidate added separately.
    """
    whole, matrices = np.eye(len(information)), problem.information.matrices
    # All candidates together have the identity, up to what the base has.
    # A candidate cannot be judged beside a selection that is deficient: a little of all others
    # takes the place of what is to come.
    mean = (whole - problem.information.base) / len(matrices)
    root = _inverse(np.asarray(np.linalg.cholesky(_ridged(information + mean)), float)).T
    counted, (_, _, half) = problem.counted, problem.tangent(root)
    if len(added) > SLOPED:
        spread = root @ (root[counted].T @ half)
        slope = np.tensordot(matrices, spread @ spread.T, axes=2)[added]
        added = np.sort(added[np.argsort(-comparable(slope), kind="stable")[:SLOPED]])
    losses = np.zeros(len(added))
    for start in range(0, len(added), AT_ONCE):
        some = added[start : start + AT_ONCE]
        factors = np.asarray(np.linalg.cholesky(_ridged(information + matrices[some])), float)
        for k, factor in enumerate(factors):
            inverse = _inverse(factor)
            pivots = np.diagonal(factor) ** 2
            if (pivots.min() < UNDETERMINED) if by_pivots else _is_deficient(inverse):
                losses[start + k] = _in_place(information + matrices[some[k]])
            else:
                losses[start + k] = ((inverse[counted, counted] @ half) ** 2).sum()
    return added, losses


def best_addition(
    problem: SelectionProblem, members: frozenset[int], losses: Losses, per_second: bool = False
) -> tuple[int, float] | None:
    """Return the candidate that lowers the criterion most within the limits, and the criterion
    with it, if one may be added.

    With `per_second` the improvement is divided by the candidate's duration.
    """
    added = problem.constraints.additions(members)
    lacking = problem.lacking(members)
    if lacking:
        # What every choice needs comes first, as long as there is room for it.
        wanted = added[np.isin(added, [k for needed in lacking for k in needed])]
        added = wanted if len(wanted) else added
    if not len(added):
        return None
    seconds = np.maximum(problem.constraints.seconds, 1.0)
    # A calibration of co-ordinates changes what is held of frames, which tangents do not show. With
    # one on offer all are evaluated in full.
    framed = np.isin(added, list(problem.information.frames.fixed))
    if len(added) > SMALL_POOL and not framed.any():
        added, tangents = losses.sieved(members, added)
        if per_second:
            tangents = (tangents - tangents.max()) / seconds[added]
        added = added[np.argsort(comparable(tangents), kind="stable")[:SIEVED]]
    after = np.array([losses.of(members | {int(k)}) for k in added])
    gain = after - losses.of(members)
    best = int(comparable(gain / seconds[added] if per_second else gain).argmin())
    return int(added[best]), float(after[best])


def fill(
    problem: SelectionProblem, chosen: Collection[int], losses: Losses, thorough: bool = True
) -> frozenset[int]:
    """Add candidates, the best first, while the limits allow one and it lowers the criterion.

    If time is limited and the filling `thorough`, the better of two results counts: largest
    improvement first, or largest improvement per second first.
    """
    timed = thorough and problem.constraints.budget.seconds is not None
    # Neither is always better: the largest improvement first may use up the time, the largest per
    # second may leave a gap that no candidate fits.
    ways = (False, True) if timed else (False,)
    return min(
        (_filled(problem, frozenset(chosen), losses, per_second) for per_second in ways),
        key=losses.of,
    )


def _filled(
    problem: SelectionProblem, members: frozenset[int], losses: Losses, per_second: bool
) -> frozenset[int]:
    while (best := best_addition(problem, members, losses, per_second)) is not None:
        addition, after = best
        if after >= losses.of(members) * (1 - GAIN):
            break
        members |= {addition}
    return members


@single_threaded
def improve(
    problem: SelectionProblem,
    start: Collection[int],
    losses: Losses,
    at_once: int,
    thorough: bool = False,
) -> Found:
    """Return the best selection reached by exchanges from a start within the limits.

    Removing one candidate and refilling the gap is repeated until it brings no improvement, then
    with two, up to `at_once`. If `thorough`, the gap is filled beginning with each candidate in
    turn, which escapes from traps of tight limits.
    """
    members = fill(problem, start, losses)
    size = 1
    while size <= at_once:
        before = members
        for gone in combinations(sorted(members - problem.constraints.must), size):
            if members.issuperset(gone):
                without = members.difference(gone)
                candidates_found = fill(problem, without, losses, thorough)
                if thorough:
                    begun = [
                        fill(problem, without | {int(k)}, losses)
                        for k in problem.constraints.additions(without)
                    ]
                    candidates_found = min([candidates_found, *begun], key=losses.of)
                if losses.of(candidates_found) < losses.of(members) * (1 - GAIN):
                    members = candidates_found
        size = size + 1 if members == before else 1
    return judged(problem, members)


def judged(problem: SelectionProblem, members: frozenset[int]) -> Found:
    """A selection with its criterion, or what compares it with other deficient ones."""
    loss = value(problem, members)
    lack = 0.0 if np.isfinite(loss) else Losses(problem).of(members)
    return Found(tuple(sorted(members)), loss, lack)


def ranked_additions(problem: SelectionProblem, chosen: Collection[int]) -> list[tuple[int, float]]:
    """Candidates that may be added to a selection, with the criterion that each would give,
    smallest first.
    """
    added = problem.constraints.additions(chosen)
    losses = [(int(k), value(problem, {*chosen, int(k)})) for k in added]
    return sorted(losses, key=lambda item: (float(comparable(item[1], COMPARED)), item[0]))


def starts(
    problem: SelectionProblem, ranked: Sequence[int], count: int, seed: int
) -> list[frozenset[int]]:
    """Selections to start from: what has to be chosen alone, filled by rank, and `count` filled in
    random order.
    """
    must = problem.constraints.must
    begun_sets = [must]
    generator = np.random.default_rng(np.random.SeedSequence(seed))
    orders = [
        list(ranked),
        *(generator.permutation(problem.constraints.count).tolist() for _ in range(count)),
    ]
    for order in orders:
        members = must
        for k in order:
            if k not in members and problem.constraints.allows(members | {k}):
                members |= {k}
        begun_sets.append(members)
    return list(dict.fromkeys(begun_sets))
