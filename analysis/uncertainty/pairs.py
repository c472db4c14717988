"""Standard uncertainties of the distances between all pairs of many places, in bounded memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing.rounding import comparable
from ballplate.simulator.estimation.functions import Displacements
from ballplate.simulator.geometry.motions import without_rigid_motion
from ballplate.simulator.inputs.quantities import LengthFunction
from ballplate.simulator.machines.protocol import Array, Integers
from numpy.typing import NDArray

# Places on a side of the tiles in which pairs are worked through: their products stay in cache.
TILE = 256


@dataclass(frozen=True)
class PairSummary:
    """Running result over pairs: how many, how many open, sum and maximum of the others and where
    it stands.

    `within` counts those that are no larger than the limit they were compared with.
    """

    count: int = 0
    undetermined: int = 0
    total: float = 0.0
    maximum: float = 0.0
    where: tuple[int, int] = (-1, -1)
    within: int = 0

    def __add__(self, other: PairSummary) -> PairSummary:
        one, two = comparable([self.maximum, other.maximum])
        # Of equal ones the first by its places, so that tiles do not matter.
        top = other if two > one or (two == one and other.where < self.where) else self
        return PairSummary(
            self.count + other.count,
            self.undetermined + other.undetermined,
            self.total + other.total,
            max(self.maximum, other.maximum),
            top.where,
            self.within + other.within,
        )


@dataclass(frozen=True, eq=False)
class PairTile:
    """Pairs of places by index, `first` and `second` (m,): `lengths` and `uncertainties` (m,) in
    metres.

    `is_open` (m,) marks those that an undetermined direction changes, whose uncertainties mean
    nothing.
    """

    first: Integers
    second: Integers
    lengths: Array
    uncertainties: Array
    is_open: NDArray[np.bool_]


def all_pairs(
    moved: Displacements, labels: Integers, limit: LengthFunction | None = None
) -> PairSummary:
    """Standard uncertainty of the distances between all pairs of n places, as `pair_tiles` gives
    them.

    `labels` (n,) name the places in the result.
    """
    return sum((_summary(tile, labels, limit) for tile in pair_tiles(moved)), PairSummary())


def pair_tiles(moved: Displacements) -> Iterator[PairTile]:
    """Standard uncertainties of the distances between all pairs of places, a tile of pairs at a
    time.

    Places that coincide make no pair. Memory is that of a tile.
    """
    places, common, null, drawn = _relative(moved)
    single = common @ common.transpose(0, 2, 1) + moved.own @ moved.own.transpose(0, 2, 1)
    for rows, columns in _tiles(len(places)):
        yield _tile(places, common, single, null, drawn, rows, columns)


def pairs_of(moved: Displacements, pairs: Integers) -> PairTile:
    """Standard uncertainties of the distances between some pairs (m, 2) of places that are
    apart.
    """
    places, common, null, drawn = _relative(moved)
    lengths, variance = np.zeros(len(pairs)), np.zeros(len(pairs))
    change = np.zeros((len(pairs), null.shape[2]))
    # A slice of the pairs at a time: the products of all would take far more memory than the pairs.
    for start in range(0, len(pairs), 2 * TILE):
        part = slice(start, start + 2 * TILE)
        i, j = pairs[part].T
        apart = places[i] - places[j]
        lengths[part] = np.sqrt((apart**2).sum(axis=1))
        unit = apart / lengths[part, None]
        variance[part] = (np.einsum("md,mdr->mr", unit, common[i] - common[j]) ** 2).sum(axis=1)
        for end in (i, j):
            variance[part] += (np.einsum("md,mdr->mr", unit, moved.own[end]) ** 2).sum(axis=1)
        as_drawn = drawn[i] - drawn[j]
        as_drawn /= np.sqrt((as_drawn**2).sum(axis=1))[:, None]
        change[part] = np.einsum("md,mdk->mk", as_drawn, null[i] - null[j])
    open_ = np.sqrt((change**2).sum(axis=1)) > _open_above(null)
    return PairTile(pairs[:, 0], pairs[:, 1], lengths, np.sqrt(variance), open_)


def _relative(moved: Displacements) -> tuple[Array, Array, Array, Array]:
    """Places, displacements, those along undetermined directions, and places as drawn, without what
    all do together.
    """
    if not len(moved.places):
        return moved.places, moved.common, moved.null, moved.drawn
    places, drawn = moved.places - moved.places.mean(axis=0), moved.drawn - moved.drawn.mean(axis=0)
    return (
        places,
        without_rigid_motion(places, moved.common),
        without_rigid_motion(drawn, moved.null),
        drawn,
    )


def _tiles(n: int) -> Iterator[tuple[slice, slice]]:
    edges = [slice(start, min(start + TILE, n)) for start in range(0, n, TILE)]
    for i, rows in enumerate(edges):
        for columns in edges[i:]:
            yield rows, columns


def _tile(
    places: Array,
    common: Array,
    single: Array,
    null: Array,
    drawn: Array,
    rows: slice,
    columns: slice,
) -> PairTile:
    diagonal = rows.start == columns.start
    n, m, d = rows.stop - rows.start, columns.stop - columns.start, places.shape[1]
    difference = [places[rows, None, axis] - places[None, columns, axis] for axis in range(d)]
    # A plate lies in a plane of its own frame, so that one component of all its distances is zero.
    used = [axis for axis in range(d) if difference[axis].any()]
    squared = sum((difference[axis] ** 2 for axis in used), np.zeros((n, m)))
    chosen: NDArray[np.bool_] = np.triu(squared > 0, 1) if diagonal else squared > 0
    weighted = np.zeros((n, m))
    for i in used:
        for j in used[used.index(i) :]:
            product = common[rows, i] @ common[columns, j].T
            product += product if i == j else common[rows, j] @ common[columns, i].T
            np.subtract(
                single[rows, None, i, j] + single[None, columns, i, j], product, out=product
            )
            product *= difference[i]
            product *= difference[j]
            weighted += product if i == j else 2.0 * product
    squared[~chosen] = 1.0
    values = np.sqrt(np.maximum(weighted / squared, 0.0))[chosen]
    open_ = np.zeros(len(values), bool)
    if null.shape[2]:
        apart = drawn[rows, None] - drawn[None, columns]
        change = sum(
            apart[:, :, i, None] * (null[rows, None, i, :] - null[None, columns, i, :])
            for i in range(d)
        )
        length = (apart**2).sum(axis=2)
        size = np.sqrt((np.asarray(change) ** 2).sum(axis=2) / np.where(length > 0.0, length, 1.0))
        open_ = size[chosen] > _open_above(null)
    first, second = np.nonzero(chosen)
    return PairTile(
        rows.start + first, columns.start + second, np.sqrt(squared[chosen]), values, open_
    )


def _summary(tile: PairTile, labels: Integers, limit: LengthFunction | None) -> PairSummary:
    values, open_ = tile.uncertainties, tile.is_open
    if not (~open_).any():
        return PairSummary(len(values), int(open_.sum()))
    determined = np.where(open_, -1.0, values)
    top = int(comparable(determined).argmax())
    where = (int(labels[tile.first[top]]), int(labels[tile.second[top]]))
    within = 0 if limit is None else int((~open_ & (values <= limit.at(tile.lengths))).sum())
    return PairSummary(
        len(values),
        int(open_.sum()),
        float(values[~open_].sum()),
        float(determined.max()),
        where,
        within,
    )


def _open_above(null: Array) -> float:
    """What a null direction must change a distance by to leave it open: well above rounding."""
    return 1e-7 * float(np.sqrt((null**2).sum(axis=2)).max(initial=0.0)) + 1e-13
