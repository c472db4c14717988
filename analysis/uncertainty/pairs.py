"""Standard uncertainties of the distances between all pairs of many points, in bounded memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from ballplate.simulator.computing.numerics import comparable, first_largest
from ballplate.simulator.estimation.functions import Displacements
from ballplate.simulator.geometry.motions import without_rigid_motion
from ballplate.simulator.inputs.number_arrays import Array, Flags, Integers
from ballplate.simulator.inputs.quantities import LengthFunction

# Points on a side of a tile of pairs, whose products stay in cache.
TILE = 256


@dataclass(frozen=True)
class PairSummary:
    """Running result over pairs: count, undetermined ones, sum and maximum of the others, and the
    pair of the maximum.

    `within` counts pairs up to the limit.
    """

    count: int = 0
    undetermined: int = 0
    total: float = 0.0
    maximum: float = 0.0
    where: tuple[int, int] = (-1, -1)
    within: int = 0

    def __add__(self, other: PairSummary) -> PairSummary:
        maximum, other_maximum = comparable([self.maximum, other.maximum])
        is_equal = other_maximum == maximum
        # Of equal maxima the first pair, so that the division into tiles does not matter.
        is_other = other_maximum > maximum or (is_equal and other.where < self.where)
        top = other if is_other else self
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
    """Pairs of points by index, `first` and `second` (m,): `lengths` and `uncertainties` (m,) in
    metres.

    `is_open` (m,) marks undetermined distances, whose uncertainties are meaningless.
    """

    first: Integers
    second: Integers
    lengths: Array
    uncertainties: Array
    is_open: Flags


def all_pairs(
    moved: Displacements, labels: Integers, limit: LengthFunction | None = None, sigma: float = 1.0
) -> PairSummary:
    """Return a summary of the distances between all pairs of n points, as in `pair_tiles`.

    `labels` (n,) number the points in the result. `sigma` times each uncertainty is compared with
    the `limit`.
    """
    return sum((_summary(tile, labels, limit, sigma) for tile in pair_tiles(moved)), PairSummary())


def pair_tiles(moved: Displacements) -> Iterator[PairTile]:
    """Yield standard uncertainties of the distances between all pairs of points, in tiles.

    Coincident points make no pair. Memory is that of a tile.
    """
    places, common, null, drawn = relative(moved)
    # The variance of a distance between i and j, along the unit vector u, is u' (C_ii + C_jj - C_ij
    # - C_ji) u. The blocks C_ii are formed once for all points, those of two points only within a
    # tile.
    single = common @ common.transpose(0, 2, 1) + moved.own @ moved.own.transpose(0, 2, 1)
    work = np.empty((5 + places.shape[1], min(TILE, len(places)) ** 2))
    for rows, columns in _tiles(len(places)):
        yield _tile(places, common, single, null, drawn, rows, columns, work)


def pairs_of(moved: Displacements, pairs: Integers) -> PairTile:
    """Return standard uncertainties of the distances between pairs (m, 2) of distinct points."""
    places, common, null, drawn = relative(moved)
    lengths, variance = np.zeros(len(pairs)), np.zeros(len(pairs))
    change = np.zeros((len(pairs), null.shape[2]))
    # In slices, since the products of all pairs would take far more memory than the pairs.
    for start in range(0, len(pairs), 2 * TILE):
        chunk = slice(start, start + 2 * TILE)
        i, j = pairs[chunk].T
        difference = places[i] - places[j]
        lengths[chunk] = np.linalg.norm(difference, axis=1)
        unit = difference / lengths[chunk, None]
        variance[chunk] = (np.einsum("md,mdr->mr", unit, common[i] - common[j]) ** 2).sum(axis=1)
        for end in (i, j):
            variance[chunk] += (np.einsum("md,mdr->mr", unit, moved.own[end]) ** 2).sum(axis=1)
        as_drawn = drawn[i] - drawn[j]
        as_drawn /= np.linalg.norm(as_drawn, axis=1)[:, None]
        change[chunk] = np.einsum("md,mdk->mk", as_drawn, null[i] - null[j])
    open_ = np.linalg.norm(change, axis=1) > open_above(null)
    return PairTile(pairs[:, 0], pairs[:, 1], lengths, np.sqrt(variance), open_)


# A motion of all points as one body changes no distance, and may be far larger than the rest. Taken
# out first, it costs no digits in the differences of pairs. Nor does it set the measure of what
# counts as rounding, see `open_above`.
def relative(moved: Displacements) -> tuple[Array, Array, Array, Array]:
    """Return points, displacements and those along undetermined directions without rigid motion,
    and nominal points.
    """
    return (
        moved.places,
        without_rigid_motion(moved.places, moved.common),
        without_rigid_motion(moved.drawn, moved.null),
        moved.drawn,
    )


def _tiles(n: int) -> Iterator[tuple[slice, slice]]:
    # Tiles of about equal size, so that those of the diagonal, half unused, stay small.
    bounds = np.linspace(0, n, -(-n // TILE) + 1).astype(int).tolist()
    edges = [slice(*ends) for ends in pairwise(bounds)]
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
    work: Array,
) -> PairTile:
    diagonal = rows.start == columns.start
    n, m, d = rows.stop - rows.start, columns.stop - columns.start, places.shape[1]
    # Arrays allocated once: allocating takes as long as computing.
    views = [buffer[: n * m].reshape(n, m) for buffer in work]
    # For a tile of n by m pairs, every component of C_ij is one product of n rows and m columns.
    # The sum over components is accumulated with the differences of co-ordinates as weights, and
    # divided by the squared length at the end.
    product, term, along, weighted, squared, *difference = views
    for axis in range(d):
        np.subtract(places[rows, None, axis], places[None, columns, axis], out=difference[axis])
    # A plate is in a plane of its own frame, so that one component of all its distances is zero.
    used = [axis for axis in range(d) if difference[axis].any()]
    squared[:] = weighted[:] = 0.0
    for k, i in enumerate(used):
        squared += np.multiply(difference[i], difference[i], out=term)
        along[:] = 0.0
        for j in used[k:]:
            np.matmul(common[rows, i], common[columns, j].T, out=product)
            # The components (i, j) and (j, i) of C_ij + C_ji. In a tile of the diagonal the second
            # product is the transpose of the first.
            if i == j:
                transposed = product
            elif diagonal:
                transposed = product.T
            else:
                transposed = np.matmul(common[rows, j], common[columns, i].T, out=term)
            np.add(product, transposed, out=term)
            np.subtract(single[rows, None, i, j], term, out=term)
            term += single[None, columns, i, j]
            term *= difference[j]
            along += term
            if i != j:
                along += term
        along *= difference[i]
        weighted += along
    # Every pair once, and none of coincident points.
    chosen: Flags = np.triu(squared > 0, 1) if diagonal else squared > 0
    squares = squared[chosen]
    values = np.sqrt(np.maximum(weighted[chosen] / squares, 0.0))
    open_ = np.zeros(len(values), bool)
    if null.shape[2]:
        difference_drawn = drawn[rows, None] - drawn[None, columns]
        change = sum(
            difference_drawn[:, :, i, None] * (null[rows, None, i, :] - null[None, columns, i, :])
            for i in range(d)
        )
        square = (difference_drawn**2).sum(axis=2)
        size = np.sqrt((np.asarray(change) ** 2).sum(axis=2) / np.where(square > 0.0, square, 1.0))
        open_ = size[chosen] > open_above(null)
    first, second = np.nonzero(chosen)
    return PairTile(rows.start + first, columns.start + second, np.sqrt(squares), values, open_)


def _summary(
    tile: PairTile, labels: Integers, limit: LengthFunction | None, sigma: float
) -> PairSummary:
    values, open_ = tile.uncertainties, tile.is_open
    count = int(open_.sum())
    if count == len(values):
        return PairSummary(count, count)
    determined = np.where(open_, np.nan, values) if count else values
    top = first_largest(determined)
    where = (int(labels[tile.first[top]]), int(labels[tile.second[top]]))
    within = (
        0 if limit is None else int((~open_ & (sigma * values <= limit.at(tile.lengths))).sum())
    )
    return PairSummary(
        len(values),
        count,
        float(np.nansum(determined)),
        float(np.nanmax(determined)),
        where,
        within,
    )


def open_above(null: Array) -> float:
    """Return the change of a distance along a null direction above which the distance is
    undetermined: well above rounding.
    """
    return 1e-7 * float(np.linalg.norm(null, axis=2).max(initial=0.0)) + 1e-13


# Coverage factor of expanded uncertainties.
COVERAGE = 2.0
