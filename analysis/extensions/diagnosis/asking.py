"""Answers of a fit's readings to the question whether each assumption of the experiment holds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from ballplate.presentation import number
from ballplate.results import Fit, ParameterEstimate
from ballplate.simulator.computing import single_threaded, svd
from ballplate.simulator.estimation import Linearisation, estimate, linearise, linearised_fit
from ballplate.simulator.machines import Array
from ballplate.uncertainty import uncertainties

from .answered import Answers, AssumptionAnswer, Contradicted
from .cause_search import Search, basis_of, explained_by
from .possible_causes import GROSS, MODEL, PossibleCause
from .remainders import Leftover, too_many_entries
from .scatter import Scatter, scatters, with_scatter
from .scatter import log_chances as scatter_chances
from .score_tests import (
    LEVEL,
    Contradiction,
    Tested,
    contradictions,
    log_chances,
    noticeable,
    reduced,
    tested,
)
from .suspects import Diagnosis, Suspect

# Kinds of suspects that are causes themselves; all others are errors of single observations.
ASKED = ("probe", "scale", "expansion")

# Share of the largest motion along undetermined directions from which on a parameter takes part in
# it. Terms of a combination below this are not printed.
OPEN, SMALLEST_TERM = 1e-6, 0.01


@single_threaded
def assumptions_asked(fit: Fit) -> Answers | None:
    """Return what the readings of a converged fit say of each assumption; None without residuals
    to ask, or with offsets in error by so much that only a fit without them tells more.
    """
    diagnosis: Any = fit.diagnosis
    if fit.without_scatter or diagnosis is None:
        return None
    return answers_at(fit.functions.at, fit.observed.x, fit.sigma_is_estimated, diagnosis)


@single_threaded
def answers_at(
    at: Linearisation, x: Array, sigma_is_estimated: bool, diagnosis: Diagnosis
) -> Answers | None:
    """Return what scale readings `x` (readings, d) say of each assumption at an estimate, as
    `assumptions_asked`; `diagnosis` is that of their residuals.
    """
    freedom = at.degrees_of_freedom
    if freedom < 3 or diagnosis.refit is not None or too_many_entries(at.design):
        return None
    if diagnosis.scatter is not None:
        noisy = with_scatter(at.design, diagnosis.scatter.of, diagnosis.scatter.times)
        at = linearise(noisy, at.state, x, at.spectrum)
    search = Search(at, x, freedom, sigma_is_estimated)
    every = list(tested(search))
    seen = [each for each in every if each.dimensions]
    noisier = scatters(search.design)
    tests = len(seen) + len(noisier) + 1
    limit = math.log(LEVEL / tests)
    left = _without_gross_errors(search, seen, diagnosis.suspects, limit)
    found, remainder = contradictions(search, left, seen, limit)
    sigma = math.sqrt(remainder.sum_of_squares / remainder.freedom) if search.estimated else 1.0
    least = noticeable(search, remainder, tests) * sigma
    return Answers(
        tuple(_contradicted(x, sigma_is_estimated, each) for each in found),
        tuple(_answers(search, remainder, every, noisier, least)),
    )


def _without_gross_errors(
    search: Search, seen: list[Tested], suspects: Sequence[Suspect], limit: float
) -> Leftover:
    """Return residuals without the suspected errors of single observations, except those that a
    cause explains.
    """
    gross = []
    for suspect in suspects:
        if suspect.patterns.kind[suspect.pattern] not in ASKED and len(suspect.patterns) == len(
            search.patterns
        ):
            columns = search.patterns.matrix[:, suspect.columns].toarray()
            cause = PossibleCause(GROSS, "", "")
            gross.append(Tested(cause, basis_of(search.start, columns), columns))
    left = search.start
    if not gross:
        return left
    found, without = contradictions(search, left, [*seen, *gross], limit)
    named = [each.best for each in found]
    for each in gross:
        basis = basis_of(without, each.sensitivity)
        if (
            any(each is one for one in named)
            or search.log_p(*explained_by(without, basis), without) < search.limit
        ):
            left = left.without(each.sensitivity)
    return left


def _contradicted(x: Array, sigma_is_estimated: bool, found: Contradiction) -> Contradicted:
    """Return a contradiction, with the result of a fit that allows for its cause, if any."""
    cause = found.best.cause
    others = tuple(other.cause.words for other in found.others)
    plain = Contradicted(
        cause.assumed,
        cause.words,
        cause.cure,
        math.exp(found.log_p),
        others,
        may_be_model=any(each.cause.assumed == MODEL for each in (found.best, *found.others)),
    )
    if cause.design is None:
        return plain
    solution = estimate(cause.design, x)
    if solution.status != "converged":
        return plain
    at = linearised_fit(cause.design, solution)
    times = math.sqrt(at.factor.sum_of_squares / max(at.degrees_of_freedom, 1))
    sigma = times if sigma_is_estimated else 1.0
    names, values, rows = _parameters(cause, at)
    u = sigma * at.of_shared(rows)
    sizes = tuple(
        ParameterEstimate(
            name, value, uncertainty, cause.unit, "offset" if cause.probe >= 0 else "influence"
        )
        for name, value, uncertainty in zip(names, values.tolist(), u.tolist(), strict=True)
        if np.isfinite(uncertainty)
    )
    lengths = uncertainties(at, sigma, symbols=("U6",)).get("U6")
    of_lengths = None if lengths is None else (lengths.average, lengths.maximum)
    return replace(plain, sizes=sizes, times=times, lengths=of_lengths)


def _parameters(cause: PossibleCause, at: Linearisation) -> tuple[tuple[str, ...], Array, Array]:
    """Return the names (k,) of a cause's parameters, or of combinations of them that are determined
    where single ones are not, with estimates (k,) and rows (k, s) of the shared parameters.
    """
    if cause.probe >= 0:
        stated = at.design.probes.offsets[cause.probe]
        values = at.state.probes[cause.probe] - stated
        columns = at.layout.offset_columns[cause.probe]
    else:
        first = len(at.state.influences) - len(cause.parameters)
        values = at.state.influences[first:]
        columns = np.arange(len(at.layout))[at.layout.influences][first:]
    combined = np.eye(len(columns))
    rows = np.eye(len(at.layout))[columns]
    if len(columns) <= at.design.dimension and np.isnan(at.of_shared(rows)).any():
        scale = at.as_drawn.spectrum.scale[columns]
        moves = at.shared_null[columns] / scale[:, None]
        directions, sizes, _ = svd(moves, full_matrices=True)
        open_directions = int((sizes > OPEN * sizes.max(initial=0.0)).sum())
        combined = reduced(directions[:, open_directions:].T / scale)
    names = tuple(combination(row, cause.parameters) for row in combined)
    return names, combined @ values, combined @ rows


def combination(row: Array, names: Sequence[str]) -> str:
    """Return a combination of named parameters, such as "x - 0.5 y", without its smallest terms."""
    terms = ""
    for factor, name in zip(row.tolist(), names, strict=True):
        if abs(factor) >= SMALLEST_TERM:
            sign = ("-" if factor < 0.0 else "+") if terms or factor < 0.0 else ""
            terms += f" {sign} " if terms else sign
            terms += (
                name
                if abs(abs(factor) - 1.0) < SMALLEST_TERM
                else f"{number(abs(factor), 2)} {name}"
            )
    return terms


def _answers(
    search: Search, left: Leftover, every: list[Tested], noisier: list[Scatter], least: float
) -> Iterator[AssumptionAnswer]:
    """Return the answer to each assumption: its smallest chance times the number of its tests."""
    chances = log_chances(search, left, every)
    for assumed in dict.fromkeys(each.cause.assumed for each in every):
        chosen = [k for k, each in enumerate(every) if each.cause.assumed == assumed]
        seen = [k for k in chosen if every[k].dimensions]
        not_seen = [every[k].cause.words for k in chosen if not every[k].dimensions]
        noticed = []
        for k in seen:
            cause = every[k].cause
            if 0 < len(cause.parameters) <= search.design.dimension:
                noticed += (least * every[k].combinations(left)[1]).tolist()
                _, _, hidden = every[k].combinations(search.start)
                names = [combination(row, cause.parameters) for row in hidden]
                not_seen += [f"{cause.words}, {name}" for name in names]
        yield AssumptionAnswer(
            assumed,
            min(len(seen) * math.exp(min(chances[seen])), 1.0) if seen else math.nan,
            len(seen),
            max(noticed, default=math.nan),
            every[chosen[0]].cause.unit,
            tuple(not_seen),
        )
    if noisier:
        chance = len(noisier) * math.exp(scatter_chances(noisier, left, search.estimated).min())
        yield AssumptionAnswer("scatter", min(chance, 1.0), len(noisier), math.nan, "1", ())
