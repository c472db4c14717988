"""Rows of the hat matrix's root, in batches: the share of each observation that the estimate
absorbs.

With the square root G of the covariance and the whitened Jacobian J, the columns of Q = J G are
orthonormal, and H = Q Q' is the hat matrix. As G has one block for each ball, a row of Q has a part
that it may share with all others and one of d columns that only rows of the same ball have. Neither
J nor H is formed; nothing here needs full rank.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..computing.threads import single_threaded
from ..design.arrays import Design, State
from ..machines.protocol import Array, Integers
from .elimination import ROWS_AT_ONCE
from .linearisation import Linearisation
from .observations import (
    coordinate_rows,
    distance_rows,
    length_shared_rows,
    prior_rows,
    reading_blocks,
)
from .parameters import SharedLayout


@dataclass(frozen=True)
class RowPlaces:
    """Where the whitened rows of each kind stand: d for each reading of a plate, one for each other
    observation.

    Of lengths read together there are as many rows as lengths that do not follow from others.
    """

    readings: slice
    lengths: slice
    priors: slice
    coordinates: slice
    distances: slice

    def __len__(self) -> int:
        return int(self.distances.stop)


@dataclass(frozen=True)
class HatRows:
    """Some `rows` (b,) of Q: `common` (b, r), and `own` (b, d) in the columns of `ball` (b,), -1
    without one.
    """

    rows: Integers
    common: Array
    own: Array
    ball: Integers


def row_places(design: Design) -> RowPlaces:
    """Lay out the rows of all observations of a design."""
    counts = [
        design.dimension * len(design.plate_readings),
        len(design.length_whitening),
        len(design.priors),
        len(design.coordinates),
        len(design.distances),
    ]
    ends = np.cumsum(counts).tolist()
    return RowPlaces(*(slice(end - count, end) for end, count in zip(ends, counts, strict=True)))


def whitened_residuals(
    design: Design, layout: SharedLayout, state: State, x: Array | None
) -> Array:
    """Residuals (rows,) of all observations, in units of their standard uncertainties."""
    chosen = design.plate_readings
    of_readings = reading_blocks(
        design, state, design.readings.select(chosen), None if x is None else x[chosen]
    )
    of_lengths = (
        length_shared_rows(design, layout, state, x)[0] if len(design.lengths) else np.zeros(0)
    )
    return np.concatenate(
        [
            of_readings.residual.ravel(),
            of_lengths,
            prior_rows(design, layout, state)[0],
            coordinate_rows(design, state).residual,
            distance_rows(design, state).residual,
        ]
    )


@single_threaded
def hat_rows(at: Linearisation, x: Array | None) -> Iterator[HatRows]:
    """All rows of Q, some at a time; readings of one ball come together."""
    design, layout, state, balls = at.design, at.layout, at.state, at.balls
    places, d = row_places(design), design.dimension
    width, rank = balls.common.shape[2], at.rank

    def widened(shared: Array) -> Array:
        common = np.zeros((*shared.shape[:-1], width))
        common[..., :rank] = shared @ at.shared
        return common

    def by_shared(start: int, derivative: Array) -> HatRows:
        m = len(derivative)
        return HatRows(start + np.arange(m), widened(derivative), np.zeros((m, d)), np.full(m, -1))

    for some in _reading_batches(design):
        ball = design.readings.ball[design.plate_readings[some]]
        shared, by_ball = _reading_rows(design, layout, state, x, design.plate_readings[some])
        common = widened(shared) + by_ball @ balls.common[ball]
        own = by_ball @ balls.own[ball]
        rows = d * some[:, None] + np.arange(d)
        yield HatRows(
            rows.ravel(),
            common.reshape(d * len(ball), width),
            own.reshape(-1, d),
            np.repeat(ball, d),
        )
    if len(design.lengths):
        yield by_shared(places.lengths.start, length_shared_rows(design, layout, state, x)[1])
    if len(design.priors):
        yield by_shared(places.priors.start, prior_rows(design, layout, state)[1])
    for part in _slices(len(design.coordinates)):
        ball, derivative = (
            design.coordinates.ball[part],
            coordinate_rows(design, state).derivative[part, None],
        )
        own = (derivative @ balls.own[ball])[:, 0]
        rows = places.coordinates.start + np.arange(part.start, part.stop)
        yield HatRows(rows, (derivative @ balls.common[ball])[:, 0], own, ball)
    for part in _slices(len(design.distances)):
        first, second = design.distances.first[part], design.distances.second[part]
        derivative = distance_rows(design, state).derivative[part, None]
        common = (derivative @ (balls.common[first] - balls.common[second]))[:, 0]
        rows = places.distances.start + np.arange(part.start, part.stop)
        # Balls that distances tie to others have no part of their own.
        yield HatRows(rows, common, np.zeros((len(rows), d)), np.full(len(rows), -1))


def _slices(count: int) -> list[slice]:
    return [
        slice(start, min(start + ROWS_AT_ONCE, count)) for start in range(0, count, ROWS_AT_ONCE)
    ]


def _reading_batches(design: Design) -> Iterator[Integers]:
    """Readings of plates by their place among these, whole balls at a time."""
    ball = design.readings.ball[design.plate_readings]
    order = np.argsort(ball, kind="stable")
    ends = np.cumsum(np.bincount(ball, minlength=1))
    start = 0
    while start < len(order):
        least = min(start + ROWS_AT_ONCE // design.dimension, len(order))
        stop = int(ends[np.searchsorted(ends, least)])
        yield order[start:stop]
        start = stop


def _reading_rows(
    design: Design, layout: SharedLayout, state: State, x: Array | None, chosen: Integers
) -> tuple[Array, Array]:
    """Derivatives of readings by the shared parameters (m, d, s) and by their balls (m, d, d)."""
    readings = design.readings.select(chosen)
    blocks = reading_blocks(design, state, readings, None if x is None else x[chosen])
    m, d = len(chosen), design.dimension
    # What is held goes to the extra column.
    shared = np.zeros((m, d, len(layout) + 1))
    shared[:, :, layout.model] = blocks.by_model
    at = np.arange(m)[:, None]
    shared[at, :, layout.pose_columns[readings.position]] = blocks.by_pose.transpose(0, 2, 1)
    if blocks.by_offset is not None:
        shared[at, :, layout.offset_columns[readings.probe]] = blocks.by_offset.transpose(0, 2, 1)
    return shared[:, :, :-1], blocks.by_ball
