"""Estimators that use distances alone, for comparison with the full one (NPL Report CISE 15/98,
section 3.4).

All of them know the machine by its parameters a only. With x*_ik the corrected point of ball i in
position k with the probe it was read with (each probe's readings count as a position of their own),
L_ijk = |x*_ik - x*_jk|, s_ijk its standard uncertainty taken from the readings' along the line of
the two balls, and D_c the calibrated distance of pair c with uncertainty u_c, they minimise over a,
for a stated set of pairs (i, j):

distances sum over ij, k of ((L_ijk - d_ij) / s_ijk)^2 + sum over c of ((d_c - D_c) / u_c)^2, over
    the distances d_ij as well: equation (12).
cresto sum over ij, k < l of (L_ijk - L_ijl)^2 / (s_ijk^2 + s_ijl^2) + sum over c, k of (L_ck -
    D_c)^2 / (s_ck^2 + u_c^2): a distance does not change with the position; calibrated ones are
    prescribed in every position.
kruth sum over ij, k > 0 of (L_ijk - L_ij0)^2 / (s_ijk^2 + s_ij0^2) + sum over c of (L_c0 - D_c)^2 /
    (s_c0^2 + u_c^2): the plate is what the corrected points of its initial position 0 say, the
    first one in which both balls are read; calibrated distances are additional measurements of it
    (Kruth, Vanherck and de Jonge).

Where a position is read with several probes, the two balls of a distance may also have been read
with different ones; with `across_probes` such distances count like those of one probe. The report
does not say which it used.

Each treats its terms as independent, though they share readings; that is what makes them worse than
the full estimator. Known lengths of length standards, and priors on the machine's parameters, enter
all of them as they do there; calibrated co-ordinates, poses and probe offsets cannot.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from ballplate.simulator.computing import single_threaded, svd
from ballplate.simulator.design import (
    CalibratedDistances,
    Design,
    Lengths,
    Priors,
    nominal_state,
    reading_uncertainties,
    shared_layout,
)
from ballplate.simulator.estimation import (
    MICROMETRE,
    RANK_TOLERANCE,
    GaussNewtonSettings,
    Iteration,
    Status,
)
from ballplate.simulator.machines import Array, Integers

# Share of a distance as read below which an estimate is no machine's.
COLLAPSE_LIMIT = 0.5

AlternativeName = Literal["distances", "cresto", "kruth"]


@dataclass(frozen=True)
class AlternativeSolution:
    """Parameters a (n,) of the machine, the record of iterations, and undetermined directions of a
    (n, deficiency).

    `observations` counts the terms of the sum of squares.
    """

    estimator: AlternativeName
    a: Array
    iterations: tuple[Iteration, ...]
    status: Status
    null: Array
    observations: int

    @property
    def deficiency(self) -> int:
        return self.null.shape[1]


@dataclass(frozen=True)
class _Points:
    """Points read, one per ball, position and probe: scale readings (r, d) and their variances (r,
    d).

    `place` (r,) numbers the pairs of position and probe, `position` (pairs,) states the position
    of each.
    """

    ball: Integers
    probe: Integers
    place: Integers
    position: Integers
    x: Array
    variance: Array


@dataclass(frozen=True)
class _Measured:
    """Distances between two points of one position (m,): pair (m,), points, distance as read, and
    variance.

    `calibrated`, `value` and `uncertainty` (c,) list pairs of known distance. Sorted by pair, then
    by position and probe.
    """

    pair: Integers
    first: Integers
    second: Integers
    length: Array
    variance: Array
    pairs: int
    calibrated: Integers
    value: Array
    uncertainty: Array


# From lengths (m,) and their derivatives (m, n) to whitened rows: residuals (rows,) and derivatives
# (rows, n).
_Rows = Callable[[_Measured, Array, Array], tuple[Array, Array]]


@single_threaded
def alternative_estimate(
    design: Design,
    x: Array,
    pairs: Integers,
    estimator: AlternativeName = "distances",
    across_probes: bool = False,
    settings: GaussNewtonSettings | None = None,
    start: Array | None = None,
) -> AlternativeSolution:
    """Minimise the objective of an alternative estimator by Gauss-Newton, from `start` or a
    machine without errors.

    `x` (readings, d) holds the scale readings, `pairs` (p, 2) ball indices; calibrated pairs are
    added to them. Directions that the distances do not determine stay at the start.
    """
    settings = settings or GaussNewtonSettings()
    points = _points(design, x)
    measured = _measured(design, points, pairs, across_probes)
    a = np.zeros(len(design.model.parameters)) if start is None else start
    scale = np.array([MICROMETRE / parameter.effect for parameter in design.model.parameters])
    record = []
    length, previous, count = 0.0, np.inf, 0
    null = np.zeros((len(a), 0))
    status: Status = "not converged"
    while True:
        residual, derivative = _all_rows(design, x, points, measured, a, _ROWS[estimator])
        count = len(residual)
        total = float(residual @ residual)
        record.append(Iteration(length, total))
        if not (np.isfinite(total) and np.isfinite(derivative).all()):
            status = "diverged"
            break
        triangle = np.asarray(
            np.linalg.qr(np.column_stack([derivative * scale, residual]), mode="r")
        )
        u, values, vh = svd(triangle[: len(a), :-1])
        rank = int((values > RANK_TOLERANCE * values.max(initial=0.0)).sum())
        null = scale[:, None] * vh[rank:].T
        if status == "converged" or len(record) > settings.iterations:
            break
        side = (u.T @ triangle[: len(a), -1])[:rank] / values[:rank]
        step = -scale * (vh[:rank].T @ side)
        size = float(np.abs(step / scale).max(initial=0.0)) * MICROMETRE
        length = float(np.sqrt(step @ step))
        a = a + step
        if size < settings.smallest_step or (size > 0.5 * previous and size < 1e-9):
            status = "converged"
        previous = size
    return AlternativeSolution(estimator, a, tuple(record), status, null, count)


def _points(design: Design, x: Array) -> _Points:
    """Readings of plates, repeats of the same one combined to their weighted mean."""
    chosen = design.plate_readings
    readings = design.readings.select(chosen)
    table = np.stack([readings.position, readings.probe, readings.ball], axis=1)
    unique, point_index = np.unique(table, axis=0, return_inverse=True)
    point_index = point_index.ravel()
    weight = readings.repeats[:, None] / reading_uncertainties(design, readings) ** 2
    total, mean = (
        np.zeros((len(unique), design.dimension)),
        np.zeros((len(unique), design.dimension)),
    )
    np.add.at(total, point_index, weight)
    # Relative to one of them, so that the mean of equal readings is that reading.
    start = np.zeros_like(mean)
    start[point_index] = x[chosen]
    np.add.at(mean, point_index, weight * (x[chosen] - start[point_index]))
    position, probe, ball = unique.T
    places, place = np.unique(unique[:, :2], axis=0, return_inverse=True)
    return _Points(ball, probe, place.ravel(), places[:, 0], start + mean / total, 1.0 / total)


def _measured(design: Design, points: _Points, pairs: Integers, across_probes: bool) -> _Measured:
    lengths_calibrated = design.of(CalibratedDistances)
    calibrated_pairs = np.stack([lengths_calibrated.first, lengths_calibrated.second], axis=1)
    ends, pair_index = np.unique(
        np.sort(np.concatenate([pairs, calibrated_pairs]).reshape(-1, 2), axis=1),
        axis=0,
        return_inverse=True,
    )
    point_of = np.full((len(design.balls.places), len(points.position)), -1)
    point_of[points.ball, points.place] = np.arange(len(points.ball))
    first_point, second_point = np.nonzero(points.position[:, None] == points.position)
    if not across_probes:
        first_point = second_point = np.arange(len(points.position))
    first, second = point_of[ends[:, :1], first_point], point_of[ends[:, 1:], second_point]
    pair, place = np.nonzero((first >= 0) & (second >= 0))
    first, second = first[pair, place], second[pair, place]
    # Along the line as drawn, so that weights stay what they are while parameters change.
    length, along = _apart(points.x + design.probes.offsets[points.probe], first, second)
    variance = np.einsum("md,md->m", along**2, points.variance[first] + points.variance[second])
    calibrated = pair_index.ravel()[len(pairs) :]
    return _Measured(
        pair,
        first,
        second,
        length,
        variance,
        len(ends),
        calibrated,
        lengths_calibrated.value,
        lengths_calibrated.uncertainty,
    )


def _apart(places: Array, first: Integers, second: Integers) -> tuple[Array, Array]:
    """Return lengths (m,) and directions (m, d) of the differences of pairs of points."""
    difference = places[first] - places[second]
    length = np.sqrt((difference**2).sum(axis=1))
    return length, difference / np.maximum(length, np.finfo(float).tiny)[:, None]


def _all_rows(
    design: Design, x: Array, points: _Points, measured: _Measured, a: Array, rows: _Rows
) -> tuple[Array, Array]:
    p = design.probes.offsets[points.probe]
    length, along = _apart(
        points.x + design.model.error(points.x, a, p), measured.first, measured.second
    )
    jacobian = design.model.jacobian(points.x, a, p)
    by_model = np.einsum("md,mdn->mn", along, jacobian[measured.first] - jacobian[measured.second])
    if (length < COLLAPSE_LIMIT * measured.length).any():
        # Without a known length a machine that shrinks everything to a point fits best of all.
        length = np.full_like(length, np.nan)
    row_parts = [rows(measured, length, by_model)]
    if len(design.of(Lengths)):
        of_lengths = design.of(Lengths).rows(design, replace(nominal_state(design), a=a), x)
        assert of_lengths.by_shared is not None
        by_shared = of_lengths.by_shared[:, design.once(shared_layout).model]
        row_parts.append((of_lengths.residual, by_shared))
    priors = design.of(Priors)
    of_model = np.flatnonzero(priors.of_model)
    if len(of_model):
        weight, of_parameters = 1.0 / priors.uncertainty[of_model], priors.by_model[of_model]
        differences = priors.value - priors.of_offsets(design.probes.offsets)
        row_parts.append(
            (
                weight * (of_parameters @ a - differences[of_model]),
                weight[:, None] * of_parameters,
            ),
        )
    return np.concatenate([row_part[0] for row_part in row_parts]), np.concatenate(
        [row_part[1] for row_part in row_parts]
    )


def _free_distances(measured: _Measured, length: Array, by_model: Array) -> tuple[Array, Array]:
    """Rows of equation (12), every pair's distance eliminated by an orthogonal projection of the
    pair's own rows.
    """
    weight = 1.0 / np.sqrt(measured.variance)
    pair = np.concatenate([measured.pair, measured.calibrated])
    by_distance = np.concatenate([-weight, 1.0 / measured.uncertainty])
    residual = np.concatenate([weight * length, -measured.value / measured.uncertainty])
    rows = np.zeros((len(pair), by_model.shape[1] + 1))
    rows[: len(length), :-1] = weight[:, None] * by_model
    rows[:, -1] = residual
    norm = np.bincount(pair, by_distance**2, measured.pairs)
    along = np.zeros((measured.pairs, rows.shape[1]))
    np.add.at(along, pair, by_distance[:, None] * rows)
    rows -= by_distance[:, None] * (along / np.maximum(norm, np.finfo(float).tiny)[:, None])[pair]
    return rows[:, -1], rows[:, :-1]


def _differences(
    measured: _Measured, length: Array, by_model: Array, first: Integers, second: Integers
) -> tuple[Array, Array]:
    """Rows that say that two measured distances of a pair are equal."""
    weight = 1.0 / np.sqrt(measured.variance[first] + measured.variance[second])
    return weight * (length[first] - length[second]), weight[:, None] * (
        by_model[first] - by_model[second]
    )


def _prescribed(
    measured: _Measured, length: Array, by_model: Array, row: Integers, calibrated: Integers
) -> tuple[Array, Array]:
    """Rows that say that measured distances `row` are those of the certificate, `calibrated`."""
    weight = 1.0 / np.sqrt(measured.variance[row] + measured.uncertainty[calibrated] ** 2)
    return weight * (length[row] - measured.value[calibrated]), weight[:, None] * by_model[row]


def _stacked(*parts: tuple[Array, Array]) -> tuple[Array, Array]:
    return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])


def _every_two_positions(
    measured: _Measured, length: Array, by_model: Array
) -> tuple[Array, Array]:
    """Rows of Cresto's estimator."""
    count = np.bincount(measured.pair, minlength=measured.pairs)
    rows = np.arange(len(measured.pair))
    later = (np.cumsum(count)[measured.pair] - 1) - rows
    first = np.repeat(rows, later)
    second = first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(later) - later, later)
    row, calibrated_index = np.nonzero(measured.pair[:, None] == measured.calibrated)
    return _stacked(
        _differences(measured, length, by_model, first, second),
        _prescribed(measured, length, by_model, row, calibrated_index),
    )


def _initial_position(measured: _Measured, length: Array, by_model: Array) -> tuple[Array, Array]:
    """Rows of the estimator of Kruth, Vanherck and de Jonge."""
    count = np.bincount(measured.pair, minlength=measured.pairs)
    start = np.cumsum(count) - count
    rows = np.arange(len(measured.pair))
    first = rows[rows > start[measured.pair]]
    usable = np.flatnonzero(count[measured.calibrated])
    return _stacked(
        _differences(measured, length, by_model, first, start[measured.pair[first]]),
        _prescribed(measured, length, by_model, start[measured.calibrated[usable]], usable),
    )


_ROWS: dict[AlternativeName, _Rows] = {
    "distances": _free_distances,
    "cresto": _every_two_positions,
    "kruth": _initial_position,
}
