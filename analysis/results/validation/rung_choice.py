"""The choice among nested error models by tests of what richer ones explain."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.design.objects import Flags
from ballplate.simulator.machines.kinematic import ErrorFunction
from ballplate.simulator.machines.protocol import Array

from .lack_of_fit import chance_of
from .nested import NestedSums
from .rungs import POOREST, LadderModel, chain_of, contains, free_coefficients

# Chance that a model is left although it is right: of all richer ones together, and of all single
# functions together.
FALSE_STEP, FALSE_FUNCTION = 0.01, 0.05

# Chance with which a last coefficient of a single function counts as none.
LAST_COEFFICIENT = 0.01

# Single functions with more coefficients than the others; of more, all have more.
MOST_FUNCTIONS = 3

# Sums of squares for each degree of freedom below this are rounding.
ROUNDING = 1e-12


@dataclass(frozen=True)
class FittedSum:
    """An error model with its S^2, and the degrees of freedom that it leaves."""

    model: LadderModel
    sum_of_squares: float
    degrees_of_freedom: int


@dataclass(frozen=True)
class Beaten:
    """The least chance, among `count` richer models, of what one of them explains more: that of
    `by`, empty without any.
    """

    least: float
    count: int
    by: str

    @property
    def chance(self) -> float:
        """The chance that any of so many explains as much."""
        return min(1.0, self.least * self.count)


@dataclass(frozen=True)
class Comparison:
    """Tests of error models with sigma `given` or estimated."""

    given: bool

    def chance(self, poor: FittedSum, rich: FittedSum) -> float:
        """Chance of what the richer model explains if the poorer one is right."""
        freedom = rich.degrees_of_freedom
        left = max(rich.sum_of_squares, ROUNDING * freedom)
        gain = max(poor.sum_of_squares, ROUNDING * freedom) - left
        return chance_of(gain, poor.degrees_of_freedom - freedom, left, freedom, self.given)

    def beaten(self, poor: FittedSum, others: list[FittedSum]) -> Beaten:
        """The richer model that explains most, by chance."""
        found = [(self.chance(poor, one), one.model.words) for one in others]
        least, by = min(found, default=(1.0, ""))
        return Beaten(least, len(found), by)


@dataclass(frozen=True, eq=False)
class PolynomialGrid:
    """All kinematic models within the richest that a design determines, with their S^2.

    `make` makes a model of numbers of coefficients, and of those of single functions.
    """

    richest: FittedSum
    sums: NestedSums
    make: Callable[[int, int, dict[str, int]], LadderModel]

    @property
    def functions(self) -> tuple[ErrorFunction, ...]:
        return chain_of(self.richest.model.model).functions

    def kept(self, model: LadderModel) -> Flags:
        """Which of the richest model's parameters a poorer one has."""
        chain = chain_of(self.richest.model.model)
        kept = np.zeros(len(chain.parameters), bool)
        for one in chain.functions:
            own = chain.slices[one.name]
            kept[own.start : own.start + self._size(model, one)] = True
        return kept

    def _size(self, model: LadderModel, one: ErrorFunction) -> int:
        if one.name not in _polynomials(self.functions):
            return one.basis.size
        return free_coefficients(one.basis, model.coefficients(one.name, one.rotation))

    def fitted(self, model: LadderModel) -> FittedSum:
        """A model within the richest, with its S^2."""
        kept = self.kept(model)
        freedom = self.richest.degrees_of_freedom + int((~kept).sum())
        return FittedSum(model, self.sums.sum_of_squares(kept), freedom)

    def every(self) -> list[FittedSum]:
        """All with the same number for all positional, and for all rotational errors."""
        assert self.richest.model.numbers is not None
        most = self.richest.model.numbers
        pairs = [
            (n, m) for n in range(POOREST[0], most[0] + 1) for m in range(POOREST[1], most[1] + 1)
        ]
        return [self.fitted(one) for one in (self.make(n, m, {}) for n, m in pairs) if one.count]

    def with_functions(self, start: FittedSum, test: Comparison) -> FittedSum:
        """The model with more coefficients for the single functions that call for them."""
        found = start
        for _ in range(MOST_FUNCTIONS):
            better = self._one_more(found, test)
            if better is None:
                break
            found = better
        return found

    def _one_more(self, start: FittedSum, test: Comparison) -> FittedSum | None:
        model, kept = start.model, self.kept(start.model)
        basis = self.sums.basis(kept)
        left = self.sums.left(basis)
        offers = list(self._offers(model))
        best, chosen = FALSE_FUNCTION / max(len(offers), 1), None
        for name, count in offers:
            wider = replace(model, own=tuple({**dict(model.own), name: count}.items()))
            rich = self._gained(start, wider, kept, basis, left)
            chance = test.chance(start, rich)
            if chance < best:
                best, chosen = chance, (name, count, rich)
        if chosen is None:
            return None
        name, count, rich = chosen
        # Of its coefficients the last ones that explain nothing are left out again.
        while True:
            fewer = replace(model, own=tuple({**dict(model.own), name: count - 1}.items()))
            if self.kept(fewer).sum() <= kept.sum():
                break
            poor = self._gained(start, fewer, kept, basis, left)
            if test.chance(poor, rich) < LAST_COEFFICIENT:
                break
            count, rich = count - 1, poor
        assert model.numbers is not None
        made = self.make(*model.numbers, {**dict(model.own), name: count})
        return replace(rich, model=made)

    def _offers(self, model: LadderModel) -> Iterator[tuple[str, int]]:
        """Single functions with the numbers of coefficients that the richest model permits."""
        names = _polynomials(self.functions)
        for one in self.functions:
            if one.name in names:
                has = model.coefficients(one.name, one.rotation)
                most = self.richest.model.coefficients(one.name, one.rotation)
                for count in range(has + 1, most + 1):
                    if free_coefficients(one.basis, count) > free_coefficients(one.basis, has):
                        yield one.name, count

    def _gained(
        self, start: FittedSum, wider: LadderModel, kept: Flags, basis: Array, left: Array
    ) -> FittedSum:
        more = np.flatnonzero(self.kept(wider) & ~kept)
        gain, dimensions = self.sums.gain(basis, left, more)
        return FittedSum(wider, start.sum_of_squares - gain, start.degrees_of_freedom - dimensions)


def _polynomials(functions: tuple[ErrorFunction, ...]) -> set[str]:
    """Names of the functions that are polynomials; squareness is a single number."""
    return {one.name for one in functions if hasattr(one.basis, "coefficients")}


def richer(model: FittedSum, every: list[FittedSum]) -> list[FittedSum]:
    """The models that can do all that one can, and more."""
    return [one for one in every if contains(one.model, model.model)]


def path(every: list[FittedSum], test: Comparison) -> list[FittedSum]:
    """A way from the poorest to the richest polynomials, one coefficient more at each step: from
    the richest down by what is missed least.
    """
    by_numbers = {one.model.numbers: one for one in every}
    at = max(every, key=lambda one: one.model.numbers or POOREST)
    found = [at]
    while True:
        assert at.model.numbers is not None
        n, m = at.model.numbers
        fewer = [by_numbers.get(one) for one in ((n - 1, m), (n, m - 1))]
        offers = [one for one in fewer if one is not None]
        if not offers:
            return found[::-1]
        here = at
        at = max(offers, key=lambda one: (test.chance(one, here), one.degrees_of_freedom))
        found.append(at)


def first_adequate(
    grid: PolynomialGrid, every: list[FittedSum], test: Comparison
) -> tuple[FittedSum, Beaten]:
    """The model with the fewest parameters that no richer one beats, and the best of these.

    Richer ones are all that contain it. Beside each of the polynomials stands the same with more
    coefficients for single functions. If every model is beaten, the richest of all.
    """
    for one in sorted(every, key=lambda one: one.model.count):
        offers = [one] if one.model.numbers is None else [grid.with_functions(one, test), one]
        for offer in offers:
            if one.model.numbers is not None and offer is one and len(offers[0].model.own):
                # A single function calls for more, whatever all of them together do.
                continue
            beaten = test.beaten(offer, richer(offer, every))
            if beaten.chance >= FALSE_STEP:
                return offer, beaten
    richest = max(every, key=lambda one: one.model.count)
    return richest, Beaten(1.0, 0, "")
