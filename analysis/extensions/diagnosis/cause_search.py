"""Search of a fit's residuals for their cause: gross errors, errors of the model, drifts, noise."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.computing import pinv, single_threaded
from ballplate.simulator.design import Design, State, expected_readings
from ballplate.simulator.estimation import Linearisation, linearise
from ballplate.simulator.machines import Array, Integers

from .bias_patterns import patterns
from .events import SLIP, Cause, all_directions, cause, event_groups
from .remainders import HIDDEN, Columns, Leftover, leftover, orthonormal
from .rivals import BELIEVED, LOG_ODDS_LIMIT, log_p
from .scatter import Scatter, log_chances, ratio, scatters, with_scatter
from .smooth import Smooth, smooth_errors
from .suspects import Diagnosis, MoreScatter, Suspect, Unexplained
from .tails import log_chance, normal_equivalent

# Significance level of the whole search: half for gross errors, half for everything else.
FAMILY = 0.01

# Largest number of gross errors in a diagnosis.
MOST = 10

# Residuals of readings without noise, in standard uncertainties: rounding.
ROUNDING = 1e-6

# A direction with at most this remaining share equals one that was removed.
SAME = 1e-3

# p-values below which a position is one of several that expand together, and a direction one of a
# cause's several.
TOGETHER, DIRECTIONS = math.log(1e-4), math.log(1e-2)

# p-value below which a smooth error explains more than a gross error that it contains.
CONTAINED = math.log(1e-2)

# Residuals below this share of the stated uncertainties are not attributed to the model, a drift or
# noise.
HARMLESS = 0.1

# Standard uncertainties from which on a machine error is not one of the noise only.
CLEAR_ERRORS = 10.0

# Squared standard deviations that bound the possible starts of a slip.
RANGE = 9.0

# Steps of the estimate of some readings' standard deviation.
WEIGHINGS = 4


@single_threaded
def diagnosis(at: Linearisation, x: Array, freedom: int, sigma_is_estimated: bool) -> Diagnosis:
    """Search the residuals of a linearised fit for their cause; the estimate itself does not
    change.

    Causes are spaces of biases, tested to first order by the sum of squares that they explain: by
    chi-squared if sigma is given and the remaining residuals are as stated, otherwise by Fisher's
    F. The limits are Bonferroni's for `FAMILY`. A gross error is removed if it is clearly less
    probable by chance than each smooth error and each increased noise, and the search is repeated.
    If the remaining residuals show smooth errors, no gross error is named, unless all are less than
    `HARMLESS` of the stated ones.
    """
    if freedom < 3 or at.factor.sum_of_squares <= ROUNDING**2 * freedom:
        return Diagnosis()
    return Search(at, x, freedom, sigma_is_estimated).diagnosis()


@dataclass(frozen=True)
class _Event:
    """The most significant event: logarithm of its p-value, and its patterns."""

    log_p: float
    columns: Integers


@dataclass(frozen=True)
class _Chosen:
    """A cause: patterns, logarithm of the p-value, possible starts of a slip, equivalent causes
    of its kind.
    """

    columns: Integers
    log_p: float
    range: tuple[int, int]
    equivalents: tuple[tuple[int, ...], ...]


class Search:
    """All tests of a fit's residuals, after removal of the causes found so far."""

    def __init__(self, at: Linearisation, x: Array, freedom: int, sigma_is_estimated: bool) -> None:
        self.design, self.state, self.x, self.estimated = at.design, at.state, x, sigma_is_estimated
        # Noise slightly determines directions that the nominal design does not: functions
        # of the noise itself, which would explain it.
        self.drawn = linearise(at.design)
        self.nominal = nominal = leftover(self.drawn, None, freedom)
        events = patterns(at.design, self.drawn.state, None, every_start=True)
        self.of_drawn = Columns(events.matrix, event_groups(events), nominal)
        start = leftover(at, x, freedom)
        # Rotations of a milliradian move readings by millimetres: smooth errors then show in
        # directions that the nominal design hides, which noise itself does not determine.
        variance = start.sum_of_squares / freedom if sigma_is_estimated else 1.0
        u = at.of_shared(np.eye(len(at.layout))[at.layout.model])
        is_clear = at.state.a**2 > CLEAR_ERRORS**2 * variance * u**2
        machine = replace(self.drawn.state, a=np.where(is_clear, at.state.a, 0.0))
        expected = _expected(at.design, machine)
        linearised = linearise(at.design, machine, expected, self.drawn.spectrum)
        shown = leftover(linearised, expected, freedom)
        self.dimensions = [
            basis_of(shown, smooth.columns).shape[1]
            for smooth in smooth_errors(at.design, self.drawn.state)
        ]
        self.sum_of_squares, self.freedom = start.sum_of_squares, freedom
        self._begin(start)

    def _begin(self, start: Leftover) -> None:
        self.left = self.start = start
        self.width = start.common.shape[1]
        self.patterns = patterns(self.design, self.state, self.x, every_start=True)
        self.groups = event_groups(self.patterns)
        self.columns = Columns(self.patterns.matrix, self.groups, start, self.of_drawn)
        self.tests = max(self.columns.tests(), 1)
        # Residuals are independent of the estimate, but not of the readings. Therefore directions
        # are those at the readings that the estimate expects.
        expected = _expected(self.design, self.state)
        linearised = linearise(self.design, self.state, expected, self.drawn.spectrum)
        self.expected = leftover(linearised, expected, start.freedom)
        smooths = smooth_errors(self.design, self.state)
        reduced = [
            replace(smooth, columns=self.visible(smooth.columns, most))
            for smooth, most in zip(smooths, self.dimensions, strict=True)
        ]
        self.smooth = [smooth for smooth in reduced if smooth.columns.shape[1]]
        self.scatters = scatters(self.design)
        self.other_tests = max(len(self.smooth) + len(self.scatters), 1)

    def visible(self, columns: Array, most: int) -> Array:
        """Return a basis (n, q) of what residuals show of biases (n, k), in `most` directions."""
        return basis_of(self.start, basis_of(self.expected, columns, most))

    @property
    def limit(self) -> float:
        """Logarithm of the significance level of a gross error."""
        return math.log(0.5 * FAMILY / self.tests)

    @property
    def other_limit(self) -> float:
        """Logarithm of the significance level of any other cause."""
        return math.log(0.5 * FAMILY / self.other_tests)

    def diagnosis(self) -> Diagnosis:
        """Search until no further gross error is significant."""
        chosen: list[_Chosen] = []
        scatter = None
        while True:
            event = self._best_event()
            smooth = self._smooth_chances(event)
            of_each_scatter = log_chances(self.scatters, self.left, self.estimated)
            of_smooth, of_scatter = (
                float(smooth.min(initial=0.0)),
                float(of_each_scatter.min(initial=0.0)),
            )
            alternative = min(of_smooth, of_scatter)
            significant = event.log_p < self.limit and len(chosen) < MOST and self.left.freedom >= 3
            if significant and event.log_p < alternative - LOG_ODDS_LIMIT:
                columns = self._testable(self._with_other_directions(self._together(event.columns)))
                chosen.append(
                    _Chosen(columns, event.log_p, self._range(columns), self._equivalents(columns))
                )
                self._remove(columns)
            elif self.left.sum_of_squares < HARMLESS**2 * self.left.freedom:
                return Diagnosis(tuple(self._suspects(chosen)), scatter)
            elif scatter is None and of_scatter < min(self.other_limit, of_smooth - LOG_ODDS_LIMIT):
                noisiest, limit = self.scatters[int(of_each_scatter.argmin())], self.other_limit
                times = self._weigh(noisiest)
                scatter = MoreScatter(
                    self.design,
                    noisiest,
                    times,
                    normal_equivalent(of_scatter),
                    normal_equivalent(limit),
                )
                for earlier in chosen:
                    self._remove(earlier.columns)
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
                return Diagnosis(tuple(self._suspects(chosen)), scatter)

    def _unexplained(self, words: str, log_p: float, limit: float) -> Unexplained:
        """Return the statement on residuals that no gross error explains, before any weighing."""
        total, freedom = self.sum_of_squares, self.freedom
        too_large = float(log_chance(total, total, freedom, freedom, True)) < BELIEVED
        statistics = normal_equivalent(log_p), normal_equivalent(limit)
        return Unexplained(words, math.sqrt(total / freedom), too_large, *statistics)

    def log_p(self, square: float, dimensions: float, remainder: Leftover) -> float:
        """Return the logarithm of the p-value of a sum of squares among the residuals
        `remainder`.
        """
        total, freedom = remainder.sum_of_squares, remainder.freedom
        return log_p(square, dimensions, total, freedom, self.estimated)

    def _best_event(self) -> _Event:
        """Return the event with the smallest p-value; of equal ones, the first."""
        best = _Event(0.0, np.zeros(0, np.int64))
        total, freedom = self.left.sum_of_squares, self.left.freedom
        for number, group in enumerate(self.groups):
            explained = self.columns.explained(number)
            log_chances_of_group = log_chance(
                explained.square, total, explained.dimensions, freedom, False
            )
            best_index = int(
                np.flatnonzero(log_chances_of_group <= log_chances_of_group.min() * (1.0 - 1e-9))[0]
            )
            found = self.log_p(
                explained.square[best_index], explained.dimensions[best_index], self.left
            )
            if found < best.log_p * (1.0 + 1e-9):
                best = _Event(found, group[best_index])
        return best

    def _smooth_chances(self, event: _Event) -> Array:
        """Return logarithms of the p-values (k,) of all smooth errors as alternatives to an event.

        A smooth error that contains the event is an alternative only if it explains more than the
        event.
        """
        event_basis = basis_of(self.left, self._dense(event.columns))
        chances = np.zeros(len(self.smooth))
        for k, smooth in enumerate(self.smooth):
            basis = further_basis(self.left, smooth.columns, self.width)
            chances[k] = self.log_p(*explained_by(self.left, basis), self.left)
            beyond = event_basis - basis @ (basis.T @ event_basis)
            if event_basis.shape[1] and (beyond**2).sum() <= SAME:
                further_log_p = self._conditional(event.columns, basis)
                chances[k] = min(chances[k], event.log_p) if further_log_p < CONTAINED else 0.0
        return chances

    def _is_part(self, smooth: Smooth, columns: Integers) -> bool:
        """Return whether a smooth error is merely a cause in one of its directions."""
        if smooth.columns.shape[1] > len(columns):
            return False
        cause_basis = basis_of(self.start, self._dense(columns))
        remainder = smooth.columns - cause_basis @ (cause_basis.T @ smooth.columns)
        return bool(((remainder**2).sum(axis=0) <= SAME).all())

    def _dense(self, columns: Integers) -> Array:
        return self.patterns.matrix[:, columns].toarray()

    def _remove(self, columns: Integers) -> None:
        self.left = self.left.without(self._dense(columns))
        self.columns.update(self.left)

    def _weigh(self, scatter: Scatter) -> float:
        """Estimate the noise of some readings, restart with their weights, and return the ratio
        to the stated noise.
        """
        times, stated_design, remainder = 1.0, self.design, self.left
        for _ in range(WEIGHINGS):
            times *= ratio(remainder, scatter.rows)
            self.design = with_scatter(stated_design, scatter, times)
            linearised = linearise(self.design, self.state, self.x, self.drawn.spectrum)
            remainder = leftover(linearised, self.x, self.start.freedom)
        self._begin(remainder)
        return times

    def _conditional(self, removed: Integers, biases: Array) -> float:
        """Return the logarithm of the p-value of biases (n, k) after removal of some patterns."""
        remainder = self.left.without(self._dense(removed))
        return self.log_p(*explained_by(remainder, basis_of(remainder, biases)), remainder)

    def _together(self, columns: Integers) -> Integers:
        """Return those of several expanding positions, or distances in error, that are
        significant given the others.
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
        """Return a cause in all its directions if the others explain more."""
        every = all_directions(self.patterns, columns)
        if len(every) == len(columns):
            return columns
        return every if self._conditional(columns, self._dense(every)) < DIRECTIONS else columns

    def _testable(self, columns: Integers) -> Integers:
        """Return the directions of a cause that show separately, the most visible one first."""
        if len(columns) == 1:
            return columns
        dense = self._dense(columns)
        size = np.linalg.norm(dense, axis=0)
        size[size == 0.0] = 1.0
        remainder, is_chosen = self.left.of(dense / size), np.zeros(len(columns), bool)
        while True:
            share = np.where(is_chosen, 0.0, (remainder**2).sum(axis=0))
            most = int(np.flatnonzero(share >= share.max() * (1.0 - 1e-6))[0])
            if share[most] <= HIDDEN:
                return columns[is_chosen]
            is_chosen[most] = True
            unit = remainder[:, most] / np.sqrt(share[most])
            remainder = remainder - unit[:, None] * (unit @ remainder)

    def _range(self, columns: Integers) -> tuple[int, int]:
        """Return the first and last reading before which a slip may have come, -1 without a
        slip.
        """
        slip = cause(self.patterns, columns)
        if slip.kind != "slip":
            return -1, -1
        all_patterns, wide = self.patterns, len(all_directions(self.patterns, columns))
        is_slip = np.isin(all_patterns.kind, SLIP)
        number = next(
            k for k, one in enumerate(self.groups) if one.shape[1] == wide and is_slip[one[0]].all()
        )
        group = self.groups[number]
        starts_here = np.flatnonzero(all_patterns.subject[group[:, 0]] == slip.subjects[0])
        square = self.columns.explained(number).square[starts_here]
        # The range has all starts that leave at most `RANGE` variances more than the best.
        variance = (
            (self.left.sum_of_squares - square.max()) / self.left.freedom if self.estimated else 1.0
        )
        starts = all_patterns.start[
            group[starts_here[square >= square.max() - RANGE * variance], 0]
        ]
        return min(int(starts.min()), slip.start), max(int(starts.max()), slip.start)

    def _equivalents(self, columns: Integers) -> tuple[tuple[int, ...], ...]:
        """Return groups of distances of other balls that explain as much as the given distances
        of one ball.
        """
        if len(columns) == 1 or self.patterns.kind[columns[0]] != "distance":
            return ()
        equivalents, dense = [], self._dense(columns)
        for group in self.groups:
            if group.shape[1] > 1 and self.patterns.kind[group[0, 0]] == "distance":
                candidates = (row for row in group if not np.array_equal(row, columns))
                equivalents += [
                    tuple(row.tolist())
                    for row in candidates
                    if self._conditional(row, dense) > CONTAINED
                ]
        return tuple(equivalents)

    def _suspects(self, chosen: list[_Chosen]) -> Iterator[Suspect]:
        """Return the suspects with their sizes, estimated together."""
        if not chosen:
            return
        sigma = math.sqrt(self.left.sum_of_squares / self.left.freedom) if self.estimated else 1.0
        matrix = self._dense(np.concatenate([cause_found.columns for cause_found in chosen]))
        size = np.linalg.norm(matrix, axis=0)
        inverse = pinv(self.start.of(matrix / size), rcond=HIDDEN)
        values = inverse @ self.start.residual / size
        uncertainties = sigma * np.linalg.norm(inverse, axis=1) / size
        first_row = 0
        for cause_found in chosen:
            rows = slice(first_row, first_row + len(cause_found.columns))
            first_row = rows.stop
            yield Suspect(
                self.patterns,
                cause_found.columns,
                values[rows],
                uncertainties[rows],
                normal_equivalent(cause_found.log_p),
                normal_equivalent(self.limit),
                tuple(
                    dict.fromkeys(
                        [*self._alternatives(cause_found.columns), *cause_found.equivalents]
                    )
                ),
                tuple(
                    dict.fromkeys(
                        smooth.words
                        for smooth in self.smooth
                        if self._is_part(smooth, cause_found.columns)
                    )
                ),
                *cause_found.range,
            )

    def _alternatives(self, columns: Integers) -> tuple[tuple[int, ...], ...]:
        """Return patterns of other causes that leave the same residuals."""
        own_cause = cause(self.patterns, columns)
        alternatives: dict[Cause, tuple[int, ...]] = {}
        self.columns.update(self.start)
        before = self.columns.information
        every = all_directions(self.patterns, columns)
        for removed in [columns] if len(every) == len(columns) else [columns, every]:
            self.columns.update(self.start.without(self._dense(removed)))
            is_gone = (self.columns.information <= SAME * before) & (before > 0.0)
            for group in self.groups:
                if group.shape[1] != len(removed):
                    continue
                for row in group[is_gone[group].all(axis=1)]:
                    alternative = cause(self.patterns, row)
                    if alternative != own_cause:
                        alternatives.setdefault(alternative, tuple(row.tolist()))
        return tuple(alternatives.values())


def _expected(design: Design, state: State) -> Array:
    """Return the scale readings (m, d) that a state lets expect, with its machine errors."""
    offsets = state.probes[design.readings.probe]
    x = expected_readings(design, state, design.readings)
    return x + offsets - design.model.error(x, state.a, offsets)


def basis_of(remainder: Leftover, columns: Array, most: int | None = None) -> Array:
    """Return an orthonormal basis (n, q) of the remainder of columns (n, k), as `orthonormal`."""
    return orthonormal(remainder.of(columns), np.linalg.norm(columns, axis=0), most)


def further_basis(remainder: Leftover, basis: Array, since: int) -> Array:
    """Return the part of an orthonormal basis orthogonal to all removed columns but the first
    `since`.
    """
    later = remainder.common[:, since:]
    if not later.shape[1]:
        return basis
    return orthonormal(basis - later @ (later.T @ basis), np.ones(basis.shape[1]))


def explained_by(remainder: Leftover, basis: Array) -> tuple[float, float]:
    """Return the sum of squares that an orthonormal `basis` (n, q) explains, and its dimensions."""
    return float(((basis.T @ remainder.residual) ** 2).sum()), float(basis.shape[1])
