"""Search of a fit's residuals for their causes: one list of hypotheses, one measure, one answer.

Hypotheses are spaces of biases, tested to first order by the sum of squares of the residuals that
they explain. The best one is removed, and the search is repeated with what remains.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from ballplate.simulator.computing import pinv, single_threaded, svd
from ballplate.simulator.estimation import Linearisation, estimate, linearise, linearised_fit
from ballplate.simulator.machines import Array, Integers

from .bias_patterns import patterns
from .events import ASSUMED, Cause, all_directions, cause, event_groups
from .hypotheses import CHAIN, PossibleCause, hypotheses
from .remainders import HIDDEN, Columns, Explained, Leftover, leftover
from .scatter import Scatter, log_chances, ratio, scatters, with_scatter
from .tails import log_chance

# Significance level of the whole search: half for single observations and events, half for
# assumptions, terms of the model and noise.
FAMILY = 0.01

# Odds by which a cause must be more probable than each of the others to be named.
LOG_ODDS_LIMIT = math.log(1000.0)

# Stated uncertainties are accepted if the residuals without a cause have at least this p-value.
BELIEVED = math.log(1e-2)

# Largest number of causes.
MOST = 10

# Residuals of readings without noise, in standard uncertainties: rounding.
ROUNDING = 1e-6

# Share of a hypothesis's direction that residuals must show; share below which it is part of
# another one.
SHOWN, SAME = 1e-6, 1e-3

# p-values below which a position is one of several that expand together, and a direction one of a
# cause's several.
TOGETHER, DIRECTIONS = math.log(1e-4), math.log(1e-2)

# p-value below which a smooth error explains more than a cause that it contains.
CONTAINED = math.log(1e-2)

# Residuals below this share of the stated uncertainties have no further cause.
HARMLESS = 0.1

# Excess of the sum of squares, in variances, up to which another cause is not told apart.
APART = 9.0

# Assumptions of which a failure explains nearly any residuals: it leaves nothing, or is none.
WIDE_ASSUMED = (CHAIN, "reproducibility")

# Steps of the estimate of some readings' standard deviation.
WEIGHINGS = 4


@dataclass(frozen=True)
class FoundCause:
    """A cause: `columns` of the patterns, or a `hypothesis`, with its biases (n, k).

    `log_p` and its `limit` are logarithms of p-values, `sigma` the root of the mean square of what
    remains. `others` and `of_others` are causes not told apart from it. A slip came between the
    readings `first` and `last`. `of_exact`: a value stated as exact.
    """

    biases: Array
    log_p: float
    limit: float
    columns: Integers = field(default_factory=lambda: np.zeros(0, np.int64))
    hypothesis: PossibleCause | None = None
    others: tuple[Integers, ...] = ()
    of_others: tuple[PossibleCause, ...] = ()
    first: int = -1
    last: int = -1
    sigma: float = math.nan
    of_exact: bool = False

    @property
    def p_value(self) -> float:
        """The p-value times the number of tests."""
        return min(0.5 * FAMILY * math.exp(min(self.log_p - self.limit, 100.0)), 1.0)


@single_threaded
def searched(at: Linearisation, x: Array, sigma_is_estimated: bool) -> Search | None:
    """Return the finished search of a linearised fit's residuals; None without residuals."""
    freedom = at.degrees_of_freedom
    if freedom < 3 or at.factor.sum_of_squares <= ROUNDING**2 * freedom:
        return None
    return Search(at, x, sigma_is_estimated).run()


class Search:
    """All tests of a fit's residuals; after `run`, the causes `found`, one of the `model` that
    explains the residuals instead, and readings with more noise.
    """

    def __init__(
        self, at: Linearisation, x: Array, sigma_is_estimated: bool, removed: Array | None = None
    ) -> None:
        """Begin a search; with biases `removed` already, wide ones, there are no further wide
        causes.
        """
        self.at, self.design, self.state, self.x = at, at.design, at.state, x
        self.estimated, self.is_last = sigma_is_estimated, removed is not None
        self.found: list[FoundCause] = []
        self.model: FoundCause | None = None
        self.scatter: tuple[Scatter, float, FoundCause] | None = None
        start = leftover(at, x, at.degrees_of_freedom)
        self._begin(start if removed is None else start.without(removed))

    def _begin(self, start: Leftover) -> None:
        self.left = self.start = start
        self.patterns = patterns(self.design, self.state, self.x, every_start=True)
        self.groups = event_groups(self.patterns)
        self.columns = Columns(self.patterns.matrix, self.groups, start)
        self.hypotheses = list(hypotheses(self.design, self.state))
        self.bases = [basis_of(start, each.biases) for each in self.hypotheses]
        self.scatters = scatters(self.design)
        self.is_assumed = [
            np.isin(self.patterns.kind[group[:, 0]], list(ASSUMED)) for group in self.groups
        ]
        shown = [self.columns.explained(n).dimensions > 0 for n in range(len(self.groups))]
        each = list(zip(shown, self.is_assumed, strict=True))
        single = sum(int((is_shown & ~assumed).sum()) for is_shown, assumed in each)
        others = sum(int((is_shown & assumed).sum()) for is_shown, assumed in each)
        others += len(self.scatters) + sum(basis.shape[1] > 0 for basis in self.bases)
        self.tests = max(single, 1)
        self.limit = math.log(0.5 * FAMILY / self.tests)
        self.other_limit = math.log(0.5 * FAMILY / max(others, 1))

    def log_p(self, square: float, dimensions: float, left: Leftover) -> float:
        """Return the logarithm of the p-value of a sum of squares in some `dimensions`."""
        total, freedom = left.sum_of_squares, left.freedom
        if freedom - dimensions < 1:
            return 0.0
        rest = float(log_chance(total - square, total, freedom - dimensions, freedom, True))
        by_size = not self.estimated and rest > BELIEVED
        return float(log_chance(square, total, dimensions, freedom, by_size))

    def _log_p_of(self, basis: Array, left: Leftover) -> float:
        """Return the logarithm of the p-value of an orthonormal basis (n, q)."""
        return self.log_p(float(((basis.T @ left.residual) ** 2).sum()), basis.shape[1], left)

    def _given(self, removed: Array, biases: Array) -> float:
        """Return the logarithm of the p-value of biases (n, k) after removal of others."""
        left = self.left.without(removed)
        return self._log_p_of(basis_of(left, biases), left)

    def chances(self) -> Array:
        """Return logarithms of the p-values (h,) of all hypotheses."""
        return np.array([self._log_p_of(self._remaining(basis), self.left) for basis in self.bases])

    def best_event_chance(self, is_chosen: Callable[[str], bool]) -> tuple[float, int]:
        """Return the smallest logarithm of the p-values of events of some kinds, and their
        number.
        """
        best, count = 0.0, 0
        total, freedom = self.left.sum_of_squares, self.left.freedom
        kinds = {kind: is_chosen(kind) for kind in np.unique(self.patterns.kind).tolist()}
        for number, group in enumerate(self.groups):
            explained = self.columns.explained(number)
            chosen = np.array([kinds[kind] for kind in self.patterns.kind[group[:, 0]].tolist()])
            chosen &= explained.dimensions > 0
            if chosen.any():
                square, dimensions = explained.square[chosen], explained.dimensions[chosen]
                k = int(log_chance(square, total, dimensions, freedom, False).argmin())
                best = min(best, self.log_p(square[k], dimensions[k], self.left))
                count += int(chosen.sum())
        return best, count

    def _dense(self, columns: Integers) -> Array:
        return self.patterns.matrix[:, columns].toarray()

    def _remaining(self, basis: Array) -> Array:
        """Return the part of a basis orthogonal to what was removed."""
        removed = self.left.common[:, self.start.common.shape[1] :]
        if not removed.shape[1]:
            return basis
        return orthonormal(basis - removed @ (removed.T @ basis))

    def run(self) -> Search:
        """Search until no further cause is significant, and return the search that ended."""
        while True:
            event = self._best_event()
            bases = [self._remaining(basis) for basis in self.bases]
            chances = np.array([self._log_p_of(basis, self.left) for basis in bases])
            named = np.array([bool(each.parameters) for each in self.hypotheses])
            candidate = self._best_candidate(event, chances, named)
            wide = self._wide(candidate, bases, np.where(named, 0.0, chances))
            noise = log_chances(self.scatters, self.left, self.estimated)
            of_wide, of_noise = float(wide.min(initial=0.0)), float(noise.min(initial=0.0))
            # An assumption that fails is named, with terms of the model, if it is no less probable.
            odds = 0.0 if candidate.limit == self.other_limit else LOG_ODDS_LIMIT
            is_clear = candidate.log_p < min(of_wide - odds, of_noise - LOG_ODDS_LIMIT)
            significant = candidate.log_p < candidate.limit
            if significant and is_clear and len(self.found) < MOST and self.left.freedom >= 3:
                self._take(candidate, bases, chances, named)
            elif self.left.sum_of_squares < HARMLESS**2 * self.left.freedom:
                return self
            elif self.scatter is None and of_noise < min(
                self.other_limit, of_wide - LOG_ODDS_LIMIT
            ):
                self._weigh(self.scatters[int(noise.argmin())], of_noise)
            elif of_wide < self.other_limit:
                return self._end_with_wide(candidate, bases, wide)
            elif significant or of_noise < self.other_limit:
                return self._unexplained(None, min(candidate.log_p, of_noise))
            else:
                return self

    def _best_candidate(self, event: FoundCause, chances: Array, named: Array) -> FoundCause:
        """Return the event, or a hypothesis of few parameters that is more probable."""
        k = int(np.argmin(np.where(named, chances, 0.0))) if named.any() else -1
        if k < 0 or not chances[k] < min(self.other_limit, event.log_p - 0.5 * LOG_ODDS_LIMIT):
            return event
        each = self.hypotheses[k]
        return FoundCause(each.biases, float(chances[k]), self.other_limit, hypothesis=each)

    def _best_event(self) -> FoundCause:
        """Return the event with the smallest p-value beyond its limit; of equal ones, the first."""
        best, columns = (0.0, self.limit), np.zeros(0, np.int64)
        total, freedom = self.left.sum_of_squares, self.left.freedom
        for number, group in enumerate(self.groups):
            explained = self.columns.explained(number)
            chances = log_chance(explained.square, total, explained.dimensions, freedom, False)
            limits = np.where(self.is_assumed[number], self.other_limit, self.limit)
            excess = chances - limits
            tolerance = 1e-9 * float(np.abs(chances).max(initial=0.0))
            k = int(np.flatnonzero(excess <= excess.min() + tolerance)[0])
            found = self.log_p(explained.square[k], explained.dimensions[k], self.left)
            if found - limits[k] < best[0] - best[1] - 1e-9 * abs(found):
                best, columns = (found, float(limits[k])), group[k]
        return FoundCause(self._dense(columns), *best, columns)

    def _wide(self, candidate: FoundCause, bases: list[Array], chances: Array) -> Array:
        """Return logarithms of the p-values (h,) of wide hypotheses as alternatives to a candidate.

        One that contains the candidate is an alternative only if it explains more.
        """
        if candidate.log_p >= candidate.limit:
            return chances
        own, chances = basis_of(self.left, candidate.biases), chances.copy()
        for k in np.flatnonzero(chances < 0.0).tolist():
            if own.shape[1] and _is_within(own, bases[k]):
                explains_more = self._given(candidate.biases, bases[k]) < CONTAINED
                chances[k] = min(chances[k], candidate.log_p) if explains_more else 0.0
        return chances

    def _take(
        self, candidate: FoundCause, bases: list[Array], chances: Array, named: Array
    ) -> None:
        """Enter a cause with those not told apart from it, and remove it."""
        if candidate.hypothesis is None:
            columns = self._with_other_directions(self._together(candidate.columns))
            columns = self._separate(columns)
            candidate = replace(candidate, columns=columns, biases=self._dense(columns))
        basis = basis_of(self.left, candidate.biases)
        others = [
            each
            for each, one, log_p, is_named in zip(
                self.hypotheses, bases, chances.tolist(), named.tolist(), strict=True
            )
            if each is not candidate.hypothesis
            and self._is_alternative(candidate, basis, one, log_p, is_named)
        ]
        unique = {each.words: each for each in others}
        candidate = replace(candidate, of_others=tuple(unique.values()))
        self._remove(self._not_told_apart(candidate, basis))

    def _is_alternative(
        self, candidate: FoundCause, basis: Array, other: Array, log_p: float, is_named: bool
    ) -> bool:
        """Return whether a hypothesis with a basis (n, q) is not told apart from a cause: it is
        merely part of it, explains nearly as much, or all that makes the cause significant.
        """
        if 0 < other.shape[1] <= basis.shape[1]:
            is_near = log_p < candidate.log_p + 0.5 * APART
            if is_near or (candidate.hypothesis is None and _is_within(other, basis)):
                return True
        if is_named or log_p >= self.other_limit:
            return False
        if log_p < candidate.log_p + LOG_ODDS_LIMIT:
            return True
        # One that contains the cause is wider, and clearly less probable.
        if _is_within(basis, other):
            return False
        return self._given(other, basis) >= candidate.limit

    def _remove(self, found: FoundCause) -> None:
        self.left = self.left.without(found.biases)
        self.columns.update(self.left)
        sigma = math.sqrt(self.left.sum_of_squares / max(self.left.freedom, 1))
        self.found.append(replace(found, sigma=sigma))

    def _not_told_apart(self, found: FoundCause, basis: Array) -> FoundCause:
        """Return a cause with the events of no more dimensions that explain nearly as much, and
        with the range of a slip.
        """
        every = found.biases
        if len(found.columns):
            every = self._dense(all_directions(self.patterns, found.columns))
        limits = []
        for each in (basis, basis_of(self.left, every)):
            square = float(((each.T @ self.left.residual) ** 2).sum())
            rest = (self.left.sum_of_squares - square) / max(self.left.freedom - each.shape[1], 1)
            variance = rest if self.estimated else 1.0
            limits.append((square - APART * variance, each.shape[1]))
        own = cause(self.patterns, found.columns) if len(found.columns) else None
        slip = own if own and own.kind == "slip" else None
        starts, others = [slip.start] if slip else [], dict[Cause, Integers]()
        for number, group in enumerate(self.groups):
            explained: Explained = self.columns.explained(number)
            near = np.zeros(len(group), bool)
            for least, dimensions in limits:
                near |= (explained.square >= least) & (explained.dimensions <= dimensions)
            near &= explained.dimensions > 0
            for row in group[near]:
                other = cause(self.patterns, row)
                if slip and other.kind == "slip" and other.subjects == slip.subjects:
                    starts.append(other.start)
                elif other != own:
                    others.setdefault(other, row)
        found = replace(found, others=tuple(others.values()))
        return replace(found, first=min(starts), last=max(starts)) if slip else found

    def _together(self, columns: Integers) -> Integers:
        """Return those of several expanding positions, or distances in error, that are
        significant given the others.
        """
        while len(columns) > 1 and self.patterns.kind[columns[0]] in ("expansion", "distance"):
            chances = [
                self._given(self._dense(np.delete(columns, k)), self._dense(columns[[k]]))
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
        is_wider = len(every) > len(columns)
        if is_wider and self._given(self._dense(columns), self._dense(every)) < DIRECTIONS:
            return every
        return columns

    def _separate(self, columns: Integers) -> Integers:
        """Return the directions of a cause that show separately, the most visible one first."""
        dense = self._dense(columns)
        size = np.linalg.norm(dense, axis=0)
        size[size == 0.0] = 1.0
        remainder, is_chosen = self.left.of(dense / size), np.zeros(len(columns), bool)
        while not is_chosen.all():
            share = np.where(is_chosen, 0.0, (remainder**2).sum(axis=0))
            most = int(np.flatnonzero(share >= share.max() * (1.0 - 1e-6))[0])
            if share[most] <= HIDDEN:
                break
            is_chosen[most] = True
            unit = remainder[:, most] / np.sqrt(share[most])
            remainder = remainder - unit[:, None] * (unit @ remainder)
        return columns[is_chosen]

    def _weigh(self, scatter: Scatter, log_p: float) -> None:
        """Estimate the noise of some readings, and restart with their weights."""
        times, stated, remainder = 1.0, self.design, self.left
        for _ in range(WEIGHINGS):
            times *= ratio(remainder, scatter.rows)
            self.design = with_scatter(stated, scatter, times)
            linearised = linearise(self.design, self.state, self.x, self.at.spectrum)
            remainder = leftover(linearised, self.x, self.start.freedom)
        limit, earlier = self.other_limit, self.found
        self._begin(remainder)
        sigma = math.sqrt(remainder.sum_of_squares / remainder.freedom)
        none = np.zeros((len(remainder.residual), 0))
        self.scatter = scatter, times, FoundCause(none, log_p, limit, sigma=sigma)
        self.found = []
        by_words = {each.words: each.biases for each in self.hypotheses}
        for each in earlier:
            words = each.hypothesis.words if each.hypothesis else ""
            self._remove(replace(each, biases=by_words.get(words, self._dense(each.columns))))

    def _unexplained(self, hypothesis: PossibleCause | None, log_p: float) -> Search:
        """Return this search, which ends with residuals that no cause explains but, if known, terms
        of the model.
        """
        self.found = []
        none = np.zeros((len(self.left.residual), 0))
        self.model = FoundCause(none, log_p, self.other_limit, hypothesis=hypothesis)
        return self

    def _end_with_wide(self, candidate: FoundCause, bases: list[Array], chances: Array) -> Search:
        """Return the search that ends with a wide hypothesis: that of what another chain or
        displacements leave, if that is nothing wide, or this one, with terms of the model.
        """
        best = int(chances.argmin())
        some = np.flatnonzero(chances < self.other_limit).tolist()
        same = [
            k for k in some if k == best or self._given(bases[k], bases[best]) >= self.other_limit
        ]
        named = [k for k in same if self.hypotheses[k].assumed in WIDE_ASSUMED]
        if named and not self.is_last:
            k = min(named, key=lambda k: float(chances[k]))
            widest = max(bases[best].shape[1], bases[k].shape[1])
            others = [j for j in same if j != k and bases[j].shape[1] <= widest]
            is_chain = self.hypotheses[k].assumed == CHAIN
            if is_chain:
                k, *chains = self._best_chains(some) or [k]
                others = chains + [j for j in others if self.hypotheses[j].assumed != CHAIN]
            # The best event, if it is significant and not clearly less probable.
            most = min(candidate.limit, float(chances[k]) + LOG_ODDS_LIMIT)
            is_near = len(candidate.columns) and candidate.log_p < most
            found = FoundCause(
                self.hypotheses[k].biases[:, :0],
                float(chances[k]),
                self.other_limit,
                hypothesis=self.hypotheses[k],
                others=(candidate.columns,) if is_near else (),
                of_others=tuple(self.hypotheses[j] for j in others),
            )
            rest = self._without(self.hypotheses[k])
            # Displacements leave nothing; another chain at most single causes.
            is_explained = rest is not None and rest.model is None
            if rest and is_explained and (is_chain or not (rest.found or rest.scatter)):
                sigma = math.sqrt(rest.start.sum_of_squares / max(rest.start.freedom, 1))
                rest.found.insert(0, replace(found, sigma=sigma))
                return rest
        return self._unexplained(self.hypotheses[best], float(chances[best]))

    def _without(self, hypothesis: PossibleCause) -> Search | None:
        """Return the finished search of what a wide hypothesis leaves; None without a fit."""
        at, removed = self.at, hypothesis.biases
        if hypothesis.design is not None:
            solution = estimate(hypothesis.design, self.x)
            if solution.status != "converged":
                return None
            at, removed = linearised_fit(hypothesis.design, solution), removed[:, :0]
        return Search(at, self.x, self.estimated, removed).run()

    def _best_chains(self, some: list[int]) -> list[int]:
        """Return the other chains that fit best, with those that are not clearly worse."""
        fits = []
        for k in some:
            design = self.hypotheses[k].design
            if design is not None:
                solution = estimate(design, self.x)
                if solution.status == "converged":
                    fits.append((solution.factor.sum_of_squares, k))
        if not fits:
            return []
        least = min(fits)[0]
        variance = max(least / self.start.freedom, 1.0) if self.estimated else 1.0
        most = least + 2.0 * LOG_ODDS_LIMIT * variance
        return [k for square, k in sorted(fits) if square <= most]

    def sizes(self) -> Iterator[tuple[Array, Array]]:
        """Yield the sizes (k,) of each cause with standard uncertainties (k,), estimated together;
        none of a wide one.
        """
        none = self.start.common[:, :0]
        matrix = np.concatenate([none, *(found.biases for found in self.found)], axis=1)
        size = np.linalg.norm(matrix, axis=0)
        size[size == 0.0] = 1.0
        inverse = pinv(self.start.of(matrix / size), rcond=HIDDEN)
        left = self.left
        sigma = math.sqrt(left.sum_of_squares / left.freedom) if self.estimated else 1.0
        values = inverse @ self.start.residual / size
        uncertainties = sigma * np.linalg.norm(inverse, axis=1) / size
        start = 0
        for found in self.found:
            end = start + found.biases.shape[1]
            yield values[start:end], uncertainties[start:end]
            start = end


def orthonormal(remainder: Array) -> Array:
    """Return an orthonormal basis (n, q) of what is shown of unit columns (n, k)."""
    u, values, _ = svd(remainder, full_matrices=False)
    return u[:, values**2 > SHOWN]


def basis_of(remainder: Leftover, columns: Array) -> Array:
    """Return an orthonormal basis (n, q) of the remainder of columns (n, k)."""
    size = np.linalg.norm(columns, axis=0)
    use = size > 0.0
    return orthonormal(remainder.of(columns[:, use] / size[use]))


def _is_within(inner: Array, outer: Array) -> bool:
    """Return whether an orthonormal basis is within another one."""
    beyond = inner - outer @ (outer.T @ inner)
    return bool(((beyond**2).sum(axis=0) <= SAME).all())
