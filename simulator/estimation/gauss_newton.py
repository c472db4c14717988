"""Gauss-Newton on the full non-linear problem of NPL Report CISE 15/98, equation (11)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from ballplate.simulator.computing.processes import scipy_linalg, single_threaded
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.design.parameters import SharedLayout, shared_layout
from ballplate.simulator.design.state import State
from ballplate.simulator.geometry.motions import rotation_from_vector
from ballplate.simulator.inputs.number_arrays import Array

from .covariance import (
    Spectrum,
    in_order,
    no_spectrum,
    solve_balls,
    solve_kept,
    solve_shared,
    spectrum,
)
from .elimination import Factor, eliminate, ensure_own_rows
from .linearisation import Linearisation, linearise

Status = Literal["converged", "not converged", "diverged"]
# An estimate with a longer step than this (m, rad), along whatever directions, has left the
# neighbourhood of the drawing.
NEIGHBOURHOOD = 0.01
# What readings seem to tell of directions that are open as drawn is noise, unless noise alone would
# seem to tell as much less often than this.
CHANCE_OF_NOISE = 0.001


@dataclass(frozen=True)
class GaussNewtonSettings:
    """When to stop.

    An iteration is the last when the step, each parameter scaled to its effect in the volume, is
    below `smallest_step` metres, or when it no longer shrinks because rounding is all that is left.
    """

    iterations: int = 20
    smallest_step: float = 1e-13


@dataclass(frozen=True)
class Iteration:
    """One line of the record: Euclidean length of the step that led here, and S^2 here.

    The length mixes metres and radians, as the report's tables do; that of the starting point is
    zero.
    """

    step: float
    sum_of_squares: float


@dataclass(frozen=True)
class Solution:
    """Where the iteration ended: the state, the factor and spectrum there, the record and the
    verdict.
    """

    state: State
    factor: Factor
    spectrum: Spectrum
    iterations: tuple[Iteration, ...]
    status: Status


@single_threaded
def iterate(
    design: Design,
    x: Array,
    start: State,
    settings: GaussNewtonSettings | None = None,
    held_spectrum: Spectrum | None = None,
) -> Solution:
    """Minimise S^2 over balls, poses and machine errors, from `start`.

    `x` (readings, d) holds the scale readings. Undetermined directions stay at the start; with
    `held_spectrum`, see `as_drawn`, its null directions do. A failure to converge is a status, not
    an exception.
    """
    settings = settings or GaussNewtonSettings()
    layout = design.once(shared_layout)
    state = start
    record = []
    length, previous = 0.0, np.inf
    status: Status = "not converged"
    while True:
        # A diverging iteration overflows, which is a status and no warning.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            factor = eliminate(design, layout, state, x)
        record.append(Iteration(length, factor.sum_of_squares))
        if not (np.isfinite(factor.sum_of_squares) and np.isfinite(factor.root).all()):
            found_spectrum = no_spectrum(layout)
            status = "diverged"
            break
        found_spectrum = spectrum(factor, held_spectrum)
        # After the last step the observations are eliminated once more: the factor, spectrum and
        # S^2 of the solution are those at its own state.
        if status == "converged" or len(record) > settings.iterations:
            break
        shared, balls = newton_step(design, factor, found_spectrum)
        size = max(
            float(np.abs(shared / layout.scale).max(initial=0.0)),
            float(np.abs(balls).max(initial=0.0)),
        )
        length = float(np.sqrt(shared @ shared + (balls**2).sum()))
        state = moved(state, layout, shared, balls)
        rounding = size > 0.5 * previous and size < 1e-9
        if size < settings.smallest_step or rounding:
            status = "converged"
        previous = size
    return Solution(state, factor, found_spectrum, tuple(record), status)


def estimate(design: Design, x: Array, settings: GaussNewtonSettings | None = None) -> Solution:
    """Return the estimate from scale readings `x` (readings, d), with starting values from the
    readings.

    Directions undetermined in the nominal design are held: noise alone would lead far along them,
    and the second order of such a step would bias determined parameters. For plates they are
    followed, as in NPL Report CISE 15/98, section 5.4, if the readings determine them, see
    `_tells_of_open`, and only within the neighbourhood: poses slightly off nominal ones would need
    steps of metres. Rank and null space of the solution are those of the nominal design.
    """
    from .initial import initial_state

    design.once(ensure_own_rows)
    start = initial_state(design, x)
    drawn = as_drawn(design)
    solution_held = iterate(design, x, start, settings, drawn)
    # With lengths of standards the least S^2 may be where all lengths are zero, see `as_drawn`.
    if not drawn.deficiency or len(design.of(Lengths)):
        return solution_held
    followed = iterate(design, x, start, settings)
    # Any step on the way counts, also if the iteration has come back.
    went_far = max(iteration.step for iteration in followed.iterations) > NEIGHBOURHOOD
    if followed.status != "converged" or went_far:
        return solution_held
    if solution_held.status == "converged" and not _tells_of_open(
        design, solution_held, followed, drawn.deficiency
    ):
        return solution_held
    # The readings lead to another state, but uncertainties stay those of the nominal rank.
    return replace(followed, spectrum=spectrum(followed.factor, drawn))


def _tells_of_open(
    design: Design, held_solution: Solution, followed: Solution, deficiency: int
) -> bool:
    """True if following the nominally undetermined directions lowers S^2 by more than noise
    explains: an F-test with the standard deviation of the readings.
    """
    from scipy.special import fdtrc

    from .implied_values import implied_count

    freedom = design.observation_count - design.parameter_count
    freedom -= implied_count(design, followed.state)
    if freedom <= 0:
        return False
    sum_left = followed.factor.sum_of_squares
    gained = held_solution.factor.sum_of_squares - sum_left
    ratio = np.inf if sum_left == 0.0 else max(gained, 0.0) / deficiency / (sum_left / freedom)
    return bool(fdtrc(deficiency, freedom, ratio) < CHANCE_OF_NOISE)


def as_drawn(design: Design) -> Spectrum:
    """Return the spectrum of a design in its nominal poses on a machine without errors: the valid
    rank and null space.

    With errors, noise and poses slightly off nominal, the readings appear to determine null
    directions. Following these may lead far astray: without a known length, S^2 is smallest with
    all lengths zero.
    """
    return linearise(design).spectrum


def linearised_fit(design: Design, solution: Solution) -> Linearisation:
    """Return the linearisation at an estimate, with the null directions of the nominal design."""
    from .implied_values import implied_count

    drawn = linearise(design) if solution.spectrum.deficiency else None
    layout, state = solution.factor.layout, solution.state
    implied = implied_count(design, state)
    return Linearisation(design, layout, state, solution.factor, solution.spectrum, drawn, implied)


def newton_step(design: Design, factor: Factor, spectrum: Spectrum) -> tuple[Array, Array]:
    """The least-squares step: shared parameters (s,) and balls (n, d)."""
    shared = _shared_step(factor, spectrum)
    balls = np.zeros((len(design.balls.names), design.dimension))
    # Back-substitution: with the shared step known, the three rows of each ball give its own.
    side = factor.ball_side + factor.ball_shared @ shared
    balls[factor.eliminated] = -solve_balls(factor, side[:, :, None])[:, :, 0]
    if len(factor.kept):
        kept_step = -solve_kept(factor, factor.kept_side + factor.kept_shared @ shared)
        balls[factor.kept] = kept_step.reshape(-1, design.dimension)
    return shared, balls


def _shared_step(factor: Factor, spectrum: Spectrum) -> Array:
    if spectrum.deficiency == 0:
        return -solve_shared(factor, factor.side)
    determined = spectrum.directions[:, : spectrum.rank]
    if factor.orders is None:
        # root = U diag(values) V' / scale, so U' side follows from root times the directions.
        rest_root = factor.root @ determined
        rest_root /= np.sqrt((rest_root**2).sum(axis=0))
        return -(spectrum.root @ (rest_root.T @ factor.side))
    from .graded import triangle

    # Least squares within the determined directions alone, so that no step follows an open one. The
    # rows differ in weight, and keep their order by it.
    reduced = triangle(in_order(factor) @ determined, factor.side[:, None])
    steps = scipy_linalg().solve_triangular(reduced.root, reduced.side[:, 0], check_finite=False)
    return -(determined[:, reduced.order] @ steps)


def moved(state: State, layout: SharedLayout, shared: Array, balls: Array) -> State:
    """The state after a step of shared parameters (s,) and balls (n, d); rotations are turned about
    the machine's axes and stay orthogonal.
    """
    d = state.origins.shape[1]
    # What is held takes the zero behind the last.
    step = np.append(shared, 0.0)
    poses = step[layout.pose_columns]
    return State(
        state.balls + balls,
        rotation_from_vector(poses[:, d:]) @ state.rotations,
        state.origins + poses[:, :d],
        state.a + shared[layout.model],
        state.probes + step[layout.offset_columns],
        state.lengths + shared[layout.lengths],
        state.influences + shared[layout.influences],
    )
