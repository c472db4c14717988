"""Largest effects of an undetected bias on the quantities that do not depend on the frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from ballplate.gross_errors import Patterns, columns_of_balls
from ballplate.simulator.computing import first_largest_of_columns
from ballplate.simulator.design import Design, offset_sensitivity
from ballplate.simulator.estimation import (
    Coordinates,
    Displacements,
    Distances,
    Linearisation,
    MeasuredPoints,
    Places,
    displacements,
)
from ballplate.simulator.machines import Array, Integers
from ballplate.uncertainty import QUANTITIES, open_above, relative

from .response import Response

if TYPE_CHECKING:
    from scipy.sparse import csc_array, csr_array

# Places of which all pairs are looked at; of more points, or balls of a plate, some are chosen
# evenly.
MOST_PLACES = 200

# Numbers of a product of functions and patterns that are held at once.
AT_ONCE = 2_000_000

SYMBOLS = tuple(symbol for symbol, kind in QUANTITIES.items() if kind.effect)


@dataclass(frozen=True)
class Largest:
    """For k patterns the largest change by a unit of the bias (k,), its function (k,), and the
    latter's uncertainty.

    The function is -1, and the change 0, where there is none that is determined.
    """

    change: Array
    function: Integers
    uncertainty: Array


@dataclass(frozen=True)
class Changes:
    """Linear functions of the displacements of places: rows of `operator` (f, places d), with
    uncertainties (f,).

    The places move by `common` (places d, r) times the common part of a response and, for balls, by
    `own` (places d, n d) times its own part; None for points. These are moved by `direct`
    (places d, k) as well where a bias of one of the k patterns enters the correction itself, as a
    probe's offset does; None for balls. `first` and `second` (f,) are the places of each function,
    or one and its axis.
    """

    operator: csr_array
    common: Array
    own: csr_array | None
    uncertainty: Array
    first: Integers
    second: Integers
    direct: csc_array | None = None

    def largest(self, response: Response) -> Largest:
        """The largest change of a function by each pattern."""
        count = len(response.index)
        change, where = np.zeros(count), np.full(count, -1)
        step = max(AT_ONCE // max(len(self.uncertainty), 1), 1)
        for start in range(0, count if len(self.uncertainty) else 0, step):
            some = slice(start, min(start + step, count))
            moved = self.common @ response.common[some].T
            if self.own is not None:
                moved += (self.own @ response.own[some].T).toarray()
            if self.direct is not None:
                # The estimate moves against the response.
                moved -= self.direct[:, response.index[some]].toarray()
            values = self.operator @ moved
            np.abs(values, out=values)
            where[some] = first_largest_of_columns(values)
            change[some] = values.max(axis=0)
        uncertainty = self.uncertainty[where] if len(self.uncertainty) else np.full(count, np.nan)
        return Largest(change, where, uncertainty)


def changes_of(
    at: Linearisation, given: Coordinates | Distances, biases: Patterns
) -> Callable[[Integers], Changes]:
    """Changes of co-ordinates, or of distances, by some `biases`; of a large artefact, those that
    end at some or the asked balls.
    """
    places, made = given.places, displacements(at, given.places, narrow=False)
    if isinstance(given, Coordinates):
        found = _coordinates(made, places)
        if isinstance(places, MeasuredPoints):
            found = replace(found, direct=_direct(at, places, biases))
        return lambda asked: found
    if isinstance(places, MeasuredPoints):
        chosen = (
            np.arange(len(made.places)) if given.pairs is not None else evenly(len(made.places))
        )
        pairs = (
            np.stack(np.triu_indices(len(chosen), 1), axis=1)
            if given.pairs is None
            else given.pairs
        )
        of_points = replace(
            _distances(made.select(chosen), None, pairs, chosen),
            direct=_direct(
                at, MeasuredPoints(places.points[chosen], places.probes[chosen]), biases
            ),
        )
        return lambda asked: of_points
    kept: dict[bytes, Changes] = {}

    def among(asked: Integers) -> Changes:
        some = evenly(len(made.places))
        others = np.setdiff1d(np.flatnonzero(np.isin(places.labels, asked)), some)
        first, second = np.triu_indices(len(some), 1)
        ends = np.stack([np.repeat(others, len(some)), np.tile(some, len(others))], axis=1)
        pairs = np.concatenate([np.stack([some[first], some[second]], axis=1), ends])
        pairs = pairs if given.pairs is None else given.pairs
        key = pairs.tobytes()
        if key not in kept:
            kept.clear()
            # Moving all balls in each batch would take time with the square of their number.
            used = np.union1d(some, pairs)
            moved, pairs = made.select(used), np.searchsorted(used, pairs)
            own = _own_parts(at, moved, places.index[used])
            kept[key] = _distances(moved, own, pairs, places.labels[used])
        return kept[key]

    return among


def across_probes(design: Design) -> Distances | None:
    """Distances between points measured with any of the probes that measuring tasks use, at some
    evaluation points; None where these are U6, or there is no task.
    """
    probes = np.unique(design.tasks.probes)
    if set(probes.tolist()) <= {design.evaluation.probe}:
        return None
    points = design.evaluation.points[evenly(len(design.evaluation.points))]
    points = points[:: max(-(-len(points) * len(probes) // MOST_PLACES), 1)]
    each = np.repeat(probes, len(points))
    return Distances(MeasuredPoints(np.tile(points, (len(probes), 1)), each))


def evenly(count: int) -> Integers:
    """Indices of up to `MOST_PLACES` of `count` places.

    >>> evenly(3).tolist(), len(evenly(1000)), int(evenly(1000)[-1])
    ([0, 1, 2], 200, 999)
    """
    if count <= MOST_PLACES:
        return np.arange(count)
    return np.linspace(0, count - 1, MOST_PLACES).round().astype(np.int64)


def _direct(at: Linearisation, places: MeasuredPoints, biases: Patterns) -> csc_array:
    """Changes (n d, k) of corrected points x + e(x, a, p) by p itself, where that is wrong."""
    from scipy.sparse import coo_array

    state, chosen = at.state, biases.of_kind("probe")
    offsets = state.probes[places.probes]
    by_offset = offset_sensitivity(at.design.model, places.points, state.a, offsets)
    mine = places.probes[:, None] == biases.subject[chosen]
    changes = np.where(mine[:, None, :], by_offset[:, :, biases.axis[chosen]], 0.0)
    changes = changes.reshape(places.points.size, len(chosen))
    row, column = np.nonzero(changes)
    shape = len(changes), len(biases)
    return coo_array((changes[row, column], (row, chosen[column])), shape=shape).tocsc()


def _own_parts(at: Linearisation, made: Displacements, index: Integers) -> csr_array:
    """The parts (places d, n d) that balls have alone, in the columns of all balls."""
    n, d = at.design.balls.places.shape
    own = columns_of_balls(made.own.reshape(-1, d), np.repeat(index, d), n)
    own.eliminate_zeros()
    return own


def _coordinates(made: Displacements, places: Places) -> Changes:
    """Co-ordinates of points that are determined."""
    from scipy.sparse import csr_array, eye

    n, d = made.places.shape
    uncertainty = made.uncertainties.ravel()
    known = np.flatnonzero(~np.isnan(uncertainty))
    operator = csr_array(eye(n * d, format="csr"))[known]
    place, axis = np.divmod(known, d)
    common = made.common.reshape(n * d, -1)
    return Changes(operator, common, None, uncertainty[known], places.labels[place], axis)


def _distances(
    made: Displacements, own: csr_array | None, pairs: Integers, labels: Integers
) -> Changes:
    """Distances between pairs (m, 2) of places that are apart and, where they are as drawn,
    determined.
    """
    from scipy.sparse import coo_array

    n, d = made.places.shape
    places, common, null, drawn = relative(made)
    first, second = pairs.T
    apart = np.linalg.norm(places[first] - places[second], axis=1) > 0.0
    first, second = first[apart], second[apart]

    def by_places(places: Array) -> csr_array:
        unit = places[first] - places[second]
        length = np.linalg.norm(unit, axis=1)
        unit /= np.where(length > 0.0, length, 1.0)[:, None]
        row = np.repeat(np.arange(len(first)), 2 * d)
        column = np.concatenate(
            [d * first[:, None] + np.arange(d), d * second[:, None] + np.arange(d)], axis=1
        )
        value = np.concatenate([unit, -unit], axis=1)
        return coo_array((value.ravel(), (row, column.ravel())), shape=(len(first), n * d)).tocsr()

    operator = by_places(places)
    change = (by_places(drawn) if null.shape[2] else operator) @ null.reshape(n * d, null.shape[2])
    known = np.linalg.norm(change, axis=1) <= open_above(null)
    operator, first, second = operator[known], first[known], second[known]
    flat = common.reshape(n * d, common.shape[2])
    variance = np.zeros(len(first))
    for start in range(0, flat.shape[1], 100):
        variance += ((operator @ flat[:, start : start + 100]) ** 2).sum(axis=1)
    if own is not None:
        variance += np.asarray((operator @ own).power(2).sum(axis=1)).ravel()
    return Changes(operator, flat, own, np.sqrt(variance), labels[first], labels[second])
