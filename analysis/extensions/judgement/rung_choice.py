"""The choice among nested error models by tests of what richer ones explain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from ballplate.simulator.design import Flags
from ballplate.simulator.machines import ErrorFunction

from .lack_of_fit import chance_of
from .nested import NestedSums
from .rungs import POOREST, LadderModel, chain_of, contains, free_coefficients

# Chance that a model is left although it is right: of all richer ones together, and of all single
# functions together. Both are limits (Bonferroni); simulated campaigns have about half of their
# sum.
FALSE_STEP, FALSE_FUNCTION = 0.01, 0.05

# Chance with which a last coefficient of a single function counts as none.
LAST_COEFFICIENT = 0.01

# Single functions with more coefficients than the others; of more, all have more.
MOST_FUNCTIONS = 3

# BIC above that of a model that is no richer form of the same, from which on the other is better.
CLEARLY_WORSE = 10.0

# Sums of squares for each degree of freedom below this are rounding.
ROUNDING = 1e-12


@dataclass(frozen=True)
class FittedSum:
    """An error model with its S^2, and the degrees of freedom that it leaves."""

    model: LadderModel
    sum_of_squares: float
    degrees_of_freedom: int


@dataclass(frozen=True)
class Criteria:
    """Akaike's and Schwarz's information criteria; differences between models count."""

    aic: float
    bic: float


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
        """The chance that any of so many explains as much; 1 without any."""
        return min(1.0, self.least * max(self.count, 1))


@dataclass(frozen=True)
class Comparison:
    """Tests of error models on so many observations, with sigma `given` or estimated."""

    given: bool
    observations: int

    def criteria(self, fitted: FittedSum) -> Criteria:
        """Akaike's and Schwarz's criteria of a normal likelihood with all parameters, sigma among
        them where it is estimated.
        """
        count = self.observations
        parameters, misfit = count - fitted.degrees_of_freedom, fitted.sum_of_squares
        if not self.given:
            parameters += 1
            misfit = count * float(np.log(max(misfit / count, ROUNDING)))
        return Criteria(misfit + 2 * parameters, misfit + float(np.log(count)) * parameters)

    def is_worse(self, fitted: FittedSum, rivals: list[FittedSum]) -> bool:
        """True if BIC clearly prefers one of others with more parameters."""
        mine = self.criteria(fitted).bic
        return any(
            self.criteria(rival).bic < mine - CLEARLY_WORSE
            for rival in rivals
            if rival.model.count > fitted.model.count
        )

    def chance(self, poor: FittedSum, rich: FittedSum) -> float:
        """Chance of what the richer model explains if the poorer one is right."""
        freedom = rich.degrees_of_freedom
        sum_left = max(rich.sum_of_squares, ROUNDING * freedom)
        gain = max(poor.sum_of_squares, ROUNDING * freedom) - sum_left
        return chance_of(gain, poor.degrees_of_freedom - freedom, sum_left, freedom, self.given)

    def beaten(self, poor: FittedSum, rivals: list[FittedSum]) -> Beaten:
        """The richer model that explains most, by chance."""
        chances = [(self.chance(poor, rival), rival.model.words) for rival in rivals]
        least, by = min(chances, default=(1.0, ""))
        return Beaten(least, len(chances), by)


@dataclass(frozen=True, eq=False)
class PolynomialGrid:
    """All kinematic models within the richest that a design determines, with their S^2.

    `make` makes a model of numbers of coefficients, and of those of single functions.
    """

    richest: FittedSum
    sums: NestedSums
    make: Callable[[int, int, dict[str, int]], LadderModel]

    @cached_property
    def functions(self) -> tuple[ErrorFunction, ...]:
        """The error functions that are polynomials; squareness is a single number."""
        every = chain_of(self.richest.model.model).functions
        return tuple(rung for rung in every if hasattr(rung.basis, "coefficients"))

    def kept(self, model: LadderModel) -> Flags:
        """Which of the richest model's parameters a poorer one has."""
        chain = chain_of(self.richest.model.model)
        kept = np.ones(len(chain.parameters), bool)
        for function in self.functions:
            first = chain.slices[function.name].start + self._size(model, function)
            kept[first : chain.slices[function.name].stop] = False
        return kept

    def _size(self, model: LadderModel, function: ErrorFunction) -> int:
        return free_coefficients(
            function.basis, model.coefficients(function.name, function.rotation)
        )

    def fitted(self, model: LadderModel) -> FittedSum:
        """A model within the richest, with its S^2."""
        is_kept = self.kept(model)
        freedom = self.richest.degrees_of_freedom + int((~is_kept).sum())
        return FittedSum(model, self.sums.sum_of_squares(is_kept), freedom)

    def every(self) -> list[FittedSum]:
        """All with the same number for all positional, and for all rotational errors."""
        assert self.richest.model.numbers is not None
        most = self.richest.model.numbers
        pairs = [
            (n, m) for n in range(POOREST[0], most[0] + 1) for m in range(POOREST[1], most[1] + 1)
        ]
        return [
            self.fitted(model) for model in (self.make(n, m, {}) for n, m in pairs) if model.count
        ]

    def with_functions(self, start: FittedSum, test: Comparison) -> FittedSum:
        """The model with more coefficients for the single functions that call for them."""
        best = start
        for _ in range(MOST_FUNCTIONS):
            better = self._one_more(best, test)
            if better is None:
                break
            best = better
        return best

    def _one_more(self, start: FittedSum, test: Comparison) -> FittedSum | None:
        """The model with more coefficients for the single function that calls for them most."""
        model = start.model
        assert model.numbers is not None
        basis = self.sums.basis(self.kept(model))
        remainder = self.sums.left(basis)
        first = {
            function.name: chain_of(self.richest.model.model).slices[function.name]
            for function in self.functions
        }

        def with_more(function: ErrorFunction, size: int) -> FittedSum:
            more = first[function.name].start + np.arange(self._size(model, function), size)
            gain, dimensions = self.sums.gain(basis, remainder, more)
            return FittedSum(
                model, start.sum_of_squares - gain, start.degrees_of_freedom - dimensions
            )

        offers = [
            (test.chance(start, with_more(function, size)), place, size)
            for place, function in enumerate(self.functions)
            for size in range(self._size(model, function) + 1, function.basis.size + 1)
        ]
        if not offers or min(offers)[0] >= FALSE_FUNCTION / len(offers):
            return None
        _, place, size = min(offers)
        function = self.functions[place]
        rich = with_more(function, size)
        # Of its coefficients the last ones that explain nothing are left out again.
        while size - 1 > self._size(model, function):
            poor = with_more(function, size - 1)
            if test.chance(poor, rich) < LAST_COEFFICIENT:
                break
            size, rich = size - 1, poor
        count = size + 1 + int(function.basis.zero_at_one)
        return replace(
            rich, model=self.make(*model.numbers, {**dict(model.own), function.name: count})
        )


def limits_reached(
    model: LadderModel, grid: PolynomialGrid, every: list[FittedSum]
) -> tuple[int, ...]:
    """Numbers of coefficients, of all or of single functions, that are the most that any model has,
    so that nothing shows that these are enough; 0 stands for those of an empirical model.
    """
    if model.numbers is None:
        largest = max(pair.model.count for pair in every if pair.model.numbers is None)
        return (0,) if model.count == largest else ()
    most, poorest = grid.richest.model, dict(zip((False, True), POOREST, strict=True))
    counts = (
        (model.coefficients(*pair), most.coefficients(*pair), poorest[pair[1]])
        for pair in ((function.name, function.rotation) for function in grid.functions)
    )
    return tuple(sorted({mine for mine, limit, least in counts if mine == limit > least}))


def richer(model: FittedSum, every: list[FittedSum]) -> list[FittedSum]:
    """The models that can do all that one can, and more."""
    return [rung for rung in every if contains(rung.model, model.model)]


def first_adequate(
    grid: PolynomialGrid, every: list[FittedSum], test: Comparison
) -> tuple[FittedSum, Beaten]:
    """The model with the fewest parameters that no richer one beats, and the best of these.

    Richer ones are all that contain it; others with more parameters are compared by BIC. Each of
    the polynomials has more coefficients for the single functions that call for them. If every
    model is beaten, it is the richest of all.
    """
    for fit in sorted(every, key=lambda fit: fit.model.count):
        offer = fit if fit.model.numbers is None else grid.with_functions(fit, test)
        beaten = test.beaten(offer, richer(offer, every))
        if beaten.chance >= FALSE_STEP and not test.is_worse(offer, every):
            return offer, beaten
    richest = max(every, key=lambda fit: fit.model.count)
    return richest, Beaten(1.0, 0, "")
