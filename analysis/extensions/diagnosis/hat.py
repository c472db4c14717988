"""Rows of the hat matrix's root, in batches: the share of each observation that the estimate
absorbs.

With the square root G of the covariance and the whitened Jacobian J, the columns of Q = J G are
orthonormal, and H = Q Q' is the hat matrix. G has one block for each ball. So a row of Q has a
common part, and a part of d columns that only rows of the same ball have. Neither J nor H is
formed, and the rank need not be full.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import Design, SharedLayout, State, reading_blocks
from ballplate.simulator.estimation import ROWS_AT_ONCE, Linearisation
from ballplate.simulator.machines import Array, Integers


@dataclass(frozen=True)
class HatRows:
    """Some `rows` (b,) of Q: `common` (b, r), and `own` (b, d) in the columns of `ball` (b,) or
    -1.
    """

    rows: Integers
    common: Array
    own: Array
    ball: Integers


def row_places(design: Design) -> dict[str, slice]:
    """Return the whitened rows by kind: d for each reading of a plate, one for each other
    observation.

    Lengths read together have one row for each length that does not follow from others.
    """
    counts = {"reading": design.dimension * len(design.plate_readings)}
    counts |= {observation.word: observation.count(design) for observation in design.observations}
    ends = np.cumsum(list(counts.values())).tolist()
    return {
        word: slice(end - count, end)
        for (word, count), end in zip(counts.items(), ends, strict=True)
    }


def row_count(design: Design) -> int:
    """Return the number of whitened rows of all observations."""
    return max(rows.stop for rows in row_places(design).values())


def whitened_residuals(design: Design, state: State, x: Array | None) -> Array:
    """Return residuals (rows,) of all observations, in units of their standard uncertainties."""
    chosen = design.plate_readings
    of_readings = reading_blocks(
        design, state, design.readings.select(chosen), None if x is None else x[chosen]
    )
    residuals = [observation.rows(design, state, x).residual for observation in design.observations]
    return np.concatenate([of_readings.residual.ravel(), *residuals])


@single_threaded
def hat_rows(at: Linearisation, x: Array | None) -> Iterator[HatRows]:
    """Return all rows of Q in batches; readings of one ball are together."""
    design, layout, state, balls = at.design, at.layout, at.state, at.balls
    places, d = row_places(design), design.dimension
    width, rank = balls.common.shape[2], at.rank

    def widened(shared: Array) -> Array:
        common = np.zeros((*shared.shape[:-1], width))
        common[..., :rank] = shared @ at.shared
        return common

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
    for observation in design.observations:
        blocks, ends = observation.rows(design, state, x), observation.balls
        is_single = ends.shape[1] == 1
        for part in _slices(len(blocks.residual)):
            shape = (part.stop - part.start, width)
            common = (
                np.zeros(shape) if blocks.by_shared is None else widened(blocks.by_shared[part])
            )
            for ball, slope in zip(ends[part].T, blocks.by_ball[part].swapaxes(0, 1), strict=True):
                common += (slope[:, None] @ balls.common[ball])[:, 0]
            # Tied balls have no part of their own.
            own, alone = np.zeros((len(common), d)), np.full(len(common), -1)
            if is_single:
                alone = ends[part, 0]
                own = (blocks.by_ball[part] @ balls.own[alone])[:, 0]
            yield HatRows(
                places[observation.word].start + np.arange(part.start, part.stop),
                common,
                own,
                alone,
            )


def _slices(count: int) -> list[slice]:
    return [
        slice(start, min(start + ROWS_AT_ONCE, count)) for start in range(0, count, ROWS_AT_ONCE)
    ]


def _reading_batches(design: Design) -> Iterator[Integers]:
    """Return indices of plate readings, whole balls at a time."""
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
    """Return derivatives of readings by the shared parameters (m, d, s) and by their balls (m,
    d, d).
    """
    readings = design.readings.select(chosen)
    blocks = reading_blocks(design, state, readings, None if x is None else x[chosen])
    m, d = len(chosen), design.dimension
    # The extra column takes the derivatives by held parameters, whose column is -1.
    shared = np.zeros((m, d, len(layout) + 1))
    shared[:, :, layout.model] = blocks.by_model
    row = np.arange(m)[:, None]
    shared[row, :, layout.pose_columns[readings.position]] = blocks.by_pose.transpose(0, 2, 1)
    if blocks.by_offset is not None:
        shared[row, :, layout.offset_columns[readings.probe]] = blocks.by_offset.transpose(0, 2, 1)
    if blocks.by_influence is not None:
        shared[:, :, layout.influences] = blocks.by_influence
    return shared[:, :, :-1], blocks.by_ball
