"""Errors in the offsets of probes that a fit without them reveals.

Offsets in error by millimetres are no small biases: their patterns at the biased estimate explain
little. A fit with all offsets free gives the sum of squares for every single error in them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from ballplate.extensions.laboratory.wrong_offsets import (
    WrongOffsets,
    discrete_mistakes,
    offset_shifts,
    stated_offsets,
    with_offsets,
)
from ballplate.simulator.computing import lstsq
from ballplate.simulator.design import Design, Flags, Priors
from ballplate.simulator.estimation import (
    Linearisation,
    Solution,
    as_drawn,
    estimate,
    linearise,
    linearised_fit,
)
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import format_length, listing
from ballplate.simulator.machines import (
    ARRANGEMENTS,
    Arrangement,
    Array,
    ErrorModel,
    Integers,
    KinematicModel,
    PlaneModel,
)

from .bias_patterns import patterns
from .cause_search import FAMILY, diagnosis
from .exact_values import diagnosis_of_all
from .remainders import leftover
from .rivals import clear_odds, log_p, standing, variance
from .suspects import Diagnosis, Refit
from .tails import normal_equivalent

# Significance level of a sum of squares that needs refits, and of the excess of an error's sum of
# squares over that with all offsets free.
TOO_LARGE = 1e-3

# Share of an offset's effect that residuals must show: with small rotations they show little of one
# that all readings of a position have in common. Largest error of an offset (m).
SHOWN, LARGEST_CHANGE = 1e-7, 0.2

# Remaining share of S^2 below which an error is named although the remainder has other causes.
NEARLY_ALL = 1e-2


def diagnosis_with_refits(
    fitted: Linearisation, x: Array, freedom: int, sigma_is_estimated: bool
) -> Diagnosis:
    """Search the residuals of a fit for their cause, including errors in offsets.

    If no cause explains the residuals to first order, or only several causes explain a large S^2,
    the estimate is repeated without each error of these kinds. An error is named if it explains S^2
    and the remainder has explained causes, together with those that the readings do not distinguish
    from it.
    """
    from scipy.special import chdtri

    first_order = diagnosis_of_all(fitted, x, freedom, sigma_is_estimated)
    is_small = fitted.factor.sum_of_squares <= float(chdtri(max(freedom, 1), TOO_LARGE))
    if first_order.unexplained is None and (is_small or len(first_order.suspects) < 2):
        return first_order
    search = _Refits(fitted, x, freedom, sigma_is_estimated, first_order)
    return search.offsets() or first_order


# The words of an error, a fit without it, its design, and the error, None of another arrangement.
_Fit = tuple[str, Solution, Design, WrongOffsets | None]

# Ratio of sizes from which on the smaller one of two errors that explain alike is meant.
FAR_LARGER = 100.0


@dataclass(frozen=True)
class _Refits:
    """A fit, and its diagnosis to first order."""

    at: Linearisation
    x: Array
    freedom: int
    estimated: bool
    first_order: Diagnosis

    def offsets(self) -> Diagnosis | None:
        """Return the diagnosis with an error in the offsets of probes; None if none explains
        S^2.
        """
        design = self.at.design
        free = _free_offsets(design, self.x)
        if free is None:
            return None
        discrete = [(free.remaining(one), 1, one) for one in discrete_mistakes(design)]
        single = [(free.remaining(one), design.dimension, one) for one in free.single()]
        least = min([free.least, *(remaining for remaining, _, _ in discrete)])
        given = least, self.freedom, self.estimated
        most = min(least + variance(*given) * free.tolerance, self.total - clear_odds(*given))
        limit = math.log(0.5 * FAMILY / max(len(discrete) + len(single), 1))
        return self._named([one for one in discrete + single if one[0] <= most], limit)

    def _named(
        self, expected: list[tuple[float, int, WrongOffsets]], limit: float
    ) -> Diagnosis | None:
        """Return the diagnosis with the errors in offsets whose fits stand against the file and all
        rivals, and the causes that remain with the best one corrected; None if another arrangement
        of axes is better, or if residuals remain unexplained.
        """
        design, given = self.at.design, (self.total, self.freedom, limit, self.estimated)
        near = standing(expected, *given)
        if not near:
            return None
        corrected = (
            (_words(design, mistake), _corrected(design, mistake), mistake) for mistake in near
        )
        chains = ((words, other, None) for words, other in other_chains(design))
        fits = [
            (
                solution.factor.sum_of_squares,
                design.dimension if mistake and mistake.is_off else 1,
                (words, solution, other, mistake),
            )
            for words, other, mistake in chain(corrected, chains)
            if (solution := estimate(other, self.x)).status == "converged"
        ]
        best = _plausible(standing(fits, *given))
        if not best or best[0][3] is None:
            return None
        words, (_, solution, right, first) = tuple(each[0] for each in best), best[0]
        refitted = linearised_fit(right, solution)
        remaining = solution.factor.sum_of_squares
        remainder = diagnosis(refitted, self.x, refitted.degrees_of_freedom, self.estimated)
        is_clear = remainder.unexplained is None and (
            self.first_order.unexplained or not remainder.suspects
        )
        if not is_clear and remaining >= NEARLY_ALL * self.total:
            return None
        before, times = (math.sqrt(square / self.freedom) for square in (self.total, remaining))
        statistics = normal_equivalent(self._log_p(remaining, 1)), normal_equivalent(limit)
        cure = "correct the offsets under probes, or the names of probes in the readings"
        if first is not None and first.is_off:
            cure = "qualify the probe again"
        return replace(remainder, refit=Refit(words, cure, before, times, *statistics))

    @property
    def total(self) -> float:
        return self.at.factor.sum_of_squares

    def _log_p(self, remaining: float, dimensions: int) -> float:
        """Return the logarithm of the p-value of a remaining sum of squares."""
        return log_p(max(self.total - remaining, 0.0), dimensions, self.total, self.freedom, True)


def _plausible(fits: list[_Fit]) -> list[_Fit]:
    """Return fits without those of single offsets whose errors are far larger than that of another
    single one, or as large as the wrong sign or exchange that is best.
    """
    size = [0.0 if mistake is None else float(np.abs(mistake.change).max()) for *_, mistake in fits]
    is_off = [mistake is not None and mistake.is_off for *_, mistake in fits]
    most = FAR_LARGER * min((s for s, off in zip(size, is_off, strict=True) if off), default=0.0)
    if fits and not is_off[0] and size[0]:
        most = min(most, size[0] / FAR_LARGER)
    kept = zip(fits, size, is_off, strict=True)
    return [each for each, s, off in kept if not off or s <= most]


def _corrected(design: Design, mistake: WrongOffsets) -> Design:
    """Return the design without an error in its offsets."""
    if mistake.is_off:
        return _exact(design, stated_offsets(design) + mistake.change, np.array(mistake.probes))
    return with_offsets(design, mistake.change)


def other_chains(design: Design) -> Iterator[tuple[str, Design]]:
    """Return the design with each other arrangement of the axes, and the words that name it."""
    model = design.model
    spatial = model.spatial if isinstance(model, PlaneModel) else model
    if not isinstance(spatial, KinematicModel):
        return
    names: dict[Arrangement, list[str]] = {}
    for name, arrangement in ARRANGEMENTS.items():
        if arrangement != spatial.arrangement:
            names.setdefault(arrangement, []).append(name)
    for arrangement, of_it in names.items():
        other: ErrorModel = replace(spatial, arrangement=arrangement)
        if isinstance(model, PlaneModel):
            other = replace(model, spatial=other)
        yield f"the arrangement of the axes is {' or '.join(of_it)}", replace(design, model=other)


def _words(design: Design, mistake: WrongOffsets) -> str:
    """Return an error in offsets; of a single offset by how much it is off."""
    if not mistake.is_off:
        return mistake.words(design)
    (probe,) = mistake.probes
    change = mistake.change[probe]
    parts = (
        f"{format_length(float(f'{change[k]:.3g}'))} along {AXIS_NAMES[k]}"
        for k in np.flatnonzero(np.abs(change) > 0.01 * np.abs(change).max()).tolist()
    )
    name = design.probes.names[probe]
    return f"the offset of probe {name} is another one, by {listing(parts)}"


@dataclass(frozen=True)
class _Offsets:
    """S^2 as a function of the offsets, from an estimate with all of them free.

    S^2 is the squared norm of `root` (r, l d) times the difference from the `estimated` offsets,
    plus `side` (r,). `prior` (l d,) are standard uncertainties of stated offsets, 0 of exact ones,
    and `size` (l d,) the changes of readings by a unit of each. `tolerance` is the largest excess
    of the right offsets' S^2 over the least.
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
        """S^2 of the best offsets."""
        return self._solved(np.zeros_like(self.prior), np.ones(len(self.prior), bool))[0]

    def remaining(self, mistake: WrongOffsets) -> float:
        """Return S^2 with the stated offsets except for an error."""
        change, loose = mistake.change.ravel(), np.zeros(mistake.change.shape, bool)
        loose[list(mistake.probes)] = mistake.is_off
        return self._solved(change, loose.ravel())[0]

    def single(self) -> Iterator[WrongOffsets]:
        """Return each probe as one with an offset in error, by the amount with the least S^2."""
        shape = self.design.probes.offsets.shape
        shown = np.sqrt((self.root**2).sum(axis=0)) > SHOWN * self.size
        for probe in np.flatnonzero(shown.reshape(shape).any(axis=1)).tolist():
            loose = np.broadcast_to(np.arange(shape[0])[:, None] == probe, shape)
            _, change = self._solved(np.zeros(self.prior.shape), loose.ravel())
            if np.abs(change).max() <= LARGEST_CHANGE:
                yield WrongOffsets((probe,), np.where(loose, change.reshape(shape), 0.0))

    def _solved(self, stated: Array, loose: Flags) -> tuple[float, Array]:
        """Return the least S^2 with `loose` (l d,) offsets free and others as `stated` (l d,), and
        the offsets (l d,).

        All are changes of those in the file.
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
        step = lstsq(root / size, -side, rcond=SHOWN)[0]
        change[moving] += step / size
        residual = side + root @ (step / size)
        return float(residual @ residual), change


def _free_offsets(design: Design, x: Array) -> _Offsets | None:
    """Return S^2 as a function of a design's offsets; None if the fit with free ones fails."""
    from scipy.special import chdtri

    stated, read = stated_offsets(design), np.unique(design.readings.probe)
    shifts = offset_shifts(design, x)
    exact_design = _exact(design, stated + shifts, read)
    free = np.isin(np.arange(len(stated)), read)[:, None] & np.ones(stated.shape, bool)
    solution = estimate(replace(exact_design, probes=replace(exact_design.probes, free=free)), x)
    if solution.status != "converged":
        return None
    exact = _exact(design, solution.state.probes, read)
    linearisation = linearise(exact, solution.state, x, as_drawn(exact))
    remainder, all_patterns = (
        leftover(linearisation, x, linearisation.degrees_of_freedom),
        patterns(exact, solution.state, x),
    )
    chosen = all_patterns.of_kind("probe")
    columns = np.zeros((len(remainder.residual), stated.size + 1))
    places = stated.shape[1] * all_patterns.subject[chosen] + all_patterns.axis[chosen]
    biases = all_patterns.matrix[:, chosen].toarray()
    columns[:, places], size = remainder.of(biases), np.zeros(stated.size)
    size[places] = np.linalg.norm(biases, axis=0)
    columns[:, -1] = remainder.residual
    root = np.asarray(np.linalg.qr(columns, mode="r"))
    priors, prior = design.of(Priors), np.zeros(stated.shape)
    rows = np.flatnonzero(priors.probe >= 0)
    prior[priors.probe[rows], priors.component[rows]] = priors.uncertainty[rows]
    change = (solution.state.probes - stated).ravel()
    tolerance = float(chdtri(stated.size, TOO_LARGE))
    size = np.maximum(size, 1.0)
    return _Offsets(design, root[:, :-1], root[:, -1], change, prior.ravel(), size, tolerance)


def _exact(design: Design, offsets: Array, probes: Integers) -> Design:
    """Return the design with some probes' offsets, from `offsets` (l, d), stated as exact."""
    priors, is_chosen = design.of(Priors), np.isin(np.arange(len(offsets)), probes)[:, None]
    rows = np.flatnonzero((priors.probe < 0) | ~np.isin(priors.probe, probes))
    old = design.probes
    new = replace(
        old, offsets=np.where(is_chosen, offsets, old.offsets), free=old.free & ~is_chosen
    )
    return replace(design, probes=new).observed(priors.select(rows))
