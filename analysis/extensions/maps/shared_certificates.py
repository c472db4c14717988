"""Values of certificates that two campaigns rest on both, and what their errors do to each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from ballplate.extensions.diagnosis.hat import hat_rows, row_count, row_places
from ballplate.results import Fit
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import (
    CalibratedCoordinates,
    CalibratedDistances,
    Design,
    JointValues,
    Lengths,
    Observations,
    length_name,
    length_whitening,
)
from ballplate.simulator.machines import Array, Integers

from .compared_maps import ComparedMap, NotComparableError, without_shared

# Observations that are values of certificates, each with an error of its own.
SINGLE = (CalibratedDistances, CalibratedCoordinates)


@dataclass(frozen=True, eq=False)
class CertifiedErrors:
    """Errors of certified values with a common cause: effects `errors` (causes, m) of one standard
    deviation of each cause on `rows` (m,) of the whitened observations.

    `key` identifies them by type, values and uncertainties.
    """

    key: tuple[object, ...]
    rows: Integers
    errors: Array


def with_shared_certificates(
    first: ComparedMap, second: ComparedMap
) -> tuple[ComparedMap, ComparedMap, int]:
    """Return two maps of fits with the effects of common certified values, and the number of these
    values.

    Common values have the same balls, or lengths, the same value and uncertainty.

    :raises NotComparableError: a map without its fit, or campaigns that have no certified value in
        common.
    """
    if first.fit is None or second.fit is None:
        side = first if first.fit is None else second
        raise NotComparableError(
            f"{side.label} does not hold what certificates do to it; compare fits, or experiment"
            " files that name their readings"
        )
    certified = [
        {errors.key: errors for errors in _certified(fit.design)} for fit in (first.fit, second.fit)
    ]
    common = [key for key in certified[0] if key in certified[1]]
    count = sum(len(certified[0][key].errors) for key in common)
    if not count:
        raise NotComparableError(
            "the campaigns have no certified value in common, of the same balls with the same"
            " value and uncertainty; leave out the shared certificate"
        )
    sides = []
    for side, own_values in zip((first, second), certified, strict=True):
        assert side.fit is not None
        absorbed = _absorbed(side.fit, [own_values[key] for key in common])
        linearisation = side.fit.functions.at
        model = np.zeros((len(side.values), absorbed.shape[1]))
        model[:, : linearisation.rank] = (
            side.fit.sigma * linearisation.shared[linearisation.layout.model]
        )
        root, shared = without_shared(model, absorbed)
        sides.append(replace(side, root=root, shared=shared, absorbed=absorbed))
    return sides[0], sides[1], count


def _certified(design: Design) -> Iterator[CertifiedErrors]:
    places = row_places(design)
    for observation in design.observations:
        start = places[observation.word].start
        if isinstance(observation, SINGLE):
            for k in range(len(observation)):
                errors = np.eye(1)[: int(observation.uncertainty[k] > 0.0)]
                yield _errors(
                    observation, (observation.name(design, k),), [k], np.array([start + k]), errors
                )
        elif isinstance(observation, Lengths):
            for number in np.unique(observation.certificate).tolist():
                rows_of_certificate = np.flatnonzero(observation.certificate == number).tolist()
                errors = np.where(observation.certificate == number, observation.uncertainty, 0.0)
                whitened = design.once(length_whitening).whitened(errors[:, None]).T
                rows = start + np.arange(whitened.shape[1])
                remaining = whitened[: int(errors.any())]
                yield _errors(
                    observation,
                    (length_name(design, rows_of_certificate[0], False),),
                    rows_of_certificate[:1],
                    rows,
                    remaining,
                )
        elif isinstance(observation, JointValues):
            names = tuple(observation.name(design, k) for k in range(len(observation)))
            first = 0
            for root in observation.roots:
                size = len(root.own)
                part = np.arange(first, first + size)
                drawn = np.abs(root.drawn(np.eye(size))).max(axis=1)
                errors = np.eye(size)[drawn > 0.0]
                own_names = names[first : first + size]
                yield _errors(observation, own_names, part.tolist(), start + part, errors)
                first += size


def _errors(
    observations: Observations,
    names: tuple[str, ...],
    chosen: list[int],
    rows: Integers,
    errors: Array,
) -> CertifiedErrors:
    values = (*observations.value[chosen].tolist(), *observations.uncertainty[chosen].tolist())
    key = (type(observations).__name__, *names, *(round(value, 12) for value in values))
    return CertifiedErrors(key, rows, errors)


@single_threaded
def _absorbed(fit: Fit, certified: list[CertifiedErrors]) -> Array:
    """Rows (q, r) of the root of the hat matrix, of one standard deviation of each error: first the
    columns that all balls share, and then each ball's own.
    """
    linearisation = fit.functions.at
    d, width = fit.design.dimension, linearisation.balls.common.shape[2]
    rows = np.unique(np.concatenate([certificate.rows for certificate in certified]))
    hat = np.zeros((len(rows), width + d * len(fit.design.balls.names)))
    place = np.full(row_count(fit.design), -1)
    place[rows] = np.arange(len(rows))
    for some in hat_rows(linearisation, fit.observed.x):
        to = place[some.rows]
        hat[to[to >= 0], :width] = some.common[to >= 0]
        alone = (to >= 0) & (some.ball >= 0)
        columns = width + d * some.ball[alone][:, None] + np.arange(d)
        hat[to[alone][:, None], columns] = some.own[alone]
    return np.concatenate(
        [certificate.errors @ hat[place[certificate.rows]] for certificate in certified]
    )
