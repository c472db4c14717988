"""A dense reference for the uncertainties U1 to U6: the definitions written out, and nothing else.

The whole non-linear residual vector is one function of one parameter vector, its Jacobian is taken
by complex steps, the covariance comes from one dense decomposition, and every uncertainty is the
spread of a function of the parameters that is written down as it is defined. It is slow and takes
memory in proportion to the square of the number of balls; no structure is made use of anywhere.

Only plain arrays of a design are read. The error model is written anew: the x axis carries the y
axis, which carries the z axis, which carries the probe (NPL Report CISE 15/98, section 2.2),
right-handed rotations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, cached_property
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
# Parameters and all that follows from them are complex while derivatives are taken.
Values = NDArray[Any]

SYMBOLS = ("U1", "U2", "U3", "U4", "U5", "U6")
STEP = 1e-30
OPEN = 1e-7

# Eigenvalues of a covariance below this fraction of the largest are rounding.
FOLLOWS = 1e-12


@dataclass(frozen=True)
class Function:
    """One of the 18 error functions: motion of `axis`, displacing along or turning about
    `component`.
    """

    name: str
    axis: int
    component: int
    turns: bool
    coefficients: int
    zero_at_one: bool

    @property
    def free(self) -> int:
        return self.coefficients - 1 - int(self.zero_at_one)


def error_functions(position_coefficients: int, rotation_coefficients: int) -> list[Function]:
    """EXX, EYX, EZX, EXY, ... and then EAX, EBX, ...; coefficients count the constant, which is
    zero.
    """
    found = []
    for turns, letters, count in (
        (False, "XYZ", position_coefficients),
        (True, "ABC", rotation_coefficients),
    ):
        for axis in range(3):
            for component in range(3):
                name = "E" + letters[component] + "XYZ"[axis]
                found.append(
                    Function(name, axis, component, turns, count, name in ("EYX", "EZX", "EZY"))
                )
    return found


def legendre(t: Values, count: int) -> Values:
    """Legendre polynomials of 2t - 1 of degrees 0 to count - 1 at t (m,), by their recurrence: (m,
    count).
    """
    s = 2.0 * t - 1.0
    columns = [np.ones_like(s), s]
    for k in range(1, count - 1):
        columns.append(((2 * k + 1) * s * columns[k] - k * columns[k - 1]) / (k + 1))
    return np.stack(columns[:count], axis=1) if count else np.zeros((len(t), 0), s.dtype)


@cache
def monomial_matrix(function: Function) -> Real:
    """From the basis, t P_k(2t - 1) or t (1 - t) P_k(2t - 1), to coefficients of t, t^2, ...:
    exact.
    """
    matrix = np.zeros((function.coefficients - 1, function.free))
    for k in range(function.free):
        for power in range(k + 1):
            whole = (-1) ** (k + power) * comb(k, power) * comb(k + power, power)
            matrix[power, k] += whole
            if function.zero_at_one:
                matrix[power + 1, k] -= whole
    return matrix


def machine_error(
    functions: list[Function], lower: Real, upper: Real, x: Values, a: Values, p: Real
) -> Values:
    """e(x, a, p) at scale readings x (m, 3) with probe offsets p (m, 3)."""
    t = (x - lower) / (upper - lower)
    shift = np.zeros((len(x), 3, 3), np.result_type(x, a))
    turn = np.zeros_like(shift)
    most = max(f.free for f in functions)
    polynomials = [legendre(t[:, axis], most) for axis in range(3)]
    start = 0
    for f in functions:
        along = t[:, f.axis]
        value = polynomials[f.axis][:, : f.free] @ a[start : start + f.free]
        value = value * along * (1.0 - along if f.zero_at_one else 1.0)
        (turn if f.turns else shift)[:, f.axis, f.component] = value
        start += f.free
    total = p.astype(shift.dtype)
    for axis in range(3):
        carried = p.astype(shift.dtype)
        carried[:, axis + 1 :] += (x - lower)[:, axis + 1 :]
        (u, v, w), (along_x, along_y, along_z) = turn[:, axis].T, carried.T
        total = total + shift[:, axis]
        total[:, 0] += v * along_z - w * along_y
        total[:, 1] += w * along_x - u * along_z
        total[:, 2] += u * along_y - v * along_x
    return total


def turned(vectors: Values, matrices: Real) -> Values:
    """`matrices` (k, 3, 3) followed by rotations about `vectors` (k, 3) by their lengths, which are
    short.
    """
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    power = np.broadcast_to(np.eye(3, dtype=vectors.dtype), cross.shape)
    result = power
    for k in range(1, 7):
        power = power @ cross / k
        result = result + power
    return result @ matrices


@dataclass(frozen=True)
class Problem:
    """A design with the numbers of coefficients of its error model, and the point it is linearised
    at.

    `scales` (readings, 3) are the scale readings, `rotations` and `origins` the poses at a zero
    parameter vector, `balls` (n, 3) and `a` the values there; for planning these are the design's
    own and zero.
    """

    design: Any
    functions: list[Function]
    scales: Real
    rotations: Real
    origins: Real
    balls: Real
    a: Real

    @cached_property
    def plate_balls(self) -> list[int]:
        design = self.design
        return [
            b
            for b in range(len(design.balls.places))
            if design.artefacts.is_plate[design.balls.artefact[b]]
        ]

    @cached_property
    def free_poses(self) -> list[tuple[int, int]]:
        """Position and place among (origin, rotation vector) of every free pose parameter."""
        design = self.design
        plates = [
            k
            for k in range(len(design.positions.origins))
            if design.artefacts.is_plate[design.positions.artefact[k]]
        ]
        return [(k, j) for k in plates for j in range(6) if not design.positions.held[k, j]]

    @cached_property
    def length_root(self) -> Real:
        """A root (r, m) of the pseudo-inverse of the lengths' covariance: what follows from others
        tells nothing.
        """
        values, vectors = np.linalg.eigh(length_covariance(self.design))
        kept = values > FOLLOWS * values[-1]
        return np.asarray((vectors[:, kept] / np.sqrt(values[kept])).T)

    @property
    def parameters(self) -> int:
        return 3 * len(self.plate_balls) + len(self.free_poses) + len(self.a)


def planned(design: Any, position_coefficients: int, rotation_coefficients: int) -> Problem:
    """The problem for planning: everything nominal, and a machine without errors."""
    readings = design.readings
    true = np.array(
        [
            design.positions.rotations[k] @ design.balls.places[b] + design.positions.origins[k]
            for b, k in zip(readings.ball, readings.position, strict=True)
        ]
    )
    functions = error_functions(position_coefficients, rotation_coefficients)
    return Problem(
        design,
        functions,
        true - design.probes.offsets[readings.probe],
        design.positions.rotations,
        design.positions.origins,
        design.balls.places,
        np.zeros(sum(f.free for f in functions)),
    )


def unpack(problem: Problem, step: Values) -> tuple[Values, Values, Values, Values]:
    """Balls, rotations, origins and coefficients after a step of all parameters from the problem's
    point.
    """
    n = len(problem.plate_balls)
    balls = problem.balls.astype(step.dtype)
    balls[problem.plate_balls] += step[: 3 * n].reshape(n, 3)
    poses = np.zeros((len(problem.origins), 6), step.dtype)
    for (k, j), value in zip(problem.free_poses, step[3 * n :], strict=False):
        poses[k, j] = value
    rotations = turned(poses[:, 3:], problem.rotations)
    return (
        balls,
        rotations,
        problem.origins + poses[:, :3],
        problem.a + step[len(step) - len(problem.a) :],
    )


def corrected(problem: Problem, x: Real, a: Values, p: Real) -> Values:
    """Corrected points x + e(x, a, p)."""
    volume = problem.design.machine.volume
    return x + machine_error(problem.functions, volume.lower, volume.upper, x, a, p)


def known(design: Any, word: str) -> Any:
    """The arrays of one kind of observations, by the word for it."""
    return next(one for one in design.observations if one.word == word)


def length(difference: Values) -> Values:
    """Euclidean length of the rows, without the conjugation that would spoil complex steps."""
    return np.sqrt((difference**2).sum(axis=-1))


def residuals(problem: Problem, step: Values) -> Values:
    """The whole residual vector, each row in units of its standard uncertainty."""
    design, readings = problem.design, problem.design.readings
    balls, rotations, origins, a = unpack(problem, step)
    points = corrected(problem, problem.scales, a, design.probes.offsets[readings.probe])
    true = np.einsum("mij,mj->mi", rotations[readings.position], balls[readings.ball])
    misfit = (points - true - origins[readings.position]) / design.machine.repeatability
    of_plates = design.artefacts.is_plate[design.balls.artefact[readings.ball]]
    # Repeats stand as rows of their own.
    rows = list(np.repeat(misfit[of_plates], readings.repeats[of_plates], axis=0).ravel())
    given = known(design, "distance")
    for i in range(len(given.first)):
        between = (balls[given.first[i]] - balls[given.second[i]])[: given.dimensions[i]]
        rows.append((length(between) - given.value[i]) / given.uncertainty[i])
    given = known(design, "coordinate")
    for i in range(len(given.ball)):
        rows.append((balls[given.ball[i], given.axis[i]] - given.value[i]) / given.uncertainty[i])
    given = known(design, "length")
    if len(given.first):
        rows.extend(problem.length_root @ length_errors(problem, points))
    return np.array(rows)


def length_errors(problem: Problem, points: Values) -> Values:
    """Lengths of standards between corrected points, less those certified."""
    given = known(problem.design, "length")
    errors: list[Any] = []
    for i in range(len(given.first)):
        between = points[given.first[i]] - points[given.second[i]]
        measured = given.direction[i] @ between if given.projected[i] else length(between)
        errors.append(measured - given.value[i])
    return np.array(errors)


def length_covariance(design: Any) -> Real:
    """Covariance of the lengths of standards: a reading's noise is in each of its lengths, a
    certificate's error, too.

    A length whose repeatability is ignored has nothing in common with any other.
    """
    given = known(design, "length")
    m, d = len(given.first), len(design.machine.repeatability)
    noise = np.zeros((m, d * len(design.readings)))
    for i in range(m):
        if not given.with_repeatability[i]:
            continue
        for sign, end in ((1.0, given.first[i]), (-1.0, given.second[i])):
            own = design.readings.uncertainty
            u = (design.machine.repeatability if own is None else own[end]) / np.sqrt(
                design.readings.repeats[end]
            )
            noise[i, d * end : d * end + d] += sign * given.direction[i] * u
    covariance = noise @ noise.T
    same = given.certificate[:, None] == given.certificate
    return np.asarray(covariance + same * np.outer(given.uncertainty, given.uncertainty))


def jacobian(function: Callable[[Values], Values], parameters: int) -> Real:
    """Derivative (m, parameters) of a function of a step, at zero, by complex steps: exact to
    rounding.
    """
    columns = []
    for k in range(parameters):
        step = np.zeros(parameters, complex)
        step[k] = STEP * 1j
        columns.append(function(step).imag / STEP)
    return np.stack(columns, axis=1)


@dataclass(frozen=True)
class Spread:
    """Square root (parameters, rank) of the covariance, and the undetermined directions
    (parameters, nulls).

    Singular values are those of the Jacobian with its columns scaled to unit length.
    """

    root: Real
    null: Real
    scale: Real
    singular_values: Real

    @property
    def deficiency(self) -> int:
        return self.null.shape[1]

    @property
    def covariance(self) -> Real:
        return self.root @ self.root.T

    def of(self, linear: Real) -> Real:
        """Standard uncertainties (m,) of linear functions (m, parameters); NaN where
        undetermined.
        """
        values = np.sqrt(((linear @ self.root) ** 2).sum(axis=1))
        change = np.sqrt(((linear @ self.null) ** 2).sum(axis=1))
        size = np.sqrt(((linear * self.scale) ** 2).sum(axis=1))
        return np.where(change > OPEN * size, np.nan, values)


def spread(whole: Real, exact: float = 1e-11) -> Spread:
    """Covariance of the parameters from the Jacobian (rows, parameters) of all residuals."""
    norms = np.sqrt((whole**2).sum(axis=0))
    scale = 1.0 / np.where(norms > 0, norms, 1.0)
    # First a triangle, whose singular values are those of the whole.
    _, values, rows = np.linalg.svd(np.linalg.qr(whole * scale, mode="r"))
    values = np.concatenate([values, np.zeros(whole.shape[1] - len(values))])
    rank = int((values > exact * values[0]).sum())
    directions = scale[:, None] * rows.T
    return Spread(directions[:, :rank] / values[:rank], directions[:, rank:], scale, values)


def pairs_of(count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """All pairs of different indices, the smaller one first."""
    first, second = np.triu_indices(count, 1)
    return first, second


def quantities(problem: Problem) -> dict[str, Callable[[Values], Values]]:
    """What U1 to U6 are the standard uncertainties of, each as a function of a step of all
    parameters.

    U5 holds the pairs of the first plate, then those of the second, and so on.
    """
    design = problem.design
    n = len(problem.plate_balls)

    def ball_coordinates(step: Values) -> Values:
        return unpack(problem, step)[0][problem.plate_balls].ravel()

    def pose_parameters(step: Values) -> Values:
        return step[3 * n : 3 * n + len(problem.free_poses)]

    def monomials(step: Values) -> Values:
        a, start, found = unpack(problem, step)[3], 0, []
        for f in problem.functions:
            found.append(monomial_matrix(f) @ a[start : start + f.free])
            start += f.free
        return np.concatenate(found)

    def points(step: Values) -> Values:
        a = unpack(problem, step)[3]
        offsets = np.tile(
            design.probes.offsets[design.evaluation.probe], (len(design.evaluation.points), 1)
        )
        return corrected(problem, design.evaluation.points, a, offsets)

    def ball_distances(step: Values) -> Values:
        balls = unpack(problem, step)[0]
        found = []
        for plate in np.flatnonzero(design.artefacts.is_plate):
            own = balls[design.balls.artefact == plate]
            first, second = pairs_of(len(own))
            found.append(length(own[first] - own[second]))
        return np.concatenate(found)

    def point_distances(step: Values) -> Values:
        places = points(step)
        first, second = pairs_of(len(places))
        return length(places[first] - places[second])

    return {
        "U1": ball_coordinates,
        "U2": pose_parameters,
        "U3": monomials,
        "U4": lambda step: points(step).ravel(),
        "U5": ball_distances,
        "U6": point_distances,
    }


def monomial_names(problem: Problem) -> list[str]:
    """Names of the coefficients behind U3, in order."""
    return [f"{f.name} t^{power}" for f in problem.functions for power in range(1, f.coefficients)]


def linearised(problem: Problem) -> Spread:
    """The covariance of all parameters of a problem."""
    return spread(jacobian(lambda step: residuals(problem, step), problem.parameters))


def standard_uncertainties(
    problem: Problem, found: Spread | None = None, symbols: Iterable[str] = SYMBOLS
) -> dict[str, Real]:
    """Every single standard uncertainty behind U1 to U6, or some of these."""
    found, functions = found or linearised(problem), quantities(problem)
    return {symbol: found.of(jacobian(functions[symbol], problem.parameters)) for symbol in symbols}


def least_squares_step(problem: Problem) -> tuple[Real, float]:
    """The Gauss-Newton step of all parameters from the problem's point, and the sum of squares
    there.
    """
    zero = np.zeros(problem.parameters)
    now = residuals(problem, zero)
    whole = jacobian(lambda step: residuals(problem, step), problem.parameters)
    scale = 1.0 / np.sqrt((whole**2).sum(axis=0))
    return -scale * np.linalg.lstsq(whole * scale, now, rcond=None)[0], float(now @ now)
