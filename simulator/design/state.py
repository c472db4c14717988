"""A state of a design: what an estimate determines, and replicates about it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array, Integers


@dataclass(frozen=True)
class State:
    """Values of all parameters: `balls` (n, d), `rotations` (k, d, d), `origins` (k, d), `a`
    (parameters,), offsets of the `probes` (l, d), unknown `lengths` and `influences` (p,).
    """

    balls: Array
    rotations: Array
    origins: Array
    a: Array
    probes: Array
    lengths: Array
    influences: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class Replicates:
    """Estimates of b replicates, as differences from `start`: the estimate from readings of the
    `truth` without noise.

    `balls` (b, d, n) and `shared` (b, s) are the sums of their steps. Observations add to their
    S^2, `squares` (b,), and to half its gradient, `by_ball` (b, d, n) and `by_shared` (b, s).
    `offsets` (l, d) are the columns of probe offsets, -1 for held ones.
    """

    start: State
    truth: State
    balls: Array
    shared: Array
    squares: Array
    by_ball: Array
    by_shared: Array
    offsets: Integers

    def pull(self, balls: Integers, forces: Array) -> None:
        """Add forces (b, m, k, d) on the `balls` (m, k) of observations to the gradient."""
        for ball, force in zip(balls.T, forces.transpose(2, 1, 0, 3), strict=True):
            # A ball may take part in several.
            order = np.argsort(ball, kind="stable")
            pulled, start = np.unique(ball[order], return_index=True)
            self.by_ball[:, :, pulled] += np.add.reduceat(force[order], start).transpose(1, 2, 0)
