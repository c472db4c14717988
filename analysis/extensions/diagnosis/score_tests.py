"""Score tests of causes at an estimate, by the residuals that they explain to first order."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing import svd
from ballplate.simulator.design import (
    Design,
    Disturbed,
    State,
    disturbed_readings,
    expected_readings,
)
from ballplate.simulator.estimation import estimate
from ballplate.simulator.machines import Array

from .bias_patterns import LinearisedDesign
from .cause_search import (
    Search,
    basis_of,
    explained_by,
    further_basis,
)
from .possible_causes import CHAIN, GROSS, MODEL, PossibleCause, possible_causes
from .power import noncentrality
from .remainders import HIDDEN, Leftover
from .rivals import clear_odds, log_p, standing, variance
from .smooth import rows_of

# Chance that any of the assumptions of a right experiment is contradicted.
LEVEL = 0.01

# Power of the test of what can be noticed.
POWER = 0.8

# Largest number of contradictions.
MOST = 5


@dataclass(frozen=True)
class Tested:
    """A cause with the `basis` (n, q) of what residuals show of it, and of its parameters in
    their unit the `sensitivity` (n, k), what residuals show of a unit of each.
    """

    cause: PossibleCause
    basis: Array
    sensitivity: Array

    @property
    def dimensions(self) -> int:
        return self.basis.shape[1]

    @property
    def is_of_model(self) -> bool:
        """True of further terms of a model of errors or drifts."""
        return self.cause.displaced is None and self.cause.assumed != GROSS

    def combinations(self, left: Leftover) -> tuple[Array, Array, Array]:
        """Return combinations (r, k) of the parameters that residuals show, with standard
        uncertainties (r,) in units of sigma, and those (k - r, k) that they do not show.
        """
        size = np.linalg.norm(self.sensitivity, axis=0)
        size[size == 0.0] = 1.0
        remaining = left.of(self.sensitivity / size)
        _, values, vectors = svd(remaining, full_matrices=False)
        shown = min(int((values**2 > HIDDEN).sum()), self.dimensions)
        rows, hidden = reduced(vectors[:shown] * size), reduced(vectors[shown:] * size)
        root = (rows / size) @ vectors[:shown].T / values[:shown]
        return rows, np.linalg.norm(root, axis=1), hidden


def reduced(rows: Array) -> Array:
    """Return rows (r, k) that span the same, each with 1 in a column in which the others have 0."""
    rows, columns = rows.copy(), np.zeros(len(rows), np.int64)
    for k in range(len(rows)):
        row, columns[k] = divmod(int(np.abs(rows[k:]).argmax()), rows.shape[1])
        rows[[k, k + row]] = rows[[k + row, k]]
        rows[k] /= rows[k, columns[k]]
        others = np.arange(len(rows)) != k
        rows[others] -= np.outer(rows[others, columns[k]], rows[k])
    return rows[np.argsort(columns)]


def tested(search: Search) -> Iterator[Tested]:
    """Return all causes with what the residuals of a search show of them."""
    nominal, expected = (
        _linearised(search.design, state) for state in (search.drawn.state, search.state)
    )
    for cause in possible_causes(search.design):
        most = basis_of(search.nominal, _rows(*nominal, cause)).shape[1]
        columns = _rows(*expected, cause)
        yield Tested(cause, search.visible(columns, most), columns)
    for smooth in search.smooth:
        assumed = "drift" if smooth.is_drift else MODEL
        cure = "consider drifts" if smooth.is_drift else "compare error models (ballplate models)"
        cause = PossibleCause(assumed, smooth.words, cure)
        yield Tested(cause, smooth.columns, smooth.columns[:, :0])


def _linearised(design: Design, state: State) -> tuple[LinearisedDesign, Disturbed]:
    """Return a design linearised at a state, and the readings that it expects."""
    readings = design.readings
    at = disturbed_readings(state, readings, expected_readings(design, state, readings))
    return LinearisedDesign(design, state, None), at


def _rows(linearised: LinearisedDesign, at: Disturbed, cause: PossibleCause) -> Array:
    """Return the whitened changes (n, k) of all rows by a unit of each parameter."""
    assert cause.displaced is not None
    return rows_of(linearised, cause.displaced(at))


@dataclass(frozen=True)
class Contradiction:
    """The cause that explains most, with the logarithm of its p-value, and `others` that
    explain the same.
    """

    best: Tested
    log_p: float
    others: tuple[Tested, ...]


def log_chances(search: Search, left: Leftover, every: list[Tested]) -> Array:
    """Return logarithms (h,) of the p-values of causes at some remainder."""
    return np.array([_log_p(search, left, each.basis) for each in every])


def _log_p(search: Search, left: Leftover, basis: Array) -> float:
    remaining = further_basis(left, basis, search.width)
    return search.log_p(*explained_by(left, remaining), left) if remaining.shape[1] else 0.0


def contradictions(
    search: Search, left: Leftover, every: list[Tested], limit: float
) -> tuple[list[Contradiction], Leftover]:
    """Return the causes that residuals confirm beyond a `limit`, one after the other, and what
    remains without them. Those whose fits stand against the file and all others are named together.
    """
    found: list[Contradiction] = []
    beyond: dict[int, float] = {}
    while len(found) < MOST and left.freedom >= 3:
        chances = log_chances(search, left, every)
        # Most of what another chain changes to first order is not in its own fit, which decides.
        chains = np.array([each.cause.assumed == CHAIN for each in every])
        some = np.flatnonzero((chances < limit) | (chains & (chances.min() < limit))).tolist()
        given = left.sum_of_squares, left.freedom, limit, search.estimated
        stand = [
            (k, count, search.log_p(left.sum_of_squares - remaining, count, left))
            for remaining, count, k in standing(
                _fits(search, left, every, some, beyond, limit), *given
            )
        ]
        if not stand:
            break
        # Further terms of the error model are an explanation where no other does as well.
        best, count, chance = min(stand, key=lambda one: (every[one[0]].is_of_model, one[2]))
        widest = max(count, stand[0][1])
        others = dict.fromkeys(k for k, count, _ in stand if k != best and count <= widest)
        found.append(Contradiction(every[best], chance, tuple(every[k] for k in others)))
        left = left.without(every[best].basis)
    return found, left


def _fits(
    search: Search,
    left: Leftover,
    every: list[Tested],
    some: list[int],
    beyond: dict[int, float],
    limit: float,
) -> list[tuple[float, int, tuple[float, int, int]]]:
    """Return the sums of squares that fits with some causes leave, with each cause's number of
    parameters, and both again with the cause. A wider one is also tried by each parameter alone.

    `beyond` gets what the fits of designs leave beyond the first order, which without earlier
    causes is about the same. Causes that the first order leaves far behind are not fitted.
    """
    to_first_order = []
    for k in some:
        each = every[k]
        bases = [each.basis]
        if each.dimensions > 1 and each.cause.assumed != CHAIN:
            bases += [basis_of(left, column) for column in each.sensitivity.T[:, :, None]]
        for basis in bases:
            square, dimensions = explained_by(left, further_basis(left, basis, search.width))
            # Another chain has no further parameters, but is one of several.
            count = int(dimensions) if each.cause.assumed != CHAIN else 1
            if count:
                to_first_order.append((left.sum_of_squares - square, count, k))
    given = min((one[0] for one in to_first_order), default=0.0), left.freedom, search.estimated
    least, unit, fits = math.inf, 2.0 * variance(*given), []
    for remaining, count, k in sorted(to_first_order, key=lambda one: one[0] + unit * one[1]):
        if remaining + unit * count > least + clear_odds(*given):
            break
        if k not in beyond:
            beyond[k] = _beyond_first_order(search, left, every[k], count, limit)
        left_by_fit = remaining + beyond[k]
        fits.append((left_by_fit, count, (left_by_fit, count, k)))
        least = min(least, left_by_fit + unit * count)
    return fits


def _beyond_first_order(
    search: Search, left: Leftover, tested: Tested, count: int, limit: float
) -> float:
    """Return by how much the sum of squares of a fit with a cause exceeds that to first order;
    infinite if this fit is not significantly better than the file's, by what is `left` of it.

    To first order a chain's errors, for one, are added to those of the stated one that it replaces.
    """
    if tested.cause.design is None:
        return 0.0
    solution = estimate(tested.cause.design, search.x)
    gained = search.start.sum_of_squares - solution.factor.sum_of_squares
    total, freedom = left.sum_of_squares + max(gained, 0.0), left.freedom + count
    log_p_of_fit = log_p(max(gained, 0.0), count, total, freedom, search.estimated)
    if solution.status != "converged" or log_p_of_fit >= limit:
        return math.inf
    return explained_by(search.start, tested.basis)[0] - gained


def noticeable(search: Search, left: Leftover, tests: int) -> float:
    """Return the size, in standard uncertainties, that a test at the common level notices."""
    freedom = left.freedom - 1 if search.estimated else math.inf
    return noncentrality(LEVEL / max(tests, 1), POWER, freedom)
