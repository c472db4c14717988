"""Mistakes in an experiment file that estimates without them show: offsets of probes, and the
arrangement of the axes.

Offsets that are wrong by millimetres and another chain of axes are no small biases: their patterns
at the wrong estimate explain little. The estimate is made anew with all offsets free, which gives
the sum of squares of every single mistake in them, and once with each other arrangement.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.objects import Flags
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.estimation.gauss_newton import as_drawn, estimate, linearised_fit
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.machines.arrangement import ARRANGEMENTS, Arrangement
from ballplate.simulator.machines.kinematic import KinematicModel
from ballplate.simulator.machines.plane import PlaneModel
from ballplate.simulator.machines.protocol import Array, ErrorModel, Integers
from ballplate.simulator.readings.wrong_offsets import (
    WrongOffsets,
    discrete_mistakes,
    offset_differences,
    stated_offsets,
    with_offsets,
)

from .bias_patterns import patterns
from .cause_search import FAMILY, LOG_ODDS_LIMIT, Search
from .exact_values import diagnosis_of_all
from .remainders import leftover
from .suspects import Diagnosis, Refit
from .tails import log_chance, normal_equivalent

Made = TypeVar("Made")

# Significance level of S^2 beyond which estimates are made anew, and of what a mistake may leave
# more than all offsets free.
TOO_LARGE = 1e-3

# Part of what an offset changes that residuals have to show: with small rotations they show little
# of one that all readings of a position have in common. No offset is off by more (m).
SHOWN, LARGEST_CHANGE = 1e-7, 0.2

# Share of S^2 below which a mistake is named although what it leaves shows more.
NEARLY_ALL = 1e-2


def diagnosis_with_refits(
    at: Linearisation, x: Array, freedom: int, sigma_is_estimated: bool
) -> Diagnosis:
    """What is suspected of the observations behind a fit, and of its offsets and arrangement.

    Where nothing explains the residuals to first order, or only several causes a S^2 that is too
    large, the estimate is made anew without each mistake of these kinds. One is named if
    it explains S^2 and leaves nothing unexplained; those that the readings do not distinguish
    from it, together with it.
    """
    from scipy.special import chdtri

    found = diagnosis_of_all(at, x, freedom, sigma_is_estimated)
    is_small = at.factor.sum_of_squares <= float(chdtri(max(freedom, 1), TOO_LARGE))
    if found.unexplained is None and (is_small or len(found.suspects) < 2):
        return found
    search = _Refits(at, x, freedom, sigma_is_estimated, found)
    return search.offsets() or search.arrangements() or found


@dataclass(frozen=True)
class _Refits:
    """A fit, and what was found of it to first order."""

    at: Linearisation
    x: Array
    freedom: int
    estimated: bool
    found: Diagnosis

    def offsets(self) -> Diagnosis | None:
        """A mistake in the offsets of probes; None where none explains S^2."""
        design = self.at.design
        free = _free_offsets(design, self.x)
        if free is None:
            return None
        kinds = [
            [(free.left(one), one) for one in every]
            for every in (discrete_mistakes(design), free.single())
        ]
        least = min([free.least, *(left for left, _ in kinds[0])])
        most = min(least + self._variance(least) * free.tolerance, self.total - self._odds(least))
        limit = math.log(0.5 * FAMILY / max(sum(map(len, kinds)), 1))
        for mistakes, dimensions in zip(kinds, (1, design.dimension), strict=True):
            possible = [
                one
                for one in mistakes
                if one[0] <= most and self._log_p(one[0], dimensions) < limit
            ]
            near = self._near(possible)
            found = self._of_offsets(near, limit) if near else None
            if found:
                return found
        return None

    def _of_offsets(self, mistakes: list[WrongOffsets], limit: float) -> Diagnosis | None:
        """What is suspected with the first of some mistakes."""
        design, first = self.at.design, mistakes[0]
        if not first.is_off:
            words = tuple(one.words(design) for one in mistakes)
            cure = "correct the offsets under probes, or the names of probes in the readings"
            return self._named("offsets", words, cure, with_offsets(design, first.change), limit)
        (probe,) = first.probes
        exact = _exact(design, stated_offsets(design) + first.change, np.array([probe]))
        found = self._without(exact)
        if found is None:
            return None
        search, rest = found
        log_p = self._log_p(search.sum_of_squares, design.dimension)
        statistics = normal_equivalent(log_p), normal_equivalent(limit)
        suspect = search.offset(probe, -first.change[probe], *statistics)
        names = {one.probes[0]: design.probes.names[one.probes[0]] for one in mistakes}
        if suspect:
            given = suspect.patterns
            every = np.array([suspect.columns[0], *(one[0] for one in suspect.alternatives)])
            told = given.subject[every[given.kind[every] == "probe"]]
            others = (f"offset of probe {name}" for k, name in names.items() if k not in told)
            suspect = replace(suspect, of_model=(*others, *suspect.of_model))
            return replace(rest, suspects=(suspect, *rest.suspects))
        words = tuple(f"the offset of probe {name} is another one" for name in names.values())
        return self._named("offsets", words, "qualify the probe again", exact, limit)

    def arrangements(self) -> Diagnosis | None:
        """Other arrangements of the axes that explain S^2; None where none does."""
        design = self.at.design
        model = design.model
        chain = model.spatial if isinstance(model, PlaneModel) else model
        if not isinstance(chain, KinematicModel):
            return None
        priors = design.of(Priors)
        if priors.of_model.any():
            # What is known of these parameters, as by a map, says nothing of another arrangement's.
            alone = design.observed(priors.select(~priors.of_model))
            solution = estimate(alone, self.x)
            if solution.status != "converged":
                return None
            at = linearised_fit(alone, solution)
            return replace(self, at=at, freedom=at.degrees_of_freedom).arrangements()
        names: dict[Arrangement, list[str]] = {}
        for name, arrangement in ARRANGEMENTS.items():
            if arrangement != chain.arrangement:
                names.setdefault(arrangement, []).append(name)
        fits = []
        for arrangement in names:
            other: ErrorModel = replace(chain, arrangement=arrangement)
            other = replace(model, spatial=other) if isinstance(model, PlaneModel) else other
            solution = estimate(replace(design, model=other), self.x)
            if solution.status == "converged":
                fits.append((solution.factor.sum_of_squares, (arrangement, other)))
        near, limit = self._near(fits), math.log(0.5 * FAMILY / len(names))
        least = min((left for left, _ in fits), default=self.total)
        if not near or self._log_p(least, 1) > limit or self.total - least < self._odds(least):
            return None
        words = tuple(
            f"the arrangement of the axes is {' or '.join(names[one])}" for one, _ in near
        )
        cure = "correct arrangement under error_model"
        return self._named("arrangement", words, cure, replace(design, model=near[0][1]), limit)

    @property
    def total(self) -> float:
        return self.at.factor.sum_of_squares

    def _log_p(self, left: float, dimensions: int) -> float:
        """Logarithm of the chance that so little is left."""
        square = max(self.total - left, 0.0)
        return float(log_chance(square, self.total, dimensions, self.freedom, False))

    def _variance(self, left: float) -> float:
        return max(left / self.freedom, 1.0) if self.estimated else 1.0

    def _odds(self, least: float) -> float:
        """What one explanation leaves more than another that clearly is the better."""
        return 2.0 * LOG_ODDS_LIMIT * self._variance(least)

    def _near(self, fits: list[tuple[float, Made]]) -> list[Made]:
        """Of explanations with what they leave, those that the best does not clearly beat."""
        fits = sorted(fits, key=lambda one: one[0])
        return [one for left, one in fits if left <= fits[0][0] + self._odds(fits[0][0])]

    def _without(self, design: Design) -> tuple[Search, Diagnosis] | None:
        """The search of what a design without a mistake leaves, and what it finds; None where that
        remains unexplained.
        """
        solution = estimate(design, self.x)
        if solution.status != "converged":
            return None
        at = linearised_fit(design, solution)
        search = Search(at, self.x, at.degrees_of_freedom, self.estimated)
        found = search.found()
        is_clear = found.unexplained is None and (self.found.unexplained or not found.suspects)
        if is_clear or solution.factor.sum_of_squares < NEARLY_ALL * self.total:
            return search, found
        return None

    def _named(
        self, kind: str, words: tuple[str, ...], cure: str, design: Design, limit: float
    ) -> Diagnosis | None:
        """A mistake with what is suspected of the design without it."""
        found = self._without(design)
        if found is None:
            return None
        search, rest = found
        left = search.sum_of_squares
        before, times = (math.sqrt(one / self.freedom) for one in (self.total, left))
        statistics = normal_equivalent(self._log_p(left, 1)), normal_equivalent(limit)
        return replace(rest, refit=Refit(kind, words, cure, before, times, *statistics))


@dataclass(frozen=True)
class _Offsets:
    """S^2 as a function of the offsets, from an estimate with all of them free.

    The norm of `root` (r, l d) times the difference of offsets from those estimated, plus `side`
    (r,), is what readings leave; `prior` (l d,) are standard uncertainties of stated offsets, 0 of
    exact ones, and `size` (l d,) what readings change by a change of each. `tolerance` is what the
    right offsets leave more than the best at most.
    """

    design: Design
    root: Array
    side: Array
    estimated: Array
    prior: Array
    size: Array
    tolerance: float

    @property
    def least(self) -> float:
        """What the best offsets leave."""
        return self._solved(np.zeros_like(self.prior), np.ones(len(self.prior), bool))[0]

    def left(self, mistake: WrongOffsets) -> float:
        """What is left with the offsets as they are but for a mistake."""
        change, loose = mistake.change.ravel(), np.zeros(mistake.change.shape, bool)
        loose[list(mistake.probes)] = mistake.is_off
        return self._solved(change, loose.ravel())[0]

    def single(self) -> Iterator[WrongOffsets]:
        """Each probe as one whose offset is off, by as much as leaves least."""
        shape = self.design.probes.offsets.shape
        shown = np.sqrt((self.root**2).sum(axis=0)) > SHOWN * self.size
        for probe in np.flatnonzero(shown.reshape(shape).any(axis=1)).tolist():
            loose = np.broadcast_to(np.arange(shape[0])[:, None] == probe, shape)
            _, change = self._solved(np.zeros(self.prior.shape), loose.ravel())
            if np.abs(change).max() <= LARGEST_CHANGE:
                yield WrongOffsets((probe,), np.where(loose, change.reshape(shape), 0.0))

    def _solved(self, stated: Array, loose: Flags) -> tuple[float, Array]:
        """The least that is left with offsets as `stated` (l d,) but for those that are `loose`
        (l d,), and these offsets (l d,), all as changes of those in the file.
        """
        change = stated.copy()
        moving = loose | (self.prior > 0.0)
        change[moving] = self.estimated[moving]
        side = self.side + self.root @ (change - self.estimated)
        weight = np.where(
            loose | (self.prior == 0.0),
            0.0,
            1.0 / np.where(moving & (self.prior > 0.0), self.prior, 1.0),
        )
        side = np.concatenate([side, weight * (change - stated)])
        root = np.concatenate([self.root, np.diag(weight)])[:, moving]
        size = np.maximum(self.size[moving], weight[moving])
        step = np.linalg.lstsq(root / size, -side, rcond=SHOWN)[0]
        change[moving] += step / size
        rest = side + root @ (step / size)
        return float(rest @ rest), change


def _free_offsets(design: Design, x: Array) -> _Offsets | None:
    """S^2 as a function of a design's offsets; None where the estimate with free ones fails."""
    from scipy.special import chdtri

    stated, read = stated_offsets(design), np.unique(design.readings.probe)
    shifts = offset_differences(design, x).shifts(len(stated))
    known = _exact(design, stated + shifts, read)
    free = np.isin(np.arange(len(stated)), read)[:, None] & np.ones(stated.shape, bool)
    solution = estimate(replace(known, probes=replace(known.probes, free=free)), x)
    if solution.status != "converged":
        return None
    exact = _exact(design, solution.state.probes, read)
    at = linearise(exact, solution.state, x, as_drawn(exact))
    rest, given = leftover(at, x, at.degrees_of_freedom), patterns(exact, solution.state, x)
    chosen = given.of_kind("probe")
    columns = np.zeros((len(rest.residual), stated.size + 1))
    places = stated.shape[1] * given.subject[chosen] + given.axis[chosen]
    biases = given.matrix[:, chosen].toarray()
    columns[:, places], size = rest.of(biases), np.zeros(stated.size)
    size[places] = np.linalg.norm(biases, axis=0)
    columns[:, -1] = rest.residual
    root = np.asarray(np.linalg.qr(columns, mode="r"))
    priors, prior = design.of(Priors), np.zeros(stated.shape)
    rows = np.flatnonzero(priors.probe >= 0)
    prior[priors.probe[rows], priors.component[rows]] = priors.uncertainty[rows]
    change = (solution.state.probes - stated).ravel()
    tolerance = float(chdtri(stated.size, TOO_LARGE))
    size = np.maximum(size, 1.0)
    return _Offsets(design, root[:, :-1], root[:, -1], change, prior.ravel(), size, tolerance)


def _exact(design: Design, offsets: Array, probes: Integers) -> Design:
    """The design with some probes' offsets, out of `offsets` (l, d), as exact ones."""
    priors, mine = design.of(Priors), np.isin(np.arange(len(offsets)), probes)[:, None]
    kept = np.flatnonzero((priors.probe < 0) | ~np.isin(priors.probe, probes))
    old = design.probes
    new = replace(old, offsets=np.where(mine, offsets, old.offsets), free=old.free & ~mine)
    return replace(design, probes=new).observed(priors.select(kept))
