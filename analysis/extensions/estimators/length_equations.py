"""The length equations of US 4,437,151 (Hurt and Foss): a machine's metric from bars and gauges,
without weights.

With D the difference of two readings a known length d apart, and G = 1 + E the metric tensor of the
machine's axes,

    d^2 = D' G D = (1 + e1) Dx^2 + 2 e2 Dx Dy + 2 e3 Dx Dz + (1 + e4) Dy^2 + 2 e5 Dy Dz + (1 + e6)
    Dz^2,

equations (100) and (110), are solved for e1 to e6 by least squares, all with the same weight. Those
of lengths that share readings are first reduced to as many as do not follow from others,
uncorrelated where all readings have the same noise. Of a Bryan gauge one end is the pivot c, which
is not read, and d its radius r. Two ways to the centre:

sphere-then-metric the patent's: first c, and r where it is not known, from the equations of a
    sphere (108), |x - c|^2 = r^2, as if the machine were right; then E with c and r held, and the
    lengths of bars beside where they are not known.
length-equations E, c, and r where it is not known, from equations (110) together. They are linear
    in E alone; Gauss-Newton does it.

For ball bars, which have no centre, both are the same, and linear. An orthogonal factorisation
replaces the patent's normal equations.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate.simulator.computing import single_threaded, svd
from ballplate.simulator.design import Design, Lengths, equation_root, length_whitening
from ballplate.simulator.estimation import MICROMETRE, RANK_TOLERANCE, initial_state
from ballplate.simulator.inputs import Flags
from ballplate.simulator.machines import Array, parameters_of_metric

LengthEstimator = Literal["length-equations", "sphere-then-metric"]

# Places of e1 to e6 in the metric tensor.
PLACES = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
ITERATIONS = 30
SMALLEST_STEP = 1e-13


class NotAMetricError(ValueError):
    """The length equations give some differences of readings no length: the readings are not those
    of the design.
    """


@dataclass(frozen=True)
class LengthSolution:
    """Solution of the length equations.

    `factors` (6,) are e1 to e6, `parameters` (6,) the equivalent scale errors of X, Y and Z and
    squareness errors C0Y, B0Z and A0Z, `spread` (6, r) a square root of the covariance of the
    latter from the residuals of the equations, NaN without redundancy. `deficiency` and `null` (6,
    deficiency) are the undetermined directions of the parameters in the equations for all unknowns
    together. `centres` (positions, 3) is NaN without a gauge; `lengths` are the unknown ones.
    `open_factors`, `open_centres` and `open_lengths` mark values that depend on held directions.
    `scatter` is the root of the sum of squares over the degrees of freedom, in square metres.
    """

    estimator: LengthEstimator
    factors: Array
    parameters: Array
    spread: Array
    null: Array
    deficiency: int
    centres: Array
    lengths: Array
    open_factors: Flags
    open_centres: Flags
    open_lengths: Flags
    scatter: float
    equations: int
    degrees_of_freedom: int
    iterations: int
    converged: bool


@single_threaded
def length_estimate(
    design: Design, x: Array, estimator: LengthEstimator = "length-equations"
) -> LengthSolution:
    """Solve the length equations of a three-dimensional design for scale readings x (readings, 3).

    Without a known length, scale errors are relative to their mean.

    :raises NotAMetricError: equations whose solution is not a metric.
    """
    equations = _equations(design, x)
    unknowns = _start(design, x)
    directions = _open_directions(equations, unknowns)
    everything = np.arange(len(unknowns))
    pivoted = equations.pivot >= 0
    if estimator == "sphere-then-metric" and pivoted.any():
        of_spheres = np.unique(equations.free[pivoted])
        unknowns, _, _, _ = _solved(equations.gauges(), unknowns, everything[6:])
        # Lengths of bars belong to the second step.
        bars = np.setdiff1d(np.arange(len(design.unknown_lengths.names)), of_spheres)
        second = np.concatenate([everything[:6], 6 + 3 * equations.pivots + bars])
        estimate, root, iterations, converged = _solved(equations, unknowns, second)
    else:
        estimate, root, iterations, converged = _solved(equations, unknowns, everything, directions)
    residual, _ = _rows(equations, estimate)
    used = root.shape[1]
    freedom = len(residual) - used
    scatter = float(np.sqrt(residual @ residual / freedom)) if freedom > 0 else np.nan
    factors = estimate[:6]
    lengths = estimate[6 + 3 * equations.pivots :]
    try:
        parameters = parameters_of_metric(_tensor(factors))
        if equations.all_free:
            # The scale of the whole is anybody's.
            size = 1.0 + float(parameters[:3].mean())
            lengths = lengths / size
            factors = _factors(_tensor(factors) / size**2)
            parameters = parameters_of_metric(_tensor(factors))
    except ValueError as error:
        raise NotAMetricError(str(error)) from None
    by_factor = _by_factor()
    is_open = (np.abs(directions) > 1e-7 * np.abs(directions).max(initial=0.0)).any(axis=1)
    end = 6 + 3 * equations.pivots
    open_centres = np.zeros(design.positions.origins.shape, bool)
    open_centres[design.gauge_positions] = is_open[6:end].reshape(-1, 3)
    spread = scatter * by_factor @ root[:6] if freedom > 0 else np.full((6, 1), np.nan)
    return LengthSolution(
        estimator,
        factors,
        parameters,
        spread,
        by_factor @ directions[:6],
        directions.shape[1],
        _centres(design, estimate),
        lengths,
        is_open[:6],
        open_centres,
        is_open[end:],
        scatter,
        len(residual),
        freedom,
        iterations,
        converged,
    )


@dataclass(frozen=True)
class _Equations:
    """Rows: the difference of both ends or, of a gauge, the point read (m, 3); pivot, or -1, and
    length of each.

    `direction` (m, 3) is the design's. `known` (m,) are lengths in metres, `free` (m,) numbers of
    unknown ones, -1 for a known length. Each group in `together`, rows and a root (m, r), gives r
    rows. Unknowns (n,) are e1 to e6, the centres of so many `pivots`, unknown lengths.
    """

    place: Array
    direction: Array
    pivot: np.ndarray
    known: Array
    free: np.ndarray
    together: tuple[tuple[np.ndarray, Array], ...] = ()
    pivots: int = 0

    def gauges(self) -> _Equations:
        """The equations of Bryan gauges, whose lengths share no readings."""
        chosen = self.pivot >= 0
        return _Equations(
            self.place[chosen],
            self.direction[chosen],
            self.pivot[chosen],
            self.known[chosen],
            self.free[chosen],
            pivots=self.pivots,
        )

    def reduced(self, rows: Array) -> Array:
        """Of rows (m, ...) of all equations those that are uncorrelated."""
        if not self.together:
            return rows
        joint = np.concatenate([chosen for chosen, _ in self.together])
        return np.concatenate(
            [
                np.delete(rows, joint, axis=0),
                *(root.T @ rows[chosen] for chosen, root in self.together),
            ]
        )

    @property
    def all_free(self) -> bool:
        return bool((self.free >= 0).all())


def _equations(design: Design, x: Array) -> _Equations:
    lengths = design.of(Lengths)
    places_seen = x + design.probes.offsets[design.readings.probe]
    place = places_seen[lengths.first]
    place[~lengths.to_pivot] -= places_seen[lengths.second[~lengths.to_pivot]]
    position = design.readings.position[lengths.first]
    number = np.full(len(design.positions.names), -1)
    number[design.gauge_positions] = np.arange(len(design.gauge_positions))
    free = np.full(len(lengths), -1) if lengths.free is None else lengths.free
    pivot = np.where(lengths.to_pivot, number[position], -1)
    groups = [rows for joint in design.once(length_whitening).joint for rows, *_ in joint.together]
    together = tuple((rows, equation_root(lengths, rows)) for rows in groups)
    return _Equations(
        place,
        lengths.direction,
        pivot,
        lengths.value,
        free,
        together,
        len(design.gauge_positions),
    )


def _start(design: Design, x: Array) -> Array:
    """The centres and lengths that a sphere through the readings has, on a machine without
    errors.
    """
    state = initial_state(design, x)
    centres = state.origins[design.gauge_positions]
    return np.concatenate([np.zeros(6), centres.ravel(), state.lengths])


def _tensor(factors: Array) -> Array:
    metric = np.eye(3)
    for value, (i, j) in zip(factors, PLACES, strict=True):
        metric[i, j] += value
        metric[j, i] = metric[i, j]
    return metric


def _factors(metric: Array) -> Array:
    return np.array([metric[i, j] - (i == j) for i, j in PLACES])


def _differences(equations: _Equations, unknowns: Array) -> tuple[Array, Array]:
    """D (m, 3) and the lengths (m,) to be compared with."""
    pivoted, free = np.flatnonzero(equations.pivot >= 0), np.flatnonzero(equations.free >= 0)
    k = equations.pivots
    difference, length = equations.place.copy(), equations.known.copy()
    difference[pivoted] -= unknowns[6 : 6 + 3 * k].reshape(k, 3)[equations.pivot[pivoted]]
    length[free] = unknowns[6 + 3 * k :][equations.free[free]]
    return difference, length


def _rows(equations: _Equations, unknowns: Array) -> tuple[Array, Array]:
    """D' G D - d^2 (r,) and its derivative by all unknowns (r, n), reduced to uncorrelated
    equations.
    """
    difference, length = _differences(equations, unknowns)
    pulled = difference @ _tensor(unknowns[:6])
    residual = (pulled * difference).sum(axis=1) - length**2
    derivative = _derivative(equations, unknowns, difference, pulled, length)
    return equations.reduced(residual), equations.reduced(derivative)


def _derivative(
    equations: _Equations, unknowns: Array, difference: Array, pulled: Array, length: Array
) -> Array:
    pivoted, free = np.flatnonzero(equations.pivot >= 0), np.flatnonzero(equations.free >= 0)
    rows = np.zeros((len(length), len(unknowns)))
    for column, (i, j) in enumerate(PLACES):
        rows[:, column] = (1.0 if i == j else 2.0) * difference[:, i] * difference[:, j]
    for axis in range(3):
        rows[pivoted, 6 + 3 * equations.pivot[pivoted] + axis] = -2.0 * pulled[pivoted, axis]
    rows[free, 6 + 3 * equations.pivots + equations.free[free]] = -2.0 * length[free]
    return rows


def _open_directions(equations: _Equations, unknowns: Array) -> Array:
    """Return orthonormal undetermined directions (n, k) of the equations, in micrometres and parts
    per million.

    They are those of a machine without errors that reads without noise in the design's directions.
    Other information in the equations is spurious: without a known length, all of them hold if all
    lengths are zero.
    """
    _, length = _differences(equations, unknowns)
    exact = equations.direction * length[:, None]
    rows = equations.reduced(_derivative(equations, unknowns, exact, exact, length)) * MICROMETRE
    _, values, vh = svd(np.linalg.qr(rows, mode="r") if len(rows) > rows.shape[1] else rows)
    return vh[int((values > RANK_TOLERANCE * values.max(initial=0.0)).sum()) :].T


def _solved(
    equations: _Equations,
    start: Array,
    columns: np.ndarray,
    held_directions: Array | None = None,
) -> tuple[Array, Array, int, bool]:
    """Return least-squares values of some unknowns, a square root (n, rank) of (J'J)^+, and the
    iterations.
    """
    unknowns, previous = start, np.inf
    for iteration in range(1, ITERATIONS + 1):
        residual, rows = _rows(equations, unknowns)
        used = rows[:, columns] * MICROMETRE
        if held_directions is not None:
            used = used - (used @ held_directions) @ held_directions.T
        u, values, vh = svd(used, full_matrices=False)
        rank = int((values > RANK_TOLERANCE * values.max(initial=0.0)).sum())
        root = np.zeros((len(unknowns), rank))
        root[columns] = MICROMETRE * vh[:rank].T / values[:rank]
        step = -root @ (u[:, :rank].T @ residual)
        unknowns = unknowns + step
        size = float(np.abs(step).max(initial=0.0))
        if not np.isfinite(size):
            break
        if size < SMALLEST_STEP or (size > 0.5 * previous and size < 1e-9):
            return unknowns, root, iteration, True
        previous = size
    return unknowns, root, iteration, False


def _by_factor() -> Array:
    """Derivative (6, 6) of the scale and squareness errors by e1 to e6 at a machine without
    errors.
    """
    derivative = np.zeros((6, 6))
    for row, (column, value) in enumerate(
        ((0, 0.5), (3, 0.5), (5, 0.5), (1, -1.0), (2, 1.0), (4, -1.0))
    ):
        derivative[row, column] = value
    return derivative


def _centres(design: Design, unknowns: Array) -> Array:
    centres = np.full(design.positions.origins.shape, np.nan)
    pivots = design.gauge_positions
    centres[pivots] = unknowns[6 : 6 + 3 * len(pivots)].reshape(-1, 3)
    return centres
