"""Realisations of errors that are drawn at random."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.presentation import Data, as_data
from ballplate.simulator.computing import eigh
from ballplate.simulator.machines import Array

# Realisations that are drawn at most, and co-ordinates of all of them, of eight bytes each.
MOST_DRAWS, MOST_NUMBERS = 1000, 20_000_000


@dataclass(frozen=True)
class Draws:
    """Number of realisations, and their seed."""

    count: int = 0
    seed: int = 1

    def ensure_possible(self, points: Array) -> None:
        """Refuse more numbers than there is memory for.

        :raises ValueError: there are more.
        """
        if self.count * points.size > MOST_NUMBERS:
            most = MOST_NUMBERS // points.size
            raise ValueError(f"{self.count} realisations are too many; {most} are possible here")

    def normal(self, *shapes: tuple[int, ...]) -> list[Array]:
        """Standard normal numbers (count, ...) of several shapes."""
        generator = np.random.default_rng(np.random.SeedSequence(self.seed))
        return [generator.standard_normal((self.count, *shape)) for shape in shapes]


@dataclass(frozen=True, eq=False)
class Realisations:
    """Drawn errors (n, m, d) at points and errors (n, k) of lengths, in metres, of one machine or
    one run each.
    """

    draws: Draws
    errors: Array
    lengths: Array

    def to_dict(self) -> Data:
        """Return plain data, None where undetermined."""
        return {
            "seed": self.draws.seed,
            "errors": as_data(self.errors),
            "lengths": as_data(self.lengths),
        }


def symmetric_root(covariance: Array, scale: Array) -> Array:
    """The symmetric root (m, m) of a covariance of parameters in units of their `scale` (m,), back
    in their own. It is the only one, so that the same numbers lead to the same draws everywhere.

    >>> root = symmetric_root(np.array([[4.0, 2.0], [2.0, 3.0]]), np.array([2.0, 1.0]))
    >>> (root @ root.T).round(12).tolist()
    [[4.0, 2.0], [2.0, 3.0]]
    """
    values, vectors = eigh(covariance / np.outer(scale, scale))
    return scale[:, None] * (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
