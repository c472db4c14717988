"""Information of every candidate on the shared parameters, as one fixed matrix each.

Information adds: that of a selection is the sum of its candidates' matrices. Two changes of basis
keep matrices small and sums accurate. The first omits combinations of balls that no position links
to machine errors: on a plate read as a whole about fifty combinations matter, for any number of
balls. The second makes the information of the whole pool the identity, by a triangular factor from
orthogonal transformations, so that products of rows lose no digits; directions that the pool
leaves undetermined are omitted.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain

import numpy as np
from ballplate.simulator.computing import (
    Report,
    counted,
    scipy_linalg,
    single_threaded,
    svd,
    unreported,
)
from ballplate.simulator.design import (
    Design,
    Lengths,
    length_deviations,
    reading_weights,
    rotation_sensitivity,
)
from ballplate.simulator.estimation import (
    ALIKE,
    RANK_TOLERANCE,
    Collected,
    Triangle,
    triangle as triangular,
)
from ballplate.simulator.experiment import Candidate, Experiment, Position
from ballplate.simulator.inputs import refused
from ballplate.simulator.machines import Array

from .candidate_rows import (
    STEP,
    CandidateRows,
    PoolDesign,
    always,
    calibration_rows,
    draw,
    position_rows,
)

# Ball combinations below this fraction of the largest are rounding.
ROUNDING = 1e-10

# Unit vectors with less than this outside of a space lie in it.
SAME = 1e-6

# What an item on offer may outweigh readings by: in the information of the whole pool, beside which
# that without it must not vanish, and at all, since more than this changes no other uncertainty.
MILDLY = 1e3
EXACTLY = 1e8

# Kinds of reading (which balls, how often) beyond which all combinations of balls are kept.
MOST_KINDS = 24

# Matrices of all candidates together, in bytes; a plan takes two and a half times as much.
MOST_BYTES = 800_000_000


@dataclass(frozen=True)
class InformationBasis:
    """Coordinates z of a plan.

    `balls` (n, d, y) are the relevant combinations of ball co-ordinates. In terms of their amounts
    u (y,) and of shared columns s (c,): u = `ball_root` z - `ball_shared` s, with the ball part of
    z first, and s = `shared_root` z for the rest of z. `ball_open` (y, open) are combinations that
    the pool does not observe.
    """

    balls: Array
    ball_root: Array
    ball_shared: Array
    shared_root: Array
    ball_open: Array

    @property
    def of_balls(self) -> int:
        """Number of z that represent balls."""
        return int(self.ball_root.shape[1])

    @property
    def size(self) -> int:
        return self.of_balls + int(self.shared_root.shape[1])

    def rows(self, by_amount: Array, by_shared: Array) -> Array:
        """Rows in z (m, size) from derivatives by the amounts (m, y) and by shared columns (m,
        c).
        """
        shared = (by_shared - by_amount @ self.ball_shared) @ self.shared_root
        return np.concatenate([by_amount @ self.ball_root, shared], axis=1)


@dataclass(frozen=True)
class Information:
    """Matrices of candidates in the basis of a pool.

    `base` (z, z) is the information without any of the `candidates`, `matrices` (candidates, z, z)
    the addition of each. `deficiency` counts shared directions (c, deficiency), `open_` in
    micrometres, that all candidates together leave undetermined. `frames` (candidates that
    calibrate co-ordinates) hold the part of its plate's frame that each fixes. `pose_ranks` counts
    the parameters of its own pose that each candidate determines, all others known, and `has_rows`
    is true if it observes anything.
    """

    drawn: PoolDesign
    candidates: tuple[Candidate, ...]
    basis: InformationBasis
    base: Array
    matrices: Array
    open_: Array
    frames: Frames
    pose_ranks: tuple[int, ...] = ()
    has_rows: tuple[bool, ...] = ()

    @property
    def deficiency(self) -> int:
        return int(self.open_.shape[1])

    @cached_property
    def shared(self) -> slice:
        """The last z, those of shared parameters."""
        return slice(self.basis.of_balls, self.basis.size)

    def placing(self, artefact: str) -> tuple[int, ...]:
        """Candidates that are positions of an artefact."""
        return _placing(self.candidates, artefact)

    def of(self, chosen: Collection[int]) -> Array:
        """Return the information (z, z) of a selection; frames without a calibration are held,
        which changes no distance.
        """
        members = sorted(chosen)
        return self.base + self.matrices[members].sum(axis=0) + self.frames.held(members)

    def weighted(self, weights: Array) -> Array:
        """Information (z, z) of candidates that count in part, by `weights` (candidates,)."""
        members = np.flatnonzero(weights > 0)
        total = np.tensordot(weights[members], self.matrices[members], axes=1)
        return self.base + total + self.frames.held(members.tolist())


@dataclass(frozen=True)
class Frames:
    """Plate frames fixed by calibrated co-ordinates, for criteria of distances that do not depend
    on the frame.

    `fixed` holds, for each candidate that calibrates co-ordinates, their change with the motions
    of the plates (m, motions), `base` the same for the experiment's own certificates. `rows`
    (motions, z) are the motions' rows. `artefacts` holds, for each artefact, the candidates that
    set it up and the information (z, z) that holds its balls or its length; plates are absent if
    balls themselves count.
    """

    fixed: dict[int, Array]
    base: Array
    rows: Array
    artefacts: tuple[tuple[frozenset[int], Array], ...] = ()

    def held(self, members: Sequence[int]) -> Array:
        """Return the information (z, z) that holds motions fixed by no member, and artefacts that
        no member sets up.
        """
        total = self._held_motions(members)
        for placing, information in self.artefacts:
            if placing.isdisjoint(members):
                total = total + information
        return total

    def _held_motions(self, members: Iterable[int]) -> Array:
        if not self.fixed:
            return np.zeros((self.rows.shape[1],) * 2)
        rows = np.concatenate([self.base, *(self.fixed[k] for k in members if k in self.fixed)])
        # A row of zeros, so that there is a decomposition without any member as well.
        _, values, directions = svd(np.concatenate([rows, np.zeros((1, rows.shape[1]))]))
        rank = int((values > 1e-9 * values.max(initial=0.0)).sum())
        directions_left = directions[rank:] @ self.rows
        size = np.linalg.norm(directions_left, axis=1)
        directions_left = directions_left[size > 1e-9] / size[size > 1e-9, None]
        return directions_left.T @ directions_left


# In one piece: two sets of rows, as stated and evenly weighted, pass through the same steps.
@single_threaded
def pool_information(
    experiment: Experiment,
    candidates: Sequence[Candidate],
    all_balls: bool = False,
    completed: Mapping[int, int] | None = None,
    report: Report = unreported,
) -> Information:
    """Return the information of every candidate of a pool.

    A candidate that completes another, and includes its readings, is given under `completed`: its
    information is the addition to that of the other, in the same pose. `all_balls`, for criteria
    of balls, keeps all combinations of balls and holds no unused plate.

    :raises ExperimentError: no candidate is a position, the matrices are too large, or the request
        cannot be planned.
    """
    positions = [candidate.item for candidate in candidates if isinstance(candidate.item, Position)]
    if not positions:
        text = "has no position to choose; add candidates"
        raise refused(experiment.source, text, "pool")
    drawn = draw(experiment, positions)
    items = {
        k: calibration_rows(drawn, experiment, candidate.item, candidate.name)
        for k, candidate in enumerate(candidates)
        if not isinstance(candidate.item, Position)
    }
    rows_always = always(drawn)
    # What is spanned and what is open does not depend on weights, but to see it these must not
    # differ too much. Values that are exact, or far better than a position, therefore come in three
    # weightings: as heavy as a position (`similar`), where it is seen what they determine; as exact
    # as it makes a difference (`items`), in the information; and in between (`blocks` below), in
    # the basis, in which both are computed.
    similar_always, similar_items, are_similar = rows_always, items, True
    # Rounding of the heaviest rows would hide what the lightest determine, as in an elimination.
    # The basis makes the whole pool the identity, beside which a selection without an exact value
    # must not vanish: so that is only mildly heavier there.
    weight = _position_weight(drawn)
    if any(_differs(rows, weight) for rows in [*rows_always, *chain(*items.values())]):
        are_similar = False
        similar_always = [_weighted(rows, weight, weight) for rows in rows_always]
        similar_items = {
            k: [_weighted(rows, weight, weight) for rows in item] for k, item in items.items()
        }
        items = {
            k: [_weighted(rows, 0.0, EXACTLY * weight) for rows in item]
            for k, item in items.items()
        }
    certificates = [*similar_always, *chain(*similar_items.values())]
    balls = _combinations(drawn, certificates, all_balls)
    size = balls.shape[2] + drawn.shared
    bytes_each = 8 * size**2
    if len(candidates) * bytes_each > MOST_BYTES:
        memory = f"{len(candidates) * bytes_each / 1e9:.3g} GB of memory"
        text = (
            f"{len(candidates)} candidates with {size} parameters each take {memory};"
            f" offer at most {MOST_BYTES // bytes_each}, positions of the experiment and"
            " certificates counted"
        )
        raise refused(experiment.source, text, "pool")

    base = np.concatenate([_in_amounts(rows, balls) for rows in rows_always])
    # A position brings its own pose, and is projected out of its rows as in B' (1 - Q Q') B with an
    # orthonormal basis Q of the pose's columns: what is left is independent of the other choices.
    of_positions = position_rows(drawn)
    pool_rows = []
    pose_ranks = []
    for k in counted(range(len(candidates)), "candidates", len(candidates), report):
        if k in items:
            pool_rows.append(np.concatenate([_in_amounts(r, balls) for r in items[k]]))
            pose_ranks.append(0)
            continue
        rows = next(of_positions)
        pool_rows.append(_reduced(_in_amounts(rows, balls)))
        pose_ranks.append(_range(rows.by_pose).shape[1])
    if are_similar:
        basis, open_ = _basis(balls, drawn.shared, [base, *pool_rows])
    else:
        similar = [
            np.concatenate([_in_amounts(rows, balls) for rows in similar_always]),
            *pool_rows,
        ]
        blocks = [base, *pool_rows]
        for k, item in similar_items.items():
            similar[k + 1] = np.concatenate([_in_amounts(rows, balls) for rows in item])
            blocks[k + 1] = np.concatenate(
                [_in_amounts(_weighted(r, 0.0, MILDLY * weight), balls) for r in items[k]]
            )
        basis, open_ = _basis(balls, drawn.shared, blocks, similar)

    def in_basis(rows: Array) -> Array:
        return basis.rows(rows[:, : balls.shape[2]], rows[:, balls.shape[2] :])

    matrices = np.zeros((len(candidates), basis.size, basis.size))
    for k, reduced in enumerate(pool_rows):
        transformed = in_basis(reduced)
        matrices[k] = transformed.T @ transformed
    # Both share a pose, which has been projected out of each. The difference is what further
    # readings in the same pose add.
    for whole, part in (completed or {}).items():
        matrices[whole] -= matrices[part]
    transformed = in_basis(base)
    has_rows = tuple(len(rows) > 0 for rows in pool_rows)
    unplaced = _unplaced(drawn, candidates, basis, all_balls, has_rows)
    frames = replace(_frames(drawn, similar_always, similar_items, basis), artefacts=unplaced)
    own_base = transformed.T @ transformed
    return Information(
        drawn,
        tuple(candidates),
        basis,
        own_base,
        matrices,
        open_,
        frames,
        tuple(pose_ranks),
        has_rows,
    )


def _in_amounts(rows: CandidateRows, balls: Array) -> Array:
    """Rows (m, y + c) by amounts of ball combinations and shared columns, the pose projected
    out.
    """
    y = balls.shape[2]
    amounts = np.zeros((len(rows), y + rows.by_shared.shape[1]))
    amounts[:, y:] = rows.by_shared
    for ball, slope in zip(rows.balls.T, rows.by_ball.swapaxes(0, 1), strict=True):
        amounts[:, :y] += np.einsum("md,mdy->my", slope, balls[ball])
    if rows.by_pose.shape[1]:
        along = _range(rows.by_pose)
        amounts -= along @ (along.T @ amounts)
    return amounts


def _position_weight(drawn: PoolDesign) -> float:
    """The weight of the heaviest readings and lengths of positions, for a micrometre."""
    of_readings = reading_weights(
        drawn.design, drawn.design.readings.select(drawn.design.plate_readings)
    )
    of_lengths = (
        1.0 / length_deviations(drawn.design, drawn.state, None)[1]
        if len(drawn.design.of(Lengths))
        else of_readings
    )
    return STEP * max(float(of_readings.max(initial=0.0)), float(of_lengths.max(initial=0.0)))


def _sizes(rows: CandidateRows) -> Array:
    """Lengths (m,) of rows."""
    of_ball = (rows.by_ball**2).sum(axis=2).max(axis=1, initial=0.0)
    return np.sqrt(of_ball + (rows.by_shared**2).sum(axis=1))


def _differs(rows: CandidateRows, weight: float) -> bool:
    """True if a row's weight differs from `weight` by more than plain orthogonal transformations
    can separate.
    """
    sizes = _sizes(rows)
    return bool((sizes > ALIKE * weight).any() or (ALIKE * sizes[sizes > 0.0] < weight).any())


def _weighted(rows: CandidateRows, least: float, most: float) -> CandidateRows:
    """Rows without a pose with weights between `least` and `most`."""
    sizes = _sizes(rows)[:, None]
    factor = np.clip(sizes, least, most) / np.where(sizes > 0.0, sizes, 1.0)
    by_ball = factor[:, :, None] * rows.by_ball
    return replace(rows, by_ball=by_ball, by_shared=factor * rows.by_shared)


def _range(columns: Array) -> Array:
    """Return an orthonormal basis of the span of columns."""
    size = np.linalg.norm(columns, axis=0)
    used = columns[:, size > 0] / size[size > 0]
    vectors, values, _ = svd(used, full_matrices=False)
    return vectors[:, values > ROUNDING * values.max(initial=0.0)]


def _reduced(rows: Array) -> Array:
    """Return rows of the same information, at most as many as columns."""
    return rows if len(rows) <= rows.shape[1] else np.asarray(np.linalg.qr(rows, mode="r"))


def _motions(design: Design) -> Array:
    """Small motions of each plate: orthonormal displacements (n, d, motions) of its balls."""
    n, d = design.balls.places.shape
    parts = []
    for artefact in design.artefacts.plates:
        balls = design.balls.of(artefact)
        places = design.balls.places[balls]
        shifts = np.broadcast_to(np.eye(d), (len(balls), d, d))
        turns = rotation_sensitivity(places - places.mean(axis=0))
        moved = _range(np.concatenate([shifts, turns], axis=2).reshape(len(balls) * d, -1))
        parts.append(np.zeros((n, d, moved.shape[1])))
        parts[-1][balls] = moved.reshape(len(balls), d, -1)
    return np.concatenate([np.zeros((n, d, 0)), *parts], axis=2)


def _combinations(drawn: PoolDesign, certificates: list[CandidateRows], all_balls: bool) -> Array:
    """Return combinations (n, d, y) of ball co-ordinates that positions or certificates link to
    shared parameters.

    They span a space that the information of every position maps into itself, so that the omitted
    rest has no effect. Motions of a whole plate, observed by calibrated co-ordinates alone, belong
    to it if such calibrations exist.
    """
    n, d = drawn.design.balls.places.shape
    of_plates = np.repeat(np.isin(np.arange(n), drawn.design.plate_balls), d)
    all_coordinates, most = np.eye(n * d)[:, of_plates], int(of_plates.sum())
    span = _Span(
        _motions(drawn.design).reshape(n * d, -1),
        keeps=any(rows.frame for rows in certificates),
    )
    if all_balls:
        span.add(all_coordinates)
    for rows in certificates:
        span.add(_by_balls(rows, np.eye(len(rows)), n) if len(rows) <= n * d else all_coordinates)
    kinds: dict[bytes, Array] = {}
    for rows in position_rows(drawn):
        if span.rank >= most:
            break
        span.add(_by_balls(rows, np.concatenate([rows.by_shared, STEP * rows.by_pose], axis=1), n))
        kind = _kind(rows, n)
        kinds.setdefault(kind.round(9).tobytes(), kind)
        if len(kinds) > MOST_KINDS:
            span.add(all_coordinates)
    # The span has to be closed: the information of a position on a ball maps a combination of
    # co-ordinates into another one. Combinations outside of a closed span interact with nothing
    # that a criterion about the machine needs, and are omitted.
    grown = -1
    while grown != span.rank and span.rank < most:
        grown = span.rank
        for kind in kinds.values():
            span.add(
                np.einsum("nij,njy->niy", kind, span.vectors.reshape(n, d, -1)).reshape(n * d, -1)
            )
    return span.vectors.reshape(n, d, -1)


def _by_balls(rows: CandidateRows, columns: Array, n: int) -> Array:
    """Products (n * d, columns) of rows' derivatives by balls with other columns (m, columns)."""
    d = rows.by_ball.shape[2]
    total = np.zeros((n, d, columns.shape[1]))
    for ball, slope in zip(rows.balls.T, rows.by_ball.swapaxes(0, 1), strict=True):
        np.add.at(total, ball, slope[:, :, None] * columns[:, None, :])
    return total.reshape(n * d, -1)


def _kind(rows: CandidateRows, n: int) -> Array:
    """Information (n, d, d) of readings on each ball, were all else known, the largest entry being
    1.
    """
    d = rows.by_ball.shape[2]
    total = np.zeros((n, d, d))
    for ball, slope in zip(rows.balls.T, rows.by_ball.swapaxes(0, 1), strict=True):
        np.add.at(total, ball, slope[:, :, None] * slope[:, None, :])
    return total / (np.abs(total).max(initial=0.0) or 1.0)


class _Span:
    """An orthonormal basis, extended by the new part of columns added to it."""

    def __init__(self, motions: Array, keeps: bool) -> None:
        none = motions[:, :0]
        self._without: Array = none if keeps else motions
        self.vectors: Array = motions if keeps else none
        self._largest = 0.0

    @property
    def rank(self) -> int:
        """Dimension, including the excluded space."""
        return int(self.vectors.shape[1] + self._without.shape[1])

    def add(self, columns: Array) -> None:
        self._largest = max(self._largest, float(np.linalg.norm(columns, axis=0).max(initial=0.0)))
        columns = self._new(columns)
        size = np.linalg.norm(columns, axis=0)
        columns = columns[:, size > ROUNDING * self._largest]
        if not columns.shape[1]:
            return
        vectors, values, _ = svd(columns, full_matrices=False)
        new_vectors = self._new(vectors[:, values > ROUNDING * self._largest])
        if new_vectors.shape[1]:
            self.vectors = np.concatenate([self.vectors, np.linalg.qr(new_vectors)[0]], axis=1)

    def _new(self, columns: Array) -> Array:
        # Twice, since a projection leaves rounding in proportion to what it removes.
        for basis in (self._without, self.vectors, self._without, self.vectors):
            columns = columns - basis @ (basis.T @ columns)
        return columns


def _basis(
    balls: Array, shared: int, blocks: list[Array], similar: list[Array] | None = None
) -> tuple[InformationBasis, Array]:
    """Return a basis in which the information of all rows together is the identity, and the
    omitted directions (shared, open).

    `blocks` (m, y + shared) are rows of one candidate each; `similar` the same with similar
    weights, used if those of `blocks` differ too much.
    """
    y = balls.shape[2]
    triangle = np.zeros((0, y + shared))
    for batch in _batches(blocks if similar is None else similar, 4 * (y + shared)):
        triangle = np.asarray(np.linalg.qr(np.concatenate([triangle, *batch]), mode="r"))
    triangle = np.concatenate([triangle, np.zeros((y + shared, y + shared))])[: y + shared]
    # The triangle of all rows has the balls first. A combination of balls with a singular value
    # that counts as zero is not read; what the rows say of shared columns beside it joins the rows
    # below.
    left_vectors, of_balls, by_balls = svd(triangle[:y, :y])
    is_read = of_balls > RANK_TOLERANCE * of_balls.max(initial=0.0)
    # What balls leave of the rows above belongs to shared columns.
    below = np.concatenate([left_vectors[:, ~is_read].T @ triangle[:y, y:], triangle[y:, y:]])
    _, values, right = svd(below, full_matrices=True)
    values = np.concatenate([values, np.zeros(shared - len(values))])
    # Where balls take up all of them, the largest that is left is rounding, too.
    is_known = values > RANK_TOLERANCE * np.linalg.norm(triangle[:, y:])
    ball_open, open_ = by_balls[~is_read].T, right[~is_known].T
    if similar is None:
        ball_root = by_balls[is_read].T / of_balls[is_read]
        ball_shared = ball_root @ left_vectors[:, is_read].T @ triangle[:y, y:]
        return (
            InformationBasis(
                balls, ball_root, ball_shared, right[is_known].T / values[is_known], ball_open
            ),
            open_,
        )
    # With weights that differ much, the same root is formed by the elimination that keeps the
    # accuracy of every row, in the directions that similar weights have shown.
    collected = Collected(int(is_read.sum()), shared)
    for rows in blocks:
        collected.add(np.concatenate([rows[:, :y] @ by_balls[is_read].T, rows[:, y:]], axis=1))
    combined = collected.found()
    ball_root = by_balls[is_read].T @ _inverse(combined)
    of_shared = triangular(combined.rest @ right[is_known].T, np.zeros((len(combined.rest), 0)))
    return (
        InformationBasis(
            balls,
            ball_root,
            ball_root @ combined.side,
            right[is_known].T @ _inverse(of_shared),
            ball_open,
        ),
        open_,
    )


def _inverse(triangle: Triangle) -> Array:
    """Inverse of a triangle, its rows in the order of the columns."""
    inverse = np.empty_like(triangle.root)
    inverse[triangle.order] = scipy_linalg().solve_triangular(
        triangle.root, np.eye(len(triangle.root)), check_finite=False
    )
    return inverse


def _batches(blocks: list[Array], size: int) -> Iterator[list[Array]]:
    batch = []
    for rows in blocks:
        batch.append(rows)
        if sum(map(len, batch)) > size:
            yield batch
            batch = []
    yield batch


def _placing(candidates: Sequence[Candidate], artefact: str) -> tuple[int, ...]:
    return tuple(
        k
        for k, candidate in enumerate(candidates)
        if isinstance(candidate.item, Position) and candidate.item.artefact == artefact
    )


def _unplaced(
    drawn: PoolDesign,
    candidates: Sequence[Candidate],
    basis: InformationBasis,
    all_balls: bool,
    has_rows: Sequence[bool],
) -> tuple[tuple[frozenset[int], Array], ...]:
    """Return, for each artefact, the candidates that set it up, and the information that holds its
    own parameters.
    """
    design, unplaced = drawn.design, []
    n, d = design.balls.places.shape
    for number, name in enumerate(design.artefacts.names):
        if all_balls and design.artefacts.is_plate[number] and _placing(candidates, name):
            continue
        # A standard of which no length has been read is not there.
        placing = frozenset(k for k in _placing(candidates, name) if has_rows[k])
        balls = design.balls.of(number)
        by_ball = basis.balls[balls].reshape(len(balls) * d, -1)
        # Of balls that no combination moves there is nothing to hold, and rounding must not be
        # taken for it.
        by_ball = by_ball[np.abs(by_ball).max(axis=1, initial=0.0) > ROUNDING]
        by_length = np.eye(drawn.shared)[
            drawn.layout.lengths.start
            - drawn.layout.model.start
            + design.unknown_lengths.of(number)
        ]
        rows = np.concatenate(
            [
                basis.rows(by_ball, np.zeros((len(by_ball), drawn.shared))),
                basis.rows(np.zeros((len(by_length), by_ball.shape[1])), by_length),
            ]
        )
        size = float(np.abs(rows).max(initial=0.0))
        if size > 0.0:
            unplaced.append((placing, rows.T @ rows / size**2))
    return tuple(unplaced)


def _frames(
    drawn: PoolDesign,
    candidate_rows: list[CandidateRows],
    items: dict[int, list[CandidateRows]],
    basis: InformationBasis,
) -> Frames:
    """Return the parts of plate frames that calibrated co-ordinates fix."""
    motions = _motions(drawn.design)

    def fixed(rows: list[CandidateRows]) -> Array:
        framed = [r for r in rows if r.frame]
        parts = [np.einsum("md,mdk->mk", r.by_ball[:, 0], motions[r.balls[:, 0]]) for r in framed]
        return np.concatenate([np.zeros((0, motions.shape[2])), *parts])

    fixed_rows = {k: fixed_part for k, rows in items.items() if len(fixed_part := fixed(rows))}
    amounts = np.einsum("ndk,ndy->ky", motions, basis.balls)
    rows = basis.rows(amounts, np.zeros((len(amounts), drawn.shared)))
    return Frames(fixed_rows, fixed(candidate_rows), rows)
