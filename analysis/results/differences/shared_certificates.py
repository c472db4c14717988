"""Values of certificates that two campaigns rest on both, and what their errors do to each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.design.arrays import Design, Observations
from ballplate.simulator.design.observations.coordinates import CalibratedCoordinates
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.observations.joint_values import JointValues
from ballplate.simulator.design.observations.lengths import Lengths, length_name
from ballplate.simulator.estimation.elimination import eliminate
from ballplate.simulator.estimation.gauss_newton import newton_step
from ballplate.simulator.machines.protocol import Array

from ..fit import Fit
from .compared_maps import ComparedMap

# Observations that are values of certificates, each with an error of its own.
SINGLE = (CalibratedDistances, CalibratedCoordinates)


class NothingSharedError(ValueError):
    """Two campaigns of which it is not known that they share anything."""


@dataclass(frozen=True, eq=False)
class CertifiedErrors:
    """Errors of certified values that have a common cause: what one standard deviation of each
    cause adds to the values of observations of a kind, `errors` (causes, m).

    `key` identifies them: what they are, their values and their uncertainties.
    """

    key: tuple[object, ...]
    observations: Observations
    errors: Array


def with_shared_certificates(
    first: ComparedMap, second: ComparedMap
) -> tuple[ComparedMap, ComparedMap, int]:
    """Two maps of fits with what errors of certified values that both have do to each, and the
    number of these values.

    Values are the same if they are of the same balls, or lengths, and certified alike with the same
    uncertainty.

    :raises NothingSharedError: a map without its fit, or campaigns that have no certified value in
        common.
    """
    if first.fit is None or second.fit is None:
        one = first if first.fit is None else second
        raise NothingSharedError(
            f"{one.label} does not hold what certificates do to it; compare fits, or experiment"
            " files that name their readings"
        )
    both = [{one.key: one for one in _certified(fit.design)} for fit in (first.fit, second.fit)]
    common = [key for key in both[0] if key in both[1]]
    count = sum(len(both[0][key].errors) for key in common)
    if not count:
        raise NothingSharedError(
            "the campaigns have no certified value in common, of the same balls with the same"
            " value and uncertainty; leave out the shared certificate"
        )
    found = []
    for one, own in zip((first, second), both, strict=True):
        assert one.fit is not None
        shared, balls = _effects(one.fit, [own[key] for key in common])
        found.append(replace(one, shared=shared, shared_balls=balls))
    return found[0], found[1], count


def _certified(design: Design) -> Iterator[CertifiedErrors]:
    for one in design.observations:
        if isinstance(one, SINGLE):
            for k in range(len(one)):
                single = np.zeros((1, len(one)))
                single[0, k] = one.uncertainty[k]
                yield _errors(one, (one.name(design, k),), [k], single)
        elif isinstance(one, Lengths):
            for number in np.unique(one.certificate).tolist():
                own = np.flatnonzero(one.certificate == number).tolist()
                errors = np.zeros((1, len(one)))
                errors[0, own] = one.uncertainty[own]
                yield _errors(one, (length_name(design, own[0], False),), own[:1], errors)
        elif isinstance(one, JointValues):
            names = tuple(one.name(design, k) for k in range(len(one)))
            start = 0
            for root in one.roots:
                size = len(root.own)
                errors = np.zeros((size, len(one)))
                part = range(start, start + size)
                errors[:, part] = root.drawn(np.eye(size))
                yield _errors(one, names[part.start : part.stop], list(part), errors)
                start += size


def _errors(
    one: Observations, names: tuple[str, ...], chosen: list[int], errors: Array
) -> CertifiedErrors:
    values = (*one.value[chosen].tolist(), *one.uncertainty[chosen].tolist())
    kept = errors[np.abs(errors).max(axis=1) > 0.0]
    key = (type(one).__name__, *names, *(round(value, 12) for value in values))
    return CertifiedErrors(key, one, kept)


@single_threaded
def _effects(fit: Fit, certified: list[CertifiedErrors]) -> tuple[Array, Array]:
    """What one standard deviation of each error changes: model parameters (n, q) and balls
    (balls, d, q), in metres and radians.
    """
    design, solution, x = fit.design, fit.solution, fit.observed.x
    layout = solution.factor.layout
    at_rest = newton_step(design, solution.factor, solution.spectrum)
    shared, balls = [], []
    for one in certified:
        for errors in one.errors:
            changed = design.observed(one.observations.given(value=one.observations.value + errors))
            factor = eliminate(changed, layout, solution.state, x)
            step = newton_step(changed, factor, solution.spectrum)
            shared.append(fit.sigma * (step[0] - at_rest[0])[layout.model])
            balls.append(fit.sigma * (step[1] - at_rest[1]))
    return np.stack(shared, axis=1), np.stack(balls, axis=2)
