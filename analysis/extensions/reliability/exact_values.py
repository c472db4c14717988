"""Test of values that are stated as exact, which an estimate that meets them cannot show wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from ballplate.results import has_exact_values
from ballplate.simulator.design import Design
from ballplate.simulator.estimation import Linearisation, estimate, linearised_fit
from ballplate.simulator.machines import Array

from .cause_search import diagnosis
from .suspects import Diagnosis, Suspect

# Standard uncertainty with which exact values are tested, in repeatabilities: little beside that of
# an estimate of a value's error from readings, and enough to tell values from one another that
# contradict one another.
TESTED_WITH = 0.1


def diagnosis_of_all(
    at: Linearisation, x: Array, freedom: int, sigma_is_estimated: bool
) -> Diagnosis:
    """What is suspected of the observations behind a fit, those among them that are exact.

    Where the residuals are too large, or show anything, the estimate is made anew with exact values
    that are let go by a share of the repeatability. If that shows one of them, all that is told is
    from there: what seems wrong beside a wrong constraint is its consequence.
    """
    from scipy.special import chdtri

    found = diagnosis(at, x, freedom, sigma_is_estimated)
    design = at.design
    if not has_exact_values(design) or freedom <= 0:
        return found
    if not found and at.factor.sum_of_squares <= float(chdtri(freedom, 1e-3)):
        return found
    least = TESTED_WITH * float(design.machine.repeatability.min())
    loose = design.observed(*(one.loosened(least) for one in design.observations))
    solution = estimate(loose, x)
    if solution.status != "converged":
        return found
    anew = diagnosis(linearised_fit(loose, solution), x, freedom, sigma_is_estimated)
    suspects = tuple(replace(one, of_exact=_is_of_exact(one, design)) for one in anew.suspects)
    if not any(one.of_exact for one in suspects):
        return found
    return replace(anew, suspects=suspects)


def _is_of_exact(suspect: Suspect, design: Design) -> bool:
    """Whether what is suspected is a value, or values, that the design states as exact."""
    given, k = suspect.patterns, suspect.pattern
    kind, subject = str(given.kind[k]), given.subject[suspect.columns]
    if kind == "scale":
        return any(
            bool((one.is_exact & (design.balls.artefact[one.balls[:, 0]] == subject[0])).any())
            for one in design.observations
            if one.scales and len(one)
        )
    return any(
        bool(np.any(one.is_exact[subject])) for one in design.observations if one.word == kind
    )
