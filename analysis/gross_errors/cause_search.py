"""Search of a fit's residuals for their cause, among mistakes, errors of the model, drifts and
scatter.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.machines.protocol import Array, Integers

from .bias_patterns import patterns
from .events import SLIP, Cause, cause, event_groups, whole
from .remainders import HIDDEN, Columns, Leftover, leftover, orthonormal
from .scatter import Scatter, log_chances, ratio, scatters, with_scatter
from .smooth import Smooth, smooth_errors
from .suspects import Diagnosis, MoreScatter, Suspect, Unexplained
from .tails import log_chance, normal_equivalent

# Chance that anything at all is suspected where nothing is wrong: half for mistakes, half for all
# else.
FAMILY = 0.01

# How many are told at the most.
MOST = 10

# Residuals of this many standard uncertainties are rounding, of readings without noise.
ROUNDING = 1e-6

# A direction of which no more than this share is left is the same as what was taken out.
SAME = 1e-3

# Times by which a mistake must be less by chance than what a lacking model or a drift explains, or
# it is not named.
LOG_ODDS_LIMIT = math.log(1000.0)

# Chance below which a position is one of several that expand together, and a direction one of a
# cause's several.
TOGETHER, DIRECTIONS = math.log(1e-4), math.log(1e-2)

# Chance below which a smooth error that contains a mistake explains more than that.
CONTAINED = math.log(1e-2)

# Stated uncertainties are believed where what a suspect leaves has at least this chance.
BELIEVED = math.log(1e-2)

# Residuals that are less than this of the stated uncertainties are not laid to the model, a drift
# or noise.
HARMLESS = 0.1

# Squared standard deviations within which the moments of a slip are told.
RANGE = 9.0

# Steps in which the scatter of some readings is estimated.
WEIGHINGS = 4


@single_threaded
def diagnosis(at: Linearisation, x: Array, freedom: int, sigma_is_estimated: bool) -> Diagnosis:
    """What is suspected of the observations behind a linearised fit; the estimate itself stays what
    it is.

    Causes are spaces of biases, tested to first order by what they explain of the residuals: by
    chi-squared where sigma is given and what they leave is as stated, otherwise by Fisher's F. The
    limits are Bonferroni's for `FAMILY`. A mistake is taken out if it is clearly less by chance
    than each smooth error and each scatter, and what it leaves is searched anew; if what is left at
    the end shows smooth errors, no mistake is named at all, unless all that is left is less than
    `HARMLESS` of what is stated.
    """
    if freedom < 3 or at.factor.sum_of_squares <= ROUNDING**2 * freedom:
        return Diagnosis()
    return Search(at, x, freedom, sigma_is_estimated).found()


@dataclass(frozen=True)
class _Event:
    """The most significant event: logarithm of its chance, and its patterns."""

    log_p: float
    columns: Integers


@dataclass(frozen=True)
class _Chosen:
    """A cause as it was found: its patterns, the logarithm of its chance, a slip's moments, and
    causes of the kind that explain as much.
    """

    columns: Integers
    log_p: float
    range: tuple[int, int]
    others: tuple[tuple[int, ...], ...]


class Search:
    """All tests of a fit's residuals, less what the causes found so far explain."""

    def __init__(self, at: Linearisation, x: Array, freedom: int, sigma_is_estimated: bool) -> None:
        self.design, self.state, self.x, self.estimated = at.design, at.state, x, sigma_is_estimated
        # Of what the design as drawn does not determine at all noise leaves a little: a direction
        # that is nothing but a function of the noise, and that would explain it.
        self.drawn = linearise(at.design)
        left = leftover(self.drawn, None, freedom)
        every = patterns(at.design, self.drawn.state, None, every_start=True)
        self.of_drawn = Columns(every.matrix, event_groups(every), left)
        self.dimensions = [
            _basis(left, one.columns).shape[1] for one in smooth_errors(at.design, self.drawn.state)
        ]
        left = leftover(at, x, freedom)
        self.sum_of_squares, self.freedom = left.sum_of_squares, freedom
        self._begin(left)

    def _begin(self, left: Leftover) -> None:
        self.left = self.start = left
        self.width = left.common.shape[1]
        self.patterns = patterns(self.design, self.state, self.x, every_start=True)
        self.groups = event_groups(self.patterns)
        self.columns = Columns(self.patterns.matrix, self.groups, left, self.of_drawn)
        self.tests = max(self.columns.tests(), 1)
        # Residuals are independent of all that is estimated, but not of the readings. Therefore
        # directions are those at the readings that the estimate expects.
        at = linearise(self.design, self.state, None, self.drawn.spectrum)
        expected = leftover(at, None, left.freedom)
        every = smooth_errors(self.design, self.state)
        reduced = [
            Smooth(one.words, _basis(left, _basis(expected, one.columns, most)))
            for one, most in zip(every, self.dimensions, strict=True)
        ]
        self.smooth = [one for one in reduced if one.columns.shape[1]]
        self.scatters = scatters(self.design)
        self.other_tests = max(len(self.smooth) + len(self.scatters), 1)

    @property
    def limit(self) -> float:
        """Logarithm of the chance below which a mistake is suspected."""
        return math.log(0.5 * FAMILY / self.tests)

    @property
    def other_limit(self) -> float:
        """Logarithm of the chance below which anything else is suspected."""
        return math.log(0.5 * FAMILY / self.other_tests)

    def found(self) -> Diagnosis:
        """The diagnosis."""
        chosen: list[_Chosen] = []
        scatter: MoreScatter | None = None
        while True:
            event = self._best_event()
            smooth = self._smooth_chances(event)
            scattered = log_chances(self.scatters, self.left, self.estimated)
            of_smooth, of_scatter = (
                float(smooth.min(initial=0.0)),
                float(scattered.min(initial=0.0)),
            )
            alternative = min(of_smooth, of_scatter)
            significant = event.log_p < self.limit and len(chosen) < MOST and self.left.freedom >= 3
            if significant and event.log_p < alternative - LOG_ODDS_LIMIT:
                columns = self._testable(self._with_other_directions(self._together(event.columns)))
                chosen.append(
                    _Chosen(columns, event.log_p, self._range(columns), self._as_good(columns))
                )
                self._take_out(columns)
            elif self.left.sum_of_squares < HARMLESS**2 * self.left.freedom:
                return Diagnosis(tuple(self._told(chosen)), scatter)
            elif scatter is None and of_scatter < min(self.other_limit, of_smooth - LOG_ODDS_LIMIT):
                one, limit = self.scatters[int(scattered.argmin())], self.other_limit
                times = self._weigh(one)
                scatter = MoreScatter(
                    self.design, one, times, normal_equivalent(of_scatter), normal_equivalent(limit)
                )
                for earlier in chosen:
                    self._take_out(earlier.columns)
            elif alternative < self.other_limit:
                words = (
                    self.smooth[int(smooth.argmin())].words if of_smooth < self.other_limit else ""
                )
                return Diagnosis(
                    (), scatter, self._unexplained(words, alternative, self.other_limit)
                )
            elif significant:
                return Diagnosis((), scatter, self._unexplained("", event.log_p, self.limit))
            else:
                return Diagnosis(tuple(self._told(chosen)), scatter)

    def _unexplained(self, words: str, log_p: float, limit: float) -> Unexplained:
        """What is told of residuals that no mistake explains, as they were before anything was
        weighed.
        """
        total, freedom = self.sum_of_squares, self.freedom
        too_large = float(log_chance(total, total, freedom, freedom, True)) < BELIEVED
        statistics = normal_equivalent(log_p), normal_equivalent(limit)
        return Unexplained(words, math.sqrt(total / freedom), too_large, *statistics)

    def _log_p(self, square: float, dimensions: float, left: Leftover) -> float:
        """Logarithm of the chance of a sum of squares, of what is `left`."""
        total, freedom = left.sum_of_squares, left.freedom
        rest = log_chance(total - square, total, freedom - dimensions, freedom, True)
        by_size = not self.estimated and float(rest) > BELIEVED
        return float(log_chance(square, total, dimensions, freedom, by_size))

    def _best_event(self) -> _Event:
        """The event that is least by chance; of those that are the same, the first."""
        best = _Event(0.0, np.zeros(0, np.int64))
        total, freedom = self.left.sum_of_squares, self.left.freedom
        for number, group in enumerate(self.groups):
            found = self.columns.explained(number)
            chances = log_chance(found.square, total, found.dimensions, freedom, False)
            place = int(np.flatnonzero(chances <= chances.min() * (1.0 - 1e-9))[0])
            log_p = self._log_p(found.square[place], found.dimensions[place], self.left)
            if log_p < best.log_p * (1.0 + 1e-9):
                best = _Event(log_p, group[place])
        return best

    def _smooth_chances(self, event: _Event) -> Array:
        """Logarithms of the chances (k,) of all smooth errors as alternatives to an event.

        One that contains the event is its alternative only if the rest of it explains something
        as well.
        """
        taken = _basis(self.left, self._dense(event.columns))
        found = np.zeros(len(self.smooth))
        for place, one in enumerate(self.smooth):
            basis = _further(self.left, one.columns, self.width)
            found[place] = self._log_p(*_explained(self.left, basis), self.left)
            beyond = taken - basis @ (basis.T @ taken)
            if taken.shape[1] and (beyond**2).sum() <= SAME:
                rest = self._conditional(event.columns, basis)
                found[place] = min(found[place], event.log_p) if rest < CONTAINED else 0.0
        return found

    def _is_part(self, smooth: Smooth, columns: Integers) -> bool:
        """Whether a smooth error is nothing but a cause, in one of its directions."""
        if smooth.columns.shape[1] > len(columns):
            return False
        taken = _basis(self.start, self._dense(columns))
        rest = smooth.columns - taken @ (taken.T @ smooth.columns)
        return bool(((rest**2).sum(axis=0) <= SAME).all())

    def _dense(self, columns: Integers) -> Array:
        return self.patterns.matrix[:, columns].toarray()

    def _take_out(self, columns: Integers) -> None:
        self.left = self.left.without(self._dense(columns))
        self.columns.update(self.left)

    def _weigh(self, scatter: Scatter) -> float:
        """Weigh some readings by how much they scatter, and begin anew; how many times that is as
        much as stated.
        """
        times, plain, left = 1.0, self.design, self.left
        for _ in range(WEIGHINGS):
            times *= ratio(left, scatter.rows)
            self.design = with_scatter(plain, scatter, times)
            at = linearise(self.design, self.state, self.x, self.drawn.spectrum)
            left = leftover(at, self.x, self.start.freedom)
        self._begin(left)
        return times

    def _conditional(self, given: Integers, more: Array) -> float:
        """Logarithm of the chance of what biases (n, k) explain beside some patterns."""
        rest = self.left.without(self._dense(given))
        return self._log_p(*_explained(rest, _basis(rest, more)), rest)

    def _together(self, columns: Integers) -> Integers:
        """Of positions that expand, or distances that are wrong, together, those without each of
        which the residuals are significantly larger.
        """
        while len(columns) > 1 and self.patterns.kind[columns[0]] in ("expansion", "distance"):
            chances = [
                self._conditional(np.delete(columns, k), self._dense(columns[[k]]))
                for k in range(len(columns))
            ]
            worst = int(np.argmax(chances))
            if chances[worst] < TOGETHER:
                break
            columns = np.delete(columns, worst)
        return columns

    def _with_other_directions(self, columns: Integers) -> Integers:
        """A cause in all its directions, where the others explain more."""
        every = whole(self.patterns, columns)
        if len(every) == len(columns):
            return columns
        return every if self._conditional(columns, self._dense(every)) < DIRECTIONS else columns

    def _testable(self, columns: Integers) -> Integers:
        """Of a cause's directions those that show beside each other, the one of which most is left
        first.
        """
        if len(columns) == 1:
            return columns
        dense = self._dense(columns)
        size = np.linalg.norm(dense, axis=0)
        size[size == 0.0] = 1.0
        rest, kept = self.left.of(dense / size), np.zeros(len(columns), bool)
        while True:
            share = np.where(kept, 0.0, (rest**2).sum(axis=0))
            most = int(np.flatnonzero(share >= share.max() * (1.0 - 1e-6))[0])
            if share[most] <= HIDDEN:
                return columns[kept]
            kept[most] = True
            unit = rest[:, most] / np.sqrt(share[most])
            rest = rest - unit[:, None] * (unit @ rest)

    def _range(self, columns: Integers) -> tuple[int, int]:
        """First and last reading that a slip may have come before, -1 for what is no slip.

        Starts belong to the range that leave no more than `RANGE` variances more than the best.
        """
        mine = cause(self.patterns, columns)
        if mine.kind != "slip":
            return -1, -1
        given, wide = self.patterns, len(whole(self.patterns, columns))
        is_slip = np.isin(given.kind, SLIP)
        number = next(
            k for k, one in enumerate(self.groups) if one.shape[1] == wide and is_slip[one[0]].all()
        )
        group = self.groups[number]
        here = np.flatnonzero(given.subject[group[:, 0]] == mine.subjects[0])
        square = self.columns.explained(number).square[here]
        variance = (
            (self.left.sum_of_squares - square.max()) / self.left.freedom if self.estimated else 1.0
        )
        starts = given.start[group[here[square >= square.max() - RANGE * variance], 0]]
        return min(int(starts.min()), mine.start), max(int(starts.max()), mine.start)

    def _as_good(self, columns: Integers) -> tuple[tuple[int, ...], ...]:
        """Of several certified distances, those of other balls that leave nothing significant of
        the residuals that these explain, though they are other directions.
        """
        if len(columns) == 1 or self.patterns.kind[columns[0]] != "distance":
            return ()
        found, dense = [], self._dense(columns)
        for group in self.groups:
            if group.shape[1] > 1 and self.patterns.kind[group[0, 0]] == "distance":
                others = (row for row in group if not np.array_equal(row, columns))
                found += [
                    tuple(row.tolist())
                    for row in others
                    if self._conditional(row, dense) > CONTAINED
                ]
        return tuple(found)

    def _told(self, chosen: list[_Chosen]) -> Iterator[Suspect]:
        """The suspects with their sizes, estimated together."""
        if not chosen:
            return
        sigma = math.sqrt(self.left.sum_of_squares / self.left.freedom) if self.estimated else 1.0
        matrix = self._dense(np.concatenate([one.columns for one in chosen]))
        size = np.linalg.norm(matrix, axis=0)
        inverse = np.linalg.pinv(self.start.of(matrix / size), rcond=HIDDEN)
        values = inverse @ self.start.residual / size
        uncertainties = sigma * np.linalg.norm(inverse, axis=1) / size
        at = 0
        for one in chosen:
            mine = slice(at, at + len(one.columns))
            at = mine.stop
            yield Suspect(
                self.patterns,
                one.columns,
                values[mine],
                uncertainties[mine],
                normal_equivalent(one.log_p),
                normal_equivalent(self.limit),
                tuple(dict.fromkeys([*self._alternatives(one.columns), *one.others])),
                tuple(
                    dict.fromkeys(
                        other.words for other in self.smooth if self._is_part(other, one.columns)
                    )
                ),
                *one.range,
            )

    def offset(self, probe: int, excess: Array, statistic: float, limit: float) -> Suspect | None:
        """A probe's offset as a suspect that was stated by an `excess` (d,) larger than here; None
        where it hardly shows.
        """
        given = self.patterns
        columns = given.of_kind("probe")
        columns = self._testable(columns[given.subject[columns] == probe])
        if not len(columns):
            return None
        (suspect,) = self._told([_Chosen(columns, 0.0, (-1, -1), ())])
        values = suspect.values + excess[given.axis[columns]]
        return replace(suspect, values=values, statistic=statistic, limit=limit)

    def _alternatives(self, columns: Integers) -> tuple[tuple[int, ...], ...]:
        """Patterns of other causes that leave the same residuals."""
        mine = cause(self.patterns, columns)
        found: dict[Cause, tuple[int, ...]] = {}
        self.columns.update(self.start)
        before = self.columns.information
        every = whole(self.patterns, columns)
        for some in [columns] if len(every) == len(columns) else [columns, every]:
            self.columns.update(self.start.without(self._dense(some)))
            gone = (self.columns.information <= SAME * before) & (before > 0.0)
            for group in self.groups:
                if group.shape[1] != len(some):
                    continue
                for row in group[gone[group].all(axis=1)]:
                    other = cause(self.patterns, row)
                    if other != mine:
                        found.setdefault(other, tuple(row.tolist()))
        return tuple(found.values())


def _basis(left: Leftover, columns: Array, most: int | None = None) -> Array:
    """An orthonormal basis (n, q) of what is left of columns (n, k), as `orthonormal`."""
    return orthonormal(left.of(columns), np.linalg.norm(columns, axis=0), most)


def _further(left: Leftover, basis: Array, since: int) -> Array:
    """What is left of an orthonormal basis that is orthogonal to the first `since` columns taken
    out.
    """
    later = left.common[:, since:]
    if not later.shape[1]:
        return basis
    return orthonormal(basis - later @ (later.T @ basis), np.ones(basis.shape[1]))


def _explained(left: Leftover, basis: Array) -> tuple[float, float]:
    """Sum of squares that an orthonormal `basis` (n, q) explains, and its dimensions."""
    return float(((basis.T @ left.residual) ** 2).sum()), float(basis.shape[1])
