"""Values of certificates that two campaigns rest on both, and what their errors do to each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from ballplate.extensions.reliability.hat import hat_rows, row_count, row_places
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

from .compared_maps import ComparedMap, without_shared

# Observations that are values of certificates, each with an error of its own.
SINGLE = (CalibratedDistances, CalibratedCoordinates)


class NothingSharedError(ValueError):
    """Two campaigns of which it is not known that they share anything."""


@dataclass(frozen=True, eq=False)
class CertifiedErrors:
    """Errors of certified values that have a common cause: what one standard deviation of each
    cause, `errors` (causes, m), adds to `rows` (m,) of all whitened observations.

    `key` identifies them: what they are, their values and their uncertainties.
    """

    key: tuple[object, ...]
    rows: Integers
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
        absorbed = _absorbed(one.fit, [own[key] for key in common])
        at = one.fit.functions.at
        model = np.zeros((len(one.values), absorbed.shape[1]))
        model[:, : at.rank] = one.fit.sigma * at.shared[at.layout.model]
        root, shared = without_shared(model, absorbed)
        found.append(replace(one, root=root, shared=shared, absorbed=absorbed))
    return found[0], found[1], count


def _certified(design: Design) -> Iterator[CertifiedErrors]:
    places = row_places(design)
    for one in design.observations:
        start = places[one.word].start
        if isinstance(one, SINGLE):
            for k in range(len(one)):
                errors = np.eye(1)[: int(one.uncertainty[k] > 0.0)]
                yield _errors(one, (one.name(design, k),), [k], np.array([start + k]), errors)
        elif isinstance(one, Lengths):
            for number in np.unique(one.certificate).tolist():
                own = np.flatnonzero(one.certificate == number).tolist()
                errors = np.where(one.certificate == number, one.uncertainty, 0.0)
                whitened = design.once(length_whitening).whitened(errors[:, None]).T
                rows = start + np.arange(whitened.shape[1])
                kept = whitened[: int(errors.any())]
                yield _errors(one, (length_name(design, own[0], False),), own[:1], rows, kept)
        elif isinstance(one, JointValues):
            names = tuple(one.name(design, k) for k in range(len(one)))
            first = 0
            for root in one.roots:
                size = len(root.own)
                part = np.arange(first, first + size)
                drawn = np.abs(root.drawn(np.eye(size))).max(axis=1)
                errors = np.eye(size)[drawn > 0.0]
                own_names = names[first : first + size]
                yield _errors(one, own_names, part.tolist(), start + part, errors)
                first += size


def _errors(
    one: Observations, names: tuple[str, ...], chosen: list[int], rows: Integers, errors: Array
) -> CertifiedErrors:
    values = (*one.value[chosen].tolist(), *one.uncertainty[chosen].tolist())
    key = (type(one).__name__, *names, *(round(value, 12) for value in values))
    return CertifiedErrors(key, rows, errors)


@single_threaded
def _absorbed(fit: Fit, certified: list[CertifiedErrors]) -> Array:
    """Rows (q, r) of the root of the hat matrix, of one standard deviation of each error: first the
    columns that all balls share, and then each ball's own.
    """
    at = fit.functions.at
    d, width = fit.design.dimension, at.balls.common.shape[2]
    rows = np.unique(np.concatenate([one.rows for one in certified]))
    hat = np.zeros((len(rows), width + d * len(fit.design.balls.names)))
    place = np.full(row_count(fit.design), -1)
    place[rows] = np.arange(len(rows))
    for some in hat_rows(at, fit.observed.x):
        to = place[some.rows]
        hat[to[to >= 0], :width] = some.common[to >= 0]
        alone = (to >= 0) & (some.ball >= 0)
        columns = width + d * some.ball[alone][:, None] + np.arange(d)
        hat[to[alone][:, None], columns] = some.own[alone]
    return np.concatenate([one.errors @ hat[place[one.rows]] for one in certified])
