"""Causes that only fits without them reveal: offsets in error by millimetres, and values that are
stated as exact.

Offsets in error by millimetres are no small biases: their patterns at the biased estimate explain
little. A constraint in error makes other observations suspicious.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from ballplate.extensions.laboratory.wrong_offsets import (
    discrete_mistakes,
    stated_offsets,
    with_offsets,
)
from ballplate.results import has_exact_values
from ballplate.simulator.design import Design, Priors
from ballplate.simulator.estimation import Linearisation, Solution, estimate, linearised_fit
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import format_length
from ballplate.simulator.machines import Array

from .cause_search import FAMILY, LOG_ODDS_LIMIT, FoundCause, Search, searched
from .hypotheses import PossibleCause
from .tails import log_chance

# Significance level of a sum of squares that needs refits.
TOO_LARGE = 1e-3

# Remaining share of S^2 below which an error is named although the remainder has other causes, and
# below which errors of signs and exchanges are preferred to an offset that is off.
NEARLY_ALL = 1e-2

# Standard uncertainty of exact values in their test, in repeatabilities: small beside that of
# a value's error from readings, and large enough to separate contradictory values.
TESTED_WITH = 0.1


def searched_with_refits(at: Linearisation, x: Array, sigma_is_estimated: bool) -> Search | None:
    """Return the finished search of a fit's residuals, including errors in offsets and in values
    stated as exact; None without residuals.

    If only terms of the model, displacements or several causes explain a large S^2, the estimate is
    repeated without each error in an offset, and if a single offset explains it, without each wrong
    sign and exchange of probes. One is named if it explains S^2 and the remainder has explained
    causes, together with those that the readings do not distinguish from it.
    """
    first = _with_exact_values(at, x, sigma_is_estimated)
    if first is None or (first.model is None and _is_small(at)):
        return first
    wide = (found for found in first.found if found.hypothesis and not found.hypothesis.parameters)
    rival = first.model or next(wide, None)
    is_single = rival is None and len(first.found) < 2
    kinds = {str(kind) for found in first.found for kind in first.patterns.kind[found.columns]}
    if is_single and kinds != {"probe"}:
        return first
    return _with_offsets(at, x, sigma_is_estimated, rival, is_single) or first


def _is_small(at: Linearisation) -> bool:
    from scipy.special import chdtri

    limit = float(chdtri(max(at.degrees_of_freedom, 1), TOO_LARGE))
    return bool(at.factor.sum_of_squares <= limit)


def _with_exact_values(at: Linearisation, x: Array, estimated: bool) -> Search | None:
    """Return the search in which exact values are loosened if one of them is a cause then."""
    first = searched(at, x, estimated)
    design = at.design
    if first is None or not has_exact_values(design):
        return first
    if not (first.found or first.scatter or first.model) and _is_small(at):
        return first
    least = TESTED_WITH * float(design.machine.repeatability.min())
    loose = design.observed(*(one.loosened(least) for one in design.observations))
    solution = estimate(loose, x)
    if solution.status != "converged":
        return first
    second = searched(linearised_fit(loose, solution), x, estimated)
    if second is None:
        return first
    second.found = [
        replace(found, of_exact=_is_of_exact(second, found, design)) for found in second.found
    ]
    return second if any(found.of_exact for found in second.found) else first


def _is_of_exact(search: Search, found: FoundCause, design: Design) -> bool:
    """Return whether a cause is among the values that the design states as exact."""
    if not len(found.columns):
        return False
    kind = str(search.patterns.kind[found.columns[0]])
    subjects = search.patterns.subject[found.columns]
    if kind == "scale":
        return any(
            bool(np.any(one.is_exact & (design.balls.artefact[one.balls[:, 0]] == subjects[0])))
            for one in design.observations
            if one.scales and len(one)
        )
    return any(
        bool(np.any(one.is_exact[subjects])) for one in design.observations if one.word == kind
    )


def _with_offsets(
    at: Linearisation, x: Array, estimated: bool, rival: FoundCause | None, is_discrete: bool
) -> Search | None:
    """Return the search of what the best error in an offset leaves, a sign or an exchange if it
    `is_discrete`; None if none explains S^2, or the `rival` explains it better.
    """
    before, freedom = at.factor.sum_of_squares, at.degrees_of_freedom
    fits = _fits(at.design, _discrete(at.design), x)
    least = min((fit[0] for fit in fits), default=math.inf)
    if least > NEARLY_ALL * before and not is_discrete:
        fits += _fits(at.design, _free(at.design), x)
    if not fits:
        return None
    least, first, solution = min(fits, key=lambda fit: fit[0])
    clear = 2.0 * LOG_ODDS_LIMIT * (max(least / freedom, 1.0) if estimated else 1.0)
    if before - least < clear:
        return None
    log_p = float(log_chance(before - least, before, at.design.dimension, freedom, False))
    if rival is not None and rival.log_p < log_p:
        return None
    assert first.design is not None
    rest = searched(linearised_fit(first.design, solution), x, estimated)
    if rest is not None:
        if (rest.model or rest.found) and least > NEARLY_ALL * before:
            return None
        none = np.zeros((len(rest.start.residual), 0))
        others = [other for square, other, _ in fits if square <= least + clear]
        if rival is not None and rival.hypothesis and rival.log_p < log_p + LOG_ODDS_LIMIT:
            others.append(rival.hypothesis)
        of_others = tuple(other for other in others if other is not first)
        found = FoundCause(none, log_p, math.log(FAMILY), hypothesis=first, of_others=of_others)
        rest.found.insert(0, replace(found, sigma=math.sqrt(least / freedom)))
    return rest


def _fits(
    design: Design, errors: Iterator[PossibleCause], x: Array
) -> list[tuple[float, PossibleCause, Solution]]:
    """Return S^2, error and estimate of each fit without an error that converges."""
    fits = []
    for error in errors:
        assert error.design is not None
        solution = estimate(error.design, x)
        if solution.status == "converged":
            changes = solution.state.probes - error.design.probes.offsets
            probe, axis = np.unravel_index(np.abs(changes).argmax(), changes.shape)
            size = float(changes[probe, axis])
            if size:
                by = f"by {format_length(float(f'{size:.3g}'))} along {AXIS_NAMES[axis]}"
                error = replace(error, words=f"{error.words}, {by}")
            fits.append((solution.factor.sum_of_squares, error, solution))
    return fits


def _discrete(design: Design) -> Iterator[PossibleCause]:
    """Return signs that are wrong, and exchanges of probes."""
    cure = "correct the offsets under probes, or the names of probes in the readings"
    for mistake in discrete_mistakes(design):
        other = with_offsets(design, mistake.change)
        yield PossibleCause("tips", mistake.words(design), cure, np.zeros((0, 0)), design=other)


def _free(design: Design) -> Iterator[PossibleCause]:
    """Return each probe with an offset in error by any amount."""
    priors = design.of(Priors)
    for probe in np.unique(design.readings.probe).tolist():
        is_other = np.arange(len(design.probes.names))[:, None] != probe
        offsets = stated_offsets(design)
        probes = replace(design.probes, offsets=offsets, free=design.probes.free | ~is_other)
        other = replace(design, probes=probes).observed(
            priors.select(np.flatnonzero(priors.probe != probe))
        )
        words = f"the offset of probe {design.probes.names[probe]} is another one"
        cure = "qualify the probe again"
        yield PossibleCause("tips", words, cure, np.zeros((0, 0)), design=other)
