"""Largest effects of an undetected bias on the quantities that do not depend on the frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.computing import evenly_spread, first_largest_of_columns
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

from .bias_patterns import Patterns
from .remainders import columns_of_balls
from .response import Response

if TYPE_CHECKING:
    from scipy.sparse import csc_array, csr_array

# Locations whose pairs are all evaluated; of more points, or balls of a plate, an even selection.
MOST_PLACES = 200

# Values of a product of functions and patterns in memory.
AT_ONCE = 2_000_000

SYMBOLS = tuple(symbol for symbol, kind in QUANTITIES.items() if kind.effect)


@dataclass(frozen=True)
class Largest:
    """Largest change by a unit of each bias (k,), its function (k,), and the function's uncertainty
    (k,).

    Without a determined function, the function is -1 and the change 0.
    """

    change: Array
    function: Integers
    uncertainty: Array


@dataclass(frozen=True)
class Changes:
    """Linear functions of displacements: rows of `operator` (f, points d), with uncertainties (f,).

    The points move by `common` (points d, r) times the common part of a response and, if they are
    balls, by `own` (points d, n d) times its own part, else None. `direct` (points d, k) is a
    direct effect of the k patterns on corrected points, as of a probe's offset; None for balls.
    `first` and `second` (f,) are the points of each function, or one and its axis.
    """

    operator: csr_array
    common: Array
    own: csr_array | None
    uncertainty: Array
    first: Integers
    second: Integers
    direct: csc_array | None = None

    def largest(self, response: Response) -> Largest:
        """Return the largest change of a function by each pattern."""
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
    linearisation: Linearisation, wanted: Coordinates | Distances, biases: Patterns
) -> Callable[[Integers], Changes]:
    """Return a function of balls that returns changes of co-ordinates or distances by some
    `biases`.

    In a large artefact, only distances that end at a selection of balls, or at the given balls,
    count.
    """
    places, moves = wanted.places, displacements(linearisation, wanted.places, narrow=False)
    if isinstance(wanted, Coordinates):
        changes = _coordinates(moves, places)
        if isinstance(places, MeasuredPoints):
            changes = replace(changes, direct=_direct(linearisation, places, biases))
        return lambda balls: changes
    if isinstance(places, MeasuredPoints):
        chosen = (
            np.arange(len(moves.places))
            if wanted.pairs is not None
            else evenly_spread(len(moves.places), MOST_PLACES)
        )
        pairs = (
            np.stack(np.triu_indices(len(chosen), 1), axis=1)
            if wanted.pairs is None
            else wanted.pairs
        )
        of_points = replace(
            _distances(moves.select(chosen), None, pairs, chosen),
            direct=_direct(
                linearisation, MeasuredPoints(places.points[chosen], places.probes[chosen]), biases
            ),
        )
        return lambda balls: of_points
    cached: dict[bytes, Changes] = {}

    def among(balls: Integers) -> Changes:
        selection = evenly_spread(len(moves.places), MOST_PLACES)
        further = np.setdiff1d(np.flatnonzero(np.isin(places.labels, balls)), selection)
        first, second = np.triu_indices(len(selection), 1)
        ends = np.stack(
            [np.repeat(further, len(selection)), np.tile(selection, len(further))], axis=1
        )
        pairs = np.concatenate([np.stack([selection[first], selection[second]], axis=1), ends])
        pairs = pairs if wanted.pairs is None else wanted.pairs
        key = pairs.tobytes()
        if key not in cached:
            cached.clear()
            # Moving all balls in each batch would take time with the square of their number.
            used = np.union1d(selection, pairs)
            moved, pairs = moves.select(used), np.searchsorted(used, pairs)
            own_parts = _own_parts(linearisation, moved, places.index[used])
            cached[key] = _distances(moved, own_parts, pairs, places.labels[used])
        return cached[key]

    return among


def across_probes(design: Design) -> Distances | None:
    """Return distances between points measured with any of the tasks' probes, at some evaluation
    points.

    None if these are U6, or there is no task.
    """
    probes = np.unique(design.tasks.probes)
    if set(probes.tolist()) <= {design.evaluation.probe}:
        return None
    points = design.evaluation.points[evenly_spread(len(design.evaluation.points), MOST_PLACES)]
    points = points[:: max(-(-len(points) * len(probes) // MOST_PLACES), 1)]
    each = np.repeat(probes, len(points))
    return Distances(MeasuredPoints(np.tile(points, (len(probes), 1)), each))


def _direct(linearisation: Linearisation, places: MeasuredPoints, biases: Patterns) -> csc_array:
    """Return changes (n d, k) of corrected points x + e(x, a, p) by an error of p itself."""
    from scipy.sparse import coo_array

    state, chosen = linearisation.state, biases.of_kind("probe")
    offsets = state.probes[places.probes]
    by_offset = offset_sensitivity(linearisation.design.model, places.points, state.a, offsets)
    is_own = places.probes[:, None] == biases.subject[chosen]
    changes = np.where(is_own[:, None, :], by_offset[:, :, biases.axis[chosen]], 0.0)
    changes = changes.reshape(places.points.size, len(chosen))
    row, column = np.nonzero(changes)
    shape = len(changes), len(biases)
    return coo_array((changes[row, column], (row, chosen[column])), shape=shape).tocsc()


def _own_parts(linearisation: Linearisation, moves: Displacements, index: Integers) -> csr_array:
    """Return the parts (balls d, n d) of single balls, in the columns of all balls."""
    n, d = linearisation.design.balls.places.shape
    parts = columns_of_balls(moves.own.reshape(-1, d), np.repeat(index, d), n)
    parts.eliminate_zeros()
    return parts


def _coordinates(moves: Displacements, places: Places) -> Changes:
    """Return the determined co-ordinates of points."""
    from scipy.sparse import csr_array, eye

    n, d = moves.places.shape
    uncertainty = moves.uncertainties.ravel()
    determined = np.flatnonzero(~np.isnan(uncertainty))
    operator = csr_array(eye(n * d, format="csr"))[determined]
    point, axis = np.divmod(determined, d)
    common = moves.common.reshape(n * d, -1)
    return Changes(operator, common, None, uncertainty[determined], places.labels[point], axis)


def _distances(
    moves: Displacements, own: csr_array | None, pairs: Integers, labels: Integers
) -> Changes:
    """Return distances between pairs (m, 2) that are apart and, in the nominal design,
    determined.
    """
    from scipy.sparse import coo_array

    n, d = moves.places.shape
    places, common, null, drawn = relative(moves)
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
    determined = np.linalg.norm(change, axis=1) <= open_above(null)
    operator, first, second = operator[determined], first[determined], second[determined]
    flat = common.reshape(n * d, common.shape[2])
    variance = np.zeros(len(first))
    for start in range(0, flat.shape[1], 100):
        variance += ((operator @ flat[:, start : start + 100]) ** 2).sum(axis=1)
    if own is not None:
        variance += np.asarray((operator @ own).power(2).sum(axis=1)).ravel()
    return Changes(operator, flat, own, np.sqrt(variance), labels[first], labels[second])
