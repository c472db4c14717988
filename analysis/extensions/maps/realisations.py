"""Realisations of errors that are drawn at random."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from ballplate.presentation import Data, as_data, given
from ballplate.simulator.computing import single_threaded, symmetric_root
from ballplate.simulator.machines import Array

from ..machine_files import FittedMap

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
    one run each; of a map also the estimated `offsets` (n, d) of probes, which are no part of the
    errors.
    """

    draws: Draws
    errors: Array
    lengths: Array
    offsets: Mapping[str, Array] = field(default_factory=dict)

    def to_dict(self) -> Data:
        """Return plain data, None where undetermined."""
        return {
            "seed": self.draws.seed,
            "errors": as_data(self.errors),
            "lengths": as_data(self.lengths),
            **given(offsets=as_data(dict(self.offsets))),
        }


@single_threaded
def drawn_deviations(fitted: FittedMap, draws: Draws) -> Array:
    """Deviations (count, m) of all parameters of a map, offsets of probes among them, from the
    estimates, drawn from their joint covariance.
    """
    (normal,), scale = draws.normal((len(fitted.scale),)), fitted.scale
    # In units of the parameters' scales, which differ by many powers of ten.
    return normal @ symmetric_root(fitted.covariance / np.outer(scale, scale)) * scale


def drawn_machines(fitted: FittedMap, count: int, seed: int = 1) -> tuple[Array, Array]:
    """Return parameters a (count, n) of the error model and offsets (count, l, d) of all probes of
    machines drawn from the joint covariance of a map, those of `map` with the same count and seed,
    with whatever probe. Undetermined directions keep their estimates.
    """
    deviations = drawn_deviations(fitted, Draws(count, seed))
    return fitted.values + deviations[:, : len(fitted.values)], drawn_offsets(fitted, deviations)


def drawn_offsets(fitted: FittedMap, deviations: Array) -> Array:
    """Return offsets (count, l, d) of all probes of machines with `drawn_deviations`."""
    offsets = np.tile(fitted.probes.offsets, (len(deviations), 1, 1))
    offsets[:, fitted.probes.free] += deviations[:, len(fitted.values) :]
    return offsets
