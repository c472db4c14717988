"""Values that are stated as exact, among the causes of a fit's residuals.

A constraint in error makes other observations suspicious: only a fit without it reveals it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from ballplate.results import has_exact_values
from ballplate.simulator.design import Design
from ballplate.simulator.estimation import Linearisation, estimate, linearised_fit
from ballplate.simulator.machines import Array

from .cause_search import FoundCause, Search, searched

# Significance level of a sum of squares that needs a refit.
TOO_LARGE = 1e-3

# Standard uncertainty of exact values in their test, in repeatabilities: small beside that of
# a value's error from readings, and large enough to separate contradictory values.
TESTED_WITH = 0.1


def searched_with_exact_values(
    at: Linearisation, x: Array, sigma_is_estimated: bool
) -> Search | None:
    """Return the finished search of a fit's residuals, in which exact values are loosened if one of
    them is a cause then; None without residuals.
    """
    first = searched(at, x, sigma_is_estimated)
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
    second = searched(linearised_fit(loose, solution), x, sigma_is_estimated)
    if second is None:
        return first
    second.found = [
        replace(found, of_exact=_is_of_exact(second, found, design)) for found in second.found
    ]
    return second if any(found.of_exact for found in second.found) else first


def _is_small(at: Linearisation) -> bool:
    from scipy.special import chdtri

    limit = float(chdtri(max(at.degrees_of_freedom, 1), TOO_LARGE))
    return bool(at.factor.sum_of_squares <= limit)


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
