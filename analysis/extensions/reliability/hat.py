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
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import Design, SharedLayout, State, reading_blocks
from ballplate.simulator.estimation import ROWS_AT_ONCE, Linearisation
from ballplate.simulator.machines import Array, Integers


@dataclass(frozen=True)
class HatRows:
    """Some `rows` (b,) of Q: `common` (b, r), and `own` (b, d) in the columns of `ball` (b,), -1
    without one.
    """

    rows: Integers
    common: Array
    own: Array
    ball: Integers


def row_places(design: Design) -> dict[str, slice]:
    """Where the whitened rows of each kind stand, by its word: d for each reading of a plate, one
    for each other observation.

    Of lengths read together there are as many rows as lengths that do not follow from others.
    """
    counts = {"reading": design.dimension * len(design.plate_readings)}
    counts |= {one.word: one.count(design) for one in design.observations}
    ends = np.cumsum(list(counts.values())).tolist()
    return {
        word: slice(end - count, end)
        for (word, count), end in zip(counts.items(), ends, strict=True)
    }


def row_count(design: Design) -> int:
    """Number of the whitened rows of all observations."""
    return max(rows.stop for rows in row_places(design).values())


def whitened_residuals(design: Design, state: State, x: Array | None) -> Array:
    """Residuals (rows,) of all observations, in units of their standard uncertainties."""
    chosen = design.plate_readings
    of_readings = reading_blocks(
        design, state, design.readings.select(chosen), None if x is None else x[chosen]
    )
    others = [one.rows(design, state, x).residual for one in design.observations]
    return np.concatenate([of_readings.residual.ravel(), *others])


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
    for one in design.observations:
        found, of = one.rows(design, state, x), one.balls
        is_single = of.shape[1] == 1
        for part in _slices(len(found.residual)):
            shape = (part.stop - part.start, width)
            common = np.zeros(shape) if found.by_shared is None else widened(found.by_shared[part])
            for ball, slope in zip(of[part].T, found.by_ball[part].swapaxes(0, 1), strict=True):
                common += (slope[:, None] @ balls.common[ball])[:, 0]
            # Balls that are tied to others have no part of their own.
            own, alone = np.zeros((len(common), d)), np.full(len(common), -1)
            if is_single:
                alone = of[part, 0]
                own = (found.by_ball[part] @ balls.own[alone])[:, 0]
            yield HatRows(
                places[one.word].start + np.arange(part.start, part.stop), common, own, alone
            )


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
    if blocks.by_influence is not None:
        shared[:, :, layout.influences] = blocks.by_influence
    return shared[:, :, :-1], blocks.by_ball
