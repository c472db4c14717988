"""Score tests of causes at an estimate, by the residuals that they explain to first order."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from ballplate.extensions.reliability.bias_patterns import LinearisedDesign
from ballplate.extensions.reliability.cause_search import (
    Search,
    basis_of,
    explained_by,
    further_basis,
    unbeaten,
)
from ballplate.extensions.reliability.power import noncentrality
from ballplate.extensions.reliability.remainders import HIDDEN, Leftover
from ballplate.extensions.reliability.smooth import rows_of
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

from .possible_causes import CHAIN, MODEL, PossibleCause, possible_causes

# Chance that any of the assumptions of a right experiment is contradicted.
LEVEL = 0.01

# Power of the test of what can be noticed.
POWER = 0.8

# Share of a parameter that is not in what residuals show, from which on they do not show it.
SEPARATE = 1e-6

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
        return self.cause.displaced is None

    def uncertainties(self, left: Leftover) -> Array:
        """Return standard uncertainties (k,) of the parameters in units of sigma, infinite of those
        that residuals do not show by themselves.
        """
        size = np.linalg.norm(self.sensitivity, axis=0)
        size[size == 0.0] = np.inf
        remaining = left.of(self.sensitivity / size)
        _, values, vectors = svd(remaining, full_matrices=False)
        shown = np.flatnonzero(values**2 > HIDDEN)[: self.dimensions]
        root = np.linalg.norm(vectors[shown].T / values[shown], axis=1)
        is_shown = (vectors[shown] ** 2).sum(axis=0) > 1.0 - SEPARATE
        return np.where(is_shown, root / size, np.inf)


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
    remains without them. Others are as good if the best explains nothing beyond them at that limit.
    """
    found: list[Contradiction] = []
    while len(found) < MOST and left.freedom >= 3:
        chances = log_chances(search, left, every)
        first = int(chances.argmin())
        if chances[first] >= limit:
            break
        same = [
            k
            for k in np.flatnonzero(chances < limit).tolist()
            if k == first
            or _log_p(search, left.without(every[k].basis), every[first].basis) >= limit
        ]
        # Further terms of the error model are an explanation where no other does as well.
        best = min(same, key=lambda k: (every[k].is_of_model, chances[k]))
        widest = max(every[best].dimensions, every[first].dimensions)
        others = [k for k in same if k != best and every[k].dimensions <= widest]
        if every[best].cause.assumed == CHAIN:
            other_causes = [k for k in others if every[k].cause.assumed != CHAIN]
            best, *others = _chains(search, every, np.flatnonzero(chances < limit).tolist())
            others += other_causes
        of_others = tuple(every[k] for k in others)
        found.append(Contradiction(every[best], float(chances[best]), of_others))
        left = left.without(every[best].basis)
    return found, left


def _chains(search: Search, every: list[Tested], candidates: list[int]) -> list[int]:
    """Return the chains of axes among some causes that fit best, by fits with each.

    A score test adds a chain's errors to those of the stated one, which it replaces.
    """
    fits = []
    for k in candidates:
        cause = every[k].cause
        if cause.assumed == CHAIN and cause.design is not None:
            solution = estimate(cause.design, search.x)
            is_good = solution.status == "converged"
            fits.append((solution.factor.sum_of_squares if is_good else math.inf, k))
    return unbeaten(fits, search.freedom, search.estimated)


def noticeable(search: Search, left: Leftover, tests: int) -> float:
    """Return the size, in standard uncertainties, that a test at the common level notices."""
    freedom = left.freedom - 1 if search.estimated else math.inf
    return noncentrality(LEVEL / max(tests, 1), POWER, freedom)
