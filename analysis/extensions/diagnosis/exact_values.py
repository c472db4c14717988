"""Test of values that are stated as exact, which are constraints without residuals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from ballplate.results import has_exact_values
from ballplate.simulator.design import Design
from ballplate.simulator.estimation import Linearisation, estimate, linearised_fit
from ballplate.simulator.machines import Array

from .cause_search import diagnosis
from .suspects import Diagnosis, Suspect

# Standard uncertainty of exact values in their test, in repeatabilities: small beside that of
# a value's error from readings, and large enough to separate contradictory values.
TESTED_WITH = 0.1


def diagnosis_of_all(
    fitted: Linearisation, x: Array, freedom: int, sigma_is_estimated: bool
) -> Diagnosis:
    """Search the residuals of a fit for their cause, including values stated as exact."""
    from scipy.special import chdtri

    first = diagnosis(fitted, x, freedom, sigma_is_estimated)
    design = fitted.design
    if not has_exact_values(design) or freedom <= 0:
        return first
    if not first and fitted.factor.sum_of_squares <= float(chdtri(freedom, 1e-3)):
        return first
    # A constraint in error makes other observations suspicious. So exact values are loosened
    # and, if one of them is a suspect then, the second search is the diagnosis.
    least = TESTED_WITH * float(design.machine.repeatability.min())
    loose = design.observed(*(one.loosened(least) for one in design.observations))
    solution = estimate(loose, x)
    if solution.status != "converged":
        return first
    second = diagnosis(linearised_fit(loose, solution), x, freedom, sigma_is_estimated)
    suspects = tuple(
        replace(suspect, of_exact=_is_of_exact(suspect, design)) for suspect in second.suspects
    )
    if not any(suspect.of_exact for suspect in suspects):
        return first
    return replace(second, suspects=suspects)


def _is_of_exact(suspect: Suspect, design: Design) -> bool:
    """Return whether a suspect is among the values that the design states as exact."""
    biases, k = suspect.patterns, suspect.pattern
    kind, subject = str(biases.kind[k]), biases.subject[suspect.columns]
    if kind == "scale":
        return any(
            bool(
                (
                    observation.is_exact
                    & (design.balls.artefact[observation.balls[:, 0]] == subject[0])
                ).any()
            )
            for observation in design.observations
            if observation.scales and len(observation)
        )
    return any(
        bool(np.any(observation.is_exact[subject]))
        for observation in design.observations
        if observation.word == kind
    )
