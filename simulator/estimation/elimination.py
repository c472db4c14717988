"""Orthogonal elimination of the balls, in batches.

The Jacobian of all readings is block-angular (NPL Report CISE 15/98, section 3.5.3): the rows of
one ball involve that ball and the shared parameters (poses, machine errors, offsets). The whitened
rows of ball i are

    [B_i  C_i | r_i],  with  Q_i' [B_i  C_i | r_i] = [R_i  S_i | z_i; 0  T_i | w_i].

The orthogonal Q_i leaves d rows that determine the ball (R_i, S_i and z_i: `ball_root`,
`ball_shared` and `ball_side`), and rows T_i for the shared parameters alone. All T_i go into one
small triangular factor (`root`, `side`), from which `covariance` takes rank, null space and
uncertainties, and `gauss_newton` the step. Time and memory grow in proportion to the readings.
Neither the whole Jacobian nor normal equations are formed: these have the squares of singular
values, of which all below 1e-8 drown in rounding, while the rank is judged at 1e-10. Balls linked
by observations, such as calibrated distances, are kept and eliminated together at the end.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.computing.processes import scipy_linalg, single_threaded
from ballplate.simulator.design.arrays import Design, Rows, measured
from ballplate.simulator.design.measurement import ensure_rows
from ballplate.simulator.design.observations.readings import reading_blocks, reading_weights
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.design.state import State
from ballplate.simulator.inputs.extensions import UnusableError
from ballplate.simulator.inputs.number_arrays import Array, Integers

# Rows handled at once: enough for the matrix products to be efficient, few enough to stay in cache.
ROWS_AT_ONCE = 2048

# Columns that are eliminated before the rest is multiplied by them.
PANEL = 16

# Rows of tied balls absorbed at once, and columns below which a plain decomposition is as fast.
TIED_AT_ONCE = 1024
SMALL = 500


# Weights of rows that differ by more than this are beyond what plain orthogonal transformations
# keep apart: of light rows among heavy ones only 12 of 16 digits are left, and the rank needs 10.
ALIKE = 1e4


@dataclass(frozen=True)
class Orders:
    """Parameters that the columns of a factor's triangles belong to: `ball` (e, d), `kept` (d k,),
    `shared` (s,).
    """

    ball: Integers
    kept: Integers
    shared: Integers


@dataclass(frozen=True)
class Factor:
    """Triangular factor of the whitened observations, with the right-hand side z = Q' r.

    With d dimensions, s shared parameters, e balls eliminated singly and k kept balls: `ball_root`
    (e, d, d) and `ball_shared` (e, d, s) with `ball_side` (e, d) are the rows of the balls
    `eliminated`; `kept_root` (d k, d k), `kept_shared` (d k, s), `kept_side` (d k,) those of the
    balls `kept`; `root` (s, s) and `side` (s,) those of the shared parameters. `sum_of_squares` is
    S^2 at the point of linearisation.

    If the weights of rows differ so widely that the order of columns has to follow them, `orders`
    states the columns of all roots, and `alike` is the factor of the same rows with about equal
    weights, which has the same rank and null space. Otherwise columns are in the order of the
    parameters.
    """

    layout: SharedLayout
    eliminated: Integers
    ball_root: Array
    ball_shared: Array
    ball_side: Array
    kept: Integers
    kept_root: Array
    kept_shared: Array
    kept_side: Array
    root: Array
    side: Array
    sum_of_squares: float
    orders: Orders | None = None
    alike: Factor | None = None


@dataclass(frozen=True)
class _Gathered:
    """Rows of all observations except readings, by subject: a single ball (m,), several balls (m,
    k) together, the shared parameters alone.
    """

    single: tuple[tuple[Integers, Rows], ...]
    tied: tuple[tuple[Integers, Rows], ...]
    shared: tuple[Rows, ...]

    @property
    def sum_of_squares(self) -> float:
        """That of the rows that are not eliminated with a ball."""
        rows = [*self.shared, *(rows for _, rows in self.tied)]
        return sum(float(row.residual @ row.residual) for row in rows)


def _gathered(design: Design, state: State, x: Array | None) -> _Gathered:
    sorted_: tuple[list[tuple[Integers, Rows]], ...] = ([], [], [])
    for observation in design.observations:
        if len(observation):
            balls = observation.balls
            width = balls.shape[1]
            # The number of balls in a row decides when it is used: with none at the end, with one
            # in the batch of that ball, with several after all batches.
            sorted_[min(width, 2)].append((balls, observation.rows(design, state, x)))
    shared, single, tied = sorted_
    return _Gathered(
        tuple((balls[:, 0], rows) for balls, rows in single),
        tuple(tied),
        tuple(rows for _, rows in shared),
    )


@single_threaded
def eliminate(design: Design, layout: SharedLayout, state: State, x: Array | None = None) -> Factor:
    """Factor the observations of a design at `state`.

    `x` (readings, d) holds a scale reading for each of the design's readings, in order. Without it
    the machine is taken to read without error, as for planning.

    :raises UnmatchedReadingsError: `x` has other rows.
    """
    if x is not None:
        ensure_rows(design, design.readings, x)
    if _differ(design, state):
        return _eliminate_graded(design, layout, state, x)
    return _eliminate_alike(design, layout, state, x)


# In one piece: the steps of one elimination, each of which uses up the rows that the one before
# leaves.
def _eliminate_alike(design: Design, layout: SharedLayout, state: State, x: Array | None) -> Factor:
    d, s = design.dimension, len(layout)
    balls_kept, gathered = design.tied_balls, _gathered(design, state, x)
    single = np.setdiff1d(design.plate_balls, balls_kept, assume_unique=True)
    shared = np.zeros((0, s + 1))
    total = 0.0
    roots, tops = [], []
    order = []
    # Tied balls go through the batches too. Their own rows shrink to d each, so that the large
    # triangle of what ties them never holds a reading.
    every = np.concatenate([single, balls_kept])
    for balls, by_ball, by_rest in _batches(design, layout, state, x, every, gathered.single):
        # S^2 at the point of linearisation, before the ball takes its share of the residuals.
        total += float((by_rest[:, :, -1] ** 2).sum())
        q, r = np.linalg.qr(by_ball)
        top = q.transpose(0, 2, 1) @ by_rest
        # (I - Q Q') C: more rows than T_i, with the same products, and no full Q.
        by_rest -= q @ top
        shared = _absorbed(shared, by_rest.reshape(-1, s + 1))
        order.append(balls)
        roots.append(r)
        tops.append(top)
    balls = np.concatenate(order) if order else np.zeros(0, np.int64)
    root = np.concatenate(roots) if roots else np.zeros((0, d, d))
    top = np.concatenate(tops) if tops else np.zeros((0, d, s + 1))

    shared = np.concatenate([shared, *(_with_residual(rows, s) for rows in gathered.shared)])
    total += gathered.sum_of_squares

    is_kept = np.isin(balls, balls_kept)
    balls_kept = balls[is_kept]
    columns = d * len(balls_kept)
    # Triangular already but for the rows of tied balls, which are absorbed some at a time: there
    # may be far more than columns.
    # The residual is the last column, so that the transformations make the right-hand side of it.
    # The last diagonal element is then the root of the sum of squares that no step can remove. It
    # is not kept.
    triangle = np.zeros((columns + s + 1, columns + s + 1), order="F")
    for place, root_of_ball in enumerate(root[is_kept]):
        triangle[d * place : d * place + d, d * place : d * place + d] = root_of_ball
    triangle[:columns, columns:] = top[is_kept].reshape(columns, s + 1)
    triangle[columns:, columns:] = _square(_triangle(shared), s + 1)
    for rows in _tied_rows(gathered, _places(design, balls_kept), columns, s):
        triangle = _with_rows(triangle, rows)
    return Factor(
        layout=layout,
        eliminated=balls[~is_kept],
        ball_root=root[~is_kept],
        ball_shared=top[~is_kept][:, :, :-1],
        ball_side=top[~is_kept][:, :, -1],
        kept=balls_kept,
        kept_root=triangle[:columns, :columns],
        kept_shared=triangle[:columns, columns:-1],
        kept_side=triangle[:columns, -1],
        root=triangle[columns:-1, columns:-1],
        side=triangle[columns:-1, -1],
        sum_of_squares=total,
    )


def ensure_own_rows(design: Design) -> None:
    """Refuse balls of plates whose own rows cannot determine them.

    Each R_i has to be regular: the rank is judged by the shared factor alone, which would be full
    beside a ball that nothing determines. A count of rows suffices: a plate that is read in its
    plane alone has to state its flatness, a row across the plane for each ball.

    :raises UnusableError: a ball has fewer rows of its own than co-ordinates.
    """
    readings, count = design.readings, len(design.balls.names)
    rows = np.bincount(readings.ball, measured(design, readings).sum(axis=1), count)
    for observation in design.observations:
        if len(observation) and observation.balls.shape[1] == 1:
            rows += np.bincount(observation.balls[:, 0], minlength=count)
    loose = design.plate_balls[rows[design.plate_balls] < design.dimension]
    if len(loose):
        text = "has fewer readings than co-ordinates; read it, or leave it out of its artefact"
        raise UnusableError(f"ball {design.ball_label(int(loose[0]))} {text}")


def _differ(design: Design, state: State) -> bool:
    """True if the weights of a design's rows differ by more than `ALIKE`."""
    weights = [
        reading_weights(design, design.readings.select(design.plate_readings)),
        *(
            observation.weights(design, state)
            for observation in design.observations
            if len(observation)
        ),
    ]
    # Zero marks what is not read, such as the co-ordinate across a hole plate, and is no weight.
    weights = [some[some > 0.0] for some in weights]
    largest = max(float(some.max(initial=0.0)) for some in weights)
    smallest = min(float(some.min(initial=np.inf)) for some in weights)
    return largest > ALIKE * smallest


def _weighted_alike(design: Design, state: State) -> Design:
    """The same observations with weights of about one each."""
    # The rank needs no true weights, only comparable ones: W J v = 0 if and only if J v = 0.
    # Repeats are a weight as well.
    readings = replace(
        design.readings, uncertainty=None, repeats=np.ones_like(design.readings.repeats)
    )
    alike = replace(
        design,
        machine=replace(design.machine, repeatability=np.ones(design.dimension)),
        readings=readings,
    )
    return alike.observed(
        *(observation.alike(design, state) for observation in design.observations)
    )


# In one piece: the steps of one elimination, each of which uses up the rows that the one before
# leaves.
def _eliminate_graded(
    design: Design, layout: SharedLayout, state: State, x: Array | None
) -> Factor:
    """The factor where rows' weights differ much: every row keeps its own relative accuracy."""
    from .graded import Collected, without_balls

    d, s = design.dimension, len(layout)
    balls_kept, gathered = design.tied_balls, _gathered(design, state, x)
    place_of = _places(design, balls_kept)
    columns = d * len(balls_kept)
    # Pivots are chosen by the size of columns, so that metres, radians and ratios are first brought
    # to the same effect on points. The residual has no column to be compared.
    scale = np.append(layout.scale, 1.0)
    single = np.setdiff1d(design.plate_balls, balls_kept, assume_unique=True)
    balls, roots, orders, tops = [], [], [], []
    total, shared, tied = 0.0, Collected(s, 1), Collected(columns, s + 1)
    for is_tied, chosen in ((False, single), (True, balls_kept)):
        for batch, by_ball, by_rest in _batches(design, layout, state, x, chosen, gathered.single):
            total += float((by_rest[:, :, -1] ** 2).sum())
            by_rest *= scale
            # Rows come whitened, and the size of their derivatives is their weight. The residual
            # has no part in it: data must not change the order of elimination.
            weights = np.maximum(
                np.abs(by_ball).max(axis=2), np.abs(by_rest[:, :, :-1]).max(axis=2, initial=0.0)
            )
            root, order, top, remaining = without_balls(by_ball, by_rest, weights)
            shared.add(remaining.reshape(-1, s + 1))
            if is_tied:
                rows = np.zeros((len(batch), d, columns + s + 1))
                ball, row = np.ogrid[: len(batch), :d]
                # Each root has the columns of its ball in the order of its own pivots. Here they
                # return to their places, since the triangle of all tied balls chooses its order
                # anew.
                for axis in range(d):
                    rows[ball, row, (d * place_of[batch] + order[:, axis])[:, None]] = root[
                        :, :, axis
                    ]
                rows[:, :, columns:] = top
                tied.add(rows.reshape(len(batch) * d, -1))
                continue
            balls.append(batch)
            roots.append(root)
            orders.append(order)
            tops.append(top)
    total += gathered.sum_of_squares
    for some in gathered.shared:
        shared.add(_with_residual(some, s) * scale)
    for rows in _tied_rows(gathered, place_of, columns, s):
        rows[:, columns:] *= scale
        tied.add(rows)
    of_kept = tied.found()
    shared.add(of_kept.rest)
    of_shared = shared.found()
    top = np.concatenate([np.zeros((0, d, s + 1)), *tops]) / scale
    kept_top = of_kept.side / scale
    return Factor(
        layout=layout,
        eliminated=np.concatenate([np.zeros(0, np.int64), *balls]),
        ball_root=np.concatenate([np.zeros((0, d, d)), *roots]),
        ball_shared=top[:, :, :-1],
        ball_side=top[:, :, -1],
        kept=balls_kept,
        kept_root=of_kept.root,
        kept_shared=kept_top[:, :-1],
        kept_side=kept_top[:, -1],
        root=of_shared.root / layout.scale[of_shared.order],
        side=of_shared.side[:, 0],
        sum_of_squares=total,
        orders=Orders(
            np.concatenate([np.zeros((0, d), np.int64), *orders]), of_kept.order, of_shared.order
        ),
        alike=_eliminate_alike(_weighted_alike(design, state), layout, state, x),
    )


def _places(design: Design, chosen: Integers) -> Integers:
    """Return the index (n,) of each ball among those kept."""
    place_of = np.zeros(len(design.balls.names), np.int64)
    place_of[chosen] = np.arange(len(chosen))
    return place_of


def _with_residual(rows: Rows, s: int) -> Array:
    """Return derivatives by the shared parameters, extended by the residual, (m, s + 1)."""
    with_residual = np.zeros((len(rows.residual), s + 1))
    if rows.by_shared is not None:
        with_residual[:, :-1] = rows.by_shared
    with_residual[:, -1] = rows.residual
    return with_residual


def _tied_rows(gathered: _Gathered, place_of: Integers, columns: int, s: int) -> Iterator[Array]:
    """Rows (m, columns + s + 1) of observations that tie balls together, some at a time, in
    Fortran's order.
    """
    for balls, of_all in gathered.tied:
        for start in range(0, len(balls), TIED_AT_ONCE):
            some = slice(start, start + TIED_AT_ONCE)
            by_ball = of_all.by_ball[some]
            rows = np.zeros((len(by_ball), columns + s + 1), order="F")
            index, d = np.arange(len(by_ball)), by_ball.shape[2]
            for ball, slope in zip(balls[some].T, by_ball.swapaxes(0, 1), strict=True):
                for axis in range(d):
                    # Added, not assigned: blocks of fewer balls repeat their first one, with a
                    # slope of zero.
                    rows[index, d * place_of[ball] + axis] += slope[:, axis]
            if of_all.by_shared is not None:
                rows[:, columns:-1] = of_all.by_shared[some]
            rows[:, -1] = of_all.residual[some]
            yield rows


def _absorbed(triangle: Array, rows: Array) -> Array:
    """Triangular factor of `triangle` (up to n, n) with `rows` (m, n) below it."""
    if len(rows) < ROWS_AT_ONCE // 2:
        return _triangle(np.concatenate([triangle, rows]))
    # Three times as fast on many rows, which pay for the time that it takes to import.
    # Householder transformations of rows below a triangle leave its zeros alone. A decomposition of
    # both stacked does not know that they are zeros.
    above = np.asfortranarray(_square(triangle, rows.shape[1]))
    return np.triu(_by_panels(above, np.asfortranarray(rows), PANEL))


def _with_rows(triangle: Array, rows: Array) -> Array:
    """Return the triangular factor of a square `triangle` with `rows` below it, without stacking
    large ones.
    """
    if len(triangle) < SMALL:
        return _square(_triangle(np.concatenate([triangle, rows])), len(triangle))
    return _by_panels(triangle, rows, 2 * PANEL)


def _by_panels(triangle: Array, rows: Array, panel: int) -> Array:
    """Triangular factor of a square `triangle` with `rows` below it, both in Fortran's order and
    instead of both.
    """
    reduced: Array
    dtpqrt = scipy_linalg().lapack.dtpqrt
    # The first argument says that no part of the rows is triangular.
    reduced, _, _, _ = dtpqrt(
        0, min(panel, len(triangle)), triangle, rows, overwrite_a=1, overwrite_b=1
    )
    return reduced


def _triangle(rows: Array) -> Array:
    return np.asarray(np.linalg.qr(rows, mode="r"))


def _square(triangle: Array, size: int) -> Array:
    """Pad a triangular factor of fewer rows than columns with zero rows."""
    if len(triangle) >= size:
        return triangle[:size]
    return np.concatenate([triangle, np.zeros((size - len(triangle), size))])


def _batches(
    design: Design,
    layout: SharedLayout,
    state: State,
    x: Array | None,
    balls: Integers,
    rows_by_ball: tuple[tuple[Integers, Rows], ...],
) -> Iterator[tuple[Integers, Array, Array]]:
    """Balls a batch at a time: their indices (b,), rows by the ball (b, rows, d), by the rest (b,
    rows, s + 1).

    `rows_by_ball` are the balls (m,) of observations of single ones, and their rows. Balls with
    fewer rows than the most in their batch are filled up with rows of zeros.
    """
    d, s = design.dimension, len(layout)
    readings = design.readings
    chosen = design.plate_readings
    chosen = chosen[np.argsort(readings.ball[chosen], kind="stable")]
    count = np.bincount(readings.ball[chosen], minlength=len(design.balls.names))
    start = np.cumsum(count) - count
    certified = np.concatenate([np.zeros(0, np.int64), *(ball for ball, _ in rows_by_ball)])
    slope = np.concatenate(
        [np.zeros((0, d)), *(ball_rows.by_ball[:, 0] for _, ball_rows in rows_by_ball)]
    )
    by_ball_first = np.argsort(certified, kind="stable")
    extra = np.bincount(certified, minlength=len(design.balls.names))
    extra_start = np.cumsum(extra) - extra
    # Where no shared parameter has a part, columns of zeros are not formed.
    is_mixed = any(ball_rows.by_shared is not None for _, ball_rows in rows_by_ball)
    beside = [
        _with_residual(ball_rows, s) if is_mixed else ball_rows.residual[:, None]
        for _, ball_rows in rows_by_ball
    ]
    known_rest = np.concatenate([np.zeros((0, s + 1 if is_mixed else 1)), *beside])

    # A batch is one array, padded to its longest ball. Sorted by their number of rows, the balls of
    # a batch need little padding.
    rows = d * count + extra
    balls = balls[np.argsort(rows[balls], kind="stable")]
    row = 0
    while row < len(balls):
        most = max(int(rows[balls[row]]), 1)
        batch = balls[row : row + max(ROWS_AT_ONCE // most, 1)]
        row += len(batch)
        m, c = int(count[batch].max(initial=0)), int(extra[batch].max(initial=0))
        # At least d rows, so that the decomposition has a square root for every ball. Rows of zeros
        # change no triangle.
        by_ball = np.zeros((len(batch), max(d * m + c, d), d))
        by_rest = np.zeros((len(batch), max(d * m + c, d), s + 1))
        present = np.arange(m) < count[batch][:, None]
        # The first reading of all stands in for those that a ball does not have; `_fill` clears its
        # rows.
        reading_index = np.where(present, start[batch][:, None] + np.arange(m), 0)
        if m:
            index = chosen[reading_index.ravel()]
            rows_of = reading_blocks(
                design, state, readings.select(index), None if x is None else x[index]
            )
            columns = layout.pose_columns[readings.position[index]]
            if rows_of.by_offset is not None:
                columns = np.concatenate(
                    [columns, layout.offset_columns[readings.probe[index]]], axis=1
                )
            _fill(by_ball[:, : d * m], by_rest[:, : d * m], rows_of, columns, layout, present)
        if c:
            member = np.arange(c) < extra[batch][:, None]
            source = by_ball_first[np.where(member, extra_start[batch][:, None] + np.arange(c), 0)]
            by_ball[:, d * m : d * m + c] = slope[source] * member[:, :, None]
            beside_ball = by_rest[:, d * m : d * m + c, -known_rest.shape[1] :]
            beside_ball[:] = known_rest[source] * member[:, :, None]
        yield batch, by_ball, by_rest


def _fill(by_ball, by_rest, blocks, columns, layout, present) -> None:  # type: ignore[no-untyped-def]
    """Write reading blocks (b m, d, ...) into the rows of a batch."""
    b, m = present.shape
    d = by_ball.shape[2]
    by_ball[:] = blocks.by_ball.reshape(b, m * d, d)
    by_rest[:, :, layout.model] = blocks.by_model.reshape(b, m * d, -1)
    if blocks.by_influence is not None:
        by_rest[:, :, layout.influences] = blocks.by_influence.reshape(b, m * d, -1)
    by_rest[:, :, -1] = blocks.residual.reshape(b, m * d)
    flat = by_rest.reshape(b, m, d, -1)
    ball, place = np.nonzero(present)
    used = columns.reshape(b, m, -1)[ball, place]
    by_column = blocks.by_pose
    if blocks.by_offset is not None:
        by_column = np.concatenate([by_column, blocks.by_offset], axis=2)
    by_pose = by_column.reshape(b, m, d, -1)[ball, place]
    # A reading has each column once, so that plain assignment, without `np.add.at`, is enough. Held
    # parameters have no column, and their derivatives are dropped.
    for j in range(columns.shape[1]):
        free = used[:, j] >= 0
        flat[ball[free], place[free], :, used[free, j]] = by_pose[free, :, j]
    if not present.all():
        absent = ~present
        by_ball.reshape(b, m, d, d)[absent] = 0.0
        flat[absent] = 0.0
