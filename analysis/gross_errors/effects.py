"""What a bias that nobody notices changes in the functions behind U4, U5 and U6, at the most."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.estimation.covariance import blank
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.geometry.motions import without_rigid_motion
from ballplate.simulator.machines.protocol import Array, Integers
from ballplate.simulator.rounding import comparable

from ..corrections import corrected_points, correction_rows
from .response import Response

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Places of which all pairs are looked at; of more points, or balls of a plate, some are chosen evenly.
MOST_PLACES = 200

# Numbers of a product of functions and patterns that are held at once.
AT_ONCE = 2_000_000

SYMBOLS = ("U4", "U5", "U6")


@dataclass(frozen=True)
class Largest:
    """For k patterns the largest change by a unit of the bias (k,), its function (k,), and the latter's uncertainty.

    The function is -1, and the change 0, where there is none that is determined.
    """

    change: Array
    function: Integers
    uncertainty: Array


@dataclass(frozen=True)
class Functions:
    """Linear functions of the displacements of places: rows of `operator` (f, places d), with uncertainties (f,).

    The places move by `common` (places d, r) times the common part of a response and, for balls, by `own`
    (places d, n d) times its own part; None for points. `first` and `second` (f,) are the places of each function, or
    one and its axis.
    """

    operator: csr_array
    common: Array
    own: csr_array | None
    uncertainty: Array
    first: Integers
    second: Integers

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
            values = np.abs(self.operator @ moved)
            where[some] = comparable(values, axis=0).argmax(axis=0)
            change[some] = values.max(axis=0)
        uncertainty = self.uncertainty[where] if len(self.uncertainty) else np.full(count, np.nan)
        return Largest(change, where, uncertainty)

    def changes(self, response: Response) -> Array:
        """Changes (f, k) of all functions by a unit of each pattern's bias; the estimate moves against residuals."""
        moved = self.common @ response.common.T
        if self.own is not None:
            moved += (self.own @ response.own.T).toarray()
        return np.asarray(-(self.operator @ moved))


def error_functions(at: Linearisation) -> Functions:
    """U4: each component of the error function at the evaluation points that is determined."""
    from scipy.sparse import csr_array, eye

    design = at.design
    probes = np.full(len(design.points), design.point_probe)
    rates = correction_rows(design, at.layout, at.state, design.points, probes)
    spread = _points(rates, at)
    if at.drawn is not None:
        rates = correction_rows(design, at.layout, at.drawn.state, design.points, probes)
    null = rates @ at.shared_null
    size = np.sqrt(((rates * at.spectrum.scale) ** 2).sum(axis=2))
    uncertainty = blank(np.sqrt((spread**2).sum(axis=2)), null, size).ravel()
    known = np.flatnonzero(~np.isnan(uncertainty))
    operator = csr_array(eye(len(uncertainty), format="csr"))[known]
    point, axis = np.divmod(known, design.dimension)
    return Functions(operator, spread.reshape(len(uncertainty), spread.shape[2]), None, uncertainty[known], point, axis)


def point_distances(at: Linearisation) -> Functions:
    """U6: distances between corrected points, of at most `MOST_PLACES` of them."""
    design, drawn = at.design, at.as_drawn.state
    chosen = evenly(len(design.points))
    points, probes = design.points[chosen], np.full(len(chosen), design.point_probe)
    spread = _points(correction_rows(design, at.layout, at.state, points, probes), at)
    corrected = corrected_points(design, at.state, points, probes)
    first, second = np.triu_indices(len(points), 1)
    null = correction_rows(design, at.layout, drawn, points, probes) @ at.shared_null
    as_drawn = corrected_points(design, drawn, points, probes)
    return _distances(corrected, spread, null, None, first, second, chosen, as_drawn)


def ball_distances(at: Linearisation) -> Callable[[Integers], Functions]:
    """U5: distances between balls of each artefact; of large ones, those that end at some or the asked balls."""
    from scipy.sparse import coo_array

    design, places, drawn = at.design, at.state.balls, at.as_drawn.state.balls
    n, d = places.shape
    common, null = np.zeros_like(at.balls.common), np.zeros_like(at.ball_null)
    for artefact in np.flatnonzero(design.is_plate):
        mine = np.flatnonzero(design.ball_artefact == artefact)
        common[mine] = without_rigid_motion(places[mine] - places[mine].mean(axis=0), at.balls.common[mine])
        null[mine] = without_rigid_motion(drawn[mine] - drawn[mine].mean(axis=0), at.ball_null[mine])
    first = d * np.arange(n)[:, None, None] + np.zeros((d, d), np.int64)
    row, column = first + np.arange(d)[:, None], first + np.arange(d)
    own = coo_array((at.balls.own.ravel(), (row.ravel(), column.ravel())), shape=(n * d, n * d)).tocsr()
    own.eliminate_zeros()
    kept: dict[bytes, Functions] = {}

    def among(asked: Integers) -> Functions:
        pairs = []
        for artefact in np.flatnonzero(design.is_plate):
            mine = np.flatnonzero(design.ball_artefact == artefact)
            some = mine[evenly(len(mine))]
            pairs.append(some[np.stack(np.triu_indices(len(some), 1))])
            others = np.setdiff1d(np.intersect1d(asked, mine), some)
            pairs.append(np.stack([np.repeat(others, len(some)), np.tile(some, len(others))]))
        first, second = np.concatenate(pairs, axis=1) if pairs else np.zeros((2, 0), np.int64)
        key = first.tobytes()
        if key not in kept:
            kept.clear()
            kept[key] = _distances(places, common, null, own, first, second, np.arange(n), drawn)
        return kept[key]

    return among


def evenly(count: int) -> Integers:
    """Indices of up to `MOST_PLACES` of `count` places.

    >>> evenly(3).tolist(), len(evenly(1000)), int(evenly(1000)[-1])
    ([0, 1, 2], 200, 999)
    """
    if count <= MOST_PLACES:
        return np.arange(count)
    return np.linspace(0, count - 1, MOST_PLACES).round().astype(np.int64)


def _points(rates: Array, at: Linearisation) -> Array:
    """Spread (p, d, r) of points, as wide as that of balls."""
    spread = np.zeros((*rates.shape[:2], at.balls.common.shape[2]))
    spread[:, :, : at.rank] = rates @ at.shared
    return spread


def _distances(
    places: Array,
    common: Array,
    null: Array,
    own: csr_array | None,
    first: Integers,
    second: Integers,
    labels: Integers,
    drawn: Array,
) -> Functions:
    """Distances between places `first` and `second` that are determined where places are as `drawn`."""
    from scipy.sparse import coo_array

    n, d = places.shape
    centred = places - places.mean(axis=0) if n else places
    if own is None:
        common = without_rigid_motion(centred, common)
        null = without_rigid_motion(drawn - drawn.mean(axis=0) if n else drawn, null)
    apart = np.sqrt(((centred[first] - centred[second]) ** 2).sum(axis=1)) > 0.0
    first, second = first[apart], second[apart]

    def by_places(places: Array) -> csr_array:
        unit = places[first] - places[second]
        length = np.sqrt((unit**2).sum(axis=1))
        unit /= np.where(length > 0.0, length, 1.0)[:, None]
        row = np.repeat(np.arange(len(first)), 2 * d)
        column = np.concatenate([d * first[:, None] + np.arange(d), d * second[:, None] + np.arange(d)], axis=1)
        value = np.concatenate([unit, -unit], axis=1)
        return coo_array((value.ravel(), (row, column.ravel())), shape=(len(first), n * d)).tocsr()

    operator = by_places(centred)
    change = (by_places(drawn) if null.shape[2] else operator) @ null.reshape(n * d, null.shape[2])
    limit = 1e-7 * float(np.sqrt((null**2).sum(axis=2)).max(initial=0.0)) + 1e-13
    known = np.sqrt((change**2).sum(axis=1)) <= limit
    operator, first, second = operator[known], first[known], second[known]
    flat = common.reshape(n * d, common.shape[2])
    variance = np.zeros(len(first))
    for start in range(0, flat.shape[1], 100):
        variance += ((operator @ flat[:, start : start + 100]) ** 2).sum(axis=1)
    if own is not None:
        variance += np.asarray((operator @ own).power(2).sum(axis=1)).ravel()
    return Functions(operator, flat, own, np.sqrt(variance), labels[first], labels[second])
