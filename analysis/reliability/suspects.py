"""What the residuals of a fit make suspect: an observation, an event, the scatter of some readings, or the model."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from simulator.design import Design, Integers
from simulator.estimation.gauss_newton import Solution
from simulator.machines.protocol import Array, Unit
from simulator.threads import single_threaded

from .events import Groups, cause, event_groups, whole
from .leftover import HIDDEN, Columns, Leftover, leftover
from .names import name
from .patterns import Patterns, patterns
from .scatter import Scatter, log_chances, ratio, scatters, with_scatter
from .smooth import Smooth, smooth_errors
from .tails import log_chance, normal_equivalent

# Chance that anything at all is suspected where nothing is wrong: half for mistakes, half for all else.
FAMILY = 0.01

# How many are told at the most.
MOST = 10

# Residuals of this many standard uncertainties are rounding, of readings without noise.
ROUNDING = 1e-6

# A direction of which no more than this share is left is the same as what was taken out.
SAME = 1e-3

# Times by which a mistake must be less by chance than what a lacking model or a drift explains, or it is not named.
CLEARLY = math.log(1e4)

# Chance of the test of what is left, after suspects, by which these are withdrawn.
REMAINDER = 0.001


@dataclass(frozen=True)
class Suspect:
    """A cause that the residuals show: its `columns` among `patterns`, their sizes and standard uncertainties.

    `values` (m, rad or ratio) are estimated together with the other suspects'. `statistic` is that of a normal
    variable of the same chance, which exceeded `limit` when the cause was found. `alternatives` names what the
    readings cannot tell from it; `first` and `last` are readings that a slip may have come before.
    """

    patterns: Patterns
    columns: Integers
    values: Array
    standard_uncertainties: Array
    statistic: float
    limit: float
    alternatives: tuple[str, ...] = ()
    first: int = -1
    last: int = -1

    @property
    def largest(self) -> int:
        """Place of the most significant direction."""
        return int(np.argmax(np.abs(self.values) / self.standard_uncertainties))

    @property
    def pattern(self) -> int:
        return int(self.columns[self.largest])

    @property
    def value(self) -> float:
        return float(self.values[self.largest])

    @property
    def standard_uncertainty(self) -> float:
        return float(self.standard_uncertainties[self.largest])

    @property
    def unit(self) -> Unit:
        return self.patterns.unit(self.pattern)


@dataclass(frozen=True)
class MoreScatter:
    """Readings of one position or with one probe that scatter `times` as much as the others."""

    design: Design
    of: Scatter
    times: float
    statistic: float
    limit: float


@dataclass(frozen=True)
class Unexplained:
    """Residuals that no single mistake explains; `words` tell what does best, empty without anything."""

    words: str
    times: float
    statistic: float
    limit: float


@dataclass(frozen=True)
class Diagnosis:
    """What is suspected of observations, of the scatter of some readings, or of all of them together."""

    suspects: tuple[Suspect, ...] = ()
    scatter: MoreScatter | None = None
    unexplained: Unexplained | None = None

    def __bool__(self) -> bool:
        return bool(self.suspects or self.scatter or self.unexplained)


@single_threaded
def diagnosis(design: Design, solution: Solution, x: Array, freedom: int, sigma_is_estimated: bool) -> Diagnosis:
    """What is suspected of the observations that a solution was found from; the estimate itself stays what it is."""
    if freedom < 3 or solution.factor.sum_of_squares <= ROUNDING**2 * freedom:
        return Diagnosis()
    return Search(design, solution, x, freedom, sigma_is_estimated).found()


@dataclass(frozen=True)
class _Best:
    """The most significant event or smooth error: logarithm of its chance, and where it stands."""

    log_p: float
    group: int = -1
    place: int = -1


class Search:
    """Statistics of all patterns, less what the suspects found so far explain."""

    def __init__(
        self, design: Design, solution: Solution, x: Array, freedom: int, sigma_is_estimated: bool
    ) -> None:
        self.design, self.state, self.x = design, solution.state, x
        self.estimated = sigma_is_estimated
        self._prepare(leftover(design, solution.state, x, freedom))

    def _prepare(self, left: Leftover) -> None:
        self.left = self.start = left
        self.patterns = patterns(self.design, self.state, self.x, every_start=True)
        self.columns = Columns(self.patterns.matrix, left)
        self.groups: list[Groups] = event_groups(self.patterns)
        explained = [self.columns.explained(one.index) for one in self.groups]
        self.tests = max(int(sum((one.dimensions > 0).sum() for one in explained)), 1)
        self.smooth = [
            Smooth(one.words, _reduced(left, one.columns)) for one in smooth_errors(self.design, self.state, self.x)
        ]
        self.smooth = [one for one in self.smooth if one.columns.shape[1]]
        self.scatters = scatters(self.design)
        self.others = max(len(self.smooth) + len(self.scatters), 1)

    def statistics(self) -> Array:
        """Estimated biases (k,) in their standard uncertainties, 0 for what cannot be tested."""
        return self.columns.statistics()

    def _log_p(self, square: Array, dimensions: Array, left: Leftover | None = None) -> Array:
        """Logarithms of chances of sums of squares (k,), of what is `left`."""
        left = left or self.left
        total, freedom = left.sum_of_squares, left.freedom
        by_share = log_chance(square, total, dimensions, freedom, False)
        if self.estimated:
            return by_share
        by_size = log_chance(square, total, dimensions, freedom, True)
        # Stated uncertainties are believed where they explain what the suspect leaves.
        rest = np.array([log_chance(total - s, total, freedom - q, freedom, True) if freedom > q else 0.0
                         for s, q in zip(np.ravel(square), np.ravel(dimensions))]).reshape(np.shape(square))
        return np.where(rest > math.log(0.01), by_size, by_share)

    def best_event(self) -> _Best:
        best = _Best(0.0)
        for number, one in enumerate(self.groups):
            found = self.columns.explained(one.index)
            log_p = log_chance(
                found.square, self.left.sum_of_squares, found.dimensions, self.left.freedom, False
            )
            place = int(np.flatnonzero(log_p <= log_p.min() + 1e-9 * abs(log_p.min()))[0])
            value = float(self._log_p(found.square[[place]], found.dimensions[[place]])[0])
            if value < best.log_p - 1e-9 * abs(best.log_p):
                best = _Best(value, number, place)
        return best

    def smooth_chances(self, left: Leftover) -> Array:
        """Logarithms of the chances (k,) of all smooth errors."""
        return np.array([float(self._log_p(*_explained(left, one.columns), left)) for one in self.smooth])

    def found(self) -> Diagnosis:
        chosen: list[tuple[Integers, float, float]] = []
        scatter: MoreScatter | None = None
        taken = 0
        while True:
            limit = math.log(0.5 * FAMILY / self.tests)
            limit_others = math.log(0.5 * FAMILY / self.others)
            event = self.best_event()
            smooth = self.smooth_chances(self.left)
            scattered = log_chances(self.scatters, self.left)
            best_smooth, best_scatter = float(smooth.min(initial=0.0)), float(scattered.min(initial=0.0))
            rival = min(best_smooth, best_scatter)
            significant = event.log_p < limit and len(chosen) < MOST and self.left.freedom >= 3
            if significant and event.log_p - limit < rival - limit_others - CLEARLY:
                columns = self.groups[event.group].index[event.place]
                columns = self._with_other_directions(columns)
                chosen.append((columns, event.log_p, limit))
                self._take_out(columns)
                continue
            if rival < limit_others or significant:
                if scatter is None and best_scatter < best_smooth - CLEARLY and best_scatter < limit_others:
                    one = self.scatters[int(scattered.argmin())]
                    times = self._with_more(one)
                    scatter = MoreScatter(self.design, one, times, normal_equivalent(best_scatter), normal_equivalent(limit_others))
                    for columns, _, _ in chosen:
                        self._take_out(columns)
                    continue
                words = self.smooth[int(smooth.argmin())].words if best_smooth < limit_others else ""
                times = math.sqrt(self.start.sum_of_squares / self.start.freedom)
                return Diagnosis((), None, Unexplained(words, times, normal_equivalent(rival), normal_equivalent(limit_others)))
            return Diagnosis(tuple(self._told(chosen)), scatter)

    def _with_more(self, one: Scatter) -> float:
        """Weigh some readings by how much they scatter, and begin anew; how many times that is as much as stated."""
        times = 1.0
        plain = self.design
        for _ in range(4):
            times *= ratio(self.left, one.rows)
            self.design = with_scatter(plain, one, times)
            self.left = leftover(self.design, self.state, self.x, self.start.freedom)
        self._prepare(self.left)
        return times

    def _take_out(self, columns: Integers) -> None:
        dense = self.patterns.matrix[:, columns].toarray()
        self.left = self.left.without(dense)
        self.columns.update(self.left)

    def _with_other_directions(self, columns: Integers) -> Integers:
        """A cause in all its directions, where the others explain more."""
        every = whole(self.patterns, columns)
        if len(every) == len(columns):
            return columns
        rest = self.left.without(self.patterns.matrix[:, columns].toarray())
        square, q = _explained(rest, rest.of(self.patterns.matrix[:, every].toarray()))
        return every if q and float(self._log_p(square, q, rest)) < math.log(0.01) else columns

    def _told(self, chosen: list[tuple[Integers, float, float]]) -> Iterator[Suspect]:
        """The suspects with their sizes, estimated together."""
        if not chosen:
            return
        sigma = math.sqrt(self.left.sum_of_squares / self.left.freedom) if self.estimated else 1.0
        matrix = self.patterns.matrix[:, np.concatenate([columns for columns, _, _ in chosen])].toarray()
        size = np.sqrt((matrix**2).sum(axis=0))
        together = self.start.of(matrix / size)
        inverse = np.linalg.pinv(together, rcond=math.sqrt(HIDDEN))
        values = inverse @ self.start.residual / size
        uncertainties = sigma * np.sqrt((inverse**2).sum(axis=1)) / size
        at = 0
        for columns, log_p, limit in chosen:
            mine = slice(at, at + len(columns))
            at += len(columns)
            yield Suspect(
                self.patterns,
                columns,
                values[mine],
                uncertainties[mine],
                normal_equivalent(log_p),
                normal_equivalent(limit),
                self._alternatives(columns),
            )

    def _alternatives(self, columns: Integers) -> tuple[str, ...]:
        """Other causes that leave the same residuals."""
        mine = cause(self.patterns, columns)
        found: dict[tuple[str, tuple[int, ...], int], str] = {}
        for some in {tuple(columns.tolist()), tuple(whole(self.patterns, columns).tolist())}:
            without = Columns.__new__(Columns)
            without.__dict__.update(self.columns.__dict__)
            without.update(self.start)
            before = without.information
            without.update(self.start.without(self.patterns.matrix[:, list(some)].toarray()))
            gone = (without.information <= SAME * before) & (before > 0.0)
            for one in self.groups:
                if one.index.shape[1] != len(some):
                    continue
                for row in one.index[gone[one.index].all(axis=1)]:
                    other = cause(self.patterns, row)
                    if other != mine:
                        found.setdefault(other, other)
        return tuple(found.values())


def _reduced(left: Leftover, columns: Array) -> Array:
    """An orthonormal basis (n, q) of what is left of columns (n, k)."""
    from .leftover import orthonormal

    return orthonormal(left.of(columns), np.sqrt((columns**2).sum(axis=0)))


def _explained(left: Leftover, basis: Array) -> tuple[float, float]:
    """Sum of squares that a space explains, and its dimensions that are left."""
    from .leftover import orthonormal

    rest = basis - left.common @ (left.common.T @ basis) if basis.shape[1] else basis
    unit = orthonormal(rest, np.ones(rest.shape[1]))
    return float(((unit.T @ left.residual) ** 2).sum()), float(unit.shape[1])
