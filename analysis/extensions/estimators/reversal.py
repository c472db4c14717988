"""Squareness and scale difference of two axes from a plate read before and after a quarter turn
(NBSIR 79-1752).

With (x1, y1) the readings of a ball in the first position, (x2, y2) those after a turn by 90
degrees + beta, clockwise as seen against z, and (ex, ey) the offset between the two, to first order
in all of alpha, beta and gamma,

    x1 = -(beta + alpha) x2 - (1 + gamma) y2 + ex,    y1 = (1 - gamma) x2 + (alpha - beta) y2 + ey,

equations (15) with the sign of gamma put right in the first. They hold for any share of gamma that
the scales of x and y are given (appendix B), and are linear: five parameters, or three without the
offset (appendix A).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing import lstsq, pinv, single_threaded, svd
from ballplate.simulator.geometry import fit_motion
from ballplate.simulator.machines import Array, MetricModel, Scale

# Balls whose spread across their main line is below this fraction of their length count as on one
# line.
ON_A_LINE = 1e-4
# Of an angle far from 90 degrees a third, at 45 degrees, is left wrong by each step.
STEPS = 40
# No machine reads finer, in metres; readings without noise scatter by their rounding only.
FINEST = 1e-9


class UndeterminedError(ValueError):
    """The balls lie on one line, so that squareness and scale difference do not both show."""


@dataclass(frozen=True, eq=False)
class Reversal:
    """Solution of the first-order equations for n balls; angles in radians, lengths in metres.

    `offset` (2,) is zero if it is not a parameter. `residuals` (n, 2) are the readings of the
    first position less their prediction from the second; `sigma` is their root mean square over
    `degrees_of_freedom`, NaN without any. Each contains the errors of two readings, so that the
    standard deviation of one is sigma / sqrt(2). `coordinates` (n, 2) are the balls along the
    machine's axes in the first position, up to a shift: the mean of both positions, corrected.

    `neglected` (n, 2) are the terms beyond first order, up to a shift, at the parameters of the
    complete equations; `exact_beta`, `exact_coordinates` (n, 2) and `exact_offset` (2,) are
    theirs, and `scatter` the standard deviation of a reading about them, which `sigma` overstates
    if much is neglected. `bias` is the largest effect of neglecting them on a parameter or
    co-ordinate, in standard uncertainties.
    """

    alpha: float
    beta: float
    gamma: float
    offset: Array
    sigma: float
    degrees_of_freedom: int
    residuals: Array
    coordinates: Array
    neglected: Array
    exact_beta: float
    exact_coordinates: Array
    exact_offset: Array
    scatter: float
    bias: float
    spread: Array

    @property
    def single(self) -> float:
        """Standard deviation of a co-ordinate of a single reading."""
        return self.sigma / float(np.sqrt(2.0))


def turn_between(first: Array, second: Array) -> float:
    """Angle in radians that takes readings (n, 2) in the first position to those in the second,
    counter-clockwise.

    >>> first, second = np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[0.0, 1.0], [0.0, 0.0]])
    >>> round(turn_between(first, second), 12)
    -1.570796326795
    """
    rotation, _ = fit_motion(first, second)
    return float(np.arctan2(rotation[1, 0], rotation[0, 0]))


@single_threaded
def reverse(first: Array, second: Array, scale: Scale, offsets: bool = True) -> Reversal:
    """Fit readings (n, 2) of the same balls in two positions, the second about 90 degrees
    clockwise from the first.

    `scale` states which axis takes the scale difference in corrected co-ordinates. With "none"
    neither does; it is still fitted, as in the report. Without `offsets` both positions must be
    read from the same ball.

    :raises UndeterminedError: the balls lie on one line.
    """
    # Without offsets a line has to go through the origin to leave anything open.
    arms = second - second.mean(axis=0) if offsets else second
    if _spread(arms) < ON_A_LINE:
        raise UndeterminedError(
            "the balls lie on one line, and do not show both squareness and scale difference"
        )
    x2, y2 = second.T
    zero, factors = np.zeros(len(x2)), np.ones(len(x2))
    by_x = np.stack([-x2, -x2, -y2, factors, zero], axis=1)
    by_y = np.stack([y2, -y2, -x2, zero, factors], axis=1)
    rows = np.concatenate([by_x, by_y])[:, : 5 if offsets else 3]
    wanted = np.concatenate([first[:, 0] + y2, first[:, 1] - x2])
    # A unit of each column then moves some reading by the plate's size.
    size = np.abs(second).max()
    weights = np.array([size, size, size, 1.0, 1.0])[: rows.shape[1]]

    def solved(neglected: Array) -> tuple[Array, Array, Array, float]:
        """Return parameters, the offset (2,), residuals (n, 2) and sigma without the neglected
        terms (n, 2).
        """
        aim = wanted - neglected.T.ravel()
        solution = lstsq(rows / weights, aim, rcond=None)[0] / weights
        remainder = aim - rows @ solution
        sigma = float(np.sqrt(remainder @ remainder / freedom)) if freedom > 0 else float("nan")
        return solution, solution[3:] if offsets else np.zeros(2), remainder.reshape(2, -1).T, sigma

    freedom = rows.shape[0] - rows.shape[1]
    solution, offset, residuals, sigma = solved(np.zeros_like(second))
    exact = solution
    for _ in range(STEPS):
        before, left_out = exact, _left_out(*exact[:3])
        exact, exact_offset, exact_residuals, exact_sigma = solved(second @ left_out.T)
        if np.allclose(weights * exact, weights * before, rtol=0.0, atol=1e-15 * size):
            break
    neglected = arms @ left_out.T
    # Each row of the inverse is how a parameter follows the readings.
    lengths = np.sqrt((pinv(rows / weights) ** 2).sum(axis=1)) / weights
    alpha, beta, gamma = (float(value) for value in solution[:3])
    return Reversal(
        alpha,
        beta,
        gamma,
        offset,
        sigma,
        freedom,
        residuals,
        _corrected(first - residuals / 2.0 - offset / 2.0, scale, alpha, gamma),
        neglected,
        float(exact[1]),
        _corrected(
            first - exact_residuals / 2.0 - exact_offset / 2.0,
            scale,
            float(exact[0]),
            float(exact[2]),
        ),
        exact_offset,
        exact_sigma / float(np.sqrt(2.0)),
        _bias(neglected, np.abs(solution - exact)[3:] / lengths[3:], exact_sigma),
        lengths,
    )


def _bias(neglected: Array, offset: Array, sigma: float) -> float:
    """Return the largest effect of neglected terms (n, 2) on a parameter or co-ordinate, in its
    standard uncertainties.

    A linear function of the readings with the coefficients l has the standard uncertainty s |l|, s
    = sigma / sqrt(2), and changes by at most |l| |n| if the readings change by n: at most |n| / s.
    A common shift is excluded from n, and the change of the offset is separate: (2,), or (0,)
    without, for coefficients of length 1.
    """
    sigma = max(sigma, float(np.sqrt(2.0)) * FINEST)
    size = max(float(np.sqrt(2.0 * (neglected**2).sum())), float(offset.max(initial=0.0)))
    return size / sigma


def _spread(arms: Array) -> float:
    """Extent of points (n, 2) across their main line through the origin, as a fraction of that
    along it.
    """
    extent = svd(arms, compute_uv=False)
    return float(extent[1] / extent[0]) if len(extent) == 2 and extent[0] > 0.0 else 0.0


def _corrected(x: Array, scale: Scale, alpha: float, gamma: float) -> Array:
    """True co-ordinates A^-1 x, up to a shift."""
    a = np.array([alpha] if scale == "none" else [alpha, gamma])
    return x + MetricModel(scale).error(x, a, np.zeros_like(x))


def _left_out(alpha: float, beta: float, gamma: float) -> Array:
    """Return A B^-1 A^-1 (2, 2) without its first-order terms."""
    inverse = _corrected(np.eye(2), "split", alpha, gamma).T
    c, s = np.cos(beta), np.sin(beta)
    exact = np.linalg.inv(inverse) @ np.array([[-s, -c], [c, -s]]) @ inverse
    return exact - np.array([[-(beta + alpha), -(1.0 + gamma)], [1.0 - gamma, alpha - beta]])
